/* What the writer writes opens again as it was; what is damaged does not. */
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "support/make_dataset.h"
#include "support/sanitised.h"

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
        splats[i] = (struct make_splat){
            .position = {500000.25 + 0.01 * (double)(i % 40), 0.01 * (double)(i / 40), 7 + sin((double)i)},
            .normal = {0.6f, 0, 0.8f},
            .radius = 0.01f + 0.001f * (float)(i % 7),
            .color = {(uint8_t)i, 100, (uint8_t)(i * i)},
            .classification = (uint8_t)(i % 3),
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
        uint64_t nodes, chunks;
        const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
        const struct spl_chunk *chunk = spl_dataset_get_chunks(dataset, &chunks);
        assert_true(nodes == info->nodes && chunks == info->chunks);
        size_t bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, 0, &bytes);
        assert_int_equal(bytes, info->page_bytes);
        uint64_t bits = 0;
        for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
            bits += info->attribute_bits[a];
        for (uint32_t s = 0; s < info->stream_count; s++)
            bits += info->streams[s].bits;
        uint64_t structs = 8 * (nodes * SPL_NODE_BYTES + chunks * (SPL_CHUNK_BYTES + 2 * SPL_STREAM_CHUNK_BYTES));
        assert_true(bits > structs && bits <= 8 * bytes + structs);
        for (uint32_t i = 0; levels == 1 && i < count; i++) {
            struct spl_splat splat;
            spl_chunk_decode(&chunk[i / SPL_CHUNK_SPLATS], page, i % SPL_CHUNK_SPLATS, &splat);
            assert_memory_equal(splat.color, splats[i].color, 3);
            double class = -1;
            assert_true(spl_dataset_find_value(dataset, spl_dataset_find_stream(dataset, "class"), i, &class));
            assert_true(class == splats[i].classification);
            for (int a = 0; a < 3; a++)
                assert_true(fabs(node->origin[a] + splat.position[a] - splats[i].position[a]) <
                            0.05 * splats[i].radius);
        }
        struct spl_camera camera;
        assert_int_equal(spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL), SPL_OK);
        assert_int_equal(spl_camera_check(&camera, NULL), SPL_OK);
        spl_dataset_close(dataset);
    }
    free(splats);
    spl_dataset_close(NULL);
}

/* One stray point makes the bounds what they like, and hides nothing. */
static void test_near_does_not_follow_the_bounds(void **state)
{
    (void)state;
    enum { count = 500 };
    static const double strays[] = {0, 1e3, 1e6, 1e9};
    struct make_splat *splats = some_splats(count);
    for (size_t i = 0; i < sizeof strays / sizeof *strays; i++) {
        splats[count - 1].position[1] = strays[i];
        struct spl_dataset *dataset = make_dataset_levels(splats, count, 1);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        struct spl_camera camera;
        assert_true(info->bounds_max[1] - info->bounds_min[1] >= strays[i]);
        assert_int_equal(spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL), SPL_OK);
        assert_true(camera.near == info->splat_radius && camera.near > 0.009 && camera.near < 0.02);
        spl_dataset_close(dataset);
    }
    free(splats);
}

/* A file's bytes in memory, to be damaged. */
struct bytes {
    uint8_t *data;
    size_t size;
};

static struct bytes load(const char *path)
{
    FILE *file = fopen(path, "rb");
    struct stat status;
    assert_non_null(file);
    assert_int_equal(fstat(fileno(file), &status), 0);
    struct bytes b = {malloc((size_t)status.st_size), (size_t)status.st_size};
    assert_int_equal(fread(b.data, 1, b.size, file), b.size);
    fclose(file);
    return b;
}

static void save(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static struct spl_file_header *header_of(struct bytes b)
{
    return (struct spl_file_header *)b.data;
}

static struct spl_section *table_of(struct bytes b)
{
    return (struct spl_section *)(b.data + header_of(b)->table_offset);
}

static struct bytes small_file(const char *path, size_t count, int levels)
{
    struct make_splat *splats = some_splats(count);
    make_dataset_file(path, splats, count, levels);
    free(splats);
    return load(path);
}

/* Opens and closes; the message of a refusal lands in `message`. */
static int try_open(const char *path, bool verify, char message[512])
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    int rc = spl_dataset_open(path, verify, &dataset, &err);
    snprintf(message, 512, "%s", err.message);
    assert_true((rc == SPL_OK) == (dataset != NULL));
    spl_dataset_close(dataset);
    return rc;
}

