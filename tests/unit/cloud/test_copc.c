/* COPC: a part of the points is whole coarse levels, and only their chunks are read; a hierarchy that is wrong in any
 * way is named and done without. Other files give as many as are wanted. */
#include "laz_file.h"

#include "base/memory.h"
#include "cloud/copc.h"
#include "support/laz_writer.h"

enum { CHUNKS = 5, POINTS = 105, HEADER = 375, RECORD = 54 + SPL_COPC_INFO_BYTES, ENTRY = 32 };
static const uint32_t chunk_points[CHUNKS + 1] = {5, 20, 30, 40, 10, 0};
static const int chunk_level[CHUNKS] = {1, 0, 2, 1, 2}; /* chunks of two levels lie apart */
static const size_t chunk_first[CHUNKS] = {0, 5, 25, 55, 95};

struct node {
    int32_t level, at[3];
    uint64_t offset;
    int32_t bytes, points;
};

/* A file whose root page has the node of chunk 1 and a page with the others. */
struct copc {
    struct bytes b;
    uint64_t root, child; /* offsets of the pages */
    struct spl_laz_chunk chunk[CHUNKS];
};

static void put_node(struct bytes *b, struct node node)
{
    put(b, &node, sizeof node);
}

static struct node node_of(const struct copc *c, unsigned chunk)
{
    return (struct node){.level = chunk_level[chunk],
                         .offset = c->chunk[chunk].at,
                         .bytes = (int32_t)c->chunk[chunk].bytes,
                         .points = (int32_t)c->chunk[chunk].points};
}

static void read_chunks(struct copc *c)
{
    struct laz_file f;
    write_scratch(c->b.data, c->b.length);
    assert_int_equal(laz_file_open(&f, scratch_path(), 1, NULL), 0);
    const struct spl_laz_table *table = spl_laz_stream_get_table(f.stream);
    assert_int_equal(table->count, CHUNKS);
    memcpy(c->chunk, table->chunks, sizeof c->chunk);
    laz_file_close(&f);
}

static void build(struct copc *c)
{
    static const uint8_t record[54] = {0, 0, 'c', 'o', 'p', 'c', [18] = 1, [20] = SPL_COPC_INFO_BYTES};
    struct spl_laz_format format = laz_format(7, 0, 3, 0);
    uint8_t *records = laz_make_records(&format, POINTS, 1), info[SPL_COPC_INFO_BYTES] = {0};
    struct laz_out file = laz_write_file(&format, 7, records, chunk_points, LAZ_TABLE_USUAL);
    struct bytes *b = &c->b;
    uint64_t points_at = spl_le_get32(file.bytes + 96) + RECORD, table_at;
    uint32_t count = spl_le_get32(file.bytes + 100) + 1;
    b->length = 0;
    put(b, file.bytes, HEADER);
    put(b, record, sizeof record);
    put(b, info, sizeof info);
    put(b, file.bytes + HEADER, file.count - HEADER);
    memcpy(b->data + 96, &points_at, 4);
    memcpy(b->data + 100, &count, 4);
    table_at = spl_le_get64(b->data + points_at) + RECORD;
    memcpy(b->data + points_at, &table_at, 8);
    read_chunks(c);
    c->child = b->length;
    for (unsigned i = 0; i < CHUNKS; i++)
        if (i != 1)
            put_node(b, node_of(c, i));
    put_node(b, (struct node){.level = 1, .at = {1, 1, 1}}); /* without points */
    c->root = b->length;
    put_node(b, node_of(c, 1));
    put_node(b, (struct node){.level = 1, .offset = c->child, .bytes = CHUNKS * ENTRY, .points = -1});
    memcpy(b->data + HEADER + 54 + 40, &c->root, 8);
    memcpy(b->data + HEADER + 54 + 48, &(uint64_t){2 * ENTRY}, 8);
    free(records);
    free(file.bytes);
}

