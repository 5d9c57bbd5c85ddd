/* The container behind its checksums: the input says what the sections hold, this file lays them out as the writer
 * does in a block of memory, computes every hash, patches header and table, and opens the result. What opens is decoded
 * to the last splat, from pages copied to blocks of their exact size.
 *
 * Input: one byte of flags (1 = fresh hashes after patching, 2 = verify, 4 = textures, 8 = tables are read by page, 16
 * = two pages, 32 = maps of one station, 64 = of two), one byte n, n patches of three bytes (offset low, high; xor)
 * into header and table, a little-endian 32 bit size for each section, then the sections, of those sizes (shortened or
 * missing as the input ends; pages and maps keep their size up to 64 KiB, with zeroes): META, PDIR, each page's HEAD,
 * each PAGE, with textures ATOM and each page's TEXP, with maps PANO and each station's PMAP. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/dictionary.h"
#include "dataset/panels.h"
#include "dataset/texture.h"
#include "geom/polar.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { flag_rehash = 1, flag_verify = 2, flag_textures = 4, flag_by_page = 8, flag_two_pages = 16, flag_maps = 96 };
enum { sections_max = 12, page_room = 1 << 16 };

struct part {
    uint32_t type, index;
    const uint8_t *bytes;
    uint32_t size;
};

struct head {
    struct spl_file_header header;
    struct spl_section table[sections_max];
};

static void rehash(struct head *head, size_t table_bytes)
{
    head->header.table_hash = XXH3_64bits(head->table, table_bytes);
    head->header.header_hash = XXH3_64bits(&head->header, offsetof(struct spl_file_header, header_hash));
}

/* The sections of the input, in its order. */
static int take_parts(const uint8_t *data, size_t size, unsigned flags, struct part parts[sections_max])
{
    static uint8_t pages[4][page_room]; /* and maps */
    const uint32_t page_count = flags & flag_two_pages ? 2 : 1, map_count = (flags & flag_maps) / 32;
    int count = 0;
    parts[count++] = (struct part){.type = SPL_SECTION_META};
    parts[count++] = (struct part){.type = SPL_SECTION_DIRECTORY};
    for (uint32_t p = 0; p < page_count; p++)
        parts[count++] = (struct part){.type = SPL_SECTION_HEAD, .index = p};
    for (uint32_t p = 0; p < page_count; p++)
        parts[count++] = (struct part){.type = SPL_SECTION_PAGE, .index = p};
    if (flags & flag_textures)
        parts[count++] = (struct part){.type = SPL_SECTION_ATOMS};
    for (uint32_t p = 0; p < page_count && flags & flag_textures; p++)
        parts[count++] = (struct part){.type = SPL_SECTION_TEXTURES, .index = p};
    if (map_count)
        parts[count++] = (struct part){.type = SPL_SECTION_STATIONS};
    for (uint32_t m = 0; m < map_count && m < 2; m++)
        parts[count++] = (struct part){.type = SPL_SECTION_MAP, .index = m};
    for (int i = 0; i < count; i++, data += size < 4 ? size : 4, size -= size < 4 ? size : 4)
        memcpy(&parts[i].size, data, size < 4 ? size : 4);
    for (int i = 0; i < count; i++) {
        uint32_t wanted = parts[i].size, left = wanted < size ? wanted : (uint32_t)size;
        parts[i].bytes = data;
        parts[i].size = left;
        data += left;
        size -= left;
        if (parts[i].type != SPL_SECTION_PAGE && parts[i].type != SPL_SECTION_MAP)
            continue;
        uint8_t *page = pages[parts[i].index + (parts[i].type == SPL_SECTION_MAP ? 2 : 0)];
        memset(page, 0, page_room);
        memcpy(page, parts[i].bytes, left < page_room ? left : page_room);
        parts[i].bytes = page;
        parts[i].size = wanted < page_room ? wanted : page_room;
    }
    return count;
}

static int pages_first(const void *a, const void *b)
{
    const struct part *x = a, *y = b;
    bool x_page = x->type == SPL_SECTION_PAGE, y_page = y->type == SPL_SECTION_PAGE;
    return x_page != y_page ? y_page - x_page : x->bytes < y->bytes ? -1 : 1;
}