static void expect_refusal(const char *path, int code, const char *part)
{
    char message[512];
    int rc = try_open(path, true, message);
    if (rc != code || !strstr(message, part))
        fail_msg("expected %d and '%s', got %d: %s", code, part, rc, message);
}

/* What a flip of a bit at `offset` has to be blamed on; NULL for padding, which nothing reads. */
static const char *region_at(struct bytes b, size_t offset)
{
    struct spl_file_header *header = header_of(b);
    if (offset < offsetof(struct spl_file_header, version))
        return "magic or kind";
    if (offset < offsetof(struct spl_file_header, header_bytes))
        return "format version";
    if (offset < sizeof *header)
        return "header fails its checksum";
    if (offset >= header->table_offset)
        return "section table fails its checksum";
    for (uint32_t i = 0; i < header->section_count; i++) {
        const struct spl_section *s = &table_of(b)[i];
        if (offset >= s->offset && offset < s->offset + s->bytes)
            return s->type == SPL_SECTION_PAGE    ? "section PAGE 0 fails its checksum"
                   : s->type == SPL_SECTION_META  ? "section META fails its checksum"
                   : s->type == SPL_SECTION_HEAD  ? "section HEAD 0 fails its checksum"
                                                  : "section PDIR fails its checksum";
    }
    return NULL;
}

static void test_every_flipped_bit(void **state)
{
    (void)state;
    const char *path = path_of("flip.spld");
    struct bytes b = small_file(path, 5, 1);
    size_t refused = 0;
    int fd = open(path, O_RDWR);
    assert_true(fd >= 0);
    for (size_t offset = 0; offset < b.size; offset++) {
        const char *region = region_at(b, offset);
        if (!region && offset % 4093)
            continue;
        for (int bit = 0; bit < 8; bit += TEST_SIZE(1, 3)) {
            uint8_t byte = (uint8_t)(b.data[offset] ^ 1u << bit);
            char message[512];
            assert_int_equal(pwrite(fd, &byte, 1, (off_t)offset), 1);
            int rc = try_open(path, true, message);
            bool named = region && (offset < sizeof header_of(b)->magic
                                        ? strstr(message, "not a packed dataset") || strstr(message, "lost its magic")
                                        : strstr(message, region) != NULL);
            if (region ? rc >= 0 || !named : rc != SPL_OK)
                fail_msg("bit %d of byte %zu: %d '%s', expected '%s'", bit, offset, rc, message, region);
            refused += rc != SPL_OK;
            if (region && strstr(region, "PAGE"))
                assert_int_equal(try_open(path, false, message), SPL_OK);
            else if (region)
                assert_true(try_open(path, false, message) < 0);
        }
        assert_int_equal(pwrite(fd, &b.data[offset], 1, (off_t)offset), 1);
    }
    assert_true(refused > TEST_SIZE(8, 3) * (sizeof(struct spl_file_header) + SPL_NODE_BYTES + SPL_CHUNK_BYTES));
    close(fd);
    unlink(path);
    free(b.data);
}

static void test_every_truncation(void **state)
{
    (void)state;
    const char *path = path_of("cut.spld");
    struct bytes b = small_file(path, 5, 1);
    for (size_t size = b.size; size-- > 0;) {
        if (size > 300 && size < SPL_FILE_ALIGNMENT - 2 && size % 997)
            continue;
        char missing[64];
        assert_int_equal(truncate(path, (off_t)size), 0);
        if (size >= sizeof(struct spl_file_header))
            snprintf(missing, sizeof missing, "truncated: %zu of its %zu bytes are missing", b.size - size, b.size);
        else
            snprintf(missing, sizeof missing, "truncated: %zu of the header's", sizeof(struct spl_file_header) - size);
        if (size == 0)
            expect_refusal(path, SPL_E_INPUT, "is empty");
        else
            expect_refusal(path, SPL_E_CORRUPT, missing);
    }
    save(path, b.data, b.size);
    int fd = open(path, O_WRONLY | O_APPEND);
    assert_int_equal(write(fd, "\n", 1), 1);
    close(fd);
    expect_refusal(path, SPL_E_CORRUPT, "1 bytes follow");
    unlink(path);
    free(b.data);
}

