/* Opening a scan with the reader that it needs, and the loop that turns its rows into batches.
 * Owned by one thread at a time; two clouds share nothing. */
#include "cloud/cloud.h"

#include <stdlib.h>

#include "base/memory.h"
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
    code = spl_cloud_find_reader(&cloud->source, &cloud->reader, err);
    if (code < 0)
        goto fail;
    cloud->info.format = cloud->reader->format;
    code = cloud->reader->open(cloud, err);
    if (code == SPL_OK)
        code = spl_cloud_find_colors(cloud, err);
    if (code < 0)
        goto fail;
    cloud->info.named = spl_cloud_find_wrong_ending(path, cloud->reader, cloud->info.format);
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
