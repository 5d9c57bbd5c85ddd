/* Opening a scan with the reader that it needs, and the loop that turns its rows into batches.
 * Owned by one thread at a time; two clouds share nothing. */
#include "cloud/cloud.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/crs.h"
#include "cloud/reader.h"

int spl_point_batch_init(struct spl_point_batch *batch, size_t capacity, struct spl_error *err)
{
    *batch = (struct spl_point_batch){.capacity = capacity};
    batch->position = spl_alloc(capacity, sizeof *batch->position, err);
    batch->color = spl_alloc(capacity, sizeof *batch->color, err);
    batch->normal = spl_alloc(capacity, sizeof *batch->normal, err);
    batch->classification = spl_alloc(capacity, sizeof *batch->classification, err);
    batch->station = spl_alloc(capacity, sizeof *batch->station, err);
    bool complete = batch->position && batch->color && batch->normal && batch->classification && batch->station;
    for (int s = 0; complete && s < SPL_SCALAR_COUNT; s++) { /* those that are not used take no memory */
        batch->scalar[s] = spl_alloc(capacity, sizeof *batch->scalar[s], err);
        complete = batch->scalar[s];
    }
    if (complete)
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
    for (int s = 0; s < SPL_SCALAR_COUNT; s++)
        free(batch->scalar[s]);
    *batch = (struct spl_point_batch){0};
}

void spl_point_batch_move(struct spl_point_batch *batch, uint32_t scalars, size_t to, size_t from)
{
    memcpy(batch->position[to], batch->position[from], sizeof batch->position[from]);
    memcpy(batch->color[to], batch->color[from], sizeof batch->color[from]);
    memcpy(batch->normal[to], batch->normal[from], sizeof batch->normal[from]);
    batch->classification[to] = batch->classification[from];
    batch->station[to] = batch->station[from];
    for (int s = 0; s < SPL_SCALAR_COUNT; s++)
        if (scalars >> s & 1)
            batch->scalar[s][to] = batch->scalar[s][from];
}

/* Decides which points make the part that is wanted. Not before colours are known, which all points have a say in. */
static int find_part(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_cloud_info *info = &cloud->info;
    uint64_t most = cloud->options->max_points, given = info->points_expected;
    int code = SPL_OK;
    if (most && (!given || cloud->sampling == SPL_SAMPLE_ALL)) /* a text's count is that of its first block */
        given = cloud->options->points;
    if (most && !given) {
        while ((code = cloud->reader->rows(cloud, &cloud->rows, SPL_ROWS, err)) > 0)
            given += cloud->rows.count;
        if (code == SPL_OK)
            code = cloud->reader->seek(cloud, 0, 1, err);
        info->points_skipped = 0;
    }
    if (code < 0)
        return code;
    if (!info->points_total)
        info->points_total = given;
    info->points_expected = given;
    if (!most || given <= most)
        return SPL_OK;
    cloud->part = info->points_expected = most;
    cloud->part_of = given;
    cloud->part_sum = given - most;
    return SPL_OK;
}

