/* What is soft and not drawn at all is as if it were not there: against the plain C reference, which leaves out what
 * decodes to a value in range, or lies in a shape. By every method, splats, panels, meshes, maps, at several levels;
 * nothing soft changes no byte, and what is all soft leaves nothing. One body for every backend. */
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
#include "gpu/panel_scenes.h"
#include "sparse/dictionary.h"
#include "support/make_textures.h"
#include "support/mapped_dataset.h"
#include "support/reference.h"
#include "support/reference_marks.h"
#include "support/sanitised.h"

static struct spl_term class_of(double least, double most)
{
    struct spl_term term = {.least = least, .most = most, .with_least = true, .with_most = true};
    strcpy(term.name, "class");
    return term;
}

static struct spl_term uncertain(double least, double most)
{
    struct spl_term term = {.least = least, .most = most};
    strcpy(term.name, "uncertainty");
    return term;
}

/* Around `center`, of random form. */
static struct spl_term shape_of(enum spl_term_measure measure, const double center[3])
{
    struct spl_term term = {.measure = measure, .least = -INFINITY, .most = measure == SPL_TERM_AXIS ? 0.5 : 0};
    for (int i = 0; i < 3; i++) {
        term.shape[i] = center[i] + 0.4 * uniform() - 0.2;
        term.shape[i + 3] = uniform() - 0.5;
    }
    for (int i = 0; i < 3 && measure == SPL_TERM_BOX; i++) {
        term.shape[i] -= 0.5;
        term.shape[i + 3] = term.shape[i] + 0.5 + uniform();
    }
    return term;
}

/* Splats whose classes are mixed within chunks, then whole chunks of one, with uncertainties. */
static struct spl_dataset *mixed(size_t count, int levels)
{
    struct make_splat *splats = random_splats(count, origin, 0.05);
    for (size_t i = 0; i < count; i++) {
        splats[i].classification = (uint8_t)(i < count / 2 ? 8 * uniform() : (double)(i / 128 % 8));
        splats[i].uncertainty = (float)(i % 7 ? uniform() * uniform() : 0);
    }
    struct spl_dataset *dataset = make_dataset_levels(splats, count, levels);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void same_by_all(const struct spl_dataset *dataset, struct spl_view *view, const char *what)
{
    char text[120];
    view->fill.kernel = 9; /* of what is left points lie as far apart as of all */
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        view->method = (enum spl_method)method;
        snprintf(text, sizeof text, "%s, method %s, lod %g", what, spl_method_name(view->method), view->lod);
        same_images(dataset, view, text);
    }
}

static void attributes_filter(void **state)
{
    (void)state;
    for (int levels = 1; levels <= 2; levels++) {
        struct spl_dataset *dataset = mixed(3000, levels);
        struct spl_view view = looking(origin, 3.2, 160, 120);
        view.lod = levels == 1 ? 0 : 1;
        view.soft = (struct spl_soft_params){.what = {.count = 2, .terms = {class_of(2, 3), class_of(7, 7)}}};
        same_by_all(dataset, &view, "classes 2, 3 and 7");
        view.soft = (struct spl_soft_params){.what = {.count = 1, .terms = {uncertain(0.4, INFINITY)}}};
        same_by_all(dataset, &view, "uncertainty above 0.4");
        view.soft =
            (struct spl_soft_params){.what = {.count = 2, .terms = {uncertain(0.1, 0.3), class_of(5, INFINITY)}}};
        same_by_all(dataset, &view, "uncertainty from 0.1 to 0.3, or class from 5");
        done(dataset);
    }
}

static void shapes_filter(void **state)
{
    (void)state;
    struct spl_dataset *dataset = mixed(2500, 1);
    struct spl_view view = looking(origin, 3.2, 160, 120);
    view.lod = 0;
    for (int measure = SPL_TERM_AXIS; measure <= SPL_TERM_BOX; measure++) {
        view.soft =
            (struct spl_soft_params){.what = {.count = 1, .terms = {shape_of((enum spl_term_measure)measure, origin)}}};
        same_by_all(dataset, &view, measure == SPL_TERM_AXIS ? "axis" : measure == SPL_TERM_PLANE ? "plane" : "box");
        view.soft.what.terms[view.soft.what.count++] = class_of(0, 1);
        same_by_all(dataset, &view, "a shape or classes");
    }
    done(dataset);
}

/* Panels and meshes lose the cells that lie in a shape; their cells are drawn, where all are asked for as such, too. */
static void cells_are_cut(void **state)
{
    (void)state;
    for (int relief = 0; relief < 2; relief++) {
        struct spl_dataset *dataset = random_panels(4, 300, origin, 0.012, relief ? 3 : 0);
        struct spl_view view = looking(origin, 3, 160, 120);
        view.lod = 0;
        view.shapes = SPL_SHAPES_OFF;
        view.soft = (struct spl_soft_params){.what = {.count = 1, .terms = {shape_of(SPL_TERM_PLANE, origin)}}};
        same_by_all(dataset, &view, relief ? "meshes" : "panels");
        view.shapes = SPL_SHAPES_ALL;
        view.soft.what.terms[0] = class_of(1, 1); /* some of a chunk, as such */
        same_by_all(dataset, &view, relief ? "class of meshes" : "class of panels");
        view.soft.what.terms[0] = class_of(0, 2); /* all of them */
        same_by_all(dataset, &view, relief ? "all meshes" : "all panels");
        done(dataset);
    }
}

