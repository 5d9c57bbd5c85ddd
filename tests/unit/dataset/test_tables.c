/* Tables that are read by page say what they say where all are kept; a head that is not what it was, or not what the
 * directory says, is refused when it is read. */
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <xxhash.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/texture.h"
#include "support/make_dataset.h"
#include "support/make_tree.h"

enum { points = 150000, page_bytes = 20000 };

static char folder[256], path[300];

static int open_within(uint64_t tables_bytes, bool verify, struct spl_dataset **out, struct spl_error *err)
{
    return spl_dataset_open_as(path, &(struct spl_dataset_opening){verify, tables_bytes, NULL}, out, err);
}

static struct spl_dataset *open_good(uint64_t tables_bytes)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (open_within(tables_bytes, true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static void compare_tables(const struct spl_tables *a, const struct spl_tables *b)
{
    assert_true(a->page == b->page && a->node_count == b->node_count && a->chunk_count == b->chunk_count &&
                a->stream_count == b->stream_count && a->first_node == b->first_node &&
                a->first_chunk == b->first_chunk && !a->textures == !b->textures);
    assert_memory_equal(a->nodes, b->nodes, a->node_count * sizeof *a->nodes);
    assert_memory_equal(a->chunks, b->chunks, a->chunk_count * sizeof *a->chunks);
    for (uint32_t s = 0; s < a->stream_count; s++) {
        assert_memory_equal(a->base[s], b->base[s], a->chunk_count * sizeof *a->base[s]);
        assert_memory_equal(a->width[s], b->width[s], a->chunk_count);
    }
}

static void by_page_they_are_the_same(void **state)
{
    (void)state;
    struct spl_dataset *all = open_good(UINT64_MAX), *by_page = open_good(0);
    const struct spl_dataset_info *info = spl_dataset_get_info(all);
    uint64_t node_count, next_node = 0, bytes = 0;
    const struct spl_node *nodes = spl_dataset_get_nodes(all, &node_count);
    assert_true(spl_dataset_keeps_all(all) && !spl_dataset_keeps_all(by_page) && info->pages > 20 && info->levels > 2);
    struct spl_dataset_info same = *spl_dataset_get_info(by_page);
    assert_true(info->stream_values && same.stream_values && info->stream_count);
    assert_memory_equal(info->stream_values, same.stream_values, info->stream_count * sizeof *same.stream_values);
    assert_int_equal(info->view_count, same.view_count);
    assert_true(info->heights && same.heights);
    assert_memory_equal(info->heights, same.heights, sizeof *same.heights);
    same.heights = info->heights;
    same.stream_values = info->stream_values;
    same.views = info->views;
    assert_memory_equal(info, &same, sizeof *info);
    for (uint32_t page = 0; page < info->pages; page++) {
        struct spl_tables *read, *none;
        const struct spl_tables *a = spl_dataset_borrow_tables(all, page, &none, NULL),
                                *b = spl_dataset_borrow_tables(by_page, page, &read, NULL);
        assert_true(a && b && !none && !read == !page && a == spl_dataset_get_tables(all, page));
        assert_true((spl_dataset_get_tables(by_page, page) != NULL) == (page == 0));
        compare_tables(a, b);
        assert_true(a->nodes == nodes + next_node);
        for (uint32_t n = 0; n < a->node_count; n++, next_node++) {
            assert_int_equal(spl_dataset_find_page_of_node(by_page, next_node), page);
            assert_int_equal(a->nodes[n].page, page);
        }
        assert_true(spl_dataset_get_page_end(all, page) == next_node);
        bytes += spl_dataset_get_tables_bytes(all, page);
        free(read);
    }
    assert_true(next_node == node_count && bytes == spl_dataset_get_all_tables_bytes(all));
    spl_dataset_close(all);
    spl_dataset_close(by_page);
}

static void all_are_kept_where_they_fit(void **state)
{
    (void)state;
    struct spl_dataset *dataset = open_good(UINT64_MAX);
    uint64_t bytes = spl_dataset_get_all_tables_bytes(dataset);
    spl_dataset_close(dataset);
    for (int less = 0; less < 2; less++) {
        dataset = open_good(bytes - (uint64_t)less);
        assert_int_equal(spl_dataset_keeps_all(dataset), !less);
        assert_true(spl_dataset_get_tables_limit(dataset) == bytes - (uint64_t)less);
        spl_dataset_close(dataset);
    }
    struct spl_open_options options;
    spl_open_options_init(&options);
    for (uint64_t most = 0; most < 2; most++) { // 0 = as many as usual
        options.tables_bytes = most;
        assert_int_equal(spl_dataset_open_with(path, &options, &dataset, NULL), SPL_OK);
        assert_int_equal(spl_dataset_keeps_all(dataset), !most);
        spl_dataset_close(dataset);
    }
}

static void splats_are_found_by_id(void **state)
{
    (void)state;
    struct spl_dataset *all = open_good(UINT64_MAX), *by_page = open_good(0);
    uint64_t ids = spl_dataset_get_info(all)->ids, linear[2] = {0}, histogram[2][SPL_ATOMS_MAX + 1] = {{0}};
    int stream = spl_dataset_find_stream(all, "uncertainty");
    assert_true(stream >= 0 && ids > points);
    for (uint64_t id = 0; id < ids; id += 97) {
        struct spl_splat a = {0}, b = {0};
        double x = -1, y = -2;
        assert_true(spl_dataset_find_splat(all, id, &a) && spl_dataset_find_splat(by_page, id, &b));
        assert_memory_equal(&a, &b, sizeof a);
        assert_true(spl_dataset_find_value(all, stream, id, &x) && spl_dataset_find_value(by_page, stream, id, &y) &&
                    x == y);
    }
    struct spl_splat none;
    assert_false(spl_dataset_find_splat(by_page, ids, &none) || spl_dataset_find_splat(by_page, UINT64_MAX, &none));
    assert_int_equal(spl_dataset_count_linear(all, &linear[0], NULL), SPL_OK);
    assert_int_equal(spl_dataset_count_linear(by_page, &linear[1], NULL), SPL_OK);
    assert_int_equal(spl_dataset_count_atoms(all, histogram[0], NULL), SPL_OK);
    assert_int_equal(spl_dataset_count_atoms(by_page, histogram[1], NULL), SPL_OK);
    assert_true(linear[0] == linear[1] && !memcmp(histogram[0], histogram[1], sizeof histogram[0]));
    spl_dataset_close(all);
    spl_dataset_close(by_page);
}

/* The file in memory, to be changed; `table` is in it. */
struct raw {
    uint8_t *data;
    size_t size;
    struct spl_section *table;
    uint32_t sections;
};

static struct raw load_raw(void)
{
    struct raw raw = {.data = malloc(8 << 20)};
    FILE *file = fopen(path, "rb");
    raw.size = fread(raw.data, 1, 8 << 20, file);
    fclose(file);
    const struct spl_file_header *header = (void *)raw.data;
    raw.table = (void *)(raw.data + header->table_offset);
    raw.sections = header->section_count;
    return raw;
}

static struct spl_section *find(struct raw *raw, uint32_t type, uint32_t index)
{
    for (uint32_t i = 0; i < raw->sections; i++)
        if (raw->table[i].type == type && raw->table[i].index == index)
            return &raw->table[i];
    fail();
    return NULL;
}

/* Every checksum anew. */
static void rehash(struct raw *raw)
{
    struct spl_file_header *header = (void *)raw->data;
    for (uint32_t i = 0; i < raw->sections; i++)
        raw->table[i].hash = XXH3_64bits(raw->data + raw->table[i].offset, raw->table[i].bytes);
    header->table_hash = XXH3_64bits(raw->table, raw->sections * sizeof *raw->table);
    header->header_hash = XXH3_64bits(header, offsetof(struct spl_file_header, header_hash));
}

static int open_raw(const struct raw *raw, uint64_t tables_bytes, bool verify, struct spl_dataset **out,
                    struct spl_error *err)
{
    const struct spl_dataset_source source = spl_dataset_source_of_memory(raw->data, raw->size);
    const struct spl_dataset_opening how = {verify, tables_bytes, NULL};
    return spl_dataset_open_source_as(&source, "raw", &how, out, err);
}

/* Refused by who opens all of it, with `part` in the message; else when page `page` is read, and only then. */
static void expect(const struct raw *raw, uint32_t page, const char *part)
{
    static const struct {
        uint64_t tables_bytes;
        bool verify;
    } ways[] = {{UINT64_MAX, false}, {UINT64_MAX, true}, {0, true}};
    struct spl_dataset *dataset;
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        struct spl_error err = {0};
        int rc = open_raw(raw, ways[i].tables_bytes, ways[i].verify, &dataset, &err);
        if (rc != SPL_E_CORRUPT || !strstr(err.message, part))
            fail_msg("way %zu: expected '%s', got %d '%s'", i, part, rc, err.message);
    }
    assert_int_equal(open_raw(raw, 0, false, &dataset, NULL), SPL_OK);
    for (uint32_t p = 0; p < spl_dataset_get_info(dataset)->pages; p++) {
        struct spl_error err = {0};
        struct spl_tables *read;
        const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, p, &read, &err);
        if ((tables == NULL) != (p == page) || (p == page && (err.code != SPL_E_CORRUPT || !strstr(err.message, part))))
            fail_msg("page %u: expected '%s', got '%s'", p, part, err.message);
        free(read);
    }
    spl_dataset_close(dataset);
}

