/* LAZ: chunks and files that tests write decode to their records, for every item, version and kind of table; layers
 * that nobody wants change nothing else; and bytes that are wrong are named, cost no memory and end. */
#include "laz_file.h"

#include "base/work.h"
#include "support/laz_writer.h"
#include "support/sanitised.h"

enum { records_max = 3000 };

static void decode(const struct spl_laz_format *format, const struct laz_out *chunk, const uint8_t *records,
                   size_t count, size_t slice, const char *what)
{
    struct spl_laz_decoder *d;
    struct spl_laz_fault fault = {0};
    size_t bytes = format->record_bytes;
    uint8_t *got = malloc(count * bytes);
    assert_int_equal(spl_laz_decoder_create(format, &d, NULL), 0);
    for (int again = 0; again < 2; again++) { /* nothing is left of the chunk before */
        int code = spl_laz_decoder_begin(d, chunk->bytes, chunk->count, SPL_LAZ_WANT_ALL, &fault);
        for (size_t at = 0; code == 0 && at < count; at += slice)
            code = spl_laz_decoder_read(d, got + at * bytes, count - at < slice ? count - at : slice, &fault);
        if (code == 0)
            code = spl_laz_decoder_end(d, false, &fault);
        if (code < 0)
            fail_msg("%s: %s: %s", what, fault.field, fault.reason);
        for (size_t i = 0; i < count * bytes; i++)
            if (got[i] != records[i])
                fail_msg("%s: byte %zu of record %zu of %zu is %u instead of %u", what, i % bytes, i / bytes, count,
                         got[i], records[i]);
    }
    spl_laz_decoder_destroy(d);
    free(got);
}

static void every_item_and_version(void **state)
{
    static const size_t counts[] = {1, 2, 3, 40, records_max};
    (void)state;
    skip_under_tsan();
    for (unsigned points = 0; points <= 10; points++)
        for (unsigned version = points < 6 ? 1 : 3; version <= (points < 6 ? 2u : 4u); version++)
            for (unsigned extra = 0; extra <= 3; extra += 3)
                for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
                    struct spl_laz_format format = laz_format(points, extra, version, 0);
                    uint8_t *records = laz_make_records(&format, counts[i], points + 100 * version);
                    struct laz_out chunk = laz_write_chunk(&format, records, counts[i], version);
                    char what[64];
                    snprintf(what, sizeof what, "format %u, version %u, %u extra bytes", points, version, extra);
                    decode(&format, &chunk, records, counts[i], 1 + counts[i] / 3, what);
                    free(chunk.bytes);
                    free(records);
                }
}

/* Reads a file in memory; the records must be `records`. */
static int read_file(const struct laz_out *file, const uint8_t *records, uint64_t count, unsigned threads,
                     struct spl_error *err)
{
    struct laz_file f;
    uint64_t done = 0;
    write_scratch(file->bytes, file->count);
    int code = laz_file_open(&f, scratch_path(), threads, err);
    while (code == 0) {
        const uint8_t *got;
        size_t n, bytes = f.format.record_bytes;
        code = spl_laz_stream_read(f.stream, SPL_LAZ_WANT_ALL, &got, 777, &n, err);
        if (code < 0 || n == 0)
            break;
        assert_true(done + n <= count);
        assert_memory_equal(got, records + done * bytes, n * bytes);
        done += n;
    }
    if (code == 0)
        assert_int_equal(done, count);
    if (code == 0 && count > 5000) { /* any place, in any order */
        for (uint64_t at = count; at > 0; at = at / 3) {
            const uint8_t *got;
            size_t n;
            spl_laz_stream_seek(f.stream, at - 1, at & 1);
            assert_int_equal(spl_laz_stream_read(f.stream, SPL_LAZ_WANT_ALL, &got, 1, &n, err), 0);
            assert_int_equal(n, 1);
            assert_memory_equal(got, records + (at - 1) * f.format.record_bytes, f.format.record_bytes);
        }
    }
    laz_file_close(&f);
    return code;
}