static void equal_frames(const struct spl_dataset *dataset, const struct spl_view *a, const struct spl_view *b)
{
    struct spl_frame one = render(dataset, a), other = render(dataset, b);
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *image = &one.images[layer];
        if (image->pixels)
            assert_memory_equal(image->pixels, other.images[layer].pixels,
                                (size_t)image->width * image->height * spl_pixel_bytes(image->type));
    }
    spl_frame_finish(&one);
    spl_frame_finish(&other);
}

/* Of panels that a shape cuts, drawn as such otherwise, nothing is left on its soft side but by half a cell. */
static void panels_end_where_they_are_cut(void **state)
{
    static const enum spl_method methods[] = {SPL_METHOD_SPLAT, SPL_METHOD_NEAREST};
    size_t all = 0;
    (void)state;
    for (int i = 0; i < 8; i++) {
        struct spl_dataset *dataset = random_panels(4, 0, origin, 0.012, i / 2 % 2 ? 3 : 0);
        struct spl_view view = looking(origin, 3, 160, 120);
        size_t beyond[2] = {0}, there = 0;
        view.lod = 0;
        view.method = methods[i % 2];
        const struct spl_term cut = shape_of(SPL_TERM_PLANE, origin); /* soft below 0 */
        for (int soft = 0; soft < 2; soft++) {
            view.soft = (struct spl_soft_params){.what = {.count = (uint32_t)soft, .terms = {cut}}};
            struct spl_frame frame = render(dataset, &view);
            const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
            for (uint32_t p = 0; p < 160 * 120; p++) {
                const double z = (double)depth[p], x = p % 160 + 0.5, y = p / 160 + 0.5;
                const double at[3] = {(x - view.camera.cx) / view.camera.fx * z,
                                      (y - view.camera.cy) / view.camera.fy * z, z};
                double world[3];
                if (!(z > 0 && z < 100))
                    continue;
                for (int a = 0; a < 3; a++) {
                    world[a] = view.camera.eye[a];
                    for (int c = 0; c < 3; c++)
                        world[a] += view.camera.rotation[3 * c + a] * at[c];
                }
                beyond[soft] += reference_distance(&cut, world) < -0.08;
                there += (size_t)soft;
            }
            spl_frame_finish(&frame);
        }
        if (beyond[1] > 10) /* discs of the margin, seen along their edge */
            fail_msg("%zu of %zu pixels lie beyond the cut, %zu without it", beyond[1], there, beyond[0]);
        all += beyond[0] > 200 && there > 200;
        done(dataset);
    }
    assert_true(all >= 4);
}

static void look_around(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map;
    for (int i = 0; i < 3; i++)
        color[i] = 127.5 + 100 * sin(7 * d[i] + 4 * d[(i + 1) % 3]);
    *range = sin(9 * d[2]) > 0.3 ? 2 : INFINITY;
}

/* What maps colour and trim, in chunks of which some splats are soft. */
static void mapped_splats_filter(void **state)
{
    (void)state;
    static const double places[2][3] = {{3, 0.5, 1}, {-1, -2.5, 0.2}};
    for (int trims = 0; trims < 2; trims++) {
        struct spl_dataset *plain = mixed(1500, 1);
        struct make_map maps[2];
        for (uint32_t i = 0; i < 2; i++) {
            maps[i] = (struct make_map){.row = mapped_row(places[i], 1 + i, 64, 1 + i, 30 + 7 * i),
                                        .look = look_around};
            maps[i].row.slack = 0.05f;
        }
        struct spl_dataset *dataset = make_mapped_alike(plain, maps, 2, trims);
        done(plain);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, 3.2, 160, 120);
        view.lod = 0;
        view.soft = (struct spl_soft_params){.what = {.count = 2, .terms = {class_of(2, 3), class_of(7, 7)}}};
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            view.method = (enum spl_method)method;
            if (spl_method_get_params(view.method) & SPL_PARAM_BIT(maps))
                same_images(dataset, &view, trims ? "mapped and trimmed" : "mapped");
        }
        done(dataset);
    }
}

