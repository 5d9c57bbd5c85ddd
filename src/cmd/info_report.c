/* Gathering what splatd info says of a dataset, page by page. The command's thread. */
#include "cmd/info_report.h"

#include <math.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "dataset/chunk_clip.h"
#include "dataset/panels.h"

const struct spl_info_code spl_info_codes[SPL_INFO_CODES] = {
    {"position_axis",
     "position, an axis",
     SPL_ATTRIBUTE_POSITION,
     {SPL_GEOMETRY_X, SPL_GEOMETRY_Y, SPL_GEOMETRY_Z},
     3,
     5},
    {"radius", "radius", SPL_ATTRIBUTE_RADIUS, {SPL_GEOMETRY_RADIUS}, 1, 4},
    {"normal_coordinate", "normal, a coordinate", SPL_ATTRIBUTE_NORMAL, {SPL_GEOMETRY_U, SPL_GEOMETRY_V}, 2, 4},
    {"color_component", "color, a component", SPL_ATTRIBUTE_COLOR, {SPL_COLOR_Y, SPL_COLOR_U, SPL_COLOR_V}, 3, 4},
};

static uint32_t code_word(const struct spl_chunk *chunk, enum spl_attribute attribute)
{
    return attribute == SPL_ATTRIBUTE_COLOR ? chunk->color_bits : chunk->geometry_bits;
}

static void gather_widths(struct spl_info_report *report, const struct spl_tables *tables, uint32_t index)
{
    const struct spl_chunk *chunk = &tables->chunks[index];
    double share = chunk->count / (double)report->info->splats;
    for (int k = 0; k < SPL_INFO_CODES; k++)
        for (unsigned s = 0; s < spl_info_codes[k].shift_count; s++) {
            uint32_t width = code_word(chunk, spl_info_codes[k].attribute) >> spl_info_codes[k].shifts[s];
            width &= (1u << spl_info_codes[k].bits) - 1;
            report->widths[k][width] += share / spl_info_codes[k].shift_count;
        }
    for (uint32_t s = 0; s < tables->stream_count; s++)
        report->widths[SPL_INFO_CODES + s][tables->width[s][index]] += share;
}

static void gather_leaf_chunk(struct spl_info_report *report, const struct spl_chunk *chunk)
{
    uint32_t kind = spl_chunk_kind(chunk);
    report->points[kind] += kind == SPL_CHUNK_DISCS ? chunk->count : 0;
    if (!spl_kind_has_panels(kind))
        return;
    double mean = (double)spl_panels_get_error_mean(chunk);
    report->points[kind] += spl_panels_get_points(chunk);
    report->error_squares[kind] += mean * mean * spl_panels_get_points(chunk);
    report->error_most[kind] = fmax(report->error_most[kind], (double)spl_panels_get_error_most(chunk));
}

double spl_info_error_mean(const struct spl_info_report *report, enum spl_chunk_kind kind)
{
    return sqrt(report->error_squares[kind] / fmax((double)report->points[kind], 1));
}

static void gather_node(struct spl_info_report *report, const struct spl_node *node, const struct spl_chunk *chunks)
{
    uint32_t depth = node->depth < SPL_INFO_LEVELS_MAX ? node->depth : SPL_INFO_LEVELS_MAX - 1;
    struct spl_info_level *level = &report->levels[depth];
    report->level_count = depth + 1 > report->level_count ? depth + 1 : report->level_count;
    level->nodes++;
    level->chunks += node->chunk_count;
    for (uint32_t c = 0; c < node->chunk_count; c++) {
        uint32_t kind = spl_chunk_kind(&chunks[c]), count = chunks[c].count;
        level->splats += kind == SPL_CHUNK_DISCS ? count : 0;
        level->pieces += spl_chunk_count_pieces(&chunks[c]);
        level->panels += kind == SPL_CHUNK_PANELS ? count : 0;
        level->meshes += kind == SPL_CHUNK_MESHES ? count : 0;
        level->spacing += kind == SPL_CHUNK_LINES ? 0 : (double)node->spacing * count;
        if (!node->child_count)
            gather_leaf_chunk(report, &chunks[c]);
    }
}

static void gather_page(struct spl_info_report *report, const struct spl_tables *tables)
{
    for (uint32_t n = 0; n < tables->node_count; n++)
        gather_node(report, &tables->nodes[n], tables->chunks + (tables->nodes[n].first_chunk - tables->first_chunk));
    for (uint32_t c = 0; c < tables->chunk_count; c++) {
        const struct spl_chunk *chunk = &tables->chunks[c];
        uint32_t kind = spl_chunk_kind(chunk);
        report->clips += spl_clip_count(chunk);
        report->chunks[kind]++;
        report->items[kind] += kind == SPL_CHUNK_LINES ? spl_chunk_count_pieces(chunk) : chunk->count;
        report->bytes[kind] += SPL_CHUNK_BYTES + 4ull * spl_chunk_words(chunk);
        if (kind == SPL_CHUNK_DISCS)
            gather_widths(report, tables, c);
    }
}

