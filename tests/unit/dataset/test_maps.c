/* Maps of stations in the container: what is written comes back, at any way of opening; what is wrong is refused by
 * name; other passes of packing keep them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/memory.h"
#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "dataset/writer.h"
#include "support/make_dataset.h"
#include "support/make_maps.h"
#include "support/spoil.h"

static char folder[256], path[300];

static struct spl_dataset *some_dataset(void)
{
    enum { count = 3000 };
    static struct make_splat splats[count];
    for (int i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {i % 60, i / 60, 2 * sin(i * 0.01)},
                                        .normal = {0, 0.6f, 0.8f},
                                        .radius = 1 + 0.2f * (float)(i % 5),
                                        .color = {(uint8_t)i, (uint8_t)(i / 3), (uint8_t)(i * 7)},
                                        .classification = (uint8_t)(i % 4)};
    make_dataset_page_bytes = 0; /* a page for each node */
    return make_dataset_levels(splats, count, 2);
}

static struct spl_dataset *open_as(bool verify, uint64_t tables_bytes)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    const struct spl_dataset_opening how = {.verify = verify, .tables_bytes = tables_bytes};
    if (spl_dataset_open_as(path, &how, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static void same_maps(const struct spl_dataset *dataset, const struct make_maps *maps)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    uint32_t count;
    const struct spl_map_row *rows = spl_dataset_get_maps(dataset, &count);
    uint64_t texels = 0, bytes = 0;
    assert_true(count == maps->count && info->maps == count);
    assert_memory_equal(rows, maps->rows, count * sizeof *rows);
    for (uint32_t i = 0; i < count; i++) {
        size_t length = spl_dataset_get_map_bytes(dataset, i);
        assert_int_equal(length, 4 * spl_map_words(&rows[i]));
        uint32_t *words = malloc(length);
        assert_int_equal(spl_dataset_read_map(dataset, i, words, NULL), SPL_OK);
        assert_memory_equal(words, maps->words[i], length);
        free(words);
        texels += 6ull * rows[i].side * rows[i].side;
        bytes += length;
    }
    assert_true(info->map_texels == texels && info->map_bytes == bytes);
    assert_true(info->station_count == count && info->stations_of_maps); /* nobody else says where somebody stood */
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 16; k++)
            assert_true(info->stations[i][k] == (k == 15 ? 1 : k >= 12 ? 0 : k % 4 == 3 ? rows[i].position[k / 4]
                                                                    : rows[i].rotation[k / 4 * 3 + k % 4]));
    if (spl_dataset_keeps_all(dataset))
        assert_memory_equal(spl_dataset_get_chunk_stations(dataset), maps->stations,
                            info->chunks * sizeof *maps->stations);
    for (uint32_t page = 0; page < info->pages; page++) {
        struct spl_tables *read;
        const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, page, &read, NULL);
        assert_non_null(tables);
        assert_memory_equal(tables->stations, maps->stations + tables->first_chunk,
                            tables->chunk_count * sizeof *maps->stations);
        free(read);
    }
}

static void what_is_written_comes_back(void **state)
{
    (void)state;
    struct spl_dataset *from = some_dataset();
    const struct spl_dataset_info *old = spl_dataset_get_info(from);
    for (uint32_t count = 1; count <= make_maps_most; count += 3) {
        struct make_maps maps = make_maps(from, count, count);
        maps.page_bytes = 64;
        make_mapped_file(from, &maps, path);
        assert_int_equal(maps.asked, count);
        for (int how = 0; how < 4; how++) {
            struct spl_dataset *dataset = open_as(how & 1, how & 2 ? 0 : SPL_TABLES_BYTES);
            const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
            assert_true(spl_dataset_keeps_all(dataset) == !(how & 2));
            same_maps(dataset, &maps);
            assert_true(info->pages > 3 && info->page_bytes == old->page_bytes + info->map_bytes);
            assert_int_equal(info->attribute_bits[SPL_ATTRIBUTE_CHUNK],
                             old->attribute_bits[SPL_ATTRIBUTE_CHUNK] + 64 * info->chunks);
            spl_dataset_close(dataset);
        }
        free_maps(&maps);
    }
    assert_true(!old->maps && !old->map_bytes && !old->map_texels && !spl_dataset_get_chunk_stations(from));
    spl_dataset_close(from);
}

