/* A file of 10^10 splats that is nowhere: 62 GB on 3699 pages, a full octree of seven levels, whose directory and heads
 * are made as they are read. It opens within what tables may take, having read the root's head alone; a view's walk
 * reads those of the pages that it comes to, and no others. Says how long that takes (RESULTS.md). */
#include <malloc.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>
#include <xxhash.h>

#include "base/clock.h"
#include "base/parallel.h"
#include "dataset/dataset.h"
#include "dataset/head.h"
#include "render/select.h"

enum { deepest = 6, node_chunks = 300, page_nodes = 81, tables_mib = 64 };
// (8^7 - 1) / 7 nodes
static const uint64_t node_count = 299593, splats_of_node = (uint64_t)node_chunks * SPL_CHUNK_SPLATS;
static const double side = 4096;

static struct far_away {
    struct spl_file_header header;
    struct spl_section *table;
    uint32_t sections, pages;
    struct spl_page_row *rows;
    char *meta;
    struct spl_chunk *chunks; /* of any node, those of all nodes being the same but for their place */
    _Atomic uint64_t bytes_read, heads_read;
} file;

static uint64_t first_of_level(uint32_t depth)
{
    return ((1ull << 3 * depth) - 1) / 7;
}

static struct spl_node node_at(uint64_t number)
{
    uint32_t depth = 0;
    while (number >= first_of_level(depth + 1))
        depth++;
    uint64_t place = number - first_of_level(depth);
    float size = (float)(side / (1 << depth)), spacing = size / 160;
    struct spl_node node = {.size = size,
                            .spacing = spacing,
                            .box_max = {size, size, size / 50}, // surfaces are thin
                            .chunk_count = node_chunks,
                            .child_count = depth < deepest ? 8 : 0,
                            .depth = (uint8_t)depth};
    for (uint32_t bit = 0; bit < depth; bit++)
        for (int a = 0; a < 3; a++)
            node.origin[a] += (place >> (3 * bit + (unsigned)a) & 1) * (double)size * (1 << bit);
    return node;
}

/* The head of a page, as it lies in the file; malloc'd. */
static char *make_head(uint32_t page, size_t *bytes)
{
    static _Thread_local struct spl_node nodes[page_nodes];
    struct spl_tables tables = {.node_count = (uint32_t)(file.rows[page + 1].first_node - file.rows[page].first_node),
                                .nodes = nodes};
    tables.chunk_count = tables.node_count * node_chunks;
    tables.chunks = file.chunks;
    for (uint32_t n = 0; n < tables.node_count; n++)
        nodes[n] = node_at(file.rows[page].first_node + n);
    *bytes = spl_head_bytes(tables.node_count, tables.chunk_count, 0, false, false);
    char *head = malloc(*bytes);
    spl_head_write(&tables, head);
    return head;
}

static void hash_heads(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)context;
    (void)worker;
    for (size_t page = begin; page < end; page++) {
        size_t bytes;
        char *head = make_head((uint32_t)page, &bytes);
        file.table[file.pages + 2 + page].hash = XXH3_64bits(head, bytes);
        free(head);
    }
}

static void add(uint32_t type, uint32_t index, uint64_t bytes, const void *data, uint64_t *offset)
{
    uint64_t alignment = type == SPL_SECTION_PAGE ? SPL_FILE_ALIGNMENT : 64;
    *offset = (*offset + alignment - 1) / alignment * alignment;
    file.table[file.sections++] = (struct spl_section){
        .type = type, .index = index, .offset = *offset, .bytes = bytes, .hash = data ? XXH3_64bits(data, bytes) : 0};
    *offset += bytes;
}

