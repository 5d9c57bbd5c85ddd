/* Maps of stations: what they trim and how they colour, against the plain C reference and against what is known of a
 * scene. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "gpu/frames.h"
#include "shared.h"
#include "support/mapped_dataset.h"

static const double spheres[3] = {1.1, 0.7, 0.9};

/* A ball around the origin before stripes of sky and of what was not scanned; colours are waves of direction. */
static void look_anywhere(const struct make_map *map, const double d[3], double color[3], double *range)
{
    double away = 0, along = 0, local[3];
    const double middle[3] = {0, 0, 0};
    mapped_local(&map->row, middle, local);
    for (int i = 0; i < 3; i++) {
        away += local[i] * local[i];
        along += local[i] * d[i];
        color[i] = 127.5 + 100 * sin(9 * d[i] + 5 * d[(i + 1) % 3] * d[(i + 2) % 3]);
    }
    double radius = spheres[0], root = along * along - away + radius * radius;
    *range = root > 0 && along > 0 ? fmax(along - sqrt(root), 0.06) : sin(20 * d[2]) > 0 ? INFINITY : NAN;
}

static struct spl_dataset *random_mapped(size_t count, double radius, int levels, uint32_t stations, bool trims)
{
    static const double places[4][3] = {{3, 0.5, 1}, {-1, -2.5, 0.2}, {0.1, 0.2, 0.05}, {0.5, 3, -2}};
    struct make_splat *splats = random_splats(count, origin, radius);
    for (size_t i = 0; i < count && i % 300 < 200; i += 3) /* some end at a line, too */
        splats[i].clip[0] = -splats[i].normal[1], splats[i].clip[1] = splats[i].normal[0], splats[i].clip_offset = 0.4f;
    struct spl_dataset *plain = make_dataset_levels(splats, count, levels);
    struct make_map maps[4];
    for (uint32_t i = 0; i < stations; i++)
        maps[i] = (struct make_map){.row = mapped_row(places[i], 1 + i, 64 << (i % 2), 1 + i % 3, 30 + 7 * i),
                                    .look = look_anywhere};
    struct spl_dataset *dataset = make_mapped_alike(plain, maps, stations, trims);
    spl_dataset_close(plain);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void maps_match_the_reference(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        size_t splats;
        double radius, distance, lod, margin;
        int levels, supersample;
        uint32_t stations;
        bool trims;
    } rows[] = {
        {"colours", 3000, 0.05, 3, 0, 1, 1, 1, 2, false}, {"trimmed", 3000, 0.05, 3, 0, 1, 1, 1, 3, true},
        {"pruned", 6000, 0.05, 6, 12, 2, 2, 1, 4, true},  {"among them", 3000, 0.03, 0.9, 1, 1, 1, 1, 4, true},
        {"supersampled", 2000, 0.1, 3, 1, 0, 1, 2, 1, true},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_dataset *dataset =
            random_mapped(rows[i].splats, rows[i].radius, rows[i].levels, rows[i].stations, rows[i].trims);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_view view = looking(origin, rows[i].distance, 160, 120);
            char what[64];
            if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
                continue;
            view.method = method;
            view.lod = rows[i].lod;
            view.disc.margin = rows[i].margin;
            view.supersample = rows[i].supersample;
            snprintf(what, sizeof what, "%s, %s", rows[i].what, spl_method_name(method));
            same_images(dataset, &view, what);
            struct spl_frame on, off;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &on, NULL), SPL_OK);
            assert_true(on.stats.complete);
            view.maps = SPL_MAPS_OFF;
            same_images(dataset, &view, what);
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &off, NULL), SPL_OK);
            struct tally t = compare(&on, &off);
            if (t.color_differs < t.pixels / 20 || (t.depth_differs > 0) != rows[i].trims)
                fail_msg("%s: maps change %zu colours and %zu depths", what, t.color_differs, t.depth_differs);

            spl_frame_finish(&on);
            spl_frame_finish(&off);
        }
        done(dataset);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(maps_match_the_reference),
    };
    return frames_run(argc, argv, "maps", tests, sizeof tests / sizeof *tests);
}