/* The pages first, as the writer has them; then the rest, the table. The block, of *length bytes, is the caller's. */
static uint8_t *lay_out(const uint8_t *data, size_t size, unsigned flags, const uint8_t *patches, unsigned patch_count,
                        size_t *length)
{
    struct part parts[sections_max] = {0};
    int count = take_parts(data, size, flags, parts);
    qsort(parts, (size_t)count, sizeof *parts, pages_first);
    const size_t table_bytes = (size_t)count * sizeof(struct spl_section);
    struct head head = {.header = {.magic = SPL_FILE_MAGIC,
                                   .version = SPL_FILE_VERSION,
                                   .header_bytes = sizeof(struct spl_file_header),
                                   .section_count = (uint32_t)count}};
    uint64_t offset = SPL_FILE_ALIGNMENT;
    for (int i = 0; i < count; i++) {
        uint64_t alignment = parts[i].type == SPL_SECTION_PAGE ? SPL_FILE_ALIGNMENT : 64;
        offset = (offset + alignment - 1) / alignment * alignment;
        head.table[i] = (struct spl_section){.type = parts[i].type,
                                             .index = parts[i].index,
                                             .offset = offset,
                                             .bytes = parts[i].size,
                                             .hash = XXH3_64bits(parts[i].bytes, parts[i].size)};
        offset += parts[i].size;
    }
    offset = (offset + 63) / 64 * 64;
    head.header.table_offset = offset;
    head.header.file_bytes = *length = offset + table_bytes;
    uint8_t *file = calloc(1, *length); /* of its exact size, so that a sanitiser sees one byte too many */
    spl_assert(file);
    for (int i = 0; i < count; i++)
        memcpy(file + head.table[i].offset, parts[i].bytes, parts[i].size);
    rehash(&head, table_bytes);
    for (unsigned i = 0; i < patch_count; i++) {
        size_t at = patches[3 * i] | (size_t)patches[3 * i + 1] << 8;
        ((uint8_t *)&head)[at % (sizeof head.header + table_bytes)] ^= patches[3 * i + 2];
    }
    if (flags & flag_rehash)
        rehash(&head, table_bytes);
    memcpy(file + offset, head.table, table_bytes);
    memcpy(file, &head.header, sizeof head.header);
    return file;
}

/* Of every page that may be read: codes within the dictionary, whose expansion fits its place. */
static void decode_textures(const struct spl_dataset *dataset, const struct spl_tables *tables)
{
    const struct spl_dictionary *dictionary = spl_dataset_get_dictionary(dataset);
    if (!dictionary->count)
        return;
    uint32_t *atoms = malloc(spl_dataset_get_info(dataset)->dictionary_bytes);
    spl_dictionary_expand(dictionary, atoms);
    free(atoms);
    uint32_t *words = malloc(spl_dataset_get_texture_bytes(dataset, tables->page));
    bool readable = !spl_dataset_read_textures(dataset, tables->page, words, NULL);
    for (uint32_t c = 0; readable && c < tables->chunk_count; c++) {
        struct spl_chunk_code code;
        uint32_t texture = tables->textures[c];
        spl_texture_decode(words + spl_texture_word(texture), spl_texture_planes(texture), tables->chunks[c].count,
                           &code);
        for (uint32_t i = 0; i < code.splats; i++)
            for (uint32_t t = 0; t < code.splat[i].count; t++)
                spl_assert(code.splat[i].atom[t] < dictionary->count && isfinite(code.plane[t].step));
    }
    free(words);
}