static int make_file(void **state)
{
    (void)state;
    file.pages = (uint32_t)((node_count + page_nodes - 1) / page_nodes);
    file.table = calloc(2 * file.pages + 2, sizeof *file.table);
    file.rows = calloc(file.pages + 1, sizeof *file.rows);
    file.chunks = calloc(page_nodes * node_chunks, sizeof *file.chunks);
    for (uint32_t c = 0; c < page_nodes * node_chunks; c++)
        file.chunks[c] = (struct spl_chunk){.step = 1,
                                            .radius_min = 1,
                                            .radius_step = 1,
                                            .radius_mean = 1,
                                            .normal_step = 1,
                                            .geometry_word = 172 * c,
                                            .geometry_bits = 8 << SPL_GEOMETRY_X | 8 << SPL_GEOMETRY_Y |
                                                             8 << SPL_GEOMETRY_Z,
                                            .color_bits = 8,
                                            .count = SPL_CHUNK_SPLATS};
    for (uint32_t p = 0; p <= file.pages; p++) {
        uint64_t nodes = (uint64_t)p * page_nodes < node_count ? (uint64_t)p * page_nodes : node_count;
        uint64_t inner = first_of_level(deepest) < nodes ? first_of_level(deepest) : nodes;
        file.rows[p] = (struct spl_page_row){nodes, nodes * node_chunks, nodes * splats_of_node, 1 + 8 * inner};
    }
    uint64_t leaf_splats = (1ull << 3 * deepest) * splats_of_node, offset = sizeof file.header;
    json_t *meta = json_pack(
        "{s:I, s:I, s:i, s:f, s:{s:[fff], s:[fff]}, s:{s:[fff], s:[fff], s:[fff], s:f}, s:{s:b}, s:[s], s:{s:I, s:i, "
        "s:i, s:{s:I, s:i, s:i, s:I, s:i, s:i, s:i, s:I}, s:[]}}",
        "points", (json_int_t)leaf_splats, "leaf_splats", (json_int_t)leaf_splats, "levels", deepest + 1,
        "splat_radius", 1.0, "bounds", "min", 0.0, 0.0, 0.0, "max", side, side, side, "default_view", "eye", -1.0, -1.0,
        0.0, "target", side, side, side, "up", 0.0, 0.0, 1.0, "fov", 50.0, "attributes", "color", 1, "sources",
        "nowhere", "counts", "splats", (json_int_t)(node_count * splats_of_node), "pieces", 0, "linear_chunks", 0,
        "bits", "position", (json_int_t)(24 * node_count * splats_of_node), "radius", 0, "normal", 0, "color",
        (json_int_t)(8 * node_count * splats_of_node), "linear", 0, "clip", 0, "lines", 0, "chunk",
        (json_int_t)(480 * node_count * (node_chunks + 1)), "stream_bits");
    assert_non_null(meta);
    assert_true(leaf_splats > 10000000000ull);
    file.meta = json_dumps(meta, 0);
    json_decref(meta);
    for (uint32_t p = 0; p < file.pages; p++)
        add(SPL_SECTION_PAGE, p, SPL_PAGE_BYTES, NULL, &offset);
    add(SPL_SECTION_META, 0, strlen(file.meta), file.meta, &offset);
    add(SPL_SECTION_DIRECTORY, 0, (file.pages + 1) * sizeof *file.rows, file.rows, &offset);
    for (uint32_t p = 0; p < file.pages; p++) {
        uint64_t nodes = file.rows[p + 1].first_node - file.rows[p].first_node;
        add(SPL_SECTION_HEAD, p, spl_head_bytes(nodes, nodes * node_chunks, 0, false, false), NULL, &offset);
    }
    spl_parallel_for(0, file.pages, 16, hash_heads, NULL);
    offset = (offset + 63) / 64 * 64;
    file.header = (struct spl_file_header){.magic = SPL_FILE_MAGIC,
                                           .version = SPL_FILE_VERSION,
                                           .header_bytes = sizeof file.header,
                                           .file_bytes = offset + file.sections * sizeof *file.table,
                                           .table_offset = offset,
                                           .section_count = file.sections,
                                           .table_hash = XXH3_64bits(file.table, file.sections * sizeof *file.table)};
    file.header.header_hash = XXH3_64bits(&file.header, offsetof(struct spl_file_header, header_hash));
    return 0;
}

static int free_file(void **state)
{
    (void)state;
    free(file.table);
    free(file.rows);
    free(file.chunks);
    free(file.meta);
    return 0;
}

static int64_t give(const void *data, uint64_t size, uint64_t from, void *out, size_t bytes)
{
    size_t count = size - from < bytes ? (size_t)(size - from) : bytes;
    memcpy(out, (const char *)data + from, count);
    return (int64_t)count;
}

static int64_t read_far_away(void *context, uint64_t offset, void *out, size_t bytes)
{
    (void)context;
    atomic_fetch_add(&file.bytes_read, bytes);
    if (offset < sizeof file.header)
        return give(&file.header, sizeof file.header, offset, out, bytes);
    if (offset >= file.header.table_offset)
        return give(file.table, file.sections * sizeof *file.table, offset - file.header.table_offset, out, bytes);
    uint32_t i = 0;
    while (offset >= file.table[i].offset + file.table[i].bytes)
        i++;
    const struct spl_section *s = &file.table[i];
    uint64_t from = offset - s->offset;
    if (s->type == SPL_SECTION_META)
        return give(file.meta, s->bytes, from, out, bytes);
    if (s->type == SPL_SECTION_DIRECTORY)
        return give(file.rows, s->bytes, from, out, bytes);
    assert_int_equal(s->type, SPL_SECTION_HEAD); // no page is looked at
    atomic_fetch_add(&file.heads_read, !from);
    size_t size;
    char *head = make_head(s->index, &size);
    int64_t given = give(head, size, from, out, bytes);
    free(head);
    return given;
}

