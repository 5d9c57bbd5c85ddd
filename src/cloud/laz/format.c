/* The VLR of LAZ files. A wrong one is refused here, so that everything behind trusts sizes and versions.
 *
 * Invariant: items of a format that was read are those of its point format, in order, and fill the record. Pure. */
#include "cloud/laz/format.h"

#include <stdarg.h>
#include <stdio.h>

#include "cloud/little.h"

enum { head_bytes = 34, item_bytes = 6, at_coder = 2, at_chunk = 12, at_count = 32 };
static const uint32_t variable_chunks = UINT32_MAX;

static const struct {
    const char *name;
    uint8_t bytes, versions[2]; /* 0 bytes: at least one */
} kinds[] = {
    [SPL_LAZ_BYTE] = {"BYTE", 0, {1, 2}},
    [SPL_LAZ_POINT10] = {"POINT10", 20, {1, 2}},
    [SPL_LAZ_GPSTIME11] = {"GPSTIME11", 8, {1, 2}},
    [SPL_LAZ_RGB12] = {"RGB12", 6, {1, 2}},
    [SPL_LAZ_WAVEPACKET13] = {"WAVEPACKET13", 29, {1, 1}},
    [SPL_LAZ_POINT14] = {"POINT14", 30, {3, 4}},
    [SPL_LAZ_RGB14] = {"RGB14", 6, {3, 4}},
    [SPL_LAZ_RGBNIR14] = {"RGBNIR14", 8, {3, 4}},
    [SPL_LAZ_WAVEPACKET14] = {"WAVEPACKET14", 29, {3, 4}},
    [SPL_LAZ_BYTE14] = {"BYTE14", 0, {3, 4}},
};

/* Of each point format, but for extra bytes. Kinds end with 0. */
static const uint8_t items_of[11][4] = {
    {SPL_LAZ_POINT10},
    {SPL_LAZ_POINT10, SPL_LAZ_GPSTIME11},
    {SPL_LAZ_POINT10, SPL_LAZ_RGB12},
    {SPL_LAZ_POINT10, SPL_LAZ_GPSTIME11, SPL_LAZ_RGB12},
    {SPL_LAZ_POINT10, SPL_LAZ_GPSTIME11, SPL_LAZ_WAVEPACKET13},
    {SPL_LAZ_POINT10, SPL_LAZ_GPSTIME11, SPL_LAZ_RGB12, SPL_LAZ_WAVEPACKET13},
    {SPL_LAZ_POINT14},
    {SPL_LAZ_POINT14, SPL_LAZ_RGB14},
    {SPL_LAZ_POINT14, SPL_LAZ_RGBNIR14},
    {SPL_LAZ_POINT14, SPL_LAZ_WAVEPACKET14},
    {SPL_LAZ_POINT14, SPL_LAZ_RGBNIR14, SPL_LAZ_WAVEPACKET14},
};

int spl_laz_fail(struct spl_laz_fault *fault, int code, uint64_t at, const char *field, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fault->at = at;
    fault->field = field;
    vsnprintf(fault->reason, sizeof fault->reason, format, arguments);
    va_end(arguments);
    return code;
}

static int read_item(struct spl_laz_format *format, const uint8_t *bytes, size_t at, unsigned points,
                     struct spl_laz_fault *fault)
{
    unsigned kind = spl_le_get16(bytes), size = spl_le_get16(bytes + 2), version = spl_le_get16(bytes + 4);
    unsigned index = format->item_count, extra = points < 6 ? SPL_LAZ_BYTE : SPL_LAZ_BYTE14;
    unsigned wanted = index < 4 && items_of[points][index] ? items_of[points][index] : extra;
    if (index > 0 && format->items[index - 1].kind == extra)
        return spl_laz_fail(fault, SPL_E_INPUT, at, "item type", "an item follows the extra bytes");
    if (kind != wanted)
        return spl_laz_fail(fault, SPL_E_INPUT, at, "item type", "%u; item %u of point format %u is %u (%s)", kind,
                            index + 1, points, wanted, kinds[wanted].name);
    if (kinds[kind].bytes ? size != kinds[kind].bytes : size == 0)
        return spl_laz_fail(fault, SPL_E_INPUT, at + 2, "item size", "%s has %u bytes, not %u", kinds[kind].name,
                            kinds[kind].bytes, size);
    if (version != kinds[kind].versions[0] && version != kinds[kind].versions[1])
        return spl_laz_fail(fault, SPL_E_UNSUPPORTED, at + 4, "item version", "%u of %s is not known here (%u, %u)",
                            version, kinds[kind].name, kinds[kind].versions[0], kinds[kind].versions[1]);
    unsigned before = index ? format->items[index - 1].at + format->items[index - 1].bytes : 0u;
    if (before + size > format->record_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, at + 2, "item size", "items take more than the record's %u bytes",
                            format->record_bytes);
    format->items[index] = (struct spl_laz_item){
        .kind = (uint8_t)kind, .version = (uint8_t)version, .bytes = (uint16_t)size, .at = (uint16_t)before};
    format->item_count++;
    return SPL_OK;
}

int spl_laz_format_read(struct spl_laz_format *format, const uint8_t *bytes, size_t length, unsigned points,
                        unsigned record_bytes, struct spl_laz_fault *fault)
{
    *format = (struct spl_laz_format){.record_bytes = record_bytes};
    if (length < head_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, 0, "LASzip record", "%zu bytes are fewer than its %d", length,
                            head_bytes);
    unsigned compressor = spl_le_get16(bytes), coder = spl_le_get16(bytes + at_coder),
             count = spl_le_get16(bytes + at_count), expected = 0;
    if (compressor < SPL_LAZ_STREAM || compressor > SPL_LAZ_LAYERS)
        return spl_laz_fail(fault, SPL_E_UNSUPPORTED, 0, "compressor", "%u is not known here (1, 2 and 3 are)",
                            compressor);
    if ((compressor == SPL_LAZ_LAYERS) != (points >= 6))
        return spl_laz_fail(fault, SPL_E_INPUT, 0, "compressor", "%u does not go with point format %u", compressor,
                            points);
    if (coder != 0)
        return spl_laz_fail(fault, SPL_E_UNSUPPORTED, at_coder, "coder", "%u is not known here (0 is)", coder);
    while (expected < 4 && items_of[points][expected])
        expected++;
    if (count < expected || count > expected + 1)
        return spl_laz_fail(fault, SPL_E_INPUT, at_count, "number of items", "%u; point format %u has %u or %u", count,
                            points, expected, expected + 1);
    if (length < head_bytes + (size_t)count * item_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, at_count, "number of items", "%u do not fit the record's %zu bytes",
                            count, length);
    format->compressor = (uint8_t)compressor;
    format->chunk_points = spl_le_get32(bytes + at_chunk);
    if (format->chunk_points == variable_chunks)
        format->chunk_points = 0;
    for (unsigned i = 0; i < count; i++) {
        size_t at = head_bytes + (size_t)i * item_bytes;
        int code = read_item(format, bytes + at, at, points, fault);
        if (code < 0)
            return code;
    }
    const struct spl_laz_item *last = &format->items[count - 1];
    if (last->at + last->bytes != (int)record_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, at_count, "items", "add up to %d bytes, but a record has %u",
                            last->at + last->bytes, record_bytes);
    return SPL_OK;
}
