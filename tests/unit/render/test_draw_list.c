/* Slots of parameters of a draw list: how many a view takes, so how many pages it may touch. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "dataset/format.h"
#include "render/draw_list.h"
#include "render/renderer.h"

static void add(struct spl_draw_list *list, uint32_t page, uint32_t splats, uint32_t texture, bool clipped)
{
    const struct spl_draw_chunk chunk = {
        .count = splats, .texture = texture, .color_bits = clipped ? 1u << SPL_COLOR_CLIP : 0};
    assert_int_equal(spl_draw_list_add(list, &(struct spl_draw_origin){page, SPL_CHUNK_DISCS, 0}, &chunk,
                                       &(struct spl_chunk_bounds){0}, 1, NULL), SPL_OK);
}

static void add_kind(struct spl_draw_list *list, uint32_t page, uint32_t kind, uint32_t count)
{
    const struct spl_draw_chunk chunk = {.count = count};
    assert_int_equal(spl_draw_list_add(list, &(struct spl_draw_origin){page, kind, 0}, &chunk,
                                       &(struct spl_chunk_bounds){0}, 1, NULL),
                     SPL_OK);
}

static void add_lines(struct spl_draw_list *list, uint32_t page, uint32_t vertices)
{
    add_kind(list, page, SPL_CHUNK_LINES, vertices);
}

static void add_panels(struct spl_draw_list *list, uint32_t page, uint32_t panels)
{
    add_kind(list, page, SPL_CHUNK_PANELS, panels);
}

/* Batches are of one key each, in the order in which these were met, and keep the order of their chunks. */
static void batches_are_of_one_key(void **state)
{
    struct spl_draw_list list = {0};
    enum { pages = 700, rounds = 3 };
    uint32_t entries = 0;
    (void)state;
    spl_draw_list_clear(&list);
    for (uint32_t round = 0; round < rounds; round++)
        for (uint32_t page = 0; page < pages; page++) {
            add(&list, page, 40, (page % 9) << SPL_CHUNK_TEXTURE_PLANES, page % 2);
            add_lines(&list, page, 7);
        }
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    for (size_t b = 0; b < list.batch_count; b++) {
        const struct spl_draw_batch *batch = &list.batches[b];
        for (size_t other = 0; other < b; other++) {
            const struct spl_draw_key *a = &list.batches[other].key, *k = &batch->key;
            assert_true(a->page != k->page || a->kind != k->kind || a->back != k->back);
        }
        for (uint32_t e = 0; e < batch->entries; e++) {
            uint32_t entry = list.entries[batch->first_entry + e], chunk = entry >> SPL_RUN_BITS;
            bool lines = batch->key.kind == SPL_CHUNK_LINES;
            assert_int_equal(chunk / 2 % pages, batch->key.page);
            assert_int_equal(chunk % 2, lines);
            assert_true(lines || (batch->key.planes == batch->key.page % 9 && batch->key.apart == batch->key.page % 2));
            assert_int_equal(batch->key.back, chunk >= list.first_back_chunk);
            assert_true(!e || entry > list.entries[batch->first_entry + e - 1]);
            entries++;
        }
    }
    assert_int_equal(entries, rounds * pages * 3);
    spl_draw_list_finish(&list);
}

/* Soft chunks and those to mark lie behind the solid ones, in batches of their own; soft ones by their ids whatever
 * order they were added in, windows of one in theirs. They count for no half. */
