/* Whole packs of what bends: a dataset of meshes whose surfaces are the scanned ones, that agree where they meet, the
 * same for any number of threads; each point is in one form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "clouds.h"
#include "dataset/dataset.h"
#include "dataset/panels.h"
#include "support/folder.h"

enum { ground = 30000, ball = 12000, bush = 600, corners_most = 200000 };
static const double noise = 0.0005, radius = 0.4;

static double wave(double x, double y)
{
    return 0.1 * sin(2.5 * x) * cos(2 * y);
}

/* A waving ground of 3 x 3 m, a ball beside it, a bush beyond. */
static const char *write_scan(void)
{
    uint64_t random = 9;
    const char *path = in_folder("scan.csv");
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "x,y,z,red,green,blue\n");
    for (int i = 0; i < ground; i++) {
        double x = 3 * uniform(&random), y = 3 * uniform(&random);
        fprintf(f, "%.5f,%.5f,%.5f,100,110,120\n", x, y, wave(x, y) + noise * (2 * uniform(&random) - 1));
    }
    for (int i = 0; i < ball; i++) {
        double angle = 2 * M_PI * uniform(&random), z = 2 * uniform(&random) - 1, flat = sqrt(1 - z * z);
        double r = radius + noise * (2 * uniform(&random) - 1);
        fprintf(f, "%.5f,%.5f,%.5f,200,60,50\n", 5 + r * flat * cos(angle), r * flat * sin(angle), r * z);
    }
    for (int i = 0; i < bush; i++)
        fprintf(f, "%.5f,%.5f,%.5f,20,200,20\n", 8 + uniform(&random), uniform(&random), uniform(&random));
    assert_int_equal(fclose(f), 0);
    return path;
}

static void pack(const char *output, enum spl_pack_primitives primitives, unsigned threads,
                 struct spl_pack_report *report)
{
    struct spl_error err = {0};
    const char *input = in_folder("scan.csv");
    const struct spl_pack_options options = {.size = sizeof options, .inputs = &input, .input_count = 1,
                                             .output = output, .threads = threads, .primitives = primitives};
    if (spl_pack(&options, report, &err))
        fail_msg("%s", err.message);
}

static double off_truth(const double at[3])
{
    if (at[0] > 4)
        return sqrt((at[0] - 5) * (at[0] - 5) + at[1] * at[1] + at[2] * at[2]) - radius;
    return at[2] - wave(at[0], at[1]);
}

/* A point of a lattice, by the plane that it is over. */
struct corner {
    float normal[2], cell;
    unsigned level;
    double at[3];
};

/* The cells of a leaf's mesh lie on the truth. Returns how many there are; adds the squares to *sum. */
static size_t check_cells(const struct spl_node *node, const struct spl_chunk *chunk, const uint32_t *page, uint32_t i,
                          double *sum)
{
    struct spl_panel_frame frame;
    struct spl_panel panel;
    struct spl_relief relief;
    size_t count = 0;
    spl_panels_get_frame(chunk, &frame);
    spl_panels_decode(chunk, page, i, &panel);
    spl_panels_get_relief(chunk, page, i, &relief);
    for (int y = 0; y < SPL_PANEL_SIDE; y++)
        for (int x = 0; x < SPL_PANEL_SIDE; x++) {
            float position[3], normal[3];
            double at[3];
            if (!(panel.cells[y] >> x & 1))
                continue;
            spl_panels_place(&frame, &panel, &relief, (float)x + 0.5f, (float)y + 0.5f, position, normal);
            for (int c = 0; c < 3; c++)
                at[c] = node->origin[c] + (double)position[c];
            *sum += off_truth(at) * off_truth(at);
            count++;
        }
    return count;
}

static size_t add_corners(const struct spl_node *node, const struct spl_chunk *chunk, const uint32_t *page, uint32_t i,
                          struct corner *corners, size_t count)
{
    struct spl_panel_frame frame;
    struct spl_panel panel;
    struct spl_relief relief;
    spl_panels_get_frame(chunk, &frame);
    spl_panels_decode(chunk, page, i, &panel);
    spl_panels_get_relief(chunk, page, i, &relief);
    int across = (1 << relief.level) + 1, apart = SPL_PANEL_SIDE >> relief.level;
    for (int k = 0; k < across * across && count < corners_most; k++) {
        struct corner *c = &corners[count++];
        float position[3], normal[3];
        *c = (struct corner){{chunk->normal_u, chunk->normal_v}, frame.cell, relief.level, {0}};
        spl_panels_place(&frame, &panel, &relief, (float)(k % across * apart), (float)(k / across * apart), position,
                         normal);
        for (int a = 0; a < 3; a++)
            c->at[a] = node->origin[a] + (double)position[a];
    }
    return count;
}