static void other_passes_keep_them(void **state)
{
    (void)state;
    struct spl_dataset *from = some_dataset();
    struct make_maps maps = make_maps(from, 3, 5);
    maps.page_bytes = 64;
    make_mapped_file(from, &maps, path);
    struct spl_dataset *mapped = open_as(true, SPL_TABLES_BYTES);
    uint64_t version = spl_dataset_get_info(mapped)->version, ids = spl_dataset_get_info(mapped)->ids;

    assert_int_equal(spl_dataset_rewrite(&(struct spl_rewrite){.from = mapped, .page_bytes = 64}, path, NULL), SPL_OK);
    struct spl_dataset *again = open_as(true, SPL_TABLES_BYTES);
    assert_true(spl_dataset_get_info(again)->version == version);
    spl_dataset_close(again);

    uint8_t(*colors)[3] = calloc(ids, sizeof *colors);
    json_t *about = json_pack("{s:i}", "stations", 3);
    const struct spl_rewrite red = {.from = mapped, .colors = (const uint8_t(*)[3])colors, .about_maps = about};
    assert_int_equal(spl_dataset_rewrite(&red, path, NULL), SPL_OK);
    again = open_as(true, SPL_TABLES_BYTES);
    assert_true(spl_dataset_get_info(again)->version != version);
    assert_true(json_equal(json_object_get(spl_dataset_get_meta(again), "maps"), about));
    same_maps(again, &maps);
    spl_dataset_close(again);
    free(colors);

    /* told to drop them: the file that it was */
    const struct spl_rewrite plain = {.from = from}, bare = {.from = mapped, .maps = maps.rows};
    assert_int_equal(spl_dataset_rewrite(&plain, path, NULL), SPL_OK);
    again = open_as(true, SPL_TABLES_BYTES);
    version = spl_dataset_get_info(again)->version;
    spl_dataset_close(again);
    assert_int_equal(spl_dataset_rewrite(&bare, path, NULL), SPL_OK);
    again = open_as(true, SPL_TABLES_BYTES);
    assert_true(spl_dataset_get_info(again)->version == version && !spl_dataset_get_info(again)->maps);
    assert_null(json_object_get(spl_dataset_get_meta(again), "maps"));
    spl_dataset_close(again);
    spl_dataset_close(mapped);
    spl_dataset_close(from);
    json_decref(about);
    free_maps(&maps);
}

static int no_map(void *context, uint32_t index, const uint32_t **words, struct spl_error *err)
{
    int rc = make_maps_get(context, index, words, err);
    return index == 2 ? spl_fail(err, SPL_E_CANCELLED, "enough") : rc;
}

static void what_cannot_be_written_leaves_nothing(void **state)
{
    (void)state;
    struct spl_dataset *from = some_dataset();
    struct make_maps maps = make_maps(from, 4, 1);
    struct spl_rewrite what = {.from = from,
                               .context = &maps,
                               .maps = maps.rows,
                               .map_count = maps.count,
                               .stations = maps.stations,
                               .get_map = no_map};
    struct spl_error err = {0};
    unlink(path);
    assert_int_equal(spl_dataset_rewrite(&what, path, &err), SPL_E_CANCELLED);
    assert_string_equal(err.message, "enough");
    assert_int_equal(access(path, F_OK), -1);

    what.get_map = make_maps_get;
    maps.rows[3].side = 65;
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_rewrite(&what, path, &err), SPL_E_LIMIT);
    assert_non_null(strstr(err.message, "the map of station 3 has sides or levels that no map can have"));
    what.map_count = SPL_MAPS_MAX + 1;
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_rewrite(&what, path, &err), SPL_E_LIMIT);
    assert_non_null(strstr(err.message, "maps of 16385 stations"));
    what.map_count = maps.count;
    maps.rows[3].side = 64;
    for (long n = 1;; n++) {
        maps.asked = 0;
        maps.rows[3] = maps.rows[0];
        free(maps.words[3]);
        maps.words[3] =
            memcpy(malloc(4 * spl_map_words(&maps.rows[0])), maps.words[0], 4 * spl_map_words(&maps.rows[0]));
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int rc = spl_dataset_rewrite(&what, path, &err);
        spl_memory_fail_after(0);
        if (rc == SPL_OK) {
            assert_true(n > 12);
            break;
        }
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(access(path, F_OK), -1);
    }
    spl_dataset_close(from);
    free_maps(&maps);
}

#define FORGE(name, statement)                                                                                         \
    static void name(struct spoil *f, struct spl_map_row *rows, struct spl_chunk_stations *stations)                   \
    {                                                                                                                  \
        (void)f, (void)rows, (void)stations;                                                                           \
        statement;                                                                                                     \
    }
