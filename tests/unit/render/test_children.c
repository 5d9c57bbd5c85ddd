/* Children in tables that are read by page: those of all their pages are asked for at once, and each is held against
 * its parent, which opening has not done. */
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

#include "render/children.h"
#include "support/make_dataset.h"

enum { splats = 400, pages = 9, size_max = 2 << 20 };

static char folder[256], path[300];
static uint8_t *bytes;
static size_t size;

/* What the test's walk has of each page, and what it is told. */
static struct have {
    const struct spl_dataset *dataset;
    struct spl_tables *tables[pages];
    enum spl_select_answer answer[pages];
    uint32_t asked; /* bit by page */
} have;

static enum spl_select_answer give_tables(void *context, uint32_t page, const struct spl_tables **tables)
{
    assert_true(context == &have && page > 0 && page < pages);
    have.asked |= 1u << page;
    if (have.answer[page] != SPL_SELECT_YES)
        return have.answer[page];
    if (!have.tables[page]) {
        have.tables[page] = malloc(spl_dataset_get_tables_bytes(have.dataset, page));
        assert_int_equal(spl_dataset_read_tables(have.dataset, page, have.tables[page], NULL), SPL_OK);
    }
    *tables = have.tables[page];
    return SPL_SELECT_YES;
}

static struct spl_dataset *open_it(uint64_t tables_bytes)
{
    const struct spl_dataset_source source = spl_dataset_source_of_memory(bytes, size);
    const struct spl_dataset_opening how = {.tables_bytes = tables_bytes};
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (spl_dataset_open_source_as(&source, "made", &how, &dataset, &err))
        fail_msg("%s", err.message);
    have = (struct have){.dataset = dataset};
    for (int p = 0; p < pages; p++)
        have.answer[p] = SPL_SELECT_YES;
    return dataset;
}

static void close_it(struct spl_dataset *dataset)
{
    for (int p = 0; p < pages; p++)
        free(have.tables[p]);
    spl_dataset_close(dataset);
}

static int find_children(const struct spl_dataset *dataset, struct spl_found_node children[8],
                         enum spl_select_answer *answer, struct spl_error *err)
{
    const struct spl_select_params params = {.dataset = dataset, .tables = give_tables, .context = &have};
    return spl_children_find(&params, spl_dataset_get_tables(dataset, 0)->nodes, children, answer, err);
}

static void children_lie_on_many_pages(void **state)
{
    (void)state;
    struct spl_dataset *dataset = open_it(0), *all = open_it(UINT64_MAX);
    struct spl_found_node here[8], there[8];
    enum spl_select_answer answer = SPL_SELECT_NO;
    uint64_t count;
    const struct spl_node *nodes = spl_dataset_get_nodes(all, &count);
    have.dataset = dataset;
    assert_true(count == pages && spl_dataset_get_info(dataset)->pages == pages && nodes->child_count == 8);
    assert_int_equal(find_children(dataset, here, &answer, NULL), SPL_OK);
    assert_true(answer == SPL_SELECT_YES && have.asked == (1 << pages) - 2);
    have.asked = 0;
    assert_int_equal(find_children(all, there, &answer, NULL), SPL_OK);
    assert_true(answer == SPL_SELECT_YES && !have.asked); // they are kept
    for (int i = 0; i < 8; i++) {
        assert_true(there[i].node == nodes + 1 + i && here[i].tables->page == (uint32_t)i + 1);
        assert_memory_equal(here[i].node, there[i].node, sizeof *here[i].node);
        assert_memory_equal(spl_found_get_chunks(&here[i]), spl_found_get_chunks(&there[i]), sizeof(struct spl_chunk));
    }
    spl_dataset_close(all);
    close_it(dataset);
}

static void all_that_are_missing_are_asked_for_together(void **state)
{
    (void)state;
    struct spl_dataset *dataset = open_it(0);
    struct spl_found_node children[8];
    enum spl_select_answer answer;
    have.answer[2] = have.answer[7] = SPL_SELECT_LATER;
    assert_int_equal(find_children(dataset, children, &answer, NULL), SPL_OK);
    assert_true(answer == SPL_SELECT_LATER && have.asked == (1 << pages) - 2);
    have.answer[5] = SPL_SELECT_NO; // nothing behind it takes room for nothing
    have.asked = 0;
    assert_int_equal(find_children(dataset, children, &answer, NULL), SPL_OK);
    assert_true(answer == SPL_SELECT_NO && have.asked == (1 << 6) - 2);
    close_it(dataset);
}

static void rehash(void)
{
    struct spl_file_header *header = (void *)bytes;
    struct spl_section *table = (void *)(bytes + header->table_offset);
    for (uint32_t i = 0; i < header->section_count; i++)
        table[i].hash = XXH3_64bits(bytes + table[i].offset, table[i].bytes);
    header->table_hash = XXH3_64bits(table, header->section_count * sizeof *table);
    header->header_hash = XXH3_64bits(header, offsetof(struct spl_file_header, header_hash));
}

static struct spl_node *node_of_page(uint32_t page)
{
    const struct spl_file_header *header = (void *)bytes;
    const struct spl_section *table = (void *)(bytes + header->table_offset);
    for (uint32_t i = 0; i < header->section_count; i++)
        if (table[i].type == SPL_SECTION_HEAD && table[i].index == page)
            return (void *)(bytes + table[i].offset);
    fail();
    return NULL;
}

static void a_child_that_does_not_fit_is_refused(void **state)
{
    (void)state;
    struct spl_node *node = node_of_page(4), good;
    memcpy(&good, node, SPL_NODE_BYTES);
    for (int fault = 0; fault < 3; fault++) {
        static const char *const parts[] = {"made: node 4 lies outside its parent's cube; pack", "is larger than half",
                                            "lies outside"};
        if (fault == 0)
            node->origin[1] += 1e3;
        if (fault == 1)
            node->size *= 2;
        if (fault == 2)
            node->origin[0] -= 1e3;
        rehash();
        struct spl_dataset *dataset = open_it(0);
        struct spl_found_node children[8];
        enum spl_select_answer answer;
        struct spl_error err = {0};
        assert_int_equal(find_children(dataset, children, &answer, &err), SPL_E_CORRUPT);
        assert_non_null(strstr(err.message, parts[fault]));
        close_it(dataset);
        memcpy(node, &good, SPL_NODE_BYTES);
    }
    rehash();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(children_lie_on_many_pages),
        cmocka_unit_test(all_that_are_missing_are_asked_for_together),
        cmocka_unit_test(a_child_that_does_not_fit_is_refused),
    };
    struct make_splat some[splats];
    for (int i = 0; i < splats; i++)
        some[i] = (struct make_splat){
            .position = {i % 8, i / 8 % 8, i / 64}, .normal = {0, 0, 1}, .radius = 0.5f, .color = {(uint8_t)i}};
    make_folder(folder);
    snprintf(path, sizeof path, "%s/made.spld", folder);
    make_dataset_page_bytes = 0;
    make_dataset_file(path, some, splats, 2);
    bytes = malloc(size_max);
    FILE *file = fopen(path, "rb");
    size = fread(bytes, 1, size_max, file);
    fclose(file);
    unlink(path);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    free(bytes);
    return rmdir(folder) ? 1 : failed;
}