static void test_other_files(void **state)
{
    (void)state;
    static const struct {
        const char *content, *part;
    } rows[] = {
        {"ply\nformat ascii 1.0\n", "is a PLY scan, not a packed dataset; 'splatd pack "},
        {"ply\r\nformat ascii 1.0\r\n", "is a PLY scan"},
        {"LASF and more", "is a LAS scan"},
        {"0.1 0.2 0.3\n", "'splatd pack SCAN -o NAME.spld' makes one"},
        {"x", "is not a packed dataset"},
    };
    const char *path = path_of("other.spld");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        save(path, rows[i].content, strlen(rows[i].content));
        expect_refusal(path, SPL_E_INPUT, rows[i].part);
    }
    static const char text_mode[] = "SPLD\n\x1a\n.................................................................";
    save(path, text_mode, sizeof text_mode);
    expect_refusal(path, SPL_E_CORRUPT, "transfer in text mode");
    unlink(path);
    expect_refusal(path, SPL_E_NOT_FOUND, "there is no such file");
    expect_refusal(folder, SPL_E_INPUT, "is not a regular file");
}

#define TEN "0123456789"
#define LONG_NAME TEN TEN TEN TEN TEN TEN TEN TEN TEN TEN TEN TEN TEN

static void test_ids(void **state)
{
    (void)state;
    static const struct {
        const char *name, *id;
    } rows[] = {
        {"a.spld", "a"},           {"Wall-2_x.v3.spld", "Wall-2_x.v3"}, {"plain", "plain"}, {"two words.spld", NULL},
        {".hidden.spld", NULL},    {"caf\xc3\xa9.spld", NULL},          {"a?b.spld", NULL}, {"..x.spld", NULL},
        {LONG_NAME ".spld", NULL},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *path = path_of(rows[i].name);
        free(small_file(path, 1, 1).data);
        struct spl_dataset *dataset = NULL;
        if (rows[i].id) {
            assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
            assert_string_equal(spl_dataset_get_info(dataset)->id, rows[i].id);
        } else {
            expect_refusal(path, SPL_E_INPUT, "cannot be a dataset's id; rename the file");
        }
        spl_dataset_close(dataset);
        unlink(path);
    }
}

static void test_version_follows_content(void **state)
{
    (void)state;
    struct make_splat splats[2] = {{.normal = {0, 0, 1}, .radius = 1},
                                   {.position = {1, 2, 3}, .normal = {0, 0, 1}, .radius = 1}};
    uint64_t versions[3];
    for (int i = 0; i < 3; i++) {
        splats[0].color[1] = i == 2;
        struct spl_dataset *dataset = make_dataset(splats, 2);
        versions[i] = spl_dataset_get_info(dataset)->version;
        spl_dataset_close(dataset);
    }
    assert_true(versions[0] == versions[1] && versions[1] != versions[2]);
}

static void test_refused_memory(void **state)
{
    (void)state;
    const char *path = path_of("memory.spld");
    free(small_file(path, 200, 2).data);
    char message[512];
    long failures = 0;
    for (long n = 1;; n++) {
        spl_memory_fail_after(n);
        int rc = try_open(path, true, message);
        spl_memory_fail_after(0);
        if (rc == SPL_OK)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        failures++;
    }
    assert_true(failures >= 4);
    unlink(path);
}

/* In place, as nobody should: what is read anew is refused, what is in memory stays. */
static void test_files_that_change_in_place(void **state)
{
    (void)state;
    enum { count = 3000 };
    struct make_splat *splats = some_splats(count);
    const char *path = path_of("place.spld");
    for (int cut = 0; cut < 2; cut++) {
        struct spl_dataset *verified, *trusted;
        make_dataset_file(path, splats, count, 1);
        assert_int_equal(spl_dataset_open(path, true, &verified, NULL), 0);
        assert_int_equal(spl_dataset_open(path, false, &trusted, NULL), 0);
        uint64_t nodes;
        struct spl_node before = spl_dataset_get_nodes(verified, &nodes)[0];
        size_t bytes;
        const uint32_t *mapped = spl_dataset_get_page(verified, 0, &bytes);
        uint32_t *page = malloc(bytes);
        assert_int_equal(spl_dataset_read_page(verified, 0, page, NULL), 0);
        assert_memory_equal(page, mapped, bytes);
        if (cut) {
            assert_int_equal(truncate(path, 100), 0);
        } else {
            int fd = open(path, O_RDWR);
            off_t at = (off_t)spl_dataset_get_info(verified)->file_bytes - (off_t)bytes; // the page is last
            char byte;
            assert_int_equal(pread(fd, &byte, 1, at), 1);
            byte ^= 1;
            assert_int_equal(pwrite(fd, &byte, 1, at), 1);
            close(fd);
        }
        struct spl_error err = {0};
        assert_int_equal(spl_dataset_read_page(verified, 0, page, &err), SPL_E_CORRUPT);
        assert_non_null(strstr(err.message, "place"));
        assert_null(strstr(err.message, folder));
        assert_non_null(strstr(err.message, cut ? "cut short" : "overwritten"));
        assert_int_equal(spl_dataset_read_page(trusted, 0, page, NULL), cut ? SPL_E_CORRUPT : 0);
        assert_true(before.origin[0] == spl_dataset_get_nodes(verified, &nodes)[0].origin[0] &&
                    before.chunk_count == spl_dataset_get_nodes(verified, &nodes)[0].chunk_count);
        free(page);
        spl_dataset_close(trusted);
        spl_dataset_close(verified);
        unlink(path);
    }
    free(splats);
}