static void a_head_is_held_against_its_row(void **state)
{
    (void)state;
    enum { page = 3 };
    struct raw raw = load_raw();
    uint8_t *head = raw.data + find(&raw, SPL_SECTION_HEAD, page)->offset;
    struct spl_page_row *rows = (void *)(raw.data + find(&raw, SPL_SECTION_DIRECTORY, 0)->offset);
    const uint32_t nodes = (uint32_t)(rows[page + 1].first_node - rows[page].first_node);
    uint8_t *child_count = head + offsetof(struct spl_node, child_count),
            *first_count = head + nodes * SPL_NODE_BYTES + offsetof(struct spl_chunk, extra_bits);
    uint16_t *chunk_count = (void *)(head + offsetof(struct spl_node, chunk_count));
    assert_true(*child_count > 1 && *chunk_count > 1);

    head[0] ^= 1;
    expect(&raw, page, "section HEAD 3 fails its checksum");
    head[0] ^= 1;
    --*child_count;
    rehash(&raw);
    expect(&raw, page, "does not end with the child or the chunk that PDIR says");
    *child_count = 8;
    rehash(&raw);
    expect(&raw, page, "has more children than PDIR leaves it");
    *child_count = 4;
    --*chunk_count;
    rehash(&raw);
    struct spl_error err = {0};
    struct spl_dataset *dataset;
    assert_int_equal(open_raw(&raw, UINT64_MAX, false, &dataset, &err), SPL_E_CORRUPT);
    ++*chunk_count;
    --*first_count;
    rehash(&raw);
    expect(&raw, page, "does not end with the id that PDIR says");
    ++*first_count;
    rows[page + 1].first_id--; // two pages then have another number, and both say so
    rehash(&raw);
    assert_int_equal(open_raw(&raw, UINT64_MAX, false, &dataset, NULL), SPL_E_CORRUPT);
    assert_int_equal(open_raw(&raw, 0, true, &dataset, NULL), SPL_E_CORRUPT);
    free(raw.data);
}