/* Stations of chunks are rows, and what a row says of its map lies within it. */
static void read_maps(const struct spl_dataset *dataset, const struct spl_tables *tables)
{
    uint32_t count;
    const struct spl_map_row *rows = spl_dataset_get_maps(dataset, &count);
    spl_assert(!count == !tables->stations);
    for (uint32_t c = 0; c < tables->chunk_count && count; c++)
        for (int s = 0; s < SPL_CHUNK_STATIONS; s++)
            spl_assert((tables->stations[c].seen_by[s] & SPL_STATION_ROW) <= count);
    for (uint32_t m = 0; m < count; m++) {
        size_t bytes = spl_dataset_get_map_bytes(dataset, m);
        uint32_t *words = malloc(bytes);
        float color[3];
        spl_assert(!spl_dataset_read_map(dataset, m, words, NULL));
        for (uint32_t level = 0; level < rows[m].levels; level++) {
            uint32_t side = rows[m].side >> level;
            const uint32_t *at = words + spl_map_level_word(&rows[m], level);
            spl_map_get_color(at, side, spl_polar_width(side, SPL_MAP_APRON) - 1,
                              spl_polar_height(side, SPL_MAP_APRON) - 1, color);
            spl_assert(color[0] >= 0 && color[0] <= 255);
        }
        size_t texels = 2 * spl_map_range_words(&rows[m]);
        spl_assert(!(spl_map_range_of_code(&rows[m], spl_map_get_code(words, texels - 1)) <= 0));
        free(words);
    }
}

/* Every code of every stream, and the same by the splat's id. */
static void decode_streams(const struct spl_dataset *dataset, const struct spl_tables *tables, uint32_t index,
                           const uint32_t *page)
{
    uint32_t count;
    const struct spl_stream *streams = spl_dataset_get_streams(dataset, &count);
    const struct spl_chunk *chunk = &tables->chunks[index];
    for (uint32_t s = 0; s < count; s++) {
        struct spl_stream_code code = {tables->base[s][index], tables->width[s][index]};
        enum spl_stream_type type = spl_stream_type_from_name(streams[s].type);
        const uint32_t *words =
            page + chunk->geometry_word + spl_chunk_words(chunk) + spl_tables_get_stream_words(tables, s, index);
        for (uint32_t i = 0; i < chunk->count; i++) {
            double value = spl_stream_decode(&streams[s], code, words, i), found = -1;
            spl_assert(type == SPL_STREAM_UNKNOWN || (type == SPL_STREAM_STEPS && isnan(value))
                           ? isnan(value)
                           : isfinite(value) && (value >= 0 || type == SPL_STREAM_STEPS));
            bool known = spl_dataset_find_stream(dataset, streams[s].name) == (int)s;
            spl_assert(known == (type != SPL_STREAM_UNKNOWN));
            if (known && i % 64 == 0 && spl_chunk_kind(chunk) != SPL_CHUNK_LINES)
                spl_assert(spl_dataset_find_value(dataset, (int)s, chunk->first_id + i, &found) &&
                           (found == value || (isnan(found) && isnan(value))));
        }
    }
}

static void decode_chunk(const struct spl_chunk *chunk, const uint32_t *page, bool leaf, uint64_t *linear)
{
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_splat s;
        spl_chunk_decode(chunk, page, i, &s);
        *linear += s.linear && leaf && spl_chunk_kind(chunk) == SPL_CHUNK_DISCS;
        spl_assert(isfinite(s.position[0]) && isfinite(s.position[1]) && isfinite(s.position[2]));
        spl_assert(s.radius > 0 && isfinite(s.radius));
        float length = s.normal[0] * s.normal[0] + s.normal[1] * s.normal[1] + s.normal[2] * s.normal[2];
        spl_assert(fabsf(length - 1) < 1e-5f);
        spl_assert(isfinite(s.clip.direction[0] + s.clip.direction[1] + s.clip.direction[2]));
        spl_assert(s.clip.offset >= 0 && s.clip.offset <= 1);
    }
}