static void test_splats_by_id(void **state)
{
    (void)state;
    enum { count = 1000 };
    struct make_splat *splats = some_splats(count);
    struct spl_dataset *dataset = make_dataset_levels(splats, count, 1); // ids are indices
    int class = spl_dataset_find_stream(dataset, "class"),
        uncertainty = spl_dataset_find_stream(dataset, "uncertainty");
    struct spl_splat splat;
    double value;
    assert_true(class >= 0 && uncertainty >= 0 && spl_dataset_find_stream(dataset, "intensity") < 0);
    for (uint32_t id = 0; id < count; id++) {
        assert_true(spl_dataset_find_splat(dataset, id, &splat));
        assert_true(spl_dataset_find_value(dataset, class, id, &value) && value == id % 3);
        assert_true(spl_dataset_find_value(dataset, uncertainty, id, &value) && value == (id % 5 ? 0.5 : 0));
        assert_int_equal(splat.color[1], 100);
        assert_true(fabsf(splat.radius - splats[id].radius) < 0.1f * splats[id].radius);
    }
    splat.radius = (float)(value = 77);
    assert_false(spl_dataset_find_splat(dataset, count, &splat));
    assert_false(spl_dataset_find_splat(dataset, UINT32_MAX, &splat));
    assert_false(spl_dataset_find_splat(dataset, 1ull << 32, &splat)); // not the first one
    assert_false(spl_dataset_find_splat(dataset, UINT64_MAX, &splat));
    assert_false(spl_dataset_find_value(dataset, class, count, &value));
    assert_false(spl_dataset_find_value(dataset, -1, 0, &value));
    assert_true(splat.radius == 77 && value == 77);
    spl_dataset_close(dataset);

    dataset = make_dataset_levels(splats, count, 2); // several nodes: each id is some splat, none beyond the last is
    uint32_t all = (uint32_t)spl_dataset_get_info(dataset)->splats;
    for (uint32_t id = 0; id < all; id++)
        assert_true(spl_dataset_find_value(dataset, class, id, &value) && value < 3);
    assert_false(spl_dataset_find_splat(dataset, all, &splat));
    spl_dataset_close(dataset);
    free(splats);
}

static void test_no_path(void **state)
{
    (void)state;
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0}, other = {0};
    struct spl_open_options options;
    struct spl_reader reader;
    spl_reader_init(&reader);
    spl_open_options_init(&options);
    options.reader = &reader;
    assert_int_equal(spl_dataset_open(NULL, true, &dataset, &err), SPL_E_USAGE);
    assert_int_equal(spl_dataset_open_with(NULL, &options, &dataset, &other), SPL_E_USAGE);
    assert_string_equal(err.field, "path");
    assert_string_equal(other.field, "path");
    assert_null(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_near_does_not_follow_the_bounds),
        cmocka_unit_test(test_every_flipped_bit),
        cmocka_unit_test(test_every_truncation),
        cmocka_unit_test(test_other_files),
        cmocka_unit_test(test_ids),
        cmocka_unit_test(test_no_path),
        cmocka_unit_test(test_splats_by_id),
        cmocka_unit_test(test_version_follows_content),
        cmocka_unit_test(test_refused_memory),
        cmocka_unit_test(test_files_that_change_in_place),
    };
    make_folder(folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return rmdir(folder) ? 1 : failed; /* a test that leaves files behind fails */
}
