/* A frame that two renderers draw together has the bytes of one that one draws, whichever draws what: of every method
 * and layer, where they take turns and side by side, where one is lost in the middle of a piece, ends early, or has no
 * room for the pages of all. One body for every backend. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "dataset/dataset.h"
#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "render/fault.h"
#include "render/spread.h"
#include "support/make_maps.h"
#include "support/make_textures.h"
#include "support/make_tree.h"

/* Beside `renderer`. Many are made with limits of memory, whose calls are those of the others: not under the validation
 * layers, where kernels take thrice as long to make. */
static struct spl_renderer *open_renderer(uint64_t memory_limit, uint64_t scratch_samples)
{
    struct spl_renderer *other = NULL;
    const struct spl_renderer_options options = {.size = sizeof options,
                                                 .device = device,
                                                 .memory_limit = memory_limit,
                                                 .scratch_samples = scratch_samples,
                                                 .debug = !memory_limit};
    assert_int_equal(spl_renderer_create(&options, &other, NULL), SPL_OK);
    return other;
}

static void assert_same(const struct spl_frame *a, const struct spl_frame *b, const char *what)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *x = &a->images[layer], *y = &b->images[layer];
        assert_int_equal(x->pixels != NULL, y->pixels != NULL);
        if (x->pixels && memcmp(x->pixels, y->pixels, (size_t)x->width * x->height * spl_pixel_bytes(x->type)))
            fail_msg("%s: layer %s differs", what, spl_layer_name((enum spl_layer)layer));
    }
}

static void assert_same_counts(const struct spl_frame_stats *a, const struct spl_frame_stats *b)
{
    assert_int_equal(a->splats_drawn, b->splats_drawn);
    assert_int_equal(a->panels_drawn, b->panels_drawn);
    assert_int_equal(a->meshes_drawn, b->meshes_drawn);
    assert_int_equal(a->tiles, b->tiles);
    assert_int_equal(a->complete, b->complete);
}

struct drawing {
    struct spl_renderer *renderer;
    struct spl_frame_steps *steps;
    bool more;
};

static void begin(struct drawing *drawing, struct spl_renderer *with, const struct spl_dataset *dataset,
                  const struct spl_view *view, struct spl_spread *spread, unsigned number)
{
    *drawing = (struct drawing){.renderer = with, .more = true};
    assert_int_equal(spl_frame_begin_spread(with, dataset, view, spread, number, &drawing->steps, NULL), SPL_OK);
}

static void step(struct drawing *drawing)
{
    assert_int_equal(spl_frame_step(drawing->steps, SPL_NEVER, &drawing->more, NULL), SPL_OK);
    if (drawing->more && spl_frame_is_waiting(drawing->steps))
        spl_renderer_wait(drawing->renderer, SPL_NEVER);
}

/* True, with the frame, of who drew its last piece. */
static bool end(struct drawing *drawing, struct spl_frame *frame)
{
    struct spl_frame own;
    bool last = spl_frame_drew_last(drawing->steps);
    spl_frame_end(drawing->steps, &own);
    assert_int_equal(last, own.stats.tiles > 0);
    if (last)
        *frame = own;
    return last;
}

/* By turns, of so many steps each. */
static struct spl_frame draw_by_turns(struct spl_renderer *both[2], const struct spl_dataset *dataset,
                                      const struct spl_view *view, const int turns[2])
{
    struct spl_spread *spread;
    struct drawing drawings[2];
    struct spl_frame frame;
    assert_int_equal(spl_spread_create(view, 2, &spread, NULL), SPL_OK);
    for (unsigned i = 0; i < 2; i++)
        begin(&drawings[i], both[i], dataset, view, spread, i);
    while (drawings[0].more || drawings[1].more)
        for (int i = 0; i < 2; i++)
            for (int turn = 0; turn < turns[i] && drawings[i].more; turn++)
                step(&drawings[i]);
    assert_int_equal(end(&drawings[0], &frame) + end(&drawings[1], &frame), 1);
    spl_spread_destroy(spread);
    return frame;
}

static struct spl_frame render_with(struct spl_renderer *with, const struct spl_dataset *dataset,
                                    const struct spl_view *view)
{
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(with, dataset, view, &frame, NULL), SPL_OK);
    return frame;
}