static void every_kind_of_table(void **state)
{
    static const uint32_t even[] = {2000, 2000, 2000, 900, 0}, odd[] = {1, 5000, 20, 1, 1878, 0}, one[] = {6900, 0};
    (void)state;
    for (unsigned points = 1; points <= 7; points += 6)
        for (int kind = 0; kind < (TEST_LOOKS_FOR_RACES ? 2 : 6); kind++) {
            static const enum laz_table tables[] = {LAZ_TABLE_USUAL, LAZ_TABLE_AT_END, LAZ_TABLE_MISSING,
                                                    LAZ_TABLE_USUAL, LAZ_TABLE_AT_END, LAZ_TABLE_USUAL};
            struct spl_error err = {0};
            struct spl_laz_format format = laz_format(points, 2, points < 6 ? 2 : 3, kind < 3 ? 2000 : 0);
            if (kind == 5 && points >= 6)
                continue;
            if (kind == 5)
                format.compressor = SPL_LAZ_STREAM;
            uint8_t *records = laz_make_records(&format, 6900, 5);
            struct laz_out file = laz_write_file(&format, points, records,
                                                 kind == 5  ? one
                                                 : kind < 3 ? even
                                                            : odd,
                                                 tables[kind]);
            for (unsigned threads = 1; threads <= 3; threads += 2)
                if (read_file(&file, records, 6900, threads, &err) < 0)
                    fail_msg("format %u, kind %d: %s", points, kind, err.message);
            free(file.bytes);
            free(records);
        }
}

static void layers_that_nobody_wants(void **state)
{
    struct spl_laz_format format = laz_format(8, 2, 3, 0);
    uint8_t *records = laz_make_records(&format, 500, 9), got[500 * 64];
    struct laz_out chunk = laz_write_chunk(&format, records, 500, 1);
    static const struct {
        uint32_t layer;
        unsigned at, bytes;
    } fields[] = {{SPL_LAZ_WANT_Z, 8, 4},      {SPL_LAZ_WANT_CLASS, 16, 1}, {SPL_LAZ_WANT_INTENSITY, 12, 2},
                  {SPL_LAZ_WANT_ANGLE, 18, 2}, {SPL_LAZ_WANT_USER, 17, 1},  {SPL_LAZ_WANT_SOURCE, 20, 2},
                  {SPL_LAZ_WANT_TIME, 22, 8},  {SPL_LAZ_WANT_COLOR, 30, 6}, {SPL_LAZ_WANT_INFRARED, 36, 2},
                  {SPL_LAZ_WANT_BYTES, 38, 2}};
    struct spl_laz_decoder *d;
    struct spl_laz_fault fault;
    (void)state;
    skip_under_tsan();
    assert_int_equal(spl_laz_decoder_create(&format, &d, NULL), 0);
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
        assert_int_equal(spl_laz_decoder_begin(d, chunk.bytes, chunk.count, fields[i].layer, &fault), 0);
        assert_int_equal(spl_laz_decoder_read(d, got, 500, &fault), 0);
        assert_int_equal(spl_laz_decoder_end(d, false, &fault), 0);
        for (size_t r = 0; r < 500; r++) {
            const uint8_t *now = got + r * format.record_bytes, *then = records + r * format.record_bytes;
            assert_memory_equal(now, then, 8);
            assert_int_equal(now[14], then[14]);
            for (size_t k = 0; k < sizeof fields / sizeof *fields; k++)
                assert_memory_equal(now + fields[k].at, (k == i ? then : records) + fields[k].at, fields[k].bytes);
        }
    }
    spl_laz_decoder_destroy(d);
    free(chunk.bytes);
    free(records);
}