/* What was taken for text, and is none, may be a damaged file of what its name says. */
static void name_ending(const struct spl_cloud *cloud, const char *path, struct spl_error *err)
{
    const char *named = spl_cloud_find_wrong_ending(path, cloud->reader, cloud->reader->format);
    size_t used = err ? strlen(err->message) : 0;
    if (named && used && cloud->reader == &spl_text_reader)
        snprintf(err->message + used, sizeof err->message - used,
                 "; by its name it is %s, but it does not begin like that: it may be damaged", named);
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
    if (cloud->options->keep)
        cloud->keep = *cloud->options->keep;
    cloud->info.fields = cloud->fields;
    int code = spl_source_open(&cloud->source, path, err);
    if (code < 0)
        goto fail;
    cloud->info.file_bytes = cloud->source.size;
    code = spl_cloud_find_reader(&cloud->source, &cloud->reader, err);
    if (code < 0)
        goto fail;
    cloud->info.format = cloud->reader->format;
    code = cloud->reader->open(cloud, err);
    if (code < 0)
        name_ending(cloud, path, err);
    if (code == SPL_OK)
        code = spl_cloud_find_colors(cloud, err);
    if (code == SPL_OK)
        code = find_part(cloud, err);
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

void spl_cloud_name_field(struct spl_cloud *cloud, const char *name, size_t length)
{
    static const char more[] = ", …";
    size_t used = strlen(cloud->fields), room = sizeof cloud->fields - used - sizeof more; /* never less than 0 */
    if (cloud->fields_cut)
        return;
    cloud->fields_cut = length + 2 > room;
    if (cloud->fields_cut)
        memcpy(cloud->fields + used, more, sizeof more);
    else
        snprintf(cloud->fields + used, room, "%s%.*s", used ? ", " : "", (int)length, name);
}

void spl_cloud_add_unused(struct spl_cloud *cloud, const char *name, size_t length, const char *why)
{
    static const char more[] = "…";
    char *unused = cloud->info.unused, entry[160];
    const size_t used = strlen(unused), room = sizeof cloud->info.unused - used;
    const bool cut = used >= sizeof more - 1 && !strcmp(unused + used - (sizeof more - 1), more);
    size_t size =
        (size_t)snprintf(entry, sizeof entry, why ? "%s%.*s (%s)" : "%s%.*s", used ? ", " : "", (int)length, name, why);
    if (!cut && size < sizeof entry && size + strlen(", ") + sizeof more <= room)
        snprintf(unused + used, room, "%s", entry);
    else if (!cut)
        snprintf(unused + used, room, "%s%s", used ? ", " : "", more);
}

void spl_cloud_tell_unused(struct spl_cloud *cloud, const char *name, int column, bool told)
{
    const bool color = column >= SPL_COLUMN_RED && column <= SPL_COLUMN_BLUE; /* spl_packed_tell_rest() tells of it */
    if (!told && !color && !spl_column_is_used(cloud->columns, column))
        spl_cloud_add_unused(cloud, name, strlen(name), NULL);
}

int spl_cloud_take_column(struct spl_cloud *cloud, const char *name, size_t length)
{
    int column = spl_keep_find_column(&cloud->keep, cloud->columns, name, length);
    spl_cloud_name_field(cloud, name, length);
    if (column >= 0)
        cloud->columns |= 1u << column;
    return column;
}

const char *spl_cloud_column_name(const struct spl_cloud *cloud, int column)
{
    return column < SPL_COLUMN_KEPT ? spl_column_name(column) : cloud->keep.names[column - SPL_COLUMN_KEPT];
}

void spl_cloud_keep_columns(struct spl_cloud *cloud)
{
    uint32_t named = cloud->keep.named | ~0u << SPL_COLUMN_KEPT;
    uint32_t kept = cloud->columns & (cloud->keep.none ? named : ~0u);
    cloud->info.columns = cloud->columns;
    cloud->info.scalars = kept >> SPL_COLUMN_INTENSITY;
    if (!(kept >> SPL_COLUMN_CLASS & 1))
        cloud->info.attributes &= ~(uint32_t)SPL_CLOUD_CLASS;
}

const struct spl_cloud_info *spl_cloud_get_info(const struct spl_cloud *cloud)
{
    return &cloud->info;
}

/* Of the points from `from` on, leaves those that belong to the part, as even as whole numbers can be. */
static void thin(struct spl_cloud *cloud, struct spl_point_batch *batch, size_t from)
{
    size_t to = from;
    for (size_t i = from; i < batch->count; i++) {
        cloud->part_sum += cloud->part;
        if (cloud->part_sum < cloud->part_of)
            continue;
        cloud->part_sum -= cloud->part_of;
        spl_point_batch_move(batch, cloud->info.scalars, to++, i);
    }
    batch->count = to;
}

int spl_cloud_read(struct spl_cloud *cloud, struct spl_point_batch *batch, struct spl_error *err)
{
    batch->count = 0;
    while (batch->count < batch->capacity) {
        size_t room = batch->capacity - batch->count;
        int code = cloud->reader->rows(cloud, &cloud->rows, room < SPL_ROWS ? room : SPL_ROWS, err);
        size_t before = batch->count;
        bool sampled = cloud->info.colors.sampled, emits = code > 0;
        if (emits)
            code = spl_rows_emit(&cloud->rows, cloud->row, &cloud->color, &cloud->source, &cloud->info, batch,
                                 sampled ? NULL : err);
        else if (code == 0)
            break;
        if (code < 0)
            return emits && sampled ? spl_cloud_begin_again(cloud, batch, err) : code;
        if (cloud->part)
            thin(cloud, batch, before);
        cloud->row += cloud->rows.count;
        cloud->info.points_from[cloud->info.colors.from] += batch->count - before;
    }
    return batch->count > 0;
}

int spl_cloud_seek(struct spl_cloud *cloud, uint64_t row, struct spl_error *err)
{
    spl_assert(cloud->info.rows && row <= cloud->info.rows && !cloud->part);
    cloud->row = row;
    return cloud->reader->seek_row(cloud, row, err);
}

void spl_cloud_take_coordinates(struct spl_cloud *cloud, struct spl_cloud_coordinates *out)
{
    *out = cloud->info.coordinates;
    cloud->info.coordinates = (struct spl_cloud_coordinates){0};
}

void spl_cloud_destroy(struct spl_cloud *cloud)
{
    if (!cloud)
        return;
    if (cloud->state && cloud->reader->close)
        cloud->reader->close(cloud);
    spl_source_close(&cloud->source);
    spl_crs_finish(&cloud->info.coordinates);
    free(cloud->info.stations);
    free(cloud->state);
    free(cloud);
}