/* Of a tile, and of several; what is filled, smoothed, shaded, soft and cut looks beyond the borders of a piece. */
static void every_method_and_layer_has_the_same_bytes(void **state)
{
    (void)state;
    static const int turns[][2] = {{1, 1}, {1, 5}};
    struct spl_dataset *dataset = random_panels(4, 4000, origin, 0.02, 4);
    static const uint64_t scratches[] = {0, 112 * 112};
    for (size_t s = 0; s < 2; s++) {
        struct spl_renderer *both[2] = {open_renderer(0, scratches[s]), open_renderer(0, scratches[s])};
        for (int i = 0; i < 2; i++)
            assert_int_equal(spl_renderer_add(both[i], dataset, NULL), SPL_OK);
        for (int method = 0; method < SPL_METHOD_COUNT; method++)
            for (int kind = 0; kind < (s ? 1 : 5); kind++) {
                struct spl_view view = looking(origin, 2, 131, 201);
                char what[64];
                view.method = (enum spl_method)method;
                view.supersample = kind == 1 ? 2 : kind == 4 ? 1.25 : 1;
                view.surrounded = kind == 2;
                view.lod = kind == 3 ? 0 : 1;
                view.fill.kernel = s ? 4 : 0;
                if (kind == 2)
                    assert_int_equal(spl_shade_parse("edl+headlight", &view.shade, NULL), SPL_OK);
                if (kind == 3) {
                    assert_int_equal(spl_terms_parse("plane:0,0,0,0,0,1>0", "soft", &view.soft.what, NULL),
                                     SPL_OK);
                    assert_int_equal(spl_terms_parse("x<0.5", "clip", &view.clip, NULL), SPL_OK);
                }
                snprintf(what, sizeof what, "%s, kind %d, scratch %zu", spl_method_name(view.method), kind, s);
                struct spl_frame alone = render_with(both[0], dataset, &view);
                struct spl_frame spread = draw_by_turns(both, dataset, &view, turns[kind % 2]);
                assert_same(&alone, &spread, what);
                assert_same_counts(&alone.stats, &spread.stats);
                spl_frame_finish(&alone);
                spl_frame_finish(&spread);
            }
        for (int i = 0; i < 2; i++)
            spl_renderer_destroy(both[i]);
    }
    done(dataset);
}

/* Of a hilly ground of 100 m. */
static struct spl_view view_from_above(double x, double height)
{
    const double eye[3] = {x, 50, height}, target[3] = {x, 50, 0}, up[3] = {0, 1, 0};
    struct spl_view view = looking(origin, 2, 200, 640);
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    view.lod = 0.5;
    return view;
}

