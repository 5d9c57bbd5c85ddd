/* What a view's clip leaves: against the plain C reference, which asks every sample of discs, panels and meshes where
 * it lies, and every point. By every method; conditions of attributes, shapes, both; with what is soft; samples end at
 * a plane, to a millimetre. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/decimal.h"
#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "support/reference_marks.h"

/* Terms around the middle of what is drawn: `text` has %X, %Y and %Z for it, plus tenths: %X+3. */
static struct spl_terms terms_of(const char *field, const char *text)
{
    char numbers[1024];
    size_t used = 0;
    struct spl_terms terms;
    struct spl_error err = {0};
    memset(&terms, 0, sizeof terms);
    for (const char *at = text; *at; at++) {
        if (*at != '%') {
            numbers[used++] = *at;
            continue;
        }
        const double middle = origin[at[1] - 'X'];
        double tenths = 0;
        const char *end = at[2] == '+' || at[2] == '-' ? spl_decimal_parse(at + 2, &tenths) : NULL;
        end -= end && end[-1] == '.'; /* the first of two dots */
        used += (size_t)snprintf(numbers + used, sizeof numbers - used, "%.17g", middle + tenths / 10);
        at = end ? end - 1 : at + 1;
    }
    numbers[used] = '\0';
    if (spl_terms_parse(numbers, field, &terms, &err) || spl_terms_check(&terms, field, &err))
        fail_msg("'%s': %s", numbers, err.message);
    return terms;
}

static const char *const shapes[] = {
    "z<%Z+1 and x:%X-4..%X+5",
    "!z:%Z-2..%Z+2",
    "box:%X-4,%Y-3,%Z-4,%X+4,%Y+2,%Z+3,30",
    "!box:%X-2,%Y-3,%Z-2,%X+3,%Y+2,%Z+1,20,-35,70",
    "polygon:%X-5,%Y-4,%X+5,%Y-3,%X+1,%Y,%X+4,%Y+5@%Z-4..%Z+2.5",
    "axis:%X,%Y,%Z,1,0.3,0.2<0.3",
    "plane:%X,%Y,%Z,1,-0.4,0.5>0 and plane:%X,%Y,%Z+1,0.3,0.2,1<=0",
    "box:%X-3,%Y-2,%Z-3,%X+2,%Y+2,%Z+3<0.1",
};

static void same_by_both(const struct spl_dataset *dataset, struct spl_view *view, const char *what)
{
    char text[200];
    static int turn;
    view->fill.kernel = 9;        /* of what is left points lie as far apart as of all */
    for (int i = 0; i < 2; i++) { /* splat or nearest, which are cut, and points or fill */
        view->method = i          ? turn % 4 < 2 ? SPL_METHOD_POINTS : SPL_METHOD_FILL
                       : turn % 2 ? SPL_METHOD_SPLAT
                                  : SPL_METHOD_NEAREST;
        snprintf(text, sizeof text, "%s, method %s, lod %g", what, spl_method_name(view->method), view->lod);
        same_images(dataset, view, text);
    }
    turn++;
}

static struct spl_dataset *mixed(size_t count, int levels, double radius)
{
    struct make_splat *splats = random_splats(count, origin, radius);
    for (size_t i = 0; i < count; i++)
        splats[i].classification = (uint8_t)(i < count / 2 ? 8 * uniform() : (double)(i / 128 % 8));
    struct spl_dataset *dataset = make_dataset_levels(splats, count, levels);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void discs_are_cut(void **state)
{
    (void)state;
    struct spl_dataset *dataset = mixed(800, 1, 0.08);
    struct spl_view view = looking(origin, 3.2, 96, 72);
    view.lod = 0;
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        view.clip = terms_of("clip", shapes[i]);
        same_by_both(dataset, &view, shapes[i]);
    }
    done(dataset);
}

static void attributes_and_shapes_combine(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "class:2-3,7",
        "!class:1,5",
        "class:2-5 and z<%Z+1",
        "class:2 or z<%Z or !box:%X-3,%Y-3,%Z-3,%X+3,%Y+3,%Z+3",
        "class:0-3 or x<%X+1 and class:3-6 or !y<%Y-1 and z:%Z-4..%Z+4",
        "!class:2,4 or plane:%X,%Y,%Z,1,1,1>0",
    };
    struct spl_dataset *dataset = mixed(800, 2, 0.06);
    struct spl_view view = looking(origin, 3.2, 96, 72);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        view.lod = i % 2 ? 0 : 1;
        view.clip = terms_of("clip", texts[i]);
        same_by_both(dataset, &view, texts[i]);
    }
    view.soft = (struct spl_soft_params){.what = terms_of("soft", "class:4-5 or !box:%X-4,%Y-4,%Z-4,%X+4,%Y+4,%Z+4"),
                                         .cover = 1}; /* not drawn */
    view.clip = terms_of("clip", "class:2-6 or z<%Z and !axis:%X,%Y,%Z,0,0,1<0.2");
    same_by_both(dataset, &view, "soft and clip");
    done(dataset);
}