/* What a chunk of `format` with `length` bytes says when `count` records are read from it. */
static void refused_chunk(const struct spl_laz_format *format, const uint8_t *bytes, size_t length, size_t count,
                          const char *field, const char *part)
{
    struct spl_laz_decoder *d;
    struct spl_laz_fault fault = {.field = ""};
    uint8_t *got = malloc(count * format->record_bytes), *exact = malloc(length + 1);
    memcpy(exact, bytes, length);
    assert_int_equal(spl_laz_decoder_create(format, &d, NULL), 0);
    int code = spl_laz_decoder_begin(d, exact, length, SPL_LAZ_WANT_ALL, &fault);
    if (code == 0)
        code = spl_laz_decoder_read(d, got, count, &fault);
    if (code == 0)
        code = spl_laz_decoder_end(d, false, &fault);
    if (code != SPL_E_INPUT || strcmp(fault.field, field) || !strstr(fault.reason, part) || fault.at > length)
        fail_msg("expected [%s] \"%s\", got %d [%s] \"%s\"", field, part, code, fault.field, fault.reason);
    spl_laz_decoder_destroy(d);
    free(exact);
    free(got);
}

static void wrong_chunks_are_named(void **state)
{
    struct spl_laz_format format = laz_format(3, 0, 2, 0), layered = laz_format(7, 0, 3, 0);
    uint8_t *records = laz_make_records(&format, 300, 1), *others = laz_make_records(&layered, 300, 1);
    struct laz_out chunk = laz_write_chunk(&format, records, 300, 1),
                   layers = laz_write_chunk(&layered, others, 300, 1);
    unsigned at = layered.record_bytes;
    (void)state;
    skip_under_tsan();
    refused_chunk(&format, chunk.bytes, 33, 300, "chunk", "33 bytes");
    refused_chunk(&format, chunk.bytes, chunk.count - 1, 300, "points", "end inside");
    refused_chunk(&format, chunk.bytes, chunk.count, 299, "chunk", "end here");
    refused_chunk(&format, chunk.bytes, chunk.count, 310, "points", "end inside");
    refused_chunk(&layered, layers.bytes, at + 4 + 39, 300, "chunk", "head of");
    refused_chunk(&layered, layers.bytes, layers.count - 1, 300, "colour", "left of the chunk");
    refused_chunk(&layered, layers.bytes, layers.count, 299, "points of the chunk", "1 more");
    refused_chunk(&layered, layers.bytes, layers.count, 301, "points of the chunk", "fewer");
    memset(layers.bytes + at + 4 + 4, 0xff, 4); /* z: nearly 2^32 bytes, and with the others a few in 32 bits */
    refused_chunk(&layered, layers.bytes, layers.count, 300, "z", "4294967295 bytes");
    free(chunk.bytes);
    free(layers.bytes);
    free(records);
    free(others);
}

static void wrong_tables_are_named_or_done_without(void **state)
{
    static const uint32_t even[] = {200, 200, 100, 0};
    (void)state;
    for (int fixed = 0; fixed < 2; fixed++)
        for (int spoil = 0; spoil < 4; spoil++) {
            struct spl_error err = {0};
            struct spl_laz_format format = laz_format(6, 0, 3, fixed ? 200 : 0);
            uint8_t *records = laz_make_records(&format, 500, 3);
            struct laz_out file = laz_write_file(&format, 6, records, even, LAZ_TABLE_USUAL);
            uint64_t start = spl_le_get32(file.bytes + 96), table = spl_le_get64(file.bytes + start);
            uint8_t *at = spoil == 0 ? file.bytes + start + 3
                                     : file.bytes + table +
                                           (spoil == 1   ? 0
                                            : spoil == 2 ? 7
                                                         : 4);
            *at += spoil == 3 ? 1 : 0x40; /* beyond the file; version; 2^30 chunks; one more */
            int code = read_file(&file, records, 500, 2, &err);
            if (fixed ? code != 0 : code != SPL_E_INPUT || !strstr(err.message, "chunk table"))
                fail_msg("%d %d: %d %s", fixed, spoil, code, err.message);
            free(file.bytes);
            free(records);
        }
}

/* A file of point format 3 or 7 whose chunks have 2000 points and whose colours are all `low`, but for a `high` red at
 * `bright` (if it is below `count`). */
enum { colored = 12000, no_point = colored };

