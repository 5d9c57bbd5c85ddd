/* LAZ of any bytes, below the file: the first byte chooses a chunk, a table of chunks or the LASzip record, a few more
 * say what is told of it, the rest are its bytes. Whole files are for fuzz_las.c. Its corpus is made by make_laz.c. */
#include <stdio.h>
#include <stdlib.h>

#include "cloud/laz/decoder.h"
#include "cloud/laz/table.h"
#include "support/laz_writer.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

enum { head = 6, records_max = 3000 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void fuzz_chunk(const struct spl_laz_format *format, size_t count, uint32_t wanted, const uint8_t *data,
                       size_t size)
{
    struct spl_laz_decoder *decoder;
    struct spl_laz_fault fault = {0};
    require(spl_laz_decoder_create(format, &decoder, NULL) == 0);
    uint8_t *records = malloc(count * format->record_bytes + 1);
    int code = spl_laz_decoder_begin(decoder, data, size, wanted, &fault);
    for (size_t done = 0; code == 0 && done < count; done += 500)
        code = spl_laz_decoder_read(decoder, records + done * format->record_bytes,
                                    count - done < 500 ? count - done : 500, &fault);
    if (code == 0)
        require(spl_laz_decoder_used(decoder) <= size);
    if (code == 0)
        code = spl_laz_decoder_end(decoder, false, &fault);
    require(code == 0 || (code == SPL_E_INPUT && fault.field && fault.reason[0] && fault.at <= size));
    free(records);
    spl_laz_decoder_destroy(decoder);
}

static void fuzz_table(const struct spl_laz_format *format, uint64_t points, const uint8_t *data, size_t size)
{
    struct spl_laz_table table;
    struct spl_laz_fault fault = {0};
    uint64_t end = 100 + points * format->record_bytes, at = 100, sum = 0;
    if (spl_laz_table_read(&table, data, size, format, 100, end, points, &fault, NULL) < 0) {
        require(fault.reason[0] && table.chunks == NULL);
        return;
    }
    for (size_t i = 0; i < table.count; i++) {
        require(table.chunks[i].at == at && table.chunks[i].first == sum);
        at += table.chunks[i].bytes;
        sum += table.chunks[i].points;
    }
    require(at <= end && sum == points && table.count <= points * 1ull + (format->chunk_points == 0) * end);
    spl_laz_table_finish(&table);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < head)
        return 0;
    unsigned points = data[1] % 11, version = (points < 6 ? 1 : 3) + data[2] % 2u, extra = data[3] % 5;
    size_t count = 1 + (data[4] | data[5] << 8) % records_max;
    struct spl_laz_format format = laz_format(points, extra, version, data[2] & 2 ? 1 + data[4] : 0);
    struct spl_laz_fault fault;
    uint32_t wanted = data[2] & 4 ? SPL_LAZ_WANT_ALL : SPL_LAZ_WANT_Z | SPL_LAZ_WANT_COLOR;
    switch (data[0] % 3) {
    case 0:
        fuzz_chunk(&format, count, wanted, data + head, size - head);
        break;
    case 1:
        fuzz_table(&format, count, data + head, size - head);
        break;
    default:
        if (spl_laz_format_read(&format, data + head, size - head, points, format.record_bytes, &fault) == 0)
            fuzz_chunk(&format, 1, SPL_LAZ_WANT_ALL, data + head, size - head);
    }
    return 0;
}
