/* Slots of parameters of a draw list: how many a view takes, so how many pages it may touch. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "render/draw_list.h"
#include "render/renderer.h"

static void add(struct spl_draw_list *list, uint32_t page, uint32_t splats, uint32_t texture, bool clipped)
{
    const struct spl_draw_chunk chunk = {
        .count = splats, .texture = texture, .color_bits = clipped ? 1u << SPL_COLOR_CLIP : 0};
    assert_int_equal(spl_draw_list_add(list, page, &chunk, &(struct spl_chunk_bounds){0}, NULL), SPL_OK);
}

/* Chunks with and without clip lines in each of 4,000 pages: depth and every group of layers share the slots of the
 * page. */
static void pages_take_two_slots(void **state)
{
    struct spl_draw_list list = {0};
    enum { pages = 4000 };
    (void)state;
    spl_draw_list_clear(&list);
    for (uint32_t page = 0; page < pages; page++) {
        add(&list, page, 128, 0, false);
        add(&list, page, 128, 0, true);
    }
    assert_int_equal(spl_draw_list_lay_out(&list, pages, NULL), SPL_OK);
    uint64_t slots = spl_draw_list_count_slots(&list, 1 << 20, 1 << 10);
    assert_int_equal(slots, 2 * pages);
    assert_true(slots < SPL_PARAMS_SLOTS);
    spl_draw_list_finish(&list);
}

/* Every entry has its slot, none has two: of so many a dispatch, fewer where textures are summed first. */
static void slots_cover_the_entries(void **state)
{
    struct spl_draw_list list = {0};
    (void)state;
    const uint32_t smooth = 1u << SPL_CHUNK_TEXTURE_SMOOTH | 3u << SPL_CHUNK_TEXTURE_PLANES;
    spl_draw_list_clear(&list);
    for (int i = 0; i < 25; i++)
        add(&list, 0, 128, 0, false); /* 100 entries */
    for (int i = 0; i < 25; i++)
        add(&list, 1, 100, smooth, false);
    assert_int_equal(spl_draw_list_lay_out(&list, 2, NULL), SPL_OK);
    static const uint64_t limits[][2] = {{UINT64_MAX, UINT64_MAX}, {100, 100}, {99, 7}, {1, 1}, {3, 1000}};
    for (size_t l = 0; l < sizeof limits / sizeof *limits; l++) {
        uint64_t slots = spl_draw_list_count_slots(&list, limits[l][0], limits[l][1]), next = 0, entries = 0;
        for (size_t i = 0; i < list.batch_count; i++) {
            const struct spl_draw_batch *batch = &list.batches[i];
            assert_int_equal(batch->first_slot, next);
            assert_true(batch->slot_entries >= 1 && batch->slot_entries <= limits[l][0] &&
                        (!batch->smooth || batch->slot_entries <= limits[l][1]));
            next += (batch->entries + batch->slot_entries - 1) / batch->slot_entries;
            entries += batch->entries;
        }
        assert_int_equal(next, slots);
        assert_int_equal(entries, 200);
    }
    spl_draw_list_finish(&list);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pages_take_two_slots),
        cmocka_unit_test(slots_cover_the_entries),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
