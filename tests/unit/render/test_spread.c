/* Pieces of a shared frame: each pixel is had once, whoever takes how many; what was put back is had again; each has a
 * stretch of its own first; and one alone drew the last. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "render/spread.h"

static struct spl_view make_view(uint32_t width, uint32_t height)
{
    struct spl_view view;
    spl_view_init(&view);
    view.camera.width = width;
    view.camera.height = height;
    return view;
}

static struct spl_spread *make_spread(uint32_t width, uint32_t height, unsigned renderers)
{
    struct spl_spread *spread;
    const struct spl_view view = make_view(width, height);
    assert_int_equal(spl_spread_create(&view, renderers, &spread, NULL), SPL_OK);
    return spread;
}

static struct spl_tiling tiles_of(uint32_t width, uint32_t height, uint32_t apron)
{
    return (struct spl_tiling){.reach = {.align = 1, .apron = apron}, .width = width, .height = height};
}

static struct spl_spread_piece take(struct spl_spread *spread, unsigned number, const struct spl_tiling *tiling)
{
    struct spl_spread_piece taken;
    assert_int_equal(spl_spread_take(spread, number, tiling, &taken, NULL), SPL_OK);
    return taken;
}

static bool drawn(struct spl_spread *spread, unsigned number)
{
    struct spl_frame_stats stats = {.complete = true, .soft_drawn = 3, .total_ms = 5};
    bool last = spl_spread_done(spread, number, &stats);
    assert_true(stats.complete && stats.soft_drawn == 0 && stats.total_ms == 5); // they are counted once
    return last;
}

static void see(uint8_t *seen, uint32_t width, const struct spl_piece *piece)
{
    for (uint32_t y = piece->y; y < piece->y + piece->height; y++)
        for (uint32_t x = piece->x; x < piece->x + piece->width; x++)
            assert_int_equal(seen[(size_t)y * width + x]++, 0);
}

/* Tiles of several sizes; the first renderer is so many times as fast as the others; every fifth piece is put back. */
static void each_pixel_is_had_once(void **state)
{
    (void)state;
    static const struct {
        uint32_t width, height, tile_width, tile_height, apron;
    } rows[] = {{700, 900, 700, 900, 0}, {700, 900, 700, 333, 1}, {700, 900, 300, 300, 40}, {64, 70, 64, 70, 0},
                {1, 1, 1, 1, 0},         {900, 65, 900, 65, 0},   {300, 3000, 300, 100, 0}, {512, 640, 512, 640, 500}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (unsigned renderers = 1; renderers <= SPL_SPREAD_MAX; renderers += renderers < 4 ? 1 : 4)
            for (unsigned faster = 1; faster < 6; faster += 2) {
                const struct spl_tiling tiling = tiles_of(rows[i].tile_width, rows[i].tile_height, rows[i].apron);
                struct spl_spread *spread = make_spread(rows[i].width, rows[i].height, renderers);
                uint8_t *seen = calloc((size_t)rows[i].width * rows[i].height, 1);
                unsigned lasts = 0, turns = 0;
                assert_non_null(seen);
                assert_true(spl_spread_get_left(spread) > 0);
                while (!lasts) {
                    unsigned number = turns % (renderers + faster - 1);
                    number = number < renderers ? number : 0;
                    const struct spl_spread_piece taken = take(spread, number, &tiling);
                    assert_true(taken.piece.width > 0 || spl_spread_get_left(spread) == 0);
                    if (!taken.piece.width)
                        break;
                    assert_true(taken.piece.y >= taken.tile.y && taken.piece.x >= taken.tile.x &&
                                taken.piece.x + taken.piece.width <= taken.tile.x + taken.tile.width &&
                                taken.piece.y + taken.piece.height <= taken.tile.y + taken.tile.height);
                    if (++turns % 5 == 0) {
                        spl_spread_leave(spread, number, 1);
                        assert_true(spl_spread_get_left(spread) > 0);
                        continue;
                    }
                    see(seen, rows[i].width, &taken.piece);
                    lasts += drawn(spread, number);
                }
                assert_int_equal(lasts, 1);
                assert_null(memchr(seen, 0, (size_t)rows[i].width * rows[i].height));
                assert_int_equal(spl_spread_get_left(spread), 0);
                free(seen);
                spl_spread_destroy(spread);
            }
}

/* Its own comes first, from its beginning; then the end of who has most left. */
static void each_has_a_stretch_of_its_own(void **state)
{
    (void)state;
    const struct spl_tiling tiling = tiles_of(1000, 1536, 0);
    struct spl_spread *spread = make_spread(1000, 1536, 2);
    uint32_t y = 0;
    for (int i = 0; i < 3; i++, y += 384) {
        const struct spl_piece left = take(spread, 0, &tiling).piece, right = take(spread, 1, &tiling).piece;
        assert_true(left.x == 0 && left.y == y && left.width == 512 && left.height == 384);
        assert_true(right.x == 512 && right.y == y && right.width == 488 && right.height == 384);
        assert_false(drawn(spread, 0));
        assert_false(drawn(spread, 1));
    }
    assert_int_equal(take(spread, 1, &tiling).piece.x, 512);
    assert_false(drawn(spread, 1));
    assert_int_equal(take(spread, 1, &tiling).piece.x, 0); // the first's last
    assert_int_equal(take(spread, 0, &tiling).piece.width, 0);
    spl_spread_leave(spread, 0, 7); // it has none
    spl_spread_leave(spread, 1, 9); // is lost
    assert_int_equal(take(spread, 0, &tiling).piece.y, y);
    assert_true(drawn(spread, 0));
    struct spl_frame frame;
    spl_spread_hand_out(spread, &frame);
    assert_int_equal(frame.stats.soft_drawn, 8 * 3);
    assert_int_equal(frame.stats.tiles, 1);
    assert_true(frame.stats.total_ms == 9 && frame.stats.complete);
    spl_frame_finish(&frame);
    spl_spread_destroy(spread);
}

/* What is known of a tile is told to who takes a piece of it, and counted once. */
static void a_tile_is_known_once(void **state)
{
    (void)state;
    const struct spl_tiling tiling = tiles_of(1000, 512, 0);
    struct spl_spread *spread = make_spread(1000, 1024, 2);
    assert_int_equal(take(spread, 0, &tiling).whole.pixels, 0);
    struct spl_frame_whole whole = {.pixels = 512000, .weight_max = 17};
    spl_spread_tell(spread, 0, &whole, &(struct spl_frame_stats){.splats_drawn = 40, .complete = true});
    spl_spread_tell(spread, 0, &whole, &(struct spl_frame_stats){.splats_drawn = 40, .complete = true});
    assert_false(drawn(spread, 0));
    assert_int_equal(take(spread, 0, &tiling).whole.weight_max, 17);
    assert_int_equal(take(spread, 1, &tiling).whole.pixels, 0); // of the other
    assert_false(drawn(spread, 1));
    struct spl_frame_stats coarse = {.complete = false, .pending = true};
    assert_false(spl_spread_done(spread, 0, &coarse));
    struct spl_frame frame;
    spl_spread_hand_out(spread, &frame);
    assert_int_equal(frame.stats.splats_drawn, 40);
    assert_true(!frame.stats.complete && frame.stats.pending);
    spl_frame_finish(&frame);
    spl_spread_destroy(spread);
}

/* Images that are made of others are not cut. */
static void not_all_views_can_be_spread(void **state)
{
    (void)state;
    struct spl_view view = make_view(64, 64);
    assert_true(spl_spread_can(&view));
    view.supersample = 4;
    assert_true(spl_spread_can(&view));
    view.supersample = 1.25;
    assert_true(spl_spread_can(&view));
    view.supersample = 1;
    view.camera.projection = SPL_ORTHOGRAPHIC;
    assert_true(spl_spread_can(&view));
    assert_int_equal(spl_camera_set_around(&view.camera, SPL_EQUIRECTANGULAR, 240, 120, NULL), SPL_OK);
    assert_false(spl_spread_can(&view));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_pixel_is_had_once),
        cmocka_unit_test(each_has_a_stretch_of_its_own),
        cmocka_unit_test(a_tile_is_known_once),
        cmocka_unit_test(not_all_views_can_be_spread),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
