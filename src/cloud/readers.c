/* The table of readers: which one a file needs, by its first bytes alone, in the order in which they are asked. A name's
 * ending decides nothing. Pure functions; any thread. */
#include "cloud/reader.h"

#include <string.h>

#include "cloud/fields.h"
#include "cloud/pcd.h"

enum { first_bytes = 4096 };

static bool begins_with(const uint8_t *bytes, size_t available, const char *text)
{
    size_t length = strlen(text);
    return available >= length && memcmp(bytes, text, length) == 0;
}

static bool is_ply(const uint8_t *bytes, size_t available)
{
    return begins_with(bytes, available, "ply") && (available == 3 || bytes[3] <= ' ');
}

static bool is_las(const uint8_t *bytes, size_t available)
{
    return begins_with(bytes, available, "LASF");
}

static bool is_pcd(const uint8_t *bytes, size_t available)
{
    return spl_pcd_is_header((const char *)bytes, available);
}

static bool is_text(const uint8_t *bytes, size_t available)
{
    for (size_t i = 0; i < available; i++)
        if ((bytes[i] < ' ' && !memchr("\t\n\f\r", bytes[i], 4)) || bytes[i] == 0x7f)
            return false;
    return true;
}

/* Its first two lines are one whole number each: the columns and rows of a station. */
static bool is_ptx(const uint8_t *bytes, size_t available)
{
    const char *p = (const char *)bytes, *end = p + available;
    for (int k = 0; k < 2; k++) {
        uint64_t ignored;
        while (p < end && memchr(" \t\r\n", *p, 4))
            p++;
        p = spl_integer_parse(p, end, &ignored);
        while (p && p < end && (*p == ' ' || *p == '\t'))
            p++;
        if (!p || (p < end && *p != '\r' && *p != '\n'))
            return false;
    }
    return is_text(bytes, available);
}

static const struct {
    const struct spl_cloud_reader *reader;
    bool (*is)(const uint8_t *bytes, size_t available);
} readers[] = {
    {&spl_ply_reader, is_ply},
    {&spl_las_reader, is_las},
    {&spl_pcd_reader, is_pcd},
    {&spl_ptx_reader, is_ptx},
    {&spl_text_reader, is_text},
};

int spl_cloud_find_reader(struct spl_source *source, const struct spl_cloud_reader **reader, struct spl_error *err)
{
    const uint8_t *bytes;
    size_t available, found = 0;
    int code = spl_source_peek(source, first_bytes, &bytes, &available, err);
    if (code < 0)
        return code;
    if (begins_with(bytes, available, "SPLD\r\n"))
        return spl_source_fail(source, SPL_E_INPUT, "", err,
                               "is packed already: \"splatd info\", \"splatd serve\" and \"splatd render\" take it as it "
                               "is; pack takes the scans that it was made of");
    if (begins_with(bytes, available, "ASTM-E57"))
        return spl_source_fail(source, SPL_E_UNSUPPORTED, "", err,
                               "is E57, which is not supported yet: convert it first, with \"pdal translate IN.e57 "
                               "OUT.las\" or CloudCompare");
    while (found < sizeof readers / sizeof *readers && !readers[found].is(bytes, available))
        found++;
    if (found == sizeof readers / sizeof *readers)
        return spl_source_fail(source, SPL_E_INPUT, "", err,
                               "is no point cloud known here (PLY, LAS, LAZ, PCD, PTX, PTS, or UTF-8 text with columns)");
    *reader = readers[found].reader;
    if ((*reader)->text && !memchr(bytes, '\n', available) && memchr(bytes, '\r', available))
        source->newline = '\r';
    return SPL_OK;
}