/* A file that is overwritten while it is in use: what was read stays, what is read now is refused, by its id alone. */
static void a_head_that_changes_is_refused(void **state)
{
    (void)state;
    struct spl_dataset *dataset = open_good(0);
    struct raw raw = load_raw();
    off_t at = (off_t)find(&raw, SPL_SECTION_HEAD, 5)->offset;
    char byte = (char)(raw.data[at] ^ 1);
    int fd = open(path, O_WRONLY);
    struct spl_error err = {0};
    struct spl_tables *read;
    const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, 5, &read, &err);
    assert_non_null(tables);
    uint64_t id = tables->chunks[0].first_id;
    free(read);
    assert_int_equal(pwrite(fd, &byte, 1, at), 1);
    assert_null(spl_dataset_borrow_tables(dataset, 5, &read, &err));
    assert_null(read);
    assert_int_equal(err.code, SPL_E_CORRUPT);
    assert_true(strstr(err.message, "tree: section HEAD 5 fails its checksum") &&
                strstr(err.message, "overwritten while in use") && !strstr(err.message, folder));
    struct spl_splat splat;
    double value;
    uint64_t linear = 0;
    assert_false(spl_dataset_find_splat(dataset, id, &splat) || spl_dataset_find_value(dataset, 0, id, &value));
    assert_true(spl_dataset_find_splat(dataset, id - 1, &splat)); // of the page before
    assert_int_equal(spl_dataset_count_linear(dataset, &linear, NULL), SPL_E_CORRUPT);
    byte ^= 1;
    assert_int_equal(pwrite(fd, &byte, 1, at), 1);
    assert_true(spl_dataset_find_splat(dataset, id, &splat));
    close(fd);
    spl_dataset_close(dataset);
    free(raw.data);
}

static void flip_bit(int fd, uint64_t at)
{
    char byte;
    assert_int_equal(pread(fd, &byte, 1, (off_t)at), 1);
    byte ^= 1;
    assert_int_equal(pwrite(fd, &byte, 1, (off_t)at), 1);
}