/* Of `methods`, bit per method, from before a page is there. */
static void same_bytes(const struct spl_dataset *dataset, const struct spl_dataset *alike, struct spl_view view,
                       uint32_t methods, const char *what)
{
    struct spl_renderer *both[2] = {open_renderer(0, 0), open_renderer(0, 0)};
    for (int i = 0; i < 2; i++)
        assert_int_equal(spl_renderer_add(both[i], dataset, NULL), SPL_OK);
    if (alike != dataset)
        assert_int_equal(spl_renderer_add(both[0], alike, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        if (!(methods >> method & 1))
            continue;
        view.method = (enum spl_method)method;
        struct spl_frame spread = draw_by_turns(both, dataset, &view, (const int[]){1, 1});
        struct spl_frame alone = render_with(both[0], alike, &view);
        assert_true(alone.stats.complete);
        assert_same(&alone, &spread, what);
        assert_same_counts(&alone.stats, &spread.stats);
        spl_frame_finish(&alone);
        spl_frame_finish(&spread);
    }
    for (int i = 0; i < 2; i++)
        spl_renderer_destroy(both[i]);
}

static void remove_file(char *path)
{
    unlink(path);
    *strrchr(path, '/') = '\0';
    rmdir(path);
}

/* Textures, and maps of stations, which colours come from and which trim. */
static void pictures_have_the_same_bytes(void **state)
{
    (void)state;
    char path[256];
    struct spl_dataset *plain = random_cube(6000, origin, 0.1), *mapped;
    struct spl_dictionary dictionary = make_dictionary(16, 8, 5);
    struct spl_dataset *textured = make_textured(plain, &dictionary, 4, 7);
    struct make_maps maps = make_maps(plain, 3, 11);
    make_folder(path);
    strcat(path, "/mapped.spld");
    make_mapped_file(plain, &maps, path);
    assert_int_equal(spl_dataset_open(path, true, &mapped, NULL), SPL_OK);
    remove_file(path);
    const uint32_t methods = 1u << SPL_METHOD_SPLAT | 1u << SPL_METHOD_NEAREST;
    same_bytes(textured, textured, looking(origin, 2, 80, 190), methods, "textured");
    same_bytes(mapped, mapped, looking(origin, 2, 80, 190), methods, "mapped");
    spl_dictionary_finish(&dictionary);
    free_maps(&maps);
    spl_dataset_close(textured);
    spl_dataset_close(mapped);
    done(plain);
}

/* Tables that are not kept are waited for, by the walk that finds the weight of a tile, too. */
static void tables_by_page_have_the_same_bytes(void **state)
{
    (void)state;
    char path[256];
    struct spl_dataset_source file;
    struct spl_dataset *all, *by_page;
    make_folder(path);
    strcat(path, "/tree.spld");
    make_tree_file(path, 60000, 1 << 14);
    assert_int_equal(spl_dataset_open(path, true, &all, NULL), SPL_OK);
    assert_int_equal(spl_dataset_source_open_file(path, &file, NULL), SPL_OK);
    const struct spl_dataset_source borrowed = {.size = file.size, .read = file.read, .context = file.context};
    const struct spl_dataset_opening how = {.tables_bytes = spl_dataset_get_all_tables_bytes(all) - 1};
    assert_int_equal(spl_dataset_open_source_as(&borrowed, "tree.spld", &how, &by_page, NULL), SPL_OK);
    assert_false(spl_dataset_keeps_all(by_page));
    remove_file(path);
    same_bytes(by_page, all, view_from_above(20, 40), UINT32_MAX, "by page");
    spl_dataset_close(by_page);
    spl_dataset_close(all);
    spl_dataset_source_close(&file);
}

/* So many on a sample of one piece that the weight of the tile is less than others would have alone. */
static void a_piece_has_the_weight_of_its_tile(void **state)
{
    (void)state;
    enum { count = 120000 };
    struct make_splat *splats = random_splats(count, origin, 0.02);
    for (size_t i = 0; i < count / 3; i++)
        splats[i].position[2] *= 6;
    struct spl_dataset *dense = make_dataset(splats, count);
    struct spl_renderer *both[2] = {renderer, open_renderer(0, 0)};
    struct spl_view view = looking(origin, 12, 64, 256);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dense, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(both[1], dense, NULL), SPL_OK);
    view.lod = 0;
    struct spl_frame alone = render_with(renderer, dense, &view);
    struct spl_frame spread = draw_by_turns(both, dense, &view, (const int[]){1, 1});
    assert_same(&alone, &spread, "many on a sample");
    spl_frame_finish(&alone);
    spl_frame_finish(&spread);
    spl_renderer_destroy(both[1]);
    done(dense);
}

