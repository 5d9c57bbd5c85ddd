/* Pieces of a tile cover each of its pixels once, however it is cut, and are told by how much is left. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "render/pieces.h"

enum { width = 203, height = 151, x = 1000, y = 7 };

static void pieces_cover_a_tile_once(void **state)
{
    static uint8_t seen[height][width];
    (void)state;
    for (uint32_t most = 1; most <= 30000; most *= 7) {
        struct spl_pieces pieces = {0};
        uint64_t left = (uint64_t)width * height;
        memset(seen, 0, sizeof seen);
        spl_pieces_begin(&pieces, &(struct spl_piece){x, y, width, height});
        while (pieces.count) {
            const struct spl_piece *next = &pieces.left[pieces.count - 1];
            if (next->width * next->height > most) {
                assert_true(spl_pieces_cut(&pieces));
                continue;
            }
            for (uint32_t row = next->y; row < next->y + next->height; row++)
                for (uint32_t column = next->x; column < next->x + next->width; column++)
                    assert_int_equal(seen[row - y][column - x]++, 0);
            left -= next->width * next->height;
            spl_pieces_remove(&pieces);
            assert_int_equal(pieces.pixels, left);
        }
        assert_int_equal(left, 0);
        assert_null(memchr(seen, 0, sizeof seen));
    }
}

static void a_pixel_is_never_cut(void **state)
{
    struct spl_pieces pieces = {0};
    (void)state;
    spl_pieces_begin(&pieces, &(struct spl_piece){0, 0, UINT32_MAX, UINT32_MAX});
    uint32_t cuts = 0;
    while (spl_pieces_cut(&pieces))
        cuts++;
    assert_int_equal(pieces.count, cuts + 1);
    assert_true(pieces.count <= SPL_PIECES_MAX);
    assert_int_equal(pieces.left[cuts].width * pieces.left[cuts].height, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(pieces_cover_a_tile_once),
                                       cmocka_unit_test(a_pixel_is_never_cut)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