/* Cells of any page, also of one that nobody checked: within the grid, on a plane that is finite. */
static void decode_panels(const struct spl_chunk *chunk, const uint32_t *page)
{
    struct spl_panel_frame frame;
    uint32_t columns, rows;
    spl_panels_get_frame(chunk, &frame);
    spl_panels_get_extent(chunk, &columns, &rows);
    spl_assert(columns <= 256 && rows <= 256 && frame.cell > 0);
    spl_assert(spl_panels_get_error_mean(chunk) >= 0 && spl_panels_get_error_most(chunk) >= 0);
    for (int a = 0; a < 3; a++)
        spl_assert(isfinite(frame.origin[a] + frame.cell * (float)SPL_PANEL_SIDE *
                                                  ((float)columns * frame.u[a] + (float)rows * frame.v[a])));
    const float reach = spl_panels_get_reach(chunk);
    spl_assert(reach >= 0 && isfinite(reach));
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_relief relief;
        spl_panels_get_relief(chunk, page, i, &relief);
        for (int h = 0; h < SPL_RELIEF_POINTS(relief.level); h++)
            spl_assert(fabsf(relief.height[h]) <= reach);
        struct spl_panel panel, again;
        spl_panels_decode(chunk, page, i, &panel);
        memset(&again, 0xff, sizeof again);
        spl_panels_decode(chunk, page, i, &again);
        spl_assert(!memcmp(&panel, &again, sizeof panel));
    }
}

/* A page whose tables can be read. Children, on whatever page, have larger numbers than their parent. */
static void decode_page(const struct spl_dataset *dataset, const struct spl_tables *tables, uint64_t *linear)
{
    size_t bytes = spl_dataset_get_page_bytes(dataset, tables->page);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    uint32_t *page = malloc(bytes);
    spl_assert(!spl_dataset_read_page(dataset, tables->page, page, NULL));
    for (uint32_t n = 0; n < tables->node_count; n++) {
        const struct spl_node *node = &tables->nodes[n];
        uint64_t number = tables->first_node + n;
        spl_assert(!node->child_count || (node->first_child > number && node->child_count <= info->nodes &&
                                          node->first_child <= info->nodes - node->child_count));
        spl_assert(node->page == tables->page && spl_dataset_find_page_of_node(dataset, number) == tables->page);
        uint32_t first = (uint32_t)(node->first_chunk - tables->first_chunk);
        spl_assert(node->first_chunk >= tables->first_chunk && first + node->chunk_count <= tables->chunk_count);
        for (uint32_t c = first; c < first + node->chunk_count; c++) {
            decode_streams(dataset, tables, c, page);
            decode_chunk(&tables->chunks[c], page, !node->child_count, linear);
            if (spl_kind_has_panels(spl_chunk_kind(&tables->chunks[c])))
                decode_panels(&tables->chunks[c], page);
        }
    }
    free(page);
    decode_textures(dataset, tables);
    read_maps(dataset, tables);
}

static void decode_all(const struct spl_dataset *dataset)
{
    uint64_t linear = 0, decoded = 0;
    bool all = true;
    for (uint32_t page = 0; page < spl_dataset_get_info(dataset)->pages; page++) {
        struct spl_tables *read;
        const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, page, &read, NULL);
        if (tables)
            decode_page(dataset, tables, &decoded);
        all &= tables != NULL;
        free(read);
    }
    spl_assert(!spl_dataset_count_linear(dataset, &linear, NULL) == all && (!all || linear == decoded));
    struct spl_camera camera;
    spl_assert(!spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2 || size < 2u + 3u * data[1])
        return 0;
    size_t skip = 2u + 3u * data[1], length;
    uint8_t *file = lay_out(data + skip, size - skip, data[0], data + 2, data[1], &length);
    struct spl_dataset_source source = spl_dataset_source_of_memory(file, length);
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    const struct spl_dataset_opening how = {.verify = data[0] & flag_verify,
                                            .tables_bytes = data[0] & flag_by_page ? 0 : SPL_TABLES_BYTES};
    int rc = spl_dataset_open_source_as(&source, "container", &how, &dataset, &err);
    spl_assert((rc == SPL_OK) == (dataset != NULL) && (rc == SPL_OK) == (err.message[0] == 0));
    spl_assert(rc == SPL_OK || rc == SPL_E_CORRUPT || rc == SPL_E_UNSUPPORTED || rc == SPL_E_INPUT);
    if (dataset)
        decode_all(dataset);
    spl_dataset_close(dataset);
    free(file);
    return 0;
}