static void write_colored(unsigned points, uint16_t low, uint16_t high, size_t bright)
{
    static const uint32_t chunks[] = {2000, 2000, 2000, 2000, 2000, 2000, 0};
    struct spl_laz_format format = laz_format(points, 0, points < 6 ? 2 : 3, 2000);
    uint8_t *records = laz_make_records(&format, colored, 11);
    for (size_t i = 0; i < colored; i++)
        for (unsigned k = 0; k < 3; k++)
            spl_laz_put16(records + i * format.record_bytes + (points < 6 ? 28 : 30) + 2 * k,
                          i == bright && k == 0 ? high : low);
    struct laz_out file = laz_write_file(&format, points, records, chunks, LAZ_TABLE_USUAL);
    write_scratch(file.bytes, file.count);
    free(file.bytes);
    free(records);
}

/* All colours of the file; how often reading began again. */
static unsigned read_colors(bool sample, uint8_t (*colors)[3], struct spl_cloud_info *info)
{
    const struct spl_cloud_options options = {.sample_colors = sample};
    struct spl_cloud *cloud;
    struct spl_point_batch batch;
    struct spl_error err = {0};
    size_t count = 0;
    unsigned again = 0;
    int code;
    assert_int_equal(spl_point_batch_init(&batch, 999, NULL), 0);
    assert_int_equal(spl_cloud_open(scratch_path(), &options, &cloud, &err), 0);
    while ((code = spl_cloud_read(cloud, &batch, &err)) > 0) {
        again += code == SPL_CLOUD_AGAIN;
        count = code == SPL_CLOUD_AGAIN ? 0 : count;
        assert_true(code == SPL_CLOUD_AGAIN ? batch.count == 0 : count + batch.count <= colored);
        memcpy(colors + count, batch.color, batch.count * sizeof *colors);
        count += batch.count;
    }
    if (code < 0)
        fail_msg("%s", err.message);
    assert_int_equal(count, colored);
    *info = *spl_cloud_get_info(cloud);
    spl_cloud_destroy(cloud);
    spl_point_batch_finish(&batch);
    return again;
}

/* What a caller that can begin again gets is what one gets that has all colours looked at first. */
static void sampled_colors_are_the_same(void **state)
{
    static const struct {
        uint16_t low, high;
        size_t bright;
        bool again;
    } rows[] = {{7, 30000, 9000, true},    {7, 256, colored - 1, true}, {7, 30000, 10, false},
                {7, 255, 9000, false},     {0, 30000, 9000, false},     {0, 9, 9000, false},
                {0, 0, no_point, false},   {7, 1000, 9000, true},       {700, 1000, 9000, false},
                {700, 3000, 9000, false},  {300, 1000, 9000, false},    {300, 400, 9000, false},
                {3000, 30000, 9000, false}};
    static uint8_t whole[colored][3], sampled[colored][3];
    (void)state;
    for (size_t i = 0; i < (TEST_LOOKS_FOR_RACES ? 1 : sizeof rows / sizeof *rows); i++)
        for (unsigned points = 3; points <= 7; points += 4) {
            struct spl_cloud_info info, of_sample;
            write_colored(points, rows[i].low, rows[i].high, rows[i].bright);
            assert_int_equal(read_colors(false, whole, &info), 0);
            unsigned again = read_colors(true, sampled, &of_sample);
            if (again != rows[i].again)
                fail_msg("%zu: reading began again %u times", i, again);
            assert_memory_equal(whole, sampled, sizeof whole);
            assert_memory_equal(info.points_from, of_sample.points_from, sizeof info.points_from);
            assert_true(info.colors.white == of_sample.colors.white && info.colors.from == of_sample.colors.from);
            assert_int_equal(info.colors.blank, of_sample.colors.blank);
            assert_int_equal(info.points_skipped, of_sample.points_skipped);
        }
}

/* Wherever reading goes on, it is with the points that lie there; of chunks that can only be found one after the other
 * it cannot be said where. */