static void panels_and_meshes_are_cut(void **state)
{
    (void)state;
    for (int relief = 0; relief < 2; relief++) {
        struct spl_dataset *dataset = random_panels(4, 200, origin, 0.012, relief ? 3 : 0);
        struct spl_view view = looking(origin, 3, 96, 72);
        view.lod = 0;
        for (size_t i = relief; i < sizeof shapes / sizeof *shapes; i += 2) {
            view.clip = terms_of("clip", shapes[i]);
            view.shapes = i % 4 < 2 ? SPL_SHAPES_ALL : SPL_SHAPES_OFF;
            same_by_both(dataset, &view, relief ? "meshes" : "panels");
        }
        view.shapes = SPL_SHAPES_ALL;
        view.clip = terms_of("clip", "class:1 or z<%Z and y<%Y+3");
        same_by_both(dataset, &view, relief ? "class of meshes, or a plane" : "class of panels, or a plane");
        done(dataset);
    }
}

/* Lines end where they are cut, and give way to their splats where attributes drop some of these. */
static void lines_are_cut(void **state)
{
    enum { discs = 100, vertices = 27 };
    (void)state;
    struct make_splat *all = random_splats(discs + vertices, origin, 0.02);
    for (size_t i = discs; i < discs + vertices; i++) {
        all[i].vertex = true;
        all[i].linear = (i - discs) % 9 != 8;
        all[i].width = 0.02f;
    }
    struct spl_dataset *dataset = make_dataset(all, discs + vertices);
    free(all);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 96, 72);
    view.lod = 0;
    view.clip = terms_of("clip", "plane:%X,%Y,%Z,1,1,1>0");
    view.method = SPL_METHOD_SPLAT;
    same_images(dataset, &view, "lines, splat");
    view.method = SPL_METHOD_NEAREST;
    same_images(dataset, &view, "lines, nearest");
    done(dataset);
}

/* What is nearest stays what it is where it lies within, to the bit, and nothing lies a millimetre beyond. */
static void cuts_are_exact(void **state)
{
    (void)state;
    size_t within = 0, beyond = 0, off = 0;
    for (int kind = 0; kind < 3; kind++) {
        struct spl_dataset *dataset = kind ? random_panels(4, 0, origin, 0.03, kind == 2 ? 3 : 0) : mixed(400, 1, 0.3);
        struct spl_view view = looking(origin, 10, 160, 120);
        view.lod = 0;
        view.method = SPL_METHOD_NEAREST;
        view.layers = 1u << SPL_LAYER_DEPTH;
        struct spl_frame plain = render(dataset, &view), cut;
        view.clip = terms_of("clip", "plane:%X,%Y,%Z,1,0.4,-0.2>0");
        cut = render(dataset, &view);
        const float *before = plain.images[SPL_LAYER_DEPTH].pixels, *after = cut.images[SPL_LAYER_DEPTH].pixels;
        for (uint32_t p = 0; p < 160 * 120; p++) {
            const double x = (p % 160 + 0.5 - view.camera.cx) / view.camera.fx;
            const double y = (p / 160 + 0.5 - view.camera.cy) / view.camera.fy;
            double sides[2];
            for (int i = 0; i < 2; i++) {
                const double z = (double)(i ? after : before)[p], at[3] = {x * z, y * z, z};
                double world[3];
                for (int a = 0; a < 3; a++)
                    world[a] = view.camera.eye[a] + view.camera.rotation[a] * at[0] +
                               view.camera.rotation[3 + a] * at[1] + view.camera.rotation[6 + a] * at[2];
                sides[i] = isfinite(z) ? reference_distance(&view.clip.terms[0], world) : NAN;
            }
            off += sides[1] < -1e-3;
            off += sides[0] > 1e-3 && before[p] != after[p];
            within += sides[0] > 1e-3;
            beyond += sides[0] < -1e-3;
        }
        spl_frame_finish(&plain);
        spl_frame_finish(&cut);
        done(dataset);
    }
    assert_true(within > 1000 && beyond > 1000);
    if (off > within / 500) /* discs along their edge are drawn beyond it by a sample */
        fail_msg("%zu of %zu samples are off", off, within);
}