/* Splats with textures, plain and summed first. A fragment at the border of two texels may take either: few pixels. */
static void textured_splats_filter(void **state)
{
    (void)state;
    for (int near = 0; near < 2; near++) {
        struct make_splat *splats = random_splats(near ? 300 : 2500, origin, near ? 0.05 : 0.02);
        for (size_t i = 0; i < (near ? 300 : 2500); i++)
            splats[i].classification = (uint8_t)(4 * uniform());
        struct spl_dataset *plain = make_dataset(splats, near ? 300 : 2500);
        struct spl_dictionary dictionary = make_dictionary(100, near ? 8 : 16, 4);
        struct spl_dataset *dataset = make_textured(plain, &dictionary, 6, 11);
        spl_dataset_close(plain);
        spl_dictionary_finish(&dictionary);
        free(splats);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, near ? 1.5 : 2.5, 160, 120);
        view.lod = 0;
        view.layers = 1u << SPL_LAYER_COLOR;
        view.disc.atoms = 8;
        view.soft = (struct spl_soft_params){.what = {.count = 1, .terms = {class_of(1, 2)}}};
        struct spl_frame gpu = render(dataset, &view), cpu;
        assert_int_equal(reference_render(dataset, &view, &cpu, NULL), SPL_OK);
        const uint8_t *a = gpu.images[SPL_LAYER_COLOR].pixels, *b = cpu.images[SPL_LAYER_COLOR].pixels;
        size_t differ = 0;
        for (size_t i = 0; i < 160 * 120; i++) {
            bool differs = false;
            for (size_t c = 4 * i; c < 4 * i + 4; c++)
                differs |= abs(a[c] - b[c]) > 1;
            differ += differs;
        }
        if (differ > 160 * 120 / 2000 + 1)
            fail_msg("textured, %s: %zu pixels differ", near ? "near" : "far", differ);
        spl_frame_finish(&gpu);
        spl_frame_finish(&cpu);
        done(dataset);
    }
}

static void equal_frames(const struct spl_dataset *dataset, const struct spl_view *a, const struct spl_view *b);

/* Lines stand for linear splats, of which some are soft: the solid ones are drawn themselves, as by a view without
 * lines. Where none is, lines are. */
static void lines_give_way(void **state)
{
    enum { discs = 2000, vertices = 27 };
    (void)state;
    struct make_splat *all = random_splats(discs + vertices, origin, 0.02);
    for (size_t i = 0; i < discs; i++) {
        all[i].linear = i % 5 == 0;
        all[i].classification = i % 5 ? 6 : (uint8_t)(i / 5 % 3);
    }
    for (size_t i = discs; i < discs + vertices; i++) {
        all[i].vertex = true;
        all[i].linear = (i - discs) % 9 != 8;
        all[i].width = 0.02f;
    }
    struct spl_dataset *dataset = make_dataset(all, discs + vertices);
    free(all);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view lined = looking(origin, 3, 160, 120), plain = lined, without;
    lined.lod = plain.lod = 0;
    lined.soft = (struct spl_soft_params){.what = {.count = 1, .terms = {class_of(1, 1)}}};
    without = lined;
    without.shapes = SPL_SHAPES_OFF;
    equal_frames(dataset, &lined, &without);
    same_images(dataset, &without, "linear splats of which some are soft");
    lined.soft.what.terms[0] = class_of(99, 99);
    equal_frames(dataset, &lined, &plain);
    done(dataset);
}

/* What takes no splat changes no byte; marks of what takes each one leave nothing, as a whole does. */
static void nothing_and_everything(void **state)
{
    (void)state;
    struct spl_dataset *dataset = mixed(3000, 1), *panels = random_panels(3, 200, origin, 0.012, 0);
    for (int i = 0; i < 2; i++) {
        struct spl_view plain = looking(origin, 3.2, 160, 120);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            plain.method = (enum spl_method)method;
            struct spl_view soft = plain, all = plain;
            soft.soft = (struct spl_soft_params){.what = {.count = 1, .terms = {class_of(200, 255)}}};
            equal_frames(i ? panels : dataset, &plain, &soft);
            soft.soft.what.terms[0] = shape_of(SPL_TERM_BOX, (const double[3]){50, 50, 50}); /* far away */
            equal_frames(i ? panels : dataset, &plain, &soft);
            soft.soft = (struct spl_soft_params){.what = {.count = 1, .terms = {class_of(0, 255)}}};
            /* by marks */
            all.soft = (struct spl_soft_params){.what = {.count = 2, .terms = {class_of(0, 3), class_of(4, 7)}}};
            equal_frames(i ? panels : dataset, &soft, &all);
            struct spl_frame frame = render(i ? panels : dataset, &all);
            const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
            for (size_t p = 0; p < 160 * 120; p++)
                assert_true(coverage[p] == 0);
            spl_frame_finish(&frame);
        }
    }
    done(dataset);
    done(panels);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(attributes_filter),
        frames_test(shapes_filter),
        frames_test(cells_are_cut),
        frames_test(panels_end_where_they_are_cut),
        frames_test(mapped_splats_filter),
        frames_test(textured_splats_filter),
        frames_test(lines_give_way),
        frames_test(nothing_and_everything),
    };
    return frames_run(argc, argv, "marks", tests, sizeof tests / sizeof *tests);
}
