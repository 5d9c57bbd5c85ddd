/* Which reader a file needs, by its first bytes, and the loop that turns its rows into batches.
 * Owned by one thread at a time; two clouds share nothing. */
#include "cloud/cloud.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/reader.h"

int spl_point_batch_init(struct spl_point_batch *batch, size_t capacity, struct spl_error *err)
{
    *batch = (struct spl_point_batch){.capacity = capacity};
    batch->position = spl_alloc(capacity, sizeof *batch->position, err);
    batch->color = spl_alloc(capacity, sizeof *batch->color, err);
    batch->normal = spl_alloc(capacity, sizeof *batch->normal, err);
    batch->classification = spl_alloc(capacity, sizeof *batch->classification, err);
    batch->station = spl_alloc(capacity, sizeof *batch->station, err);
    if (batch->position && batch->color && batch->normal && batch->classification && batch->station)
        return SPL_OK;
    spl_point_batch_finish(batch);
    return SPL_E_NOMEM;
}

void spl_point_batch_finish(struct spl_point_batch *batch)
{
    free(batch->position);
    free(batch->color);
    free(batch->normal);
    free(batch->classification);
    free(batch->station);
    *batch = (struct spl_point_batch){0};
}

static bool begins_with(const uint8_t *bytes, size_t available, const char *text)
{
    size_t length = strlen(text);
    return available >= length && memcmp(bytes, text, length) == 0;
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
    return true;
}

static int find_reader(struct spl_source *source, const struct spl_reader **reader, struct spl_error *err)
{
    const uint8_t *bytes;
    size_t available;
    int code = spl_source_peek(source, 4096, &bytes, &available, err);
    if (code < 0)
        return code;
    if (begins_with(bytes, available, "ply") && (available == 3 || bytes[3] <= ' '))
        *reader = &spl_ply_reader;
    else if (begins_with(bytes, available, "LASF"))
        *reader = &spl_las_reader;
    else if (begins_with(bytes, available, "SPLD\r\n"))
        return spl_source_fail(source, SPL_E_INPUT, "", err,
                               "is packed already: \"splatd info\", \"splatd serve\" and \"splatd render\" take it as it "
                               "is; pack takes the scans that it was made of");
    else if (begins_with(bytes, available, "ASTM-E57"))
        return spl_source_fail(source, SPL_E_UNSUPPORTED, "", err,
                               "is E57, which is not supported yet: convert it first, with \"pdal translate IN.e57 "
                               "OUT.las\" or CloudCompare");
    else if (is_text(bytes, available))
        *reader = is_ptx(bytes, available) ? &spl_ptx_reader : &spl_text_reader;
    else
        return spl_source_fail(source, SPL_E_INPUT, "", err,
                               "is no point cloud known here (PLY, LAS, LAZ, PTX, PTS, or UTF-8 text with columns)");
    if ((*reader == &spl_ptx_reader || *reader == &spl_text_reader) && !memchr(bytes, '\n', available) &&
        memchr(bytes, '\r', available))
        source->newline = '\r';
    return SPL_OK;
}

int spl_cloud_open(const char *path, const struct spl_cloud_options *options, struct spl_cloud **out,
                   struct spl_error *err)
{
    static const struct spl_cloud_options defaults = {0};
    struct spl_cloud *cloud = spl_alloc(1, sizeof *cloud, err);
    if (!cloud)
        return SPL_E_NOMEM;
    cloud->source.fd = -1;
    cloud->options = options ? options : &defaults;
    cloud->intensity = cloud->options->intensity;
    int code = spl_source_open(&cloud->source, path, err);
    if (code < 0)
        goto fail;
    cloud->info.file_bytes = cloud->source.size;
    code = find_reader(&cloud->source, &cloud->reader, err);
    if (code < 0)
        goto fail;
    cloud->info.format = cloud->reader->format;
    code = cloud->reader->open(cloud, err);
    if (code == SPL_OK)
        code = spl_cloud_find_colors(cloud, err);
    if (code < 0)
        goto fail;
    cloud->options = NULL;
    *out = cloud;
    return SPL_OK;
fail:
    spl_cloud_destroy(cloud);
    return code;
}

const struct spl_cloud_info *spl_cloud_get_info(const struct spl_cloud *cloud)
{
    return &cloud->info;
}

uint64_t spl_cloud_get_offset(const struct spl_cloud *cloud)
{
    return spl_source_tell(&cloud->source);
}

int spl_cloud_read(struct spl_cloud *cloud, struct spl_point_batch *batch, struct spl_error *err)
{
    batch->count = 0;
    while (batch->count < batch->capacity) {
        size_t room = batch->capacity - batch->count;
        int code = cloud->reader->rows(cloud, &cloud->rows, room < SPL_ROWS ? room : SPL_ROWS, err);
        size_t before = batch->count;
        if (code > 0)
            code = spl_rows_emit(&cloud->rows, cloud->row, &cloud->color, &cloud->source, &cloud->info, batch, err);
        else if (code == 0)
            break;
        if (code < 0)
            return code;
        cloud->row += cloud->rows.count;
        cloud->info.points_from[cloud->info.colors.from] += batch->count - before;
    }
    return batch->count > 0;
}

void spl_cloud_destroy(struct spl_cloud *cloud)
{
    if (!cloud)
        return;
    if (cloud->state && cloud->reader->close)
        cloud->reader->close(cloud);
    spl_source_close(&cloud->source);
    free(cloud->info.stations);
    free(cloud->state);
    free(cloud);
}