/* In the middle of the first piece, of the last, or when the other has ended: then a third draws what is left. */
static void a_lost_one_leaves_its_piece_to_others(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(5000, origin, 0.05);
    struct spl_view view = looking(origin, 3, 120, 600);
    struct spl_frame alone = render_with(renderer, dataset, &view), frame;
    for (int lost_after = 0; lost_after < 3; lost_after++) {
        struct spl_renderer *both[2] = {renderer, open_renderer(0, 0)};
        struct spl_spread *spread;
        struct drawing drawings[2];
        struct spl_error err = {0};
        assert_int_equal(spl_renderer_add(both[1], dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_preload(both[1], dataset, NULL), SPL_OK);
        assert_int_equal(spl_spread_create(&view, 2, &spread, NULL), SPL_OK);
        for (unsigned i = 0; i < 2; i++)
            begin(&drawings[i], both[i], dataset, &view, spread, i);
        for (int i = 0; i < lost_after; i++)
            step(&drawings[1]);
        spl_renderer_inject_loss(both[1]);
        assert_int_equal(spl_frame_step(drawings[1].steps, SPL_NEVER, &drawings[1].more, &err), SPL_E_DEVICE_LOST);
        if (lost_after == 2)
            while (drawings[0].more)
                step(&drawings[0]);
        assert_false(end(&drawings[1], &frame));
        spl_renderer_destroy(both[1]);
        if (lost_after == 2) {
            assert_false(end(&drawings[0], &frame));
            assert_true(spl_spread_get_left(spread) > 0);
            begin(&drawings[0], renderer, dataset, &view, spread, 1);
        }
        while (drawings[0].more)
            step(&drawings[0]);
        assert_true(end(&drawings[0], &frame));
        assert_same(&alone, &frame, "with one lost");
        spl_frame_finish(&frame);
        spl_spread_destroy(spread);
    }
    spl_frame_finish(&alone);
    done(dataset);
}

/* Whatever ends all of them, nothing is left, and nothing is handed out. */
static void steps_may_end_before_the_frame(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(5000, origin, 0.05);
    struct spl_view view = looking(origin, 3, 120, 600);
    struct spl_spread *spread;
    struct drawing drawings[2];
    struct spl_frame frame = {0};
    bool more;
    struct spl_cancel cancel = {0};
    assert_int_equal(spl_spread_create(&view, 2, &spread, NULL), SPL_OK);
    for (unsigned i = 0; i < 2; i++) {
        begin(&drawings[i], renderer, dataset, &view, spread, i);
        step(&drawings[i]);
    }
    assert_int_equal(spl_frame_step(drawings[0].steps, 1, &more, NULL), SPL_E_TIMEOUT);
    spl_frame_set_cancel(drawings[1].steps, &cancel);
    spl_cancel_set(&cancel);
    assert_int_equal(spl_frame_step(drawings[1].steps, SPL_NEVER, &more, NULL), SPL_E_CANCELLED);
    for (int i = 0; i < 2; i++)
        assert_false(end(&drawings[i], &frame));
    assert_null(frame.images[SPL_LAYER_COLOR].pixels);
    spl_spread_destroy(spread);
    done(dataset);
}

/* A dataset of many small pages, known to the renderer. */
static struct spl_dataset *add_tree(void)
{
    char path[256];
    struct spl_dataset *dataset;
    make_folder(path);
    strcat(path, "/tree.spld");
    make_tree_file(path, 60000, 1 << 14);
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
    remove_file(path);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

/* Together they draw all of a view of which one has no room for all pages at once, and draws coarser nodes. */
static void pages_of_its_pieces_are_enough(void **state)
{
    (void)state;
    struct spl_view view = view_from_above(50, 90);
    struct spl_dataset *dataset = add_tree();
    struct spl_frame whole = render_with(renderer, dataset, &view), alone;
    struct spl_renderer *both[2] = {open_renderer(0, 0), NULL};
    assert_int_equal(spl_renderer_add(both[0], dataset, NULL), SPL_OK);
    const uint64_t bare = spl_renderer_get_memory(both[0]);
    alone = render_with(both[0], dataset, &view);
    const uint64_t full = spl_renderer_get_memory(both[0]);
    uint64_t limit = full;
    while (alone.stats.complete) {
        spl_frame_finish(&alone);
        spl_renderer_destroy(both[0]);
        limit -= (full - bare) / 16;
        both[0] = open_renderer(limit, 0);
        assert_int_equal(spl_renderer_add(both[0], dataset, NULL), SPL_OK);
        alone = render_with(both[0], dataset, &view);
    }
    both[1] = open_renderer(limit, 0);
    assert_int_equal(spl_renderer_add(both[1], dataset, NULL), SPL_OK);
    struct spl_frame spread = draw_by_turns(both, dataset, &view, (const int[]){1, 1});
    assert_true(spread.stats.complete);
    assert_same(&whole, &spread, "within a limit");
    assert_same_counts(&whole.stats, &spread.stats);
    for (int i = 0; i < 2; i++) {
        assert_true(spl_renderer_get_memory(both[i]) <= limit);
        spl_renderer_destroy(both[i]);
    }
    spl_frame_finish(&whole);
    spl_frame_finish(&alone);
    spl_frame_finish(&spread);
    done(dataset);
}

/* Where pieces have no room for their pages either: what is said to be drawn is, as of one that has as many. */
static void what_is_left_out_is_not_counted(void **state)
{
    (void)state;
    struct spl_view view = view_from_above(50, 90);
    struct spl_dataset *dataset = add_tree();
    struct spl_frame whole = render_with(renderer, dataset, &view);
    struct spl_renderer *both[2] = {open_renderer(0, 0), NULL};
    assert_int_equal(spl_renderer_add(both[0], dataset, NULL), SPL_OK);
    const uint64_t bare = spl_renderer_get_memory(both[0]);
    struct spl_frame alone = render_with(both[0], dataset, &view), spread;
    const uint64_t full = spl_renderer_get_memory(both[0]);
    spl_renderer_destroy(both[0]);
    bool left_out = false, equal = false;
    for (int part = 3; part < 16; part++) {
        spl_frame_finish(&alone);
        for (int i = 0; i < 2; i++) {
            both[i] = open_renderer(bare + (full - bare) / 16 * (uint64_t)part, 0);
            assert_int_equal(spl_renderer_add(both[i], dataset, NULL), SPL_OK);
        }
        alone = render_with(both[1], dataset, &view);
        spread = draw_by_turns(both, dataset, &view, (const int[]){1, 1});
        assert_in_range(spread.stats.splats_drawn, alone.stats.splats_drawn, whole.stats.splats_drawn);
        left_out |= spread.stats.splats_drawn < whole.stats.splats_drawn;
        const struct spl_image *a = &alone.images[SPL_LAYER_COLOR], *b = &spread.images[SPL_LAYER_COLOR];
        if (!spread.stats.complete && !memcmp(a->pixels, b->pixels, (size_t)a->width * a->height * 4)) {
            assert_same_counts(&alone.stats, &spread.stats);
            equal = true;
        }
        spl_frame_finish(&spread);
        for (int i = 0; i < 2; i++)
            spl_renderer_destroy(both[i]);
    }
    assert_true(left_out && equal);
    spl_frame_finish(&whole);
    spl_frame_finish(&alone);
    done(dataset);
}

struct side {
    const struct spl_dataset *dataset;
    const struct spl_view *view;
    struct spl_spread *spread;
    unsigned number;
    bool last;
    struct spl_frame frame;
};

/* With a renderer of its own, since that belongs to its thread. */
static void *draw(void *argument)
{
    struct side *side = argument;
    struct spl_renderer *own = open_renderer(0, 0);
    struct drawing drawing;
    assert_int_equal(spl_renderer_add(own, side->dataset, NULL), SPL_OK);
    begin(&drawing, own, side->dataset, side->view, side->spread, side->number);
    while (drawing.more)
        step(&drawing);
    side->last = end(&drawing, &side->frame);
    spl_renderer_destroy(own);
    return NULL;
}

static void threads_draw_side_by_side(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(20000, origin, 0.03);
    struct spl_view view = looking(origin, 2, 300, 700);
    struct spl_frame alone = render_with(renderer, dataset, &view);
    struct spl_spread *spread;
    struct side sides[2];
    pthread_t threads[2];
    assert_int_equal(spl_spread_create(&view, 2, &spread, NULL), SPL_OK);
    for (unsigned i = 0; i < 2; i++) {
        sides[i] = (struct side){dataset, &view, spread, .number = i};
        assert_int_equal(pthread_create(&threads[i], NULL, draw, &sides[i]), 0);
    }
    for (int i = 0; i < 2; i++)
        pthread_join(threads[i], NULL);
    assert_int_equal(sides[0].last + sides[1].last, 1);
    struct spl_frame *frame = &sides[sides[1].last].frame;
    assert_same(&alone, frame, "side by side");
    spl_frame_finish(frame);
    spl_spread_destroy(spread);
    spl_frame_finish(&alone);
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(every_method_and_layer_has_the_same_bytes),
        frames_test(pictures_have_the_same_bytes),
        frames_test(tables_by_page_have_the_same_bytes),
        frames_test(a_piece_has_the_weight_of_its_tile),
        frames_test(a_lost_one_leaves_its_piece_to_others),
        frames_test(steps_may_end_before_the_frame),
        frames_test(pages_of_its_pieces_are_enough),
        frames_test(what_is_left_out_is_not_counted),
        frames_test(threads_draw_side_by_side),
    };
    return frames_run(argc, argv, "spread", tests, sizeof tests / sizeof *tests);
}