/* Positions of at most `most` points, at most POINTS of them; info.points_total in *total. */
static size_t load(const char *path, uint64_t most, double position[POINTS][3], uint64_t *total)
{
    const struct spl_cloud_options options = {.max_points = most};
    struct spl_cloud *cloud;
    struct spl_error err = {0};
    struct spl_point_batch batch;
    size_t count = 0;
    int code;
    assert_int_equal(spl_point_batch_init(&batch, 7, NULL), 0);
    if (spl_cloud_open(path, &options, &cloud, &err))
        fail_msg("%s", err.message);
    uint64_t expected = spl_cloud_get_info(cloud)->points_expected;
    while ((code = spl_cloud_read(cloud, &batch, &err)) > 0) {
        assert_true(count + batch.count <= POINTS);
        memcpy(position[count], batch.position, batch.count * sizeof batch.position[0]);
        count += batch.count;
    }
    if (code)
        fail_msg("%s", err.message);
    assert_true(expected == 0 || expected == count);
    *total = spl_cloud_get_info(cloud)->points_total;
    spl_cloud_destroy(cloud);
    spl_point_batch_finish(&batch);
    return count;
}

static size_t load_built(const struct copc *c, uint64_t most, double position[POINTS][3])
{
    uint64_t total;
    write_scratch(c->b.data, c->b.length);
    size_t count = load(scratch_path(), most, position, &total);
    assert_int_equal(total, POINTS);
    return count;
}

/* Whether point `i` is among `most` of `total`, as evenly as they can be. */
static bool is_given(uint64_t i, uint64_t most, uint64_t total)
{
    return i == 0 || i * most / total > (i - 1) * most / total;
}

static void whole_levels(void **state)
{
    static const struct {
        uint64_t most;
        unsigned levels;
        size_t points;
    } rows[] = {{1000, 3, 105}, {105, 3, 105}, {104, 2, 65}, {65, 2, 65}, {64, 1, 20}, {20, 1, 20}};
    static struct copc c;
    double all[POINTS][3], part[POINTS][3];
    (void)state;
    build(&c);
    assert_int_equal(load_built(&c, 0, all), POINTS);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        size_t n = 0;
        assert_int_equal(load_built(&c, rows[i].most, part), rows[i].points);
        for (unsigned chunk = 0; chunk < CHUNKS; chunk++)
            for (size_t p = 0; chunk_level[chunk] < (int)rows[i].levels && p < chunk_points[chunk]; p++)
                assert_memory_equal(part[n++], all[chunk_first[chunk] + p], sizeof part[0]);
        assert_int_equal(n, rows[i].points);
    }
    for (uint64_t most = 1; most < 20; most++) { /* of the first level, so many */
        size_t n = 0;
        assert_int_equal(load_built(&c, most, part), most);
        for (size_t p = 0; p < 20; p++)
            if (is_given(p, most, 20))
                assert_memory_equal(part[n++], all[chunk_first[1] + p], sizeof part[0]);
        assert_int_equal(n, most);
    }
}