/* Its section table lies behind a hole, so that it takes no room on the disk. What is damaged is refused when it is
 * read, and before where all of it is to be verified. */
static void a_large_file_is_verified_as_it_is_read(void **state)
{
    (void)state;
    enum { broken = 5 };
    const struct spl_dataset_opening all = {.verify = true, .verify_all = true, .tables_bytes = 0};
    struct raw raw = load_raw();
    struct spl_file_header *header = (void *)raw.data;
    const size_t table_bytes = header->section_count * sizeof(struct spl_section);
    const uint64_t page_at = find(&raw, SPL_SECTION_PAGE, broken)->offset,
                   head_at = find(&raw, SPL_SECTION_HEAD, broken)->offset;
    void *table = raw.data + header->table_offset;
    const int fd = open(path, O_RDWR);
    header->table_offset = SPL_VERIFY_AT_OPEN_MAX;
    header->file_bytes = header->table_offset + table_bytes;
    header->header_hash = XXH3_64bits(header, offsetof(struct spl_file_header, header_hash));
    assert_int_equal(pwrite(fd, table, table_bytes, (off_t)header->table_offset), table_bytes);
    assert_int_equal(pwrite(fd, header, sizeof *header, 0), sizeof *header);

    struct spl_dataset *dataset = open_good(0), *refused;
    struct spl_error err = {0};
    struct spl_tables *read;
    uint32_t *words = malloc(SPL_PAGE_BYTES_MAX);
    assert_int_equal(spl_dataset_read_page(dataset, broken, words, NULL), 0);
    spl_dataset_close(dataset);
    flip_bit(fd, page_at);
    dataset = open_good(0);
    assert_int_equal(spl_dataset_read_page(dataset, broken, words, &err), SPL_E_CORRUPT);
    assert_non_null(strstr(err.message, "tree: page 5 fails its checksum: it is damaged, or was overwritten"));
    assert_int_equal(spl_dataset_read_page(dataset, broken - 1, words, NULL), 0);
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_open_as(path, &all, &refused, &err), SPL_E_CORRUPT);
    assert_non_null(strstr(err.message, "section PAGE 5 fails its checksum"));
    assert_int_equal(spl_dataset_open_whole(path, true, &refused, NULL), SPL_E_CORRUPT);
    flip_bit(fd, page_at);
    assert_int_equal(spl_dataset_read_page(dataset, broken, words, NULL), 0);
    spl_dataset_close(dataset);
    flip_bit(fd, head_at);
    dataset = open_good(0);
    err = (struct spl_error){0};
    assert_null(spl_dataset_borrow_tables(dataset, broken, &read, &err));
    assert_non_null(strstr(err.message, "tree: section HEAD 5 fails its checksum"));
    assert_int_equal(spl_dataset_open_as(path, &all, &refused, NULL), SPL_E_CORRUPT);
    spl_dataset_close(dataset);
    close(fd);
    free(words);
    make_tree_file(path, points, page_bytes);
    free(raw.data);
}

static void refused_memory_is_an_error(void **state)
{
    (void)state;
    for (int verify = 0; verify < 2; verify++) {
        long n = 1;
        for (;; n++) {
            struct spl_dataset *dataset;
            struct spl_error err = {0};
            spl_memory_fail_after(n);
            int rc = open_within(0, verify, &dataset, &err);
            spl_memory_fail_after(0);
            spl_dataset_close(dataset);
            if (!rc)
                break;
            assert_int_equal(rc, SPL_E_NOMEM);
        }
        assert_true(n > 4);
    }
    struct spl_dataset *dataset = open_good(0);
    struct spl_tables *read;
    for (long n = 1; n <= 2; n++) { // the block, and the head as it lies in the file
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        assert_null(spl_dataset_borrow_tables(dataset, 1, &read, &err));
        spl_memory_fail_after(0);
        assert_int_equal(err.code, SPL_E_NOMEM);
    }
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(by_page_they_are_the_same),     cmocka_unit_test(all_are_kept_where_they_fit),
        cmocka_unit_test(splats_are_found_by_id),        cmocka_unit_test(a_head_is_held_against_its_row),
        cmocka_unit_test(a_head_that_changes_is_refused), cmocka_unit_test(a_large_file_is_verified_as_it_is_read),
        cmocka_unit_test(refused_memory_is_an_error),
    };
    make_folder(folder);
    snprintf(path, sizeof path, "%s/tree.spld", folder);
    make_tree_file(path, points, page_bytes);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return rmdir(folder) ? 1 : failed;
}
