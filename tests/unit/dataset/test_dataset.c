/* What the writer writes opens again as it was; what is damaged does not. */
#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/writer.h"
#include "support/make_dataset.h"

static char folder[256];

static const char *path_of(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static struct make_splat *some_splats(size_t count)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {500000.25 + 0.01 * (double)(i % 40), 0.01 * (double)(i / 40), 7 + sin((double)i)},
                                        .normal = {0.6f, 0, 0.8f}, .radius = 0.01f + 0.001f * (float)(i % 7),
                                        .color = {(uint8_t)i, 100, (uint8_t)(i * i)}, .classification = (uint8_t)(i % 3),
                                        .uncertainty = i % 5 ? 0.5f : 0};
    return splats;
}

static void test_round_trip(void **state)
{
    (void)state;
    enum { count = 1000 };
    struct make_splat *splats = some_splats(count);
    for (int levels = 1; levels <= 2; levels++) {
        struct spl_dataset *dataset = make_dataset_levels(splats, count, levels);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        assert_string_equal(info->id, "made");
        assert_int_equal(info->points, count);
        assert_int_equal(info->leaf_splats, count);
        assert_int_equal(info->splats, levels == 1 ? count : count + count / 8);
        assert_int_equal(info->levels, levels);
        assert_int_equal(info->pages, 1);
        assert_true(info->has_color && info->has_class && info->has_uncertainty);
        assert_true(info->bounds_min[0] == 500000.25 && info->default_fov == 50);
        uint32_t nodes, chunks;
        const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
        const struct spl_chunk *chunk = spl_dataset_get_chunks(dataset, &chunks);
        assert_true(nodes == info->nodes && chunks == info->chunks);
        size_t bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, 0, &bytes);
        assert_int_equal(bytes, info->page_bytes);
        uint64_t bits = 0;
        for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
            bits += info->attribute_bits[a];
        uint64_t structs = 8 * (nodes * sizeof *node + chunks * sizeof *chunk);
        assert_true(bits > structs && bits <= 8 * bytes + structs);
        for (uint32_t i = 0; levels == 1 && i < count; i++) {
            struct spl_splat splat;
            spl_chunk_decode(&chunk[i / SPL_CHUNK_SPLATS], page, i % SPL_CHUNK_SPLATS, &splat);
            assert_memory_equal(splat.color, splats[i].color, 3);
            assert_int_equal(splat.classification, splats[i].classification);
            for (int a = 0; a < 3; a++)
                assert_true(fabs(node->origin[a] + splat.position[a] - splats[i].position[a]) < 0.05 * splats[i].radius);
        }
        struct spl_camera camera;
        assert_int_equal(spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL), SPL_OK);
        assert_int_equal(spl_camera_check(&camera, NULL), SPL_OK);
        spl_dataset_close(dataset);
    }
    free(splats);
    spl_dataset_close(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
    };
    make_folder(folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    rmdir(folder);
    (void)path_of;
    return failed;
}
