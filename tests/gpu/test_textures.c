/* Textured splats against the plain C reference, and what textures must not change. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "dataset/dictionary.h"
#include "gpu/frames.h"
#include "render/fault.h"
#include "support/make_textures.h"
#include "support/reference.h"

/* Splats of every orientation around the origin, of up to ten times `radius`. */
static struct spl_dataset *lined_cube(size_t count, double radius, int levels)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++) {
        double length = 0, n[3];
        for (int c = 0; c < 3; c++) {
            splats[i].position[c] = 2 * uniform() - 1;
            n[c] = i % 7 == (size_t)c ? 0 : uniform() - 0.5; // some exactly along an axis
            length += n[c] * n[c];
            splats[i].color[c] = (uint8_t)(40 + uniform() * 176);
        }
        for (int c = 0; c < 3; c++)
            splats[i].normal[c] = (float)(n[c] / sqrt(length));
        splats[i].radius = (float)(radius * pow(10, uniform()));
        for (int c = 0; c < 3 && i % 300 < 100 && i % 2; c++) // some end at a line
            splats[i].clip[c] = splats[i].normal[(c + 1) % 3] - splats[i].normal[(c + 2) % 3];
        splats[i].clip_offset = 0.3f;
    }
    struct spl_dataset *dataset = make_dataset_levels(splats, count, levels);
    free(splats);
    return dataset;
}

/* From aside, colours alone. */
static struct spl_view colored(double distance, uint32_t width, uint32_t height)
{
    struct spl_view view = looking(origin, distance, width, height);
    view.layers = 1 << SPL_LAYER_COLOR;
    return view;
}