static void other_chunks_are_not_read(void **state)
{
    static struct copc c;
    double all[POINTS][3], part[POINTS][3];
    (void)state;
    build(&c);
    load_built(&c, 0, all);
    for (unsigned chunk = 0; chunk < CHUNKS; chunk++)
        if (chunk_level[chunk] > 0)
            memset(c.b.data + c.chunk[chunk].at, 0xff, c.chunk[chunk].bytes);
    assert_int_equal(load_built(&c, 20, part), 20);
    assert_memory_equal(part, all[chunk_first[1]], 20 * sizeof part[0]);
    struct loaded l;
    load_bytes(&c.b, NULL, 100, &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    loaded_finish(&l);
}

/* The fault of the hierarchy in the scratch file. */
static void find_fault(const struct copc *c, struct spl_laz_fault *fault)
{
    struct laz_file f;
    struct spl_copc_levels levels;
    struct spl_error err = {0};
    write_scratch(c->b.data, c->b.length);
    assert_int_equal(laz_file_open(&f, scratch_path(), 1, NULL), 0);
    *fault = (struct spl_laz_fault){0};
    int code = spl_copc_read_levels(&levels, &f.source, c->b.data + HEADER + 54, HEADER + 54,
                                    spl_laz_stream_get_table(f.stream), fault, &err);
    assert_int_equal(code, SPL_E_INPUT);
    assert_int_equal(err.code, 0);
    assert_null(levels.level);
    laz_file_close(&f);
}

static void wrong_hierarchies_are_done_without(void **state)
{
    static struct copc good, c;
    double all[POINTS][3], part[POINTS][3];
    (void)state;
    build(&good);
    load_built(&good, 0, all);
    const uint64_t info = HEADER + 54 + 40, root = good.root, child = good.child;
    const struct {
        uint64_t at, value;
        unsigned bytes;
        uint64_t fault_at;
        const char *part;
    } rows[] = {
        {info, UINT64_MAX - 63, 8, info, "a page of 64 bytes at 18446744073709551552; the file has"},
        {info, good.b.length, 8, info, "a page of 64 bytes at"},
        {info + 8, 0, 8, info, "a page of 0 bytes"},
        {info + 8, 63, 8, info, "a page of 63 bytes"},
        {info + 8, UINT64_MAX - 31, 8, info, "a page of 18446744073709551584 bytes"},
        {info + 8, 32, 8, info, "4 of 5 chunks are no node's"},
        {root + ENTRY + 16, root, 8, root + ENTRY + 16, "a page of 160 bytes"},
        {root + ENTRY + 16, root + ENTRY, 8, root + ENTRY + 16, "a page of 160 bytes"},
        {root + ENTRY + 24, UINT32_MAX - 31, 4, root + ENTRY + 16, "a page of 4294967264 bytes"},
        {child, 32, 4, child, "a node of level 32"},
        {child, UINT32_MAX, 4, child, "a node of level -1"},
        {child + 16, 7, 8, child + 16, "bytes at 7, where there is no such chunk"},
        {child + 16, good.chunk[1].at, 8, child + 16, "where there is no such chunk"},
        {child + 24, 1, 4, child + 16, "a node of 5 points in 1 bytes at"},
        {child + 28, 6, 4, child + 16, "a node of 6 points in"},
        {child + 28, 0, 4, info, "1 of 5 chunks are no node's"},
        {child + 28, (uint32_t)-2, 4, child + 28, "a node of -2 points"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_laz_fault fault;
        c = good;
        memcpy(c.b.data + rows[i].at, &rows[i].value, rows[i].bytes);
        find_fault(&c, &fault);
        if (!strstr(fault.reason, rows[i].part) || fault.at != rows[i].fault_at)
            fail_msg("row %zu: offset %llu instead of %llu: %s", i, (unsigned long long)fault.at,
                     (unsigned long long)rows[i].fault_at, fault.reason);
        assert_int_equal(load_built(&c, 0, part), POINTS);
        assert_memory_equal(part, all, sizeof all);
        assert_int_equal(load_built(&c, 35, part), 35); /* each third */
        for (size_t p = 0; p < 35; p++)
            assert_memory_equal(part[p], all[3 * p], sizeof part[0]);
    }
    /* a page that leads to itself, with a node and without one */
    struct spl_laz_fault fault;
    c = good;
    struct node again = {.offset = root, .bytes = 2 * ENTRY, .points = -1};
    memcpy(c.b.data + root + ENTRY, &again, sizeof again);
    find_fault(&c, &fault);
    assert_non_null(strstr(fault.reason, "is named twice: pages lead in a circle"));
    memcpy(c.b.data + root, &again, sizeof again);
    find_fault(&c, &fault);
    assert_non_null(strstr(fault.reason, "far more nodes than the 5 chunks"));
}

static void memory_refused_at_any_allocation(void **state)
{
    static struct copc c;
    const struct spl_cloud_options options = {.max_points = 20};
    (void)state;
    build(&c);
    write_scratch(c.b.data, c.b.length);
    for (long n = 1;; n++) {
        struct spl_cloud *cloud = NULL;
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int code = spl_cloud_open(scratch_path(), &options, &cloud, &err);
        spl_memory_fail_after(0);
        spl_cloud_destroy(cloud);
        assert_in_range(n, 1, 40);
        assert_int_equal(code, err.code);
        if (code == 0)
            break;
        assert_int_equal(code, SPL_E_NOMEM);
    }
}

/* Formats without levels, whether or not a header counts their points. */
static void so_many_of_other_files(void **state)
{
    static const char *const heads[] = {"", "105\n", "60\n", "# .PCD v.7\nFIELDS x y z\nWIDTH 105\nDATA ascii\n",
                                        ("ply\nformat ascii 1.0\nelement vertex 105\nproperty int x\nproperty int y\n"
                                         "property int z\nend_header\n")};
    (void)state;
    for (size_t h = 0; h < sizeof heads / sizeof *heads; h++)
        for (uint64_t most = 1; most < 120; most += 13) {
            static struct bytes b;
            double part[POINTS][3];
            uint64_t total;
            b.length = 0;
            put_text(&b, "%s", heads[h]);
            for (int i = 0; i < POINTS; i++)
                put_text(&b, "%s%d %d %d\n", h == 2 && i == 60 ? "45\n" : "", i, 2 * i, 3 * i); /* PTS of two blocks */
            write_scratch(b.data, b.length);
            size_t n = 0, given = most < POINTS ? most : POINTS;
            assert_int_equal(load(scratch_path(), most, part, &total), given);
            assert_int_equal(total, POINTS);
            for (uint64_t i = 0; i < POINTS; i++)
                if (is_given(i, given, POINTS)) {
                    assert_true(part[n][0] == (double)i && part[n][2] == (double)(3 * i));
                    n++;
                }
            assert_int_equal(n, given);
        }
}

/* Sums by level of the reference, and that a part is of the whole. */
static void real_files(void **state)
{
    static const struct {
        const char *path;
        uint64_t most, points;
    } rows[] = {{"copc/lone-star.copc.laz", 50000, 0},
                {"interchange/copc/simple_with_page.copc.laz", 500, 0},
                {"interchange/bad/copc-hier-loop.copc.laz", 0, 1065},
                {"interchange/bad/copc-root-past-eof.copc.laz", 0, 1065}};
    const char *data = getenv("SPLATD_DATA");
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct loaded l;
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", data ? data : "", rows[i].path);
        if (!data || access(path, R_OK))
            skip();
        if (rows[i].points) {
            load_path(path, NULL, 100, &l);
            assert_int_equal(l.code, 0);
            assert_int_equal(l.points, rows[i].points);
            loaded_finish(&l);
            continue;
        }
        struct laz_file f;
        struct spl_copc_levels levels;
        struct spl_laz_fault fault;
        const uint8_t *info;
        size_t available;
        uint64_t sum = 0;
        assert_int_equal(laz_file_open(&f, path, 1, NULL), 0);
        spl_source_seek(&f.source, 0);
        assert_int_equal(spl_source_peek(&f.source, 1024, &info, &available, NULL), 0);
        if (spl_copc_read_levels(&levels, &f.source, info + 429, 429, spl_laz_stream_get_table(f.stream), &fault, NULL))
            fail_msg("%s: %s", path, fault.reason);
        for (unsigned level = 0; level < SPL_COPC_LEVELS; level++)
            sum += levels.points[level];
        assert_int_equal(sum, f.points);
        assert_true(levels.points[0] > 0 && levels.points[0] < sum);
        spl_copc_levels_finish(&levels);
        laz_file_close(&f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_levels),
        cmocka_unit_test(other_chunks_are_not_read),
        cmocka_unit_test(wrong_hierarchies_are_done_without),
        cmocka_unit_test(memory_refused_at_any_allocation),
        cmocka_unit_test(so_many_of_other_files),
        cmocka_unit_test(real_files),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