FORGE(rotation_nan, rows[1].rotation[4] = NAN)
FORGE(rotation_scaled, rows[0].rotation[8] = 1.1)
FORGE(rotation_mirrored, (rows[0].rotation[0] *= -1, rows[0].rotation[1] *= -1, rows[0].rotation[2] *= -1))
FORGE(position_infinite, rows[0].position[2] = INFINITY)
FORGE(side_zero, rows[1].side = 0)
FORGE(side_odd, rows[1].side = 65)
FORGE(side_huge, rows[1].side = 0x80000000u)
FORGE(levels_zero, rows[0].levels = 0)
FORGE(levels_many, rows[0].levels = SPL_MAP_LEVELS_MAX + 1)
FORGE(range_side_zero, rows[0].range_side = 0)
FORGE(range_side_huge, rows[0].range_side = 0xffffffffu)
FORGE(near_zero, rows[0].near = 0)
FORGE(near_infinite, rows[0].near = INFINITY)
FORGE(slack_negative, rows[1].slack = -1)
FORGE(slack_nan, rows[1].slack = NAN)
FORGE(reserved, rows[1].reserved[2] = 1)
FORGE(too_large, (rows[1].side = rows[1].range_side = SPL_MAP_SIDE_MAX, rows[1].levels = SPL_MAP_LEVELS_MAX))
FORGE(another_length, rows[1].range_side++)
FORGE(a_level_less, rows[2].levels--)
FORGE(rows_swapped, (rows[2] = rows[0], rows[0] = rows[1], rows[1] = rows[2]))
FORGE(no_such_station, stations[1].seen_by[0] = 4)
FORGE(no_such_second, (stations[1].seen_by[0] = 1, stations[1].seen_by[1] = 4))
FORGE(second_trims, (stations[0].seen_by[0] = 1, stations[0].seen_by[1] = 2 | SPL_STATION_TRIMS))
FORGE(nobody_trims, (stations[0] = (struct spl_chunk_stations){{SPL_STATION_TRIMS}}))
FORGE(behind_the_end, (stations[0] = (struct spl_chunk_stations){{1, 0, 2}}))
FORGE(behind_no_first, (stations[0] = (struct spl_chunk_stations){{0, 1}}))
FORGE(twice, (stations[0] = (struct spl_chunk_stations){{1 | SPL_STATION_TRIMS, 2, 1}}))
FORGE(twice_behind, (stations[0] = (struct spl_chunk_stations){{1, 2, 3, 2}}))
FORGE(length_of_index, spoil_find(f, SPL_SECTION_STATIONS)->bytes -= 4)
FORGE(length_of_map, spoil_find(f, SPL_SECTION_MAP)->bytes -= 4)
FORGE(half_a_word, spoil_find(f, SPL_SECTION_MAP)->bytes -= 2)
FORGE(one_row_less, spoil_find(f, SPL_SECTION_STATIONS)->bytes -= sizeof *rows)
FORGE(no_index, spoil_find(f, SPL_SECTION_STATIONS)->type = SPL_FOURCC('N', 'O', 'N', 'E'))
FORGE(no_first_map, spoil_find(f, SPL_SECTION_MAP)->type = SPL_FOURCC('N', 'O', 'N', 'E'))
FORGE(second_index, spoil_find(f, SPL_SECTION_MAP)[1].index = 2)
static void neither(struct spoil *f, struct spl_map_row *rows, struct spl_chunk_stations *stations)
{
    no_index(f, rows, stations);
    for (int i = 0; i < 3; i++)
        no_first_map(f, rows, stations);
}