static struct spl_dataset *open_it(void)
{
    struct spl_dataset_source source = {.size = file.header.file_bytes, .read = read_far_away};
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (spl_dataset_open_source(&source, "far-away.spld", false, NULL, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static void it_opens_within_what_tables_may_take(void **state)
{
    (void)state;
    file.bytes_read = file.heads_read = 0;
    struct mallinfo2 before = mallinfo2();
    uint64_t clock = spl_now_ns();
    struct spl_dataset *dataset = open_it();
    double ms = (double)(spl_now_ns() - clock) * 1e-6;
    struct mallinfo2 after = mallinfo2();
    size_t bytes = after.uordblks + after.hblkhd - before.uordblks - before.hblkhd;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    printf("%.3g splats on %u pages: %.1f ms, %zu KiB kept, %llu KiB read; all tables would be %llu MiB\n",
           (double)info->leaf_splats, info->pages, ms, bytes >> 10, (unsigned long long)file.bytes_read >> 10,
           (unsigned long long)spl_dataset_get_all_tables_bytes(dataset) >> 20);
    assert_true(info->nodes == node_count && info->chunks == node_count * node_chunks &&
                info->ids == node_count * splats_of_node && info->leaf_splats > 10000000000ull);
    assert_true(!spl_dataset_keeps_all(dataset) && file.heads_read == 1);
    assert_true(bytes < (size_t)tables_mib << 20 && file.bytes_read < 4 << 20);
    spl_dataset_close(dataset);
}

/* What a view has read of the dataset, as much as tables may take. */
struct view {
    const struct spl_dataset *dataset;
    struct spl_tables **tables; /* by page */
    uint64_t pages_drawn, bytes;
};

static enum spl_select_answer take_tables(void *context, uint32_t page, const struct spl_tables **tables)
{
    struct view *view = context;
    size_t bytes = spl_dataset_get_tables_bytes(view->dataset, page);
    if (!view->tables[page]) {
        if (view->bytes + bytes > (uint64_t)tables_mib << 20)
            return SPL_SELECT_NO;
        view->tables[page] = malloc(bytes);
        assert_int_equal(spl_dataset_read_tables(view->dataset, page, view->tables[page], NULL), SPL_OK);
        view->bytes += bytes;
    }
    *tables = view->tables[page];
    return SPL_SELECT_YES;
}

static enum spl_select_answer take_page(void *context, uint32_t page)
{
    (void)context;
    (void)page;
    return SPL_SELECT_YES;
}

static void a_walk_reads_the_heads_that_it_comes_to(void **state)
{
    (void)state;
    struct spl_dataset *dataset = open_it();
    struct view view = {.dataset = dataset, .tables = calloc(file.pages, sizeof *view.tables)};
    struct spl_camera camera = {0};
    const double eye[3] = {1000.5, 1000.5, 1000.5}, target[3] = {1100, 1100, 960}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_set_fov(&camera, 40, 1280, 720, NULL), SPL_OK);
    assert_int_equal(spl_camera_look_at(&camera, eye, target, up, NULL), SPL_OK);
    camera.near = 1;
    camera.far = 20000;
    struct spl_select_params params = {.dataset = dataset,
                                       .camera = &camera,
                                       .lod = 4,
                                       .low_pass = (double)SPL_LOW_PASS,
                                       .discs = true,
                                       .tables = take_tables,
                                       .resident = take_page,
                                       .context = &view};
    struct spl_draw_list list = {0};
    file.heads_read = 0;
    uint64_t clock = spl_now_ns();
    assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
    double ms = (double)(spl_now_ns() - clock) * 1e-6;
    printf("a view: %u nodes, %llu heads read, %llu KiB, %.1f ms\n", list.nodes, (unsigned long long)file.heads_read,
           (unsigned long long)view.bytes >> 10, ms);
    bool depths[deepest + 1] = {false};
    uint32_t used = 0;
    for (uint32_t p = 0; p < file.pages; p++)
        for (uint32_t n = 0; view.tables[p] && n < view.tables[p]->node_count; n++, used += n == 1)
            depths[view.tables[p]->nodes[n].depth] = true;
    assert_true(list.complete && list.nodes > 20 && depths[deepest]); // down to leaves
    assert_int_equal(used, file.heads_read);
    assert_true(file.heads_read > 3 && file.heads_read < 45);
    spl_draw_list_finish(&list);
    for (uint32_t p = 0; p < file.pages; p++)
        free(view.tables[p]);
    free(view.tables);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_opens_within_what_tables_may_take),
        cmocka_unit_test(a_walk_reads_the_heads_that_it_comes_to),
    };
    return cmocka_run_group_tests(tests, make_file, free_file);
}
