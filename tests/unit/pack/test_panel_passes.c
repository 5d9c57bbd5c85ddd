/* What comes after the scan is packed, on datasets with panels: maps of stations, which see what was scanned and not
 * what stands for it; other colours of their cells; pruning, which counts them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <dirent.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "clouds.h"
#include "dataset/dataset.h"
#include "dataset/panels.h"
#include "dataset/rewrite.h"
#include "pack/texture/colors.h"
#include "support/folder.h"
#include "support/sanitised.h"

enum { columns = 320, rows = 120 };
static const double place[3] = {100, 200, 50};

/* A room of 6 x 6 x 3 metres around the station; through a window 2 metres wide nothing comes back. */
static double range_of(const double d[3])
{
    static const double low[3] = {-3, -3, -1.4}, high[3] = {3, 3, 1.6};
    double range = INFINITY;
    for (int c = 0; c < 3; c++)
        if (fabs(d[c]) > 1e-9)
            range = fmin(range, (d[c] > 0 ? high[c] : low[c]) / d[c]);
    bool window = fabs(range * d[0] - 3) < 1e-6 && fabs(range * d[1]) < 1 && fabs(range * d[2]) < 0.8;
    return window ? 0 : range;
}

static void write_room(const char *path)
{
    uint64_t random = 5;
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fprintf(f, "%d\n%d\n%g %g %g\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%g %g %g 1\n", columns, rows,
            place[0], place[1], place[2], place[0], place[1], place[2]);
    for (int column = 0; column < columns; column++)
        for (int row = 0; row < rows; row++) {
            double turn = 2 * M_PI * column / columns, rise = (row + 0.5) / rows * 2 - 1;
            double d[3] = {cos(rise) * cos(turn), cos(rise) * sin(turn), sin(rise)};
            double range = range_of(d) + (range_of(d) > 0 ? 0.001 * (uniform(&random) - 0.5) : 0);
            fprintf(f, "%.5f %.5f %.5f 0.5 %d %d %d\n", range * d[0], range * d[1], range * d[2],
                    (int)(128 + 80 * d[0]), (int)(128 + 80 * d[1]), (int)(128 + 80 * d[2]));
        }
    assert_int_equal(fclose(f), 0);
}