static int compare_corners(const void *a, const void *b)
{
    const struct corner *x = a, *y = b;
    return (x->at[0] > y->at[0]) - (x->at[0] < y->at[0]);
}

static long size_of(const char *path)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    return status.st_size;
}

static void meshes_lie_on_what_was_scanned(void **state)
{
    struct spl_pack_report off, on;
    struct spl_error err = {0};
    struct spl_dataset *dataset = NULL;
    double sum = 0, cells = 0;
    uint64_t nodes, chunks, discs = 0, points = 0, met = 0, apart = 0;
    struct corner *corners = malloc(corners_most * sizeof *corners);
    size_t count = 0;
    (void)state;
    write_scan();
    pack(in_folder("off.spld"), SPL_PRIMITIVES_OFF, 2, &off);
    pack(in_folder("on.spld"), SPL_PRIMITIVES_ALL, 2, &on);
    if (spl_dataset_open_whole(in_folder("on.spld"), true, &dataset, &err))
        fail_msg("%s", err.message);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    for (uint64_t n = 0; n < nodes; n++) {
        size_t bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, node[n].page, &bytes);
        for (uint64_t c = node[n].first_chunk; c < node[n].first_chunk + node[n].chunk_count; c++) {
            const struct spl_chunk *chunk = &all[c];
            if (node[n].child_count)
                continue;
            discs += spl_chunk_kind(chunk) == SPL_CHUNK_DISCS ? chunk->count : 0;
            points += spl_kind_has_panels(spl_chunk_kind(chunk)) ? spl_panels_get_points(chunk) : 0;
            for (uint32_t i = 0; spl_chunk_kind(chunk) == SPL_CHUNK_MESHES && i < chunk->count; i++) {
                cells += (double)check_cells(&node[n], chunk, page, i, &sum);
                count = add_corners(&node[n], chunk, page, i, corners, count);
            }
        }
    }
    assert_int_equal(info->leaf_splats, ground + ball + bush); /* each point is in one form */
    assert_int_equal(discs + points, ground + ball + bush);
    assert_int_equal(points, info->panel_points + info->mesh_points);
    assert_int_equal(on.mesh_points, info->mesh_points);
    assert_true((double)info->mesh_points > 0.9 * (ground + ball));
    assert_true((double)size_of(in_folder("on.spld")) < 0.6 * (double)size_of(in_folder("off.spld")));
    assert_true(cells > 0 && sqrt(sum / cells) < 0.0025);

    /* lattices of one piece and one size of cells meet at the same heights, but beyond its border */
    qsort(corners, count, sizeof *corners, compare_corners);
    for (size_t a = 0; a < count; a++)
        for (size_t b = a + 1; b < count && corners[b].at[0] < corners[a].at[0] + 0.01; b++) {
            const struct corner *x = &corners[a], *y = &corners[b];
            double d[3], across = 0;
            for (int c = 0; c < 3; c++) {
                d[c] = y->at[c] - x->at[c];
                across += d[c] * d[c];
            }
            if (memcmp(x->normal, y->normal, sizeof x->normal) || x->cell != y->cell ||
                sqrt(across) > 0.2 * (double)x->cell)
                continue;
            met++;
            apart += sqrt(across) >= 0.03 * (double)x->cell;
        }
    assert_true(met > 100 && (double)apart < 0.06 * (double)met);
    free(corners);
    spl_dataset_close(dataset);
}

static void threads_do_not_matter(void **state)
{
    char command[1200];
    (void)state;
    for (unsigned threads = 1; threads <= 5; threads += 4) {
        pack(in_folder("threads.spld"), SPL_PRIMITIVES_ALL, threads, NULL);
        snprintf(command, sizeof command, "cmp %s %s", in_folder("on.spld"), in_folder("threads.spld"));
        assert_int_equal(system(command), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meshes_lie_on_what_was_scanned),
        cmocka_unit_test(threads_do_not_matter),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