/* Each fault alone, behind checksums that hold. */
static void what_is_wrong_is_refused(void **state)
{
    (void)state;
    static const struct {
        void (*forge)(struct spoil *f, struct spl_map_row *rows, struct spl_chunk_stations *stations);
        const char *part;
    } rows[] = {
        {rotation_nan, "section PANO: station 1 has a rotation that is none"},
        {rotation_mirrored, "section PANO: station 0 has a rotation that mirrors"},
        {rotation_scaled, "section PANO: station 0 has a rotation that is none"},
        {position_infinite, "section PANO: station 0 has a position that is no number"},
        {side_zero, "section PANO: station 1 has sides or levels"},
        {side_odd, "section PANO: station 1 has sides or levels"},
        {side_huge, "section PANO: station 1 has sides or levels"},
        {levels_zero, "section PANO: station 0 has sides or levels"},
        {levels_many, "section PANO: station 0 has sides or levels"},
        {range_side_zero, "section PANO: station 0 has sides or levels"},
        {range_side_huge, "section PANO: station 0 has sides or levels"},
        {near_zero, "section PANO: station 0 has a nearest range or a slack"},
        {near_infinite, "section PANO: station 0 has a nearest range or a slack"},
        {slack_negative, "section PANO: station 1 has a nearest range or a slack"},
        {slack_nan, "section PANO: station 1 has a nearest range or a slack"},
        {reserved, "section PANO: station 1 has a reserved field"},
        {too_large, "section PANO: station 1 is larger than 96 MiB"},
        {another_length, "section PANO: station 1 has a PMAP of another length"},
        {a_level_less, "section PANO: station 2 has a PMAP of another length"},
        {rows_swapped, "section PANO: station 0 has a PMAP of another length"},
        {no_such_station, "section HEAD 0: chunk 1 names a station that PANO does not have"},
        {no_such_second, "section HEAD 0: chunk 1 names a station that PANO does not have"},
        {second_trims, "section HEAD 0: chunk 0 names a station that PANO does not have"},
        {nobody_trims, "section HEAD 0: chunk 0 is trimmed by no station"},
        {behind_the_end, "section HEAD 0: chunk 0 names a station behind the end of its list"},
        {behind_no_first, "section HEAD 0: chunk 0 names a station behind the end of its list"},
        {twice, "section HEAD 0: chunk 0 names a station twice"},
        {twice_behind, "section HEAD 0: chunk 0 names a station twice"},
        {length_of_index, "section PANO is not a whole number of rows, 1 to 16384"},
        {length_of_map, "section PANO: station 0 has a PMAP of another length"},
        {half_a_word, "section PMAP 0 has a size that no map can have"},
        {one_row_less, "section table lists some of PANO and a PMAP for each of its rows, but not all"},
        {no_index, "section table lists some of PANO and a PMAP for each of its rows, but not all"},
        {no_first_map, "section PMAP 1 is out of order"},
        {second_index, "section PMAP 2 is out of order"},
        {neither, "section PDIR: page 0 has another number of nodes or chunks"}, /* as a reader from before maps says */
    };
    struct spl_dataset *from = some_dataset();
    struct make_maps maps = make_maps(from, 3, 2);
    uint64_t nodes;
    const uint32_t chunks_in_head = spl_dataset_get_nodes(from, &nodes)->chunk_count;
    maps.page_bytes = 64;
    make_mapped_file(from, &maps, path);
    spl_dataset_close(open_as(true, SPL_TABLES_BYTES));
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spoil f = spoil_load(path), good = spoil_load(path);
        char *head = spoil_at(&f, SPL_SECTION_HEAD);
        rows[i].forge(&f, spoil_at(&f, SPL_SECTION_STATIONS),
                      (void *)(head + SPL_NODE_BYTES + chunks_in_head * SPL_CHUNK_BYTES));
        spoil_store(&f, path, true);
        spoil_expect(path, rows[i].part);
        spoil_store(&good, path, false);
        free(f.bytes);
        free(good.bytes);
    }
    free_maps(&maps);
    spl_dataset_close(from);
}

/* Any word of a map is one, so only checksums say that it is another's. */
static void damage_is_found_where_it_is_read(void **state)
{
    (void)state;
    struct spl_dataset *from = some_dataset();
    struct make_maps maps = make_maps(from, 2, 2);
    maps.page_bytes = 64;
    make_mapped_file(from, &maps, path);
    struct spoil good = spoil_load(path), f = spoil_load(path);
    struct spl_dataset *dataset = open_as(true, 0), *unverified;
    uint32_t *words = malloc(spl_dataset_get_map_bytes(dataset, 0));
    ((uint8_t *)spoil_at(&f, SPL_SECTION_MAP))[77] ^= 4;
    spoil_store(&f, path, false);
    spoil_expect(path, "section PMAP 0 fails its checksum");
    unverified = open_as(false, 0);
    assert_int_equal(spl_dataset_read_map(unverified, 0, words, NULL), SPL_OK);
    assert_memory_equal(words, spoil_at(&f, SPL_SECTION_MAP), spl_dataset_get_map_bytes(dataset, 0));
    spl_dataset_close(unverified);
    struct spl_error err = {0};
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, &err), SPL_E_CORRUPT);
    assert_non_null(strstr(err.message, "the map of station 0 was overwritten while in use"));
    assert_int_equal(truncate(path, (off_t)spoil_find(&f, SPL_SECTION_MAP)->offset + 9), 0);
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, &err), SPL_E_CORRUPT);
    spl_dataset_close(dataset);
    spoil_store(&good, path, false);
    ((uint8_t *)spoil_at(&good, SPL_SECTION_STATIONS))[100] ^= 1;
    spoil_store(&good, path, false);
    spoil_expect(path, "section PANO fails its checksum");
    free(words);
    free(good.bytes);
    free(f.bytes);
    free_maps(&maps);
    spl_dataset_close(from);
}

static int set_up(void **state)
{
    (void)state;
    make_folder(folder);
    snprintf(path, sizeof path, "%s/some.spld", folder);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_comes_back),
        cmocka_unit_test(other_passes_keep_them),
        cmocka_unit_test(what_cannot_be_written_leaves_nothing),
        cmocka_unit_test(what_is_wrong_is_refused),
        cmocka_unit_test(damage_is_found_where_it_is_read),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
