/* The two forms of the kernels that draw discs (shaders/common/walk.glsl), one for hardware, one for software drivers,
 * draw the same bytes: discs alone and by windows, that end at clip lines, of which some are soft, that maps trim and
 * colour, with textures, and cells of panels and of meshes, each of them. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "dataset/dictionary.h"
#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "render/fault.h"
#include "support/make_textures.h"
#include "support/mapped_dataset.h"

/* Of every method that draws discs. */
static void same_both_ways(const struct spl_dataset *dataset, const struct spl_view *from, const char *what)
{
    static const enum spl_method methods[] = {SPL_METHOD_SPLAT, SPL_METHOD_NEAREST};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        struct spl_view view = *from;
        struct spl_frame alone, shared;
        size_t covered = 0;
        view.method = methods[m];
        spl_renderer_set_shares(renderer, false);
        alone = render(dataset, &view);
        spl_renderer_set_shares(renderer, true);
        shared = render(dataset, &view);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            const struct spl_image *a = &alone.images[layer], *b = &shared.images[layer];
            if (!a->pixels)
                continue;
            size_t bytes = (size_t)a->width * a->height * spl_pixel_bytes(a->type);
            if (memcmp(a->pixels, b->pixels, bytes))
                fail_msg("%s, method %s: layer %s differs", what, spl_method_name(view.method), spl_layer_name(layer));
        }
        const float *coverage = alone.images[SPL_LAYER_COVERAGE].pixels;
        for (size_t i = 0; i < (size_t)view.camera.width * view.camera.height; i++)
            covered += coverage[i] > 0;
        if (covered < (size_t)view.camera.width * view.camera.height / 20)
            fail_msg("%s, method %s: hardly anything is drawn", what, spl_method_name(view.method));
        spl_frame_finish(&alone);
        spl_frame_finish(&shared);
    }
}

/* Some end at a line, some are of class 1; the lines' direction lies in the disc. */
static struct spl_dataset *discs(size_t count, double radius)
{
    struct make_splat *splats = random_splats(count, origin, radius);
    for (size_t i = 0; i < count; i++) {
        splats[i].classification = (uint8_t)(uniform() < 0.3);
        if (i % 300 >= 200 || i % 3)
            continue;
        splats[i].clip[0] = -splats[i].normal[1];
        splats[i].clip[1] = splats[i].normal[0];
        splats[i].clip_offset = 0.4f;
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    return dataset;
}

/* Colours, as a rule: each group of layers is another kernel to be compiled. */
static struct spl_view colors(double distance)
{
    struct spl_view view = looking(origin, distance, 96, 72);
    view.layers = 1 << SPL_LAYER_COLOR | 1 << SPL_LAYER_COVERAGE;
    view.lod = 0;
    return view;
}

/* Without those of class 1, of what has any. */
static struct spl_view without(const struct spl_view *from)
{
    struct spl_view view = *from;
    view.soft.what.count = 1;
    view.soft.what.terms[0] = (struct spl_term){.least = 1, .most = 1, .with_least = true, .with_most = true};
    strcpy(view.soft.what.terms[0].name, "class");
    return view;
}

static void add(const struct spl_dataset *dataset)
{
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
}

static void discs_are_the_same(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        size_t splats;
        double radius, distance;
    } rows[] = {{"small", 1500, 0.03, 3}, {"wider than windows", 60, 0.6, 1.5}, {"among them", 500, 0.05, 0.5}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_dataset *dataset = discs(rows[i].splats, rows[i].radius);
        struct spl_view view = colors(rows[i].distance), some = without(&view);
        view.layers = i ? view.layers : (1 << SPL_LAYER_COUNT) - 1;
        add(dataset);
        same_both_ways(dataset, &view, rows[i].what);
        same_both_ways(dataset, &some, rows[i].what);
        done(dataset);
    }
}

static void textures_are_the_same(void **state)
{
    (void)state;
    for (int magnified = 0; magnified < 2; magnified++) {
        struct spl_dataset *plain = discs(magnified ? 100 : 900, magnified ? 0.2 : 0.04);
        struct spl_dictionary dictionary = make_dictionary(40, magnified ? 8 : 32, 4);
        struct spl_dataset *dataset = make_textured(plain, &dictionary, 4, 11);
        spl_dataset_close(plain);
        spl_dictionary_finish(&dictionary);
        add(dataset);
        struct spl_view view = colors(2);
        same_both_ways(dataset, &view, magnified ? "interpolated" : "textured");
        done(dataset);
    }
}

/* Half of all directions nothing came back from, the others from near the origin. */
static void look_around(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map;
    *range = sin(9 * d[2]) > 0 ? INFINITY : 3;
    for (int i = 0; i < 3; i++)
        color[i] = 127.5 + 100 * d[i];
}

static struct spl_dataset *mapped(const struct spl_dataset *plain)
{
    static const double place[3] = {3, 0.5, 1};
    const struct make_map map = {.row = mapped_row(place, 1, 64, 1, 30), .look = look_around};
    struct spl_dataset *dataset = make_mapped_alike(plain, &map, 1, true);
    add(dataset);
    return dataset;
}

static void trimmed_are_the_same(void **state)
{
    (void)state;
    struct spl_dataset *plain = discs(1500, 0.06), *dataset = mapped(plain);
    struct spl_view view = colors(3), some = without(&view);
    spl_dataset_close(plain);
    same_both_ways(dataset, &view, "trimmed");
    same_both_ways(dataset, &some, "trimmed, some soft");
    done(dataset);
}

static void cells_are_the_same(void **state)
{
    (void)state;
    for (int relief = 0; relief < 2; relief++) {
        struct spl_dataset *plain = random_panels(4, 300, origin, 0.012, relief ? 3 : 0), *trimmed = mapped(plain);
        struct spl_view view = colors(3), some;
        view.shapes = SPL_SHAPES_OFF;
        some = without(&view);
        same_both_ways(plain, &view, relief ? "cells of meshes" : "cells of panels");
        same_both_ways(plain, &some, relief ? "cells of meshes, some soft" : "cells of panels, some soft");
        same_both_ways(trimmed, &view, relief ? "cells of meshes, trimmed" : "cells of panels, trimmed");
        done(trimmed);
        done(plain);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(discs_are_the_same),   frames_test(textures_are_the_same), frames_test(trimmed_are_the_same),
        frames_test(cells_are_the_same),
    };
    return frames_run(argc, argv, "walk", tests, sizeof tests / sizeof *tests);
}
