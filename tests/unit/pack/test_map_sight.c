/* What stations see where nobody says who scanned what: z-buffers of discs of any size. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <cmocka.h>

#include <splatd/pack.h>

#include "pack/maps/maps.h"
#include "pack/maps/sight.h"
#include "support/make_dataset.h"
#include "support/sanitised.h"

static char folder[256];

static const char *at(const char *name)
{
    static char paths[4][512];
    static int next;
    snprintf(paths[next = (next + 1) % 4], 512, "%s/%s", folder, name);
    return paths[next];
}

/* Three parallel walls, 12 m wide and high, at x = -2, 0 and 2, with a point every `step` metres. */
static void write_walls(const char *path, double step)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    int count = (int)(12 / step);
    for (int wall = 0; wall < 3; wall++)
        for (int i = 0; i <= count; i++)
            for (int k = 0; k <= count; k++)
                fprintf(f, "%d %.4f %.4f\n", 2 * wall - 2, i * step - 6, k * step - 6);
    assert_int_equal(fclose(f), 0);
}

static char warnings[4096];

static void warn(void *context, const char *text)
{
    (void)context;
    strncat(warnings, text, sizeof warnings - strlen(warnings) - 1);
    strncat(warnings, "\n", sizeof warnings - strlen(warnings) - 1);
}

/* `panoramas` "": maps of the scan's own stations. */
static int pack(const char *input, const char *output, const char *panoramas, struct spl_pack_report *report,
                struct spl_error *err)
{
    const struct spl_map_options maps = {.size = sizeof maps, .panoramas = panoramas && *panoramas ? panoramas : NULL};
    const struct spl_pack_options options = {.size = sizeof options,
                                             .inputs = &input,
                                             .input_count = 1,
                                             .output = output,
                                             .threads = 2,
                                             .no_linear = true,
                                             .warn = warn,
                                             .maps = panoramas ? &maps : NULL};
    *warnings = 0;
    return spl_pack(&options, report, err);
}

/* From x = -1 the first two walls are seen, but for what is grazed; the third lies behind the second. Discs are of one
 * texel of the finest z-buffer up to hundreds of them. */
static void a_wall_hides_what_lies_behind_it_for_any_threads(void **state)
{
    static const double steps[] = {0.06, 0.2, 0.6};
    (void)state;
    for (int s = 0; s < 3; s++) {
        struct spl_error err = {0};
        struct spl_dataset *dataset;
        struct spl_splats splats;
        struct spl_sight sights[2];
        const struct spl_station station = {.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1}, .position = {-1, 0.1, 0.2}};
        unsigned seen[3] = {0}, all[3] = {0};
        write_walls(at("walls.xyz"), steps[s]);
        if (pack(at("walls.xyz"), at("walls.spld"), NULL, NULL, &err) ||
            spl_dataset_open_whole(at("walls.spld"), false, &dataset, &err) || spl_splats_init(&splats, dataset, &err))
            fail_msg("%s", err.message);
        for (unsigned threads = 1; threads < 3; threads++)
            assert_int_equal(spl_sight_init(&sights[threads - 1], &station, &splats, threads, NULL), 0);
        for (uint32_t c = 0; c < splats.chunk_count; c++) {
            struct spl_world_splat list[SPL_CHUNK_SPLATS];
            uint32_t count = spl_splats_is_leaf(&splats, c) ? spl_splats_get(&splats, c, list) : 0;
            for (uint32_t i = 0; i < count; i++) {
                double cosine, range;
                bool sees = spl_sight_sees(&sights[0], &list[i], &cosine, &range);
                int wall = (int)lround(list[i].position[0] / 2) + 1;
                assert_int_equal(sees, spl_sight_sees(&sights[1], &list[i], &cosine, &range));
                if (hypot(list[i].position[1], list[i].position[2]) > 4)
                    continue;
                all[wall]++;
                seen[wall] += sees;
            }
        }
        for (int wall = 0; wall < 3; wall++)
            assert_true(all[wall] > 10);
        assert_true(20 * seen[0] >= 19 * all[0] && 20 * seen[1] >= 19 * all[1]);
        assert_true(50 * seen[2] <= all[2]);
        spl_sight_finish(&sights[0]);
        spl_sight_finish(&sights[1]);
        spl_splats_finish(&splats);
        spl_dataset_close(dataset);
    }
}

/* Panoramas.json with a place alone for each of `count` positions, named s0, s1, .... Returns its folder. */
static const char *write_places(const double (*positions)[3], int count)
{
    static char list[512];
    snprintf(list, sizeof list, "%s", at("places"));
    mkdir(list, 0777);
    FILE *f = fopen(at("places/panoramas.json"), "w");
    assert_non_null(f);
    fprintf(f, "{\"panoramas\": [");
    for (int i = 0; i < count; i++)
        fprintf(f, "%s{\"name\": \"s%d\", \"color\": null, \"position\": [%g, %g, %g], "
                   "\"quaternion\": [1, 0, 0, 0]}",
                i ? ", " : "", i, positions[i][0], positions[i][1], positions[i][2]);
    fprintf(f, "]}");
    assert_int_equal(fclose(f), 0);
    return list;
}