static struct spl_frame render(const struct spl_dataset *dataset, const struct spl_view *view)
{
    struct spl_frame frame;
    struct spl_error err = {0};
    if (spl_renderer_render(renderer, dataset, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

/* Pixels of which a channel differs by more than `levels`. */
static size_t differing(const struct spl_image *a, const struct spl_image *b, int levels)
{
    const uint8_t *p = a->pixels, *q = b->pixels;
    size_t count = 0;
    for (size_t i = 0; i < (size_t)a->width * a->height; i++) {
        int worst = 0;
        for (size_t c = 4 * i; c < 4 * i + 4; c++)
            worst = abs(p[c] - q[c]) > worst ? abs(p[c] - q[c]) : worst;
        count += worst > levels;
    }
    return count;
}

/* A fragment at the border of two texels may take either: few pixels. */
static void same_as_reference(const struct spl_dataset *dataset, const struct spl_view *view, const char *what)
{
    struct spl_frame gpu = render(dataset, view), cpu;
    assert_int_equal(reference_render(dataset, view, &cpu, NULL), SPL_OK);
    const struct spl_image *a = &gpu.images[SPL_LAYER_COLOR], *b = &cpu.images[SPL_LAYER_COLOR];
    size_t pixels = (size_t)a->width * a->height, differ = differing(a, b, 1);
    if (differ > pixels / 2000 + 1)
        fail_msg("%s, %u atoms, lod %g: %zu of %zu pixels differ", what, view->disc.atoms, view->lod, differ, pixels);
    spl_frame_finish(&gpu);
    spl_frame_finish(&cpu);
}

static void textures_match_the_reference(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        uint32_t size, atoms, planes;
        size_t splats;
        double radius, distance, lod;
        int levels;
    } rows[] = {
        {"small splats", 32, 300, 8, 3000, 0.02, 2.5, 0, 1},   {"magnified", 8, 40, 4, 400, 0.05, 1.5, 0, 1},
        {"magnified, fine", 32, 700, 8, 60, 0.1, 1.2, 0, 1},   {"among them", 16, 5, 3, 500, 0.05, 0.3, 0, 1},
        {"pruned", 16, 100, 8, 4000, 0.03, 2.5, 6, 2},         {"far", 32, 100, 8, 3000, 0.02, 12, 1, 1},
        {"summed in rounds", 32, 50, 7, 900, 0.06, 1.2, 0, 1},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_dataset *plain = lined_cube(rows[i].splats, rows[i].radius, rows[i].levels);
        struct spl_dictionary dictionary = make_dictionary(rows[i].atoms, rows[i].size, 4);
        struct spl_dataset *dataset = make_textured(plain, &dictionary, rows[i].planes, 11);
        spl_dataset_close(plain);
        spl_dictionary_finish(&dictionary);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        spl_renderer_set_work_at_once(renderer, i % 2 ? UINT64_MAX : 1); // in parts, or not
        struct spl_view view = colored(rows[i].distance, 160, 120);
        view.lod = rows[i].lod;
        static const uint32_t atoms[2][3] = {{8, 3, 0}, {7, 5, 1}};
        for (int k = 0; k < 3; k++) {
            view.disc.atoms = atoms[i % 2][k];
            same_as_reference(dataset, &view, rows[i].what);
        }
        view.disc.atoms = 8;
        view.supersample = 2;
        if (i == 0)
            same_as_reference(dataset, &view, rows[i].what);
        done(dataset);
    }
}

/* Bit for bit: no atoms is the dataset without textures; all other layers and method points know nothing of them. With
 * atoms the image is another, and each cap its own. */
static void textures_change_colours_only(void **state)
{
    (void)state;
    struct spl_dataset *plain = lined_cube(3000, 0.03, 1);
    struct spl_dictionary dictionary = make_dictionary(200, 16, 4);
    struct spl_dataset *dataset = make_textured(plain, &dictionary, 8, 11);
    assert_int_equal(spl_renderer_add(renderer, plain, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = colored(2.5, 160, 120);
    view.layers = (1 << SPL_LAYER_COUNT) - 1;
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        view.method = method;
        view.disc.atoms = 8;
        struct spl_frame a = render(plain, &view), b = render(dataset, &view);
        view.disc.atoms = 0;
        struct spl_frame none = render(dataset, &view);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            const struct spl_image *x = &a.images[layer], *y = &b.images[layer], *z = &none.images[layer];
            size_t bytes = (size_t)x->width * x->height * spl_pixel_bytes(x->type);
            bool changes = layer == SPL_LAYER_COLOR && method == SPL_METHOD_SPLAT;
            assert_int_equal(memcmp(x->pixels, y->pixels, bytes) != 0, changes);
            assert_memory_equal(x->pixels, z->pixels, bytes);
        }
        spl_frame_finish(&a);
        spl_frame_finish(&b);
        spl_frame_finish(&none);
    }
    view.method = SPL_METHOD_SPLAT;
    view.layers = 1 << SPL_LAYER_COLOR;
    struct spl_frame last = render(dataset, &view);
    for (uint32_t atoms = 1; atoms <= 8; atoms++) {
        view.disc.atoms = atoms;
        struct spl_frame next = render(dataset, &view), again = render(dataset, &view);
        assert_true(differing(&last.images[0], &next.images[0], 0) > 100);
        assert_int_equal(differing(&again.images[0], &next.images[0], 0), 0);
        spl_frame_finish(&last);
        spl_frame_finish(&again);
        last = next;
    }
    spl_frame_finish(&last);
    view.disc.atoms = 9;
    struct spl_error err = {0};
    assert_int_equal(spl_view_check(&view, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "atoms");
    spl_dictionary_finish(&dictionary);
    done(plain);
    done(dataset);
}

/* Codes and dictionary are accounted; where they do not fit, colours are drawn and the frame says that it is not all.
 */
static void textures_count_as_memory(void **state)
{
    (void)state;
    struct spl_dataset *plain = lined_cube(3000, 0.03, 1);
    struct spl_dictionary dictionary = make_dictionary(2000, 32, 4);
    struct spl_dataset *dataset = make_textured(plain, &dictionary, 8, 11);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_residency_info resident;
    struct spl_view view = colored(2.5, 64, 48);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    view.disc.atoms = 0;
    struct spl_frame frame = render(dataset, &view);
    spl_frame_finish(&frame);
    spl_renderer_get_residency(renderer, dataset, &resident);
    uint64_t without = resident.bytes;
    view.disc.atoms = 1;
    frame = render(dataset, &view);
    assert_true(frame.stats.complete);
    spl_renderer_get_residency(renderer, dataset, &resident);
    assert_int_equal(resident.bytes - without, info->dictionary_bytes + spl_dataset_get_texture_bytes(dataset, 0));
    assert_true(resident.bytes >= info->page_bytes && resident.bytes <= info->page_bytes + 4);
    uint64_t taken = resident.taken_bytes;
    spl_renderer_remove(renderer, dataset);
    spl_renderer_get_residency(renderer, dataset, &resident);
    assert_true(resident.taken_bytes <= taken - info->page_bytes);

    struct spl_renderer *small, *other = renderer;
    struct spl_renderer_options options = {
        .size = sizeof options,
        .device = device, .scratch_samples = 1 << 16, .memory_limit = resident.taken_bytes + info->page_bytes / 2};
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    uint64_t base = spl_renderer_get_memory(small);
    spl_renderer_destroy(small);
    options.memory_limit = base + info->page_bytes - info->dictionary_bytes / 2;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    renderer = small;
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    assert_int_equal(spl_renderer_preload(small, dataset, NULL), SPL_OK);
    struct spl_frame poor = render(dataset, &view);
    assert_false(poor.stats.complete);
    view.disc.atoms = 0;
    struct spl_frame colors = render(dataset, &view);
    assert_true(colors.stats.complete);
    assert_int_equal(differing(&poor.images[0], &colors.images[0], 0), 0);
    assert_true(differing(&poor.images[0], &frame.images[0], 0) > 10);
    renderer = other;
    spl_renderer_destroy(small);
    spl_frame_finish(&poor);
    spl_frame_finish(&colors);
    spl_frame_finish(&frame);
    spl_dictionary_finish(&dictionary);
    spl_dataset_close(dataset);
    spl_dataset_close(plain);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(textures_match_the_reference),
        frames_test(textures_change_colours_only),
        frames_test(textures_count_as_memory),
    };
    return frames_run(argc, argv, "textures", tests, sizeof tests / sizeof *tests);
}