static int gather(struct spl_info_report *report, uint32_t page, struct spl_error *err)
{
    struct spl_error why = {0};
    struct spl_tables *read;
    const struct spl_tables *tables = spl_dataset_borrow_tables(report->dataset, page, &read, &why);
    if (!tables)
        return spl_fail(err, why.code, "%s", why.message);
    gather_page(report, tables);
    free(read);
    return spl_dataset_count_linear_of(report->dataset, page, &report->linear, err);
}

int spl_info_gather(struct spl_info_report *report, const struct spl_dataset *dataset, struct spl_error *err)
{
    *report = (struct spl_info_report){.dataset = dataset, .info = spl_dataset_get_info(dataset)};
    for (uint32_t page = 0; page < report->info->pages; page++) {
        struct spl_error why = {0};
        int rc = gather(report, page, &why);
        if (rc && (rc != SPL_E_CORRUPT || !spl_dataset_get_part(dataset, page)))
            return spl_fail(err, rc, "%s", why.message);
    }
    for (uint32_t i = 0; i < report->level_count; i++) {
        struct spl_info_level *level = &report->levels[i];
        level->spacing /= fmax((double)(level->splats + level->panels + level->meshes), 1);
    }
    report->lost_count = spl_dataset_list_faulty(dataset, report->lost, SPL_INFO_LOST_MAX);
    return spl_dataset_count_atoms(dataset, report->atoms, err);
}

int spl_info_check_tiles(struct spl_info_report *report, void (*progress)(void *context, const struct spl_progress *),
                         void *context, struct spl_error *err)
{
    const struct spl_dataset *dataset = report->dataset;
    const uint32_t pages = report->info->pages, own = spl_dataset_get_own_pages(dataset);
    const uint64_t began_ns = spl_now_ns();
    struct spl_progress said = {.stage = "checking tiles", .unit = "bytes"};
    uint64_t said_ns = 0;
    size_t room = 0;
    uint32_t bad = 0; /* the tile that is not read on */
    int rc = SPL_OK;
    for (uint32_t page = own; page < pages; page++) {
        const size_t bytes = spl_dataset_get_page_bytes(dataset, page);
        said.total += bytes;
        room = bytes > room ? bytes : room;
    }
    void *buffer = own < pages ? spl_alloc_raw(room, 1, err) : NULL;
    if (own < pages && !buffer)
        return SPL_E_NOMEM;
    for (uint32_t page = own; page < pages && !rc; page++) {
        const uint32_t part = spl_dataset_get_part(dataset, page);
        const uint64_t now_ns = spl_now_ns();
        struct spl_error why = {0};
        if (progress && now_ns - said_ns > SPL_NS_PER_S / 10) {
            said.rate = (double)said.done * SPL_NS_PER_S / (double)(now_ns - began_ns + 1);
            progress(context, &said);
            said_ns = now_ns;
        }
        said.done += spl_dataset_get_page_bytes(dataset, page);
        if (part == bad || !(rc = spl_dataset_read_page(dataset, page, buffer, &why)))
            continue;
        bad = part;
        rc = rc == SPL_E_CORRUPT ? SPL_OK : spl_fail(err, rc, "%s", why.message);
    }
    free(buffer);
    report->lost_count = spl_dataset_list_faulty(dataset, report->lost, SPL_INFO_LOST_MAX);
    return rc;
}

const char *spl_info_name(const struct spl_dataset_info *info, int attribute)
{
    return attribute < SPL_ATTRIBUTE_COUNT ? spl_attribute_name((enum spl_attribute)attribute)
                                           : info->streams[attribute - SPL_ATTRIBUTE_COUNT].name;
}

int spl_info_count(const struct spl_dataset_info *info)
{
    return SPL_ATTRIBUTE_COUNT + (int)info->stream_count;
}

double spl_info_bytes_per_splat(const struct spl_dataset_info *info, int attribute)
{
    uint64_t bits = attribute < SPL_ATTRIBUTE_COUNT ? info->attribute_bits[attribute]
                                                    : info->streams[attribute - SPL_ATTRIBUTE_COUNT].bits;
    return (double)bits / 8 / (double)(spl_info_has_primitives(info) ? info->leaf_splats : info->splats);
}

double spl_info_total_bytes_per_splat(const struct spl_dataset_info *info)
{
    double total = 0;
    for (int a = 0; a < spl_info_count(info); a++)
        total += spl_info_bytes_per_splat(info, a);
    return total;
}