/* Points all over a room, whose discs are as large as their distances: hundreds of texels each. Drawn texel by texel
 * this would take minutes. */
static void a_loose_cloud_costs_by_its_points(void **state)
{
    enum { stations = 24, points = 2000 };
    struct spl_pack_report report;
    struct spl_error err = {0};
    uint32_t random = 1;
    double places[stations][3];
    (void)state;
    FILE *f = fopen(at("cloud.xyz"), "w");
    assert_non_null(f);
    for (int i = 0; i < points; i++) {
        double p[3];
        for (int k = 0; k < 3; k++) {
            random = random * 1664525u + 1013904223u;
            p[k] = (random >> 8) / (double)(1 << 24) * 6;
        }
        fprintf(f, "%.4f %.4f %.4f\n", p[0], p[1], p[2]);
    }
    assert_int_equal(fclose(f), 0);
    for (int i = 0; i < stations; i++) {
        places[i][0] = 0.6 + 0.6 * (i % 8);
        places[i][1] = 1 + 0.7 * (i / 8);
        places[i][2] = 1.5;
    }
    if (pack(at("cloud.xyz"), at("cloud.spld"), write_places((const double(*)[3])places, stations), &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.stations, stations);
}

/* A sphere around one station of a PTX, and four points of another. */
static void write_stations(const char *path)
{
    enum { columns = 120, rows = 60 };
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    for (int s = 0; s < 2; s++) {
        int across = s ? 2 : columns, down = s ? 2 : rows;
        fprintf(f, "%d\n%d\n0 0 %d\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 %d 1\n", across, down, s, s);
        for (int i = 0; i < across * down; i++) {
            double turn = -2 * M_PI * (i / down) / columns, rise = M_PI * ((i % down + 0.5) / rows - 0.5);
            fprintf(f, "%.5f %.5f %.5f 0.5\n", 3 * cos(turn) * cos(rise), 3 * sin(turn) * cos(rise), 3 * sin(rise));
        }
    }
    assert_int_equal(fclose(f), 0);
}

/* A place in other coordinates sees all of the scan from afar, one that hardly scanned anything next to nothing: both
 * are told by name. */
static void a_station_that_cannot_be_right_is_told(void **state)
{
    static const double places[2][3] = {{-1, 0.1, 0.2}, {1, 0.3, -0.2}}, far[2][3] = {{-1, 0.1, 0.2}, {1e6, 5e5, 3}};
    struct spl_pack_report report;
    struct spl_error err = {0};
    (void)state;
    write_walls(at("walls.xyz"), 0.1);
    if (pack(at("walls.xyz"), at("walls.spld"), write_places(places, 2), &report, &err))
        fail_msg("%s", err.message);
    assert_null(strstr(warnings, "stands"));
    assert_null(strstr(warnings, "sees"));
    if (pack(at("walls.xyz"), at("walls.spld"), write_places(far, 2), &report, &err))
        fail_msg("%s", err.message);
    assert_non_null(strstr(warnings, "station 2 (s1"));
    assert_non_null(strstr(warnings, "stands 1.118e+06 away"));
    assert_null(strstr(warnings, "station 1"));
    write_stations(at("two.ptx"));
    if (pack(at("two.ptx"), at("two.spld"), "", &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.stations, 2);
    assert_non_null(strstr(warnings, "station 2 sees 4 of the scan's"));
    assert_null(strstr(warnings, "station 1"));
}

/* Each station looks at all splats where nobody says whose they are: what is planned grows with their product. */
static void what_stations_see_is_planned_by_what_it_costs(void **state)
{
    struct spl_named_view places[10] = {{0}};
    const struct spl_view_list views = {.views = places, .count = 10};
    struct spl_stage stage = {.threads = 1};
    (void)state;
    spl_maps_plan(&stage, &views, 1, 20000000);
    double scanned = spl_stage_left_s(&stage, 0);
    spl_maps_plan(&stage, &views, 0, 20000000);
    double judged = spl_stage_left_s(&stage, 0);
    assert_true(scanned > 10 && judged > scanned + 60 && judged < 600);
    spl_maps_plan(&stage, &(struct spl_view_list){.views = places, .count = 5}, 0, 20000000);
    assert_true(spl_stage_left_s(&stage, 0) < 0.7 * judged);
    assert_int_equal(stage.part_count, 5); /* changed, not appended */
}

int main(void)
{
    make_folder(folder);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wall_hides_what_lies_behind_it_for_any_threads),
        cmocka_unit_test(a_station_that_cannot_be_right_is_told),
        cmocka_unit_test(what_stations_see_is_planned_by_what_it_costs),
        cmocka_unit_test(a_loose_cloud_costs_by_its_points),
    };
    only_threads_under_tsan();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