static void roles_are_told_apart(void **state)
{
    enum { chunks = 90 };
    static const uint8_t roles[6] = {SPL_ROLE_SOFT, SPL_ROLE_SOLID, SPL_ROLE_MARK,
                                     SPL_ROLE_SOLID, SPL_ROLE_SOFT, SPL_ROLE_SOLID};
    struct spl_draw_list list = {0};
    uint32_t entries[3] = {0}, words[3] = {5, 6, 7}, first;
    (void)state;
    spl_draw_list_clear(&list);
    assert_int_equal(list.mark_words, SPL_MARKS_NONE);
    for (uint32_t i = 0; i < chunks; i++) { /* ids fall, in pairs; `count` has the window, `texture_scale` the order */
        const struct spl_draw_chunk chunk = {.count = 40 | (i + 1) << SPL_COUNT_BITS,
                                             .first_id = 1000 - i / 12 * 10,
                                             .marks = i % 12 < 6 ? 0 : 64 * i,
                                             .texture_scale = (float)i};
        const struct spl_chunk_bounds bounds = {.near = (float)i};
        const struct spl_draw_origin origin = {.page = i % 2, .kind = SPL_CHUNK_DISCS, .role = roles[i % 6]};
        assert_int_equal(spl_draw_list_add(&list, &origin, &chunk, &bounds, i, NULL), SPL_OK);
        assert_int_equal(spl_draw_list_add_tests(&list, words, 3, &first, NULL), SPL_OK);
        assert_int_equal(first, 3 * i);
    }
    assert_int_equal(list.test_count, 3 * chunks);
    assert_int_equal(list.listed_splats, 40 * chunks / 2);
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    assert_int_equal(list.first_soft_chunk, chunks / 2);
    assert_int_equal(list.first_mark_chunk, chunks / 2 + chunks / 3);
    assert_true(list.first_back_chunk > chunks / 4 - 2 && list.first_back_chunk < chunks / 4 + 2);
    for (size_t i = 0; i < chunks; i++) {
        const struct spl_draw_chunk *chunk = &list.chunks[i];
        const uint32_t added = (uint32_t)chunk->texture_scale;
        const uint8_t role = i < list.first_soft_chunk ? SPL_ROLE_SOLID
                             : i < list.first_mark_chunk ? SPL_ROLE_SOFT
                                                         : SPL_ROLE_MARK;
        assert_int_equal(roles[added % 6], role);
        assert_true(list.bounds[i].near == chunk->texture_scale); /* what is parallel stays so */
        assert_int_equal(list.key_of_chunk[i].page, added % 2);
        if (i == 0 || i == list.first_soft_chunk || i == list.first_mark_chunk)
            continue;
        const struct spl_draw_chunk *before = chunk - 1;
        if (role == SPL_ROLE_SOFT)
            assert_true(before->first_id < chunk->first_id ||
                        (before->first_id == chunk->first_id && before->count < chunk->count));
        else
            assert_true(before->texture_scale < chunk->texture_scale);
    }
    for (size_t b = 0; b < list.batch_count; b++) {
        const struct spl_draw_batch *batch = &list.batches[b];
        for (uint32_t e = 0; e < batch->entries; e++) {
            uint32_t i = list.entries[batch->first_entry + e] >> SPL_RUN_BITS;
            assert_int_equal(batch->key.role, roles[(uint32_t)list.chunks[i].texture_scale % 6]);
            assert_int_equal(batch->key.marked, list.chunks[i].marks != 0);
            assert_int_equal(batch->key.back, batch->key.role == SPL_ROLE_SOLID && i >= list.first_back_chunk);
            entries[batch->key.role]++;
        }
    }
    assert_int_equal(entries[SPL_ROLE_SOLID], chunks);
    assert_int_equal(entries[SPL_ROLE_SOFT], 2 * chunks / 3);
    assert_int_equal(entries[SPL_ROLE_MARK], chunks / 3);
    assert_true(spl_draw_list_has(&list, SPL_CHUNK_DISCS, SPL_ROLE_SOFT));
    assert_false(spl_draw_list_has(&list, SPL_CHUNK_PANELS, SPL_ROLE_SOFT));
    spl_draw_list_clear(&list);
    assert_int_equal(list.test_count, 0);
    add(&list, 0, 40, 0, false);
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    assert_int_equal(list.first_soft_chunk, 1);
    spl_draw_list_finish(&list);
}

/* Chunks of a page that different stations trim, or none, are drawn apart; cells of maps lie behind all entries, in the
 * order of their stations. */
static void stations_are_told_apart(void **state)
{
    enum { chunks = 60, stations = 3 };
    struct spl_draw_list list = {0};
    const struct spl_draw_chunk chunk = {.count = 40};
    (void)state;
    spl_draw_list_clear(&list);
    for (uint16_t i = 0; i < chunks; i++)
        assert_int_equal(spl_draw_list_add(&list, &(struct spl_draw_origin){7, SPL_CHUNK_DISCS, i % (stations + 1)},
                                           &chunk, &(struct spl_chunk_bounds){0}, 1, NULL), SPL_OK);
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    size_t entries = list.entry_count;
    assert_int_equal(entries, 2 * chunks);
    assert_int_equal(list.batch_count, 2 * (stations + 1));
    for (size_t b = 0; b < list.batch_count; b++)
        for (uint32_t e = 0; e < list.batches[b].entries; e++)
            assert_int_equal((list.entries[list.batches[b].first_entry + e] >> SPL_RUN_BITS) % (stations + 1),
                             list.batches[b].key.trims);
    for (uint32_t s = 0; s < stations; s++) {
        assert_int_equal(spl_draw_list_add_map(&list, 5 * s, s + 1, NULL), SPL_OK);
        for (uint32_t cell = 0; cell <= s; cell++)
            list.entries[list.entry_count++] = cell;
        assert_int_equal(list.maps[s].station, 5 * s);
        assert_int_equal(list.maps[s].first_entry, entries);
        entries += s + 1;
    }
    assert_int_equal(spl_draw_list_add_map(&list, 99, UINT32_MAX / 2, NULL), SPL_E_LIMIT);
    spl_draw_list_clear(&list);
    assert_int_equal(list.map_count, 0);
    spl_draw_list_finish(&list);
}