/* A loop of a software driver's kernel ends after 65535 rounds, those of loops within it counted: of as many large
 * discs as an invocation draws, the last and nearest is whole, whatever asks its samples. */
static void large_discs_are_whole(void **state)
{
    enum { discs = SPL_RUN_SPLATS, side = 2 * SPL_WINDOW };
    static const char *const around[] = {
        "z<%Z+100",
        "axis:%X,%Y,%Z,0,1,0<10",
        "box:%X-100,%Y-100,%Z-100,%X+100,%Y+100,%Z+100",
        "box:%X-100,%Y-100,%Z-100,%X+100,%Y+100,%Z+100,30",
    };
    (void)state;
    struct make_splat *splats = random_splats(discs + 1, origin, 3);
    struct spl_view view = looking(origin, 3.2, side, side);
    for (int i = 0; i < discs; i++)
        for (int a = 0; a < 3; a++) { /* facing the eye, each nearer than the one before */
            splats[i].position[a] = origin[a] - 0.01 * i * view.camera.rotation[6 + a];
            splats[i].normal[a] = (float)-view.camera.rotation[6 + a];
        }
    memcpy(splats[discs].position, origin, sizeof origin);
    splats[discs].position[2] += 30; /* what shapes leave out */
    struct spl_dataset *dataset = make_dataset(splats, discs + 1);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    view.lod = 0;
    view.layers = 1u << SPL_LAYER_DEPTH;
    for (size_t method = 0; method < 2; method++) {
        view.method = method ? SPL_METHOD_SPLAT : SPL_METHOD_NEAREST;
        view.clip = (struct spl_terms){0};
        struct spl_frame plain = render(dataset, &view);
        for (size_t i = method; i < sizeof around / sizeof *around; i += 2) {
            view.clip = terms_of("clip", around[i]);
            struct spl_frame cut = render(dataset, &view);
            const float *whole = plain.images[SPL_LAYER_DEPTH].pixels, *left = cut.images[SPL_LAYER_DEPTH].pixels;
            for (size_t p = 0; p < (size_t)side * side; p++)
                if (!(left[p] == whole[p]) || !isfinite(whole[p]))
                    fail_msg("%s, method %s: pixel %zu, %zu", around[i], spl_method_name(view.method), p % side,
                             p / side);
            spl_frame_finish(&cut);
        }
        spl_frame_finish(&plain);
    }
    done(dataset);
}

/* What is not drawn is not drawn as soft, either; a clip that holds everywhere changes no byte. */
static void soft_spheres_are_dropped(void **state)
{
    (void)state;
    struct spl_dataset *dataset = mixed(800, 1, 0.04);
    struct spl_view view = looking(origin, 3.2, 96, 72);
    view.lod = 0;
    view.soft = (struct spl_soft_params){.what = terms_of("soft", "class:0-5"), .opacity = 0.3, .cover = 1};
    view.clip = terms_of("clip", "class:3-7"); /* 3 to 5 soft, 6 and 7 solid */
    struct spl_view other = view, plain = view;
    other.soft.what = terms_of("soft", "class:3-5");
    other.clip = terms_of("clip", "class:3,4,5,6,7");
    plain.clip = (struct spl_terms){0};
    struct spl_view all = plain;
    all.clip = terms_of("clip", "class:0-7 and !class:9 and z<%Z+99 and x>%X-99");
    const struct spl_view *const pairs[2][2] = {{&view, &other}, {&plain, &all}};
    struct spl_frame first = render(dataset, &view), whole = render(dataset, &plain);
    assert_memory_not_equal(first.images[SPL_LAYER_COLOR].pixels, whole.images[SPL_LAYER_COLOR].pixels, 96 * 72 * 4);
    assert_true(first.stats.soft_drawn > 0 && first.stats.soft_drawn < whole.stats.soft_drawn);
    spl_frame_finish(&first);
    spl_frame_finish(&whole);
    for (int i = 0; i < 2; i++) {
        struct spl_frame one = render(dataset, pairs[i][0]), same = render(dataset, pairs[i][1]);
        assert_memory_equal(one.images[SPL_LAYER_COLOR].pixels, same.images[SPL_LAYER_COLOR].pixels, 96 * 72 * 4);
        spl_frame_finish(&one);
        spl_frame_finish(&same);
    }
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(discs_are_cut),
        frames_test(attributes_and_shapes_combine),
        frames_test(panels_and_meshes_are_cut),
        frames_test(lines_are_cut),
        frames_test(cuts_are_exact),
        frames_test(large_discs_are_whole),
        frames_test(soft_spheres_are_dropped),
    };
    return frames_run(argc, argv, "cut", tests, sizeof tests / sizeof *tests);
}