static struct spl_dataset *pack_room(const char *name, enum spl_pack_primitives primitives, bool mapped, unsigned prune,
                                     unsigned threads, struct spl_pack_report *report)
{
    const char *scan = in_folder("room.ptx");
    const struct spl_map_options maps = {.size = sizeof maps};
    const struct spl_pack_options options = {.size = sizeof options, .inputs = &scan, .input_count = 1,
                                             .output = in_folder(name), .threads = threads, .primitives = primitives,
                                             .maps = mapped ? &maps : NULL, .prune = prune};
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    if (spl_pack(&options, report, &err) || spl_dataset_open_whole(in_folder(name), true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static bool is_panels(const struct spl_dataset *dataset, uint64_t chunk)
{
    uint64_t count;
    return spl_chunk_kind(&spl_dataset_get_chunks(dataset, &count)[chunk]) == SPL_CHUNK_PANELS;
}

/* The map is the same to the last bit, whatever its points become; panels have stations as discs have, and those at the
 * window are trimmed. */
static void stations_see_points_and_not_panels(void **state)
{
    (void)state;
    uint32_t counts[2];
    struct spl_pack_report report = {0};
    struct spl_dataset *off = pack_room("off.spld", SPL_PRIMITIVES_OFF, true, 0, 2, NULL);
    struct spl_dataset *all = pack_room("all.spld", SPL_PRIMITIVES_ALL, true, 0, 2, &report);
    const struct spl_map_row *row = spl_dataset_get_maps(off, &counts[0]);
    const struct spl_map_row *other = spl_dataset_get_maps(all, &counts[1]);
    assert_true(counts[0] == 1 && counts[1] == 1 && report.maps.stations == 1 && report.panels > 20);
    assert_memory_equal(row, other, sizeof *row);
    uint32_t *words = malloc(spl_map_words(row) * 4), *again = malloc(spl_map_words(row) * 4);
    assert_int_equal(spl_dataset_read_map(off, 0, words, NULL), 0);
    assert_int_equal(spl_dataset_read_map(all, 0, again, NULL), 0);
    assert_memory_equal(words, again, spl_map_words(row) * 4);
    free(words);
    free(again);
    const struct spl_chunk_stations *stations = spl_dataset_get_chunk_stations(all);
    uint32_t trimmed = 0, panels = 0;
    for (uint64_t c = 0; c < spl_dataset_get_info(all)->chunks; c++) {
        assert_int_equal(stations[c].seen_by[0] & SPL_STATION_ROW, 1);
        panels += is_panels(all, c);
        trimmed += is_panels(all, c) && stations[c].seen_by[0] & SPL_STATION_TRIMS;
    }
    assert_true(trimmed > 0 && trimmed < panels);
    spl_dataset_close(off);
    spl_dataset_close(all);
    DIR *dir = opendir(test_folder);
    for (struct dirent *entry; (entry = readdir(dir));)
        assert_null(strstr(entry->d_name, ".part"));
    closedir(dir);
}

static void threads_change_nothing(void **state)
{
    (void)state;
    skip_under_tsan();
    for (int k = 0; k < 2; k++) {
        char command[1200];
        spl_dataset_close(pack_room("one.spld", SPL_PRIMITIVES_ALL, k, k ? 20 : 10, 1, NULL));
        spl_dataset_close(pack_room("three.spld", SPL_PRIMITIVES_ALL, k, k ? 20 : 10, 3, NULL));
        snprintf(command, sizeof command, "cmp %s %s", in_folder("one.spld"), in_folder("three.spld"));
        assert_int_equal(system(command), 0);
    }
}

/* What leaves are worth: splats, and half the cells of panels; *stated: as their headers say. */
static double worth_of(const struct spl_dataset *dataset, uint64_t *stated)
{
    uint64_t nodes, chunks;
    double worth = 0;
    *stated = 0;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    for (uint64_t n = 0; n < nodes; n++)
        for (uint32_t k = 0; k < node[n].chunk_count && !node[n].child_count; k++) {
            uint64_t c = node[n].first_chunk + k;
            size_t bytes;
            const uint32_t *page = spl_dataset_get_page(dataset, node[n].page, &bytes);
            const uint32_t kind = spl_chunk_kind(&all[c]);
            const bool panels = spl_kind_has_panels(kind);
            worth += panels ? spl_panels_count_cells(&all[c], page) / 2.0 : kind == SPL_CHUNK_DISCS ? all[c].count : 0;
            *stated += panels ? spl_panels_get_points(&all[c]) : kind == SPL_CHUNK_DISCS ? all[c].count : 0;
        }
    return worth;
}

static void panels_are_pruned(void **state)
{
    (void)state;
    for (int mapped = 0; mapped < 2; mapped++) {
        struct spl_pack_report report = {0};
        struct spl_dataset *whole = pack_room("whole.spld", SPL_PRIMITIVES_ALL, mapped, 0, 2, NULL);
        struct spl_dataset *pruned = pack_room("pruned.spld", SPL_PRIMITIVES_ALL, mapped, 8, 2, &report);
        const struct spl_dataset_info *info = spl_dataset_get_info(pruned);
        uint64_t stated, unused;
        double left = worth_of(pruned, &stated), before = worth_of(whole, &unused);
        if (!(left < before / 4 && left > before / 16))
            fail_msg("of %.0f there are %.0f left", before, left);
        assert_int_equal(info->leaf_splats, stated);
        assert_true(info->panels > 0 && info->panel_points > info->leaf_splats / 2);
        assert_true(report.pruned_of > 4 * report.leaf_splats && report.leaf_splats == info->leaf_splats);
        assert_true(info->panel_points == report.panel_points && info->maps == (uint32_t)mapped);
        spl_dataset_close(whole);
        spl_dataset_close(pruned);
    }
}

/* A colour for each id, that says where it is. */
static void color_of(const double position[3], uint8_t color[3])
{
    for (int c = 0; c < 3; c++)
        color[c] = (uint8_t)fmin(fmax(128 + 30 * (position[c] - place[c]), 0), 255);
}

/* Cells are splats behind those of the dataset, each where it is drawn; written with other colours they have these, and
 * everything else stays. */
static void cells_take_colours(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_dataset *dataset = pack_room("plain.spld", SPL_PRIMITIVES_ALL, false, 0, 2, NULL), *written = NULL;
    struct spl_splats splats, after;
    struct spl_error err = {0};
    uint64_t cells = 0, ids = spl_dataset_get_info(dataset)->ids;
    uint32_t second_halves = 0;
    double worst = 0, sum = 0, before[3] = {0};
    assert_int_equal(spl_splats_init_with_cells(&splats, dataset, &err), 0);
    assert_true(splats.count > ids + 1000);
    uint8_t(*colors)[3] = calloc(splats.count, sizeof *colors);
    struct spl_world_splat list[SPL_CHUNK_SPLATS], again[SPL_CHUNK_SPLATS];
    for (uint32_t c = 0; c < splats.chunk_count; c++) {
        uint32_t count = spl_splats_get(&splats, c, list);
        assert_true(count <= SPL_CHUNK_SPLATS && count == splats.chunks[c].count);
        for (uint32_t i = 0; i < count; i++)
            color_of(list[i].position, colors[splats.chunks[c].first_id + i]);
        if (splats.chunks[c].first_id < ids)
            continue;
        cells += count;
        if (splats.parts[c - splats.chunks_before].first) { /* goes on where the part before it ended */
            assert_memory_not_equal(list[0].position, before, sizeof before);
            second_halves++;
        }
        memcpy(before, list[0].position, sizeof before);
    }
    assert_true(second_halves > 5);
    assert_int_equal(cells, splats.count - ids);
    const struct spl_rewrite what = {
        .from = dataset, .colors = (const uint8_t(*)[3])colors, .first_cell = splats.first_cell};
    if (spl_dataset_rewrite(&what, in_folder("written.spld"), &err) ||
        spl_dataset_open_whole(in_folder("written.spld"), true, &written, &err) ||
        spl_splats_init_with_cells(&after, written, &err))
        fail_msg("%s", err.message);
    assert_int_equal(after.count, splats.count);
    for (uint32_t c = 0; c < after.chunk_count; c++) {
        uint32_t count = spl_splats_get(&after, c, list);
        assert_int_equal(spl_splats_get(&splats, c, again), count);
        for (uint32_t i = 0; i < count; i++) {
            const uint8_t *wanted = colors[after.chunks[c].first_id + i];
            assert_memory_equal(list[i].position, again[i].position, sizeof list[i].position);
            for (int k = 0; k < 3; k++) {
                double off = fabs((double)list[i].splat.color[k] - wanted[k]);
                worst = fmax(worst, off);
                sum += after.chunks[c].first_id >= ids ? off * off / 3 : 0;
                assert_true(off == 0 || after.chunks[c].first_id >= ids);
            }
        }
    }
    assert_true(worst < 40);
    assert_true(sqrt(sum / (double)cells) < SPL_PANEL_COLOR_ERROR);
    free(colors);
    spl_splats_finish(&splats);
    spl_splats_finish(&after);
    spl_dataset_close(dataset);
    spl_dataset_close(written);
}

/* No photograph shows anything: all ids say so, those of panels too, whose cells are asked in their place. */
static void panels_themselves_choose_no_photograph(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_dataset *dataset = pack_room("plain.spld", SPL_PRIMITIVES_ALL, false, 0, 2, NULL);
    struct spl_splats splats;
    struct spl_candidates candidates;
    struct spl_chosen chosen;
    struct spl_gain gains[1] = {0};
    struct spl_stage stage = quiet_stage(2);
    void *dirt = malloc(1 << 20); /* what is not set is not 0 */
    memset(dirt, 0x55, 1 << 20);
    free(dirt);
    assert_int_equal(spl_splats_init_with_cells(&splats, dataset, NULL), 0);
    assert_int_equal(spl_candidates_init(&candidates, splats.count, 2, NULL), 0);
    uint8_t(*own)[3] = calloc(splats.count, sizeof *own);
    for (int k = 0; k < 3 * SPL_GAIN_NODES; k++)
        gains[0].factor[k / 3][k % 3] = 1;
    int rc = spl_chosen_init(&chosen, &splats, &candidates, gains, 0, (const uint8_t(*)[3])own, &stage, NULL);
    assert_int_equal(rc, 0);
    for (uint64_t id = 0; id < splats.count; id++)
        assert_int_equal(chosen.photo[id], SPL_NO_PHOTO);
    assert_int_equal(chosen.unseen, splats.count - spl_dataset_get_info(dataset)->panels);
    free(own);
    spl_chosen_finish(&chosen);
    spl_candidates_finish(&candidates);
    spl_splats_finish(&splats);
    spl_dataset_close(dataset);
}

static int make_scan(void **state)
{
    int rc = folder_make(state);
    write_room(in_folder("room.ptx"));
    return rc;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stations_see_points_and_not_panels),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(panels_are_pruned),
        cmocka_unit_test(cells_take_colours),
        cmocka_unit_test(panels_themselves_choose_no_photograph),
    };
    return cmocka_run_group_tests(tests, make_scan, folder_remove);
}