/* Chunks with and without clip lines in each of 4,000 pages: depth and every group of layers share the rounds of the
 * page. */
static void pages_take_two_rounds(void **state)
{
    struct spl_draw_list list = {0};
    enum { pages = 4000 };
    (void)state;
    spl_draw_list_clear(&list);
    for (uint32_t page = 0; page < pages; page++) {
        add(&list, page, 128, 0, false);
        add(&list, page, 128, 0, true);
    }
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    uint64_t rounds = spl_draw_list_count_rounds(&list, &(struct spl_draw_rounds){1 << 20, 1 << 10, 1 << 10, 1 << 10});
    assert_int_equal(rounds, 2 * pages);
    assert_true(rounds < SPL_PARAMS_MAX);
    spl_draw_list_finish(&list);
}

/* Every entry has its round, none has two: of so many a dispatch, fewer where textures are summed first. */
static void rounds_cover_the_entries(void **state)
{
    struct spl_draw_list list = {0};
    (void)state;
    const uint32_t smooth = 1u << SPL_CHUNK_TEXTURE_SMOOTH | 3u << SPL_CHUNK_TEXTURE_PLANES;
    spl_draw_list_clear(&list);
    for (int i = 0; i < 25; i++)
        add(&list, 0, 128, 0, false); /* 100 entries */
    for (int i = 0; i < 25; i++)
        add(&list, 1, 100, smooth, false);
    for (int i = 0; i < 25; i++) /* of the same page, but for another kernel */
        add_lines(&list, 1, 50);
    for (int i = 0; i < 25; i++)
        add_panels(&list, 1, 9); /* 2 entries */
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    static const uint64_t limits[][2] = {{UINT64_MAX, UINT64_MAX}, {100, 100}, {99, 7}, {1, 1}, {3, 1000}};
    for (size_t l = 0; l < sizeof limits / sizeof *limits; l++) {
        const struct spl_draw_rounds most = {limits[l][0], limits[l][1], limits[l][1], limits[l][1]};
        uint64_t rounds = spl_draw_list_count_rounds(&list, &most), next = 0, entries = 0;
        for (size_t i = 0; i < list.batch_count; i++) {
            const struct spl_draw_batch *batch = &list.batches[i];
            assert_int_equal(batch->first_round, next);
            assert_true(batch->round_entries >= 1 && batch->round_entries <= limits[l][0] &&
                        (!batch->key.smooth || batch->round_entries <= limits[l][1]) &&
                        (batch->key.kind == SPL_CHUNK_DISCS || batch->round_entries <= limits[l][1]));
            next += (batch->entries + batch->round_entries - 1) / batch->round_entries;
            entries += batch->entries;
        }
        assert_int_equal(next, rounds);
        assert_int_equal(entries, 300);
    }
    spl_draw_list_finish(&list);
}

/* Chunks of every number of splats: each splat lies in one run of the list. */
static void runs_hold_every_splat(void **state)
{
    struct spl_draw_list list = {0};
    (void)state;
    for (uint32_t splats = 1; splats <= SPL_CHUNK_SPLATS; splats++) {
        spl_draw_list_clear(&list);
        add(&list, 0, splats, 0, false);
        assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
        assert_int_equal(list.batch_count, 1);
        uint32_t runs = list.batches[0].entries;
        assert_true(runs * SPL_RUN_SPLATS >= splats && (runs - 1) * SPL_RUN_SPLATS < splats);
        for (uint32_t run = 0; run < runs; run++)
            assert_int_equal(list.entries[run], run);
    }
    spl_draw_list_finish(&list);
}