static void rows_are_gone_to(void **state)
{
    static const uint32_t chunks[] = {2000, 2000, 2000, 2000, 2000, 2000, 0};
    static const uint64_t rows[] = {0, 1, 5999, 2000, 11999, 3, 12000, 4100, 4100};
    (void)state;
    for (int table = LAZ_TABLE_USUAL; table <= LAZ_TABLE_MISSING; table += LAZ_TABLE_MISSING - LAZ_TABLE_USUAL) {
        struct spl_laz_format format = laz_format(3, 0, 2, 2000);
        uint8_t *records = laz_make_records(&format, colored, 12);
        struct laz_out file = laz_write_file(&format, 3, records, chunks, (enum laz_table)table);
        struct spl_cloud *cloud;
        struct spl_point_batch all, some;
        struct spl_error err = {0};
        write_scratch(file.bytes, file.count);
        assert_int_equal(spl_point_batch_init(&all, colored, NULL), 0);
        assert_int_equal(spl_point_batch_init(&some, 700, NULL), 0);
        if (spl_cloud_open(scratch_path(), NULL, &cloud, &err) || spl_cloud_read(cloud, &all, &err) != 1)
            fail_msg("%s", err.message);
        assert_int_equal(all.count, colored);
        assert_int_equal(spl_cloud_get_info(cloud)->rows, table == LAZ_TABLE_USUAL ? colored : 0);
        for (size_t i = 0; table == LAZ_TABLE_USUAL && i < sizeof rows / sizeof *rows; i++) {
            const size_t left = colored - (size_t)rows[i], wanted = left < 700 ? left : 700;
            assert_int_equal(spl_cloud_seek(cloud, rows[i], &err), 0);
            assert_int_equal(spl_cloud_read(cloud, &some, &err), wanted > 0);
            assert_int_equal(some.count, wanted);
            assert_memory_equal(some.position, all.position + rows[i], wanted * sizeof *some.position);
            assert_memory_equal(some.color, all.color + rows[i], wanted * sizeof *some.color);
        }
        spl_cloud_destroy(cloud);
        spl_point_batch_finish(&all);
        spl_point_batch_finish(&some);
        free(file.bytes);
        free(records);
    }
}

/* In the middle of a file, of chunks side by side and one after the other. */
static void reading_is_cancelled(void **state)
{
    static const uint32_t chunks[] = {2000, 2000, 2000, 2000, 2000, 2000, 0};
    (void)state;
    for (int table = LAZ_TABLE_USUAL; table <= LAZ_TABLE_MISSING; table += LAZ_TABLE_MISSING - LAZ_TABLE_USUAL) {
        struct spl_laz_format format = laz_format(3, 0, 2, 2000);
        uint8_t *records = laz_make_records(&format, colored, 12);
        struct laz_out file = laz_write_file(&format, 3, records, chunks, (enum laz_table)table);
        atomic_bool cancelled = false;
        const struct spl_cloud_options options = {.threads = 1, .cancelled = &cancelled};
        struct spl_cloud *cloud;
        struct spl_point_batch batch;
        struct spl_error err = {0};
        size_t count = 0;
        int code;
        write_scratch(file.bytes, file.count);
        assert_int_equal(spl_point_batch_init(&batch, 500, NULL), 0);
        assert_int_equal(spl_cloud_open(scratch_path(), &options, &cloud, &err), 0);
        while ((code = spl_cloud_read(cloud, &batch, &err)) > 0) {
            count += batch.count;
            atomic_store(&cancelled, true);
        }
        assert_int_equal(code, SPL_E_CANCELLED);
        assert_in_range(count, 500, colored / 2);
        spl_cloud_destroy(cloud);
        assert_int_equal(spl_cloud_open(scratch_path(), &options, &cloud, &err), SPL_E_CANCELLED);
        spl_point_batch_finish(&batch);
        free(file.bytes);
        free(records);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_item_and_version),
        cmocka_unit_test(every_kind_of_table),
        cmocka_unit_test(layers_that_nobody_wants),
        cmocka_unit_test(wrong_chunks_are_named),
        cmocka_unit_test(wrong_tables_are_named_or_done_without),
        cmocka_unit_test(sampled_colors_are_the_same),
        cmocka_unit_test(rows_are_gone_to),
        cmocka_unit_test(reading_is_cancelled),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