/* The half of the splats that was listed first hides chunks of the rest. */
static void the_nearer_half_goes_first(void **state)
{
    struct spl_draw_list list = {0};
    (void)state;
    for (size_t chunks = 1; chunks < 12; chunks++) {
        spl_draw_list_clear(&list);
        for (uint32_t i = 0; i < chunks; i++)
            add(&list, i % 2, 128, 0, false);
        assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
        assert_int_equal(list.first_back_chunk, (chunks + 1) / 2);
        for (size_t b = 0; b < list.batch_count; b++)
            for (uint32_t e = 0; e < list.batches[b].entries; e++)
                assert_true(list.batches[b].key.back ==
                            (list.entries[list.batches[b].first_entry + e] >> SPL_RUN_BITS >= list.first_back_chunk));
    }
    spl_draw_list_finish(&list);
}

/* A panel is as much work as SPL_PANEL_WORTH splats, with relief or without: the halves are of work. */
static void panels_count_as_much_work(void **state)
{
    struct spl_draw_list list = {0};
    (void)state;
    spl_draw_list_clear(&list);
    add_panels(&list, 0, 4);
    add_kind(&list, 0, SPL_CHUNK_MESHES, 9);
    for (int i = 0; i < 2; i++)
        add(&list, 0, 128, 0, false);
    assert_int_equal(list.listed_splats, 13 * SPL_PANEL_WORTH + 2 * 128);
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    assert_int_equal(list.first_back_chunk, 2);
    assert_int_equal(list.batches[1].key.kind, SPL_CHUNK_MESHES);
    assert_int_equal(list.batches[1].entries, 2);
    assert_true(spl_draw_list_has(&list, SPL_CHUNK_PANELS, SPL_ROLE_SOLID) &&
                spl_draw_list_has(&list, SPL_CHUNK_DISCS, SPL_ROLE_SOLID));
    assert_true(spl_draw_list_has(&list, SPL_CHUNK_MESHES, SPL_ROLE_SOLID));
    assert_false(spl_draw_list_has(&list, SPL_CHUNK_LINES, SPL_ROLE_SOLID));
    spl_draw_list_finish(&list);
}

/* A batch is no more work than it may be, or one chunk, and is full before the next of its key begins; chunks keep
 * their order from one to the next, also beside chunks of other keys and once there are many. */
static void much_work_is_many_batches(void **state)
{
    enum { chunks = 3000, pages = 3 };
    struct spl_draw_list list = {0};
    (void)state;
    spl_draw_list_clear(&list);
    for (uint32_t i = 0; i < chunks; i++) {
        const struct spl_draw_chunk chunk = {.count = 32};
        const uint64_t looks = i % 100 == 50 ? UINT64_MAX : i % pages == 0 ? 1 : SPL_BATCH_WORK / 32 / 10;
        assert_int_equal(spl_draw_list_add(&list, &(struct spl_draw_origin){i % pages, SPL_CHUNK_DISCS}, &chunk,
                                           &(struct spl_chunk_bounds){0}, looks, NULL), SPL_OK);
    }
    assert_int_equal(spl_draw_list_lay_out(&list, NULL), SPL_OK);
    uint32_t entries = 0, last[2][pages] = {0}, alone = 0, of_little = 0;
    uint64_t before[2][pages] = {0};
    for (size_t b = 0; b < list.batch_count; b++) {
        const struct spl_draw_batch *batch = &list.batches[b];
        const uint32_t page = batch->key.page, back = batch->key.back;
        assert_int_equal(batch->first_entry, entries);
        assert_true(batch->work <= SPL_BATCH_WORK || batch->entries == 1);
        for (uint32_t e = 0; e < batch->entries; e++) {
            uint32_t chunk = list.entries[entries++] >> SPL_RUN_BITS;
            assert_true(chunk % pages == page && (!last[back][page] || chunk > last[back][page]));
            last[back][page] = chunk;
        }
        alone += batch->work > SPL_BATCH_WORK;
        of_little += page == 0;
        assert_true(!before[back][page] || before[back][page] + batch->work > SPL_BATCH_WORK);
        before[back][page] = batch->work;
    }
    assert_int_equal(entries, chunks);
    assert_int_equal(alone, chunks / 100);
    assert_true(of_little > 2 && of_little < 2 + 3 * chunks / 100);
    spl_draw_list_finish(&list);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(batches_are_of_one_key),
        cmocka_unit_test(stations_are_told_apart),
        cmocka_unit_test(roles_are_told_apart),
        cmocka_unit_test(pages_take_two_rounds),
        cmocka_unit_test(rounds_cover_the_entries),
        cmocka_unit_test(runs_hold_every_splat),
        cmocka_unit_test(the_nearer_half_goes_first),
        cmocka_unit_test(panels_count_as_much_work),
        cmocka_unit_test(much_work_is_many_batches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
