/* A packer without any packing: consecutive splats become chunks, boxes come from what the chunks decode to. */
#include "support/make_dataset.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <jansson.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/writer.h"

enum { node_splats_max = SPL_NODE_CHUNKS_MAX * SPL_CHUNK_SPLATS };

struct build {
    struct spl_dataset_writer *writer;
    struct spl_node nodes[9];
    uint32_t node_count;
    struct spl_chunk *chunks;
    uint32_t *bases[SPL_STREAM_KNOWN_COUNT]; /* by chunk */
    uint8_t *widths[SPL_STREAM_KNOWN_COUNT];
    size_t chunk_count, chunk_capacity;
    uint32_t splats; /* ids that are taken */
    const struct make_panels *panels;
    size_t panel_count;
};

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "make_dataset: %s\n", err->message);
    abort();
}

static void *must_have(void *p)
{
    must(p ? 0 : -1, &(struct spl_error){.message = "out of memory"});
    return p;
}

double make_dataset_normal_error = M_PI / 180;
bool make_dataset_station;
const json_t *make_dataset_meta;
size_t make_dataset_page_bytes = SPL_PAGE_BYTES;
const char *make_dataset_unit = "us-ft", *make_dataset_crs = "EPSG:2263";

/* Class and uncertainty of chunk `index`; returns the words that they take. */
static uint32_t add_streams(struct build *b, size_t index, const struct make_splat *splats, uint32_t count,
                            uint32_t *words)
{
    uint32_t used = 0;
    for (int s = 0; s < SPL_STREAM_KNOWN_COUNT; s++) {
        double values[SPL_CHUNK_SPLATS];
        struct spl_stream_code code;
        for (uint32_t i = 0; i < count; i++)
            values[i] = s == SPL_STREAM_CLASS ? splats[i].classification : (double)splats[i].uncertainty;
        used += spl_stream_encode(spl_stream_type_from_name(spl_streams_known[s].type), values, count, &code,
                                  words + used);
        b->bases[s][index] = code.base;
        b->widths[s][index] = code.width;
    }
    return used;
}

static size_t chunks_of(const struct make_panels *panels)
{
    return (panels->count + SPL_PANELS_MAX - 1) / SPL_PANELS_MAX;
}

/* Is it the node's? The root of two levels has what is coarse. */
static bool is_of(const struct make_panels *panels, const struct spl_node *node, bool levels)
{
    bool inside = true;
    for (int a = 0; a < 3; a++)
        inside &= panels->plane.origin[a] >= node->origin[a] && panels->plane.origin[a] < node->origin[a] + node->size;
    return !levels || (node->depth ? !panels->coarse && inside : panels->coarse);
}

/* The finest step that holds all heights. */
static unsigned step_of(const struct make_panels *panels)
{
    float most = 0;
    for (size_t p = 0; p < panels->count; p++)
        for (int i = 0; i < SPL_RELIEF_POINTS(panels->reliefs[p].level); i++)
            most = fmaxf(most, fabsf(panels->reliefs[p].height[i]));
    return spl_relief_choose_step(panels->plane.cell, most);
}

/* The panels as chunks from `*chunk` on, words from words[*used] on. Returns the sum of their spacings. */
static double add_panels(struct build *b, struct spl_node *node, const struct make_panels *panels,
                         struct spl_chunk *chunk, uint32_t *words, size_t *used)
{
    struct spl_panel_plane plane = panels->plane;
    struct spl_panel_frame frame;
    for (int a = 0; a < 3; a++)
        plane.origin[a] -= node->origin[a];
    for (size_t first = 0; first < panels->count; first += SPL_PANELS_MAX, chunk++) {
        size_t left = panels->count - first, index = (size_t)(chunk - b->chunks);
        uint32_t extent[2], n = left < SPL_PANELS_MAX ? (uint32_t)left : SPL_PANELS_MAX;
        spl_panels_begin(&plane, chunk);
        plane.points = 0;
        chunk->geometry_word = (uint32_t)*used;
        *used += panels->reliefs
                     ? spl_meshes_encode(panels->panels + first, panels->reliefs + first, n, step_of(panels),
                                         panels->color_error, chunk, words + *used)
                     : spl_panels_encode(panels->panels + first, n, panels->color_error, chunk, words + *used);
        chunk->first_id = b->splats;
        b->splats += n;
        for (int s = 0; s < SPL_STREAM_KNOWN_COUNT; s++) {
            struct spl_stream_code code;
            double values[SPL_PANELS_MAX];
            for (uint32_t i = 0; i < n; i++)
                values[i] = s == SPL_STREAM_CLASS
                                ? (double)(panels->classification + (panels->classes_vary ? (first + i) % 3 : 0))
                                : 0;
            *used += spl_stream_encode(spl_stream_type_from_name(spl_streams_known[s].type), values, n, &code,
                                       words + *used);
            b->bases[s][index] = code.base;
            b->widths[s][index] = code.width;
        }
        spl_panels_get_frame(chunk, &frame);
        spl_panels_get_extent(chunk, &extent[0], &extent[1]);
        for (int i = 0; i < 8; i++)
            for (int a = 0; a < 3; a++) {
                float u = i & 1 ? (float)(extent[0] * SPL_PANEL_SIDE) * frame.cell : 0;
                float v = i & 2 ? (float)(extent[1] * SPL_PANEL_SIDE) * frame.cell : 0;
                float w = (i & 4 ? 1 : -1) * spl_panels_get_reach(chunk);
                float at = frame.origin[a] + u * frame.u[a] + v * frame.v[a] + w * frame.normal[a];
                node->box_min[a] = fminf(node->box_min[a], at);
                node->box_max[a] = fmaxf(node->box_max[a], at);
            }
    }
    return (double)plane.cell * SPL_RADIUS_SPACING * (double)panels->count;
}

/* Writes `count` splats and the node's panels as its chunks and sets what follows from them. */
static void add_node(struct build *b, struct spl_node *node, const struct make_splat *splats, size_t count, bool levels)
{
    const struct spl_chunk_options options = {.position_error = 0.016,
                                              .normal_error = make_dataset_normal_error,
                                              .radius_error = 0.05};
    const size_t words_max = SPL_CHUNK_WORDS_MAX + SPL_STREAM_KNOWN_COUNT * SPL_STREAM_WORDS_MAX;
    size_t splat_count = 0, used = 0;
    while (splat_count < count && !splats[splat_count].vertex)
        splat_count++;
    size_t disc_chunks = (splat_count + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
    size_t chunk_count = disc_chunks + (count > splat_count), panel_chunks = 0, items = count;
    for (size_t p = 0; p < b->panel_count; p++) {
        bool own = is_of(&b->panels[p], node, levels);
        panel_chunks += own ? chunks_of(&b->panels[p]) : 0;
        items += own ? b->panels[p].count : 0;
    }
    size_t own_chunks = chunk_count;
    chunk_count += panel_chunks;
    spl_assert(items && chunk_count <= SPL_NODE_CHUNKS_MAX && b->chunk_count + chunk_count <= b->chunk_capacity &&
               count - splat_count <= SPL_CHUNK_SPLATS);
    uint32_t *words = must_have(malloc(chunk_count * words_max * sizeof *words));
    struct spl_chunk *chunks = b->chunks + b->chunk_count;
    double radius_sum = 0;
    for (int a = 0; a < 3; a++) {
        node->box_min[a] = FLT_MAX;
        node->box_max[a] = -FLT_MAX;
    }
    for (size_t c = 0; c < own_chunks; c++) {
        struct spl_splat part[SPL_CHUNK_SPLATS];
        double position[SPL_CHUNK_SPLATS][3];
        const struct make_splat *from = splats + (c < disc_chunks ? c * SPL_CHUNK_SPLATS : splat_count);
        size_t left = c < disc_chunks ? splat_count - c * SPL_CHUNK_SPLATS : count - splat_count;
        uint32_t n = left < SPL_CHUNK_SPLATS ? (uint32_t)left : SPL_CHUNK_SPLATS;
        struct spl_chunk_options own = options;
        own.kind = c < disc_chunks ? SPL_CHUNK_DISCS : SPL_CHUNK_LINES;
        own.width = (double)from->width;
        for (uint32_t i = 0; i < n; i++) {
            part[i] = (struct spl_splat){.radius = from[i].radius,
                                         .linear = from[i].linear,
                                         .clip.offset = from[i].clip_offset};
            memcpy(part[i].clip.direction, from[i].clip, sizeof part[i].clip.direction);
            memcpy(part[i].normal, from[i].normal, sizeof part[i].normal);
            memcpy(part[i].color, from[i].color, sizeof part[i].color);
            for (int a = 0; a < 3; a++)
                position[i][a] = from[i].position[a] - node->origin[a];
        }
        uint32_t length =
            spl_chunk_encode(part, (const double(*)[3])position, n, &own, &chunks[c], words + used, NULL);
        for (uint32_t i = 0; i < n; i++) {
            struct spl_splat out;
            spl_chunk_decode(&chunks[c], words + used, i, &out);
            radius_sum += out.radius;
            for (int a = 0; a < 3; a++) {
                node->box_min[a] = fminf(node->box_min[a], out.position[a] - out.radius);
                node->box_max[a] = fmaxf(node->box_max[a], out.position[a] + out.radius);
            }
        }
        chunks[c].geometry_word = (uint32_t)used;
        chunks[c].first_id = b->splats;
        b->splats += n;
        used += length;
        used += add_streams(b, b->chunk_count + c, from, n, words + used);
    }
    for (size_t p = 0, c = own_chunks; p < b->panel_count; p++)
        if (is_of(&b->panels[p], node, levels)) {
            radius_sum += add_panels(b, node, &b->panels[p], &chunks[c], words, &used);
            c += chunks_of(&b->panels[p]);
        }
    struct spl_error err = {0};
    must(spl_dataset_writer_add_node(b->writer, words, used, chunks, chunk_count, &node->page, &err), &err);
    node->spacing = (float)(radius_sum / (double)items / SPL_RADIUS_SPACING);
    node->first_chunk = (uint32_t)b->chunk_count;
    node->chunk_count = (uint32_t)chunk_count;
    b->chunk_count += chunk_count;
    free(words);
}

/* The root's selection, then one child for each octant that holds splats. */
static void add_two_levels(struct build *b, const struct make_splat *splats, size_t count)
{
    size_t stride = count < 8 ? 1 : 8, kept = 0, all = 0;
    struct make_splat *part = must_have(malloc((count + 1) * sizeof *part));
    for (size_t i = 0; i < count; i += stride) {
        part[kept] = splats[i];
        part[kept++].radius *= sqrtf((float)stride);
    }
    struct spl_node *root = &b->nodes[0];
    add_node(b, root, part, kept, true);
    root->first_child = 1;
    for (unsigned octant = 0; octant < 8; octant++) {
        struct spl_node *child = &b->nodes[1 + root->child_count];
        *child = (struct spl_node){.size = 0.5f * root->size, .depth = 1};
        for (int a = 0; a < 3; a++)
            child->origin[a] = root->origin[a] + (octant >> a & 1) * 0.5 * root->size;
        kept = 0;
        for (size_t i = 0; i < count; i++) {
            unsigned at = 0;
            for (int a = 0; a < 3; a++)
                at |= (splats[i].position[a] >= root->origin[a] + 0.5 * root->size ? 1u : 0u) << a;
            if (at == octant)
                part[kept++] = splats[i];
        }
        all += kept;
        bool has = kept > 0;
        for (size_t p = 0; p < b->panel_count; p++)
            has |= is_of(&b->panels[p], child, true);
        if (!has)
            continue;
        add_node(b, child, part, kept, true);
        root->child_count++;
        for (int a = 0; a < 3; a++) {
            float shift = (float)(child->origin[a] - root->origin[a]);
            root->box_min[a] = fminf(root->box_min[a], child->box_min[a] + shift);
            root->box_max[a] = fmaxf(root->box_max[a], child->box_max[a] + shift);
        }
    }
    spl_assert(all == count);
    b->node_count = 1 + root->child_count;
    free(part);
}

void make_dataset_file(const char *path, const struct make_splat *splats, size_t count, int levels)
{
    make_dataset_file_panels(path, splats, count, NULL, 0, levels);
}

void make_dataset_file_panels(const char *path, const struct make_splat *splats, size_t count,
                              const struct make_panels *panels, size_t panel_count, int levels)
{
    struct build b = {.node_count = 1,
                      .chunk_capacity = 2 * (count / SPL_CHUNK_SPLATS) + 10,
                      .panels = panels,
                      .panel_count = panel_count};
    double low[3], high[3], middle[3], size = 1e-3, radius = 0;
    size_t discs = 0, points = 0;
    for (size_t i = 0; i < count; i++)
        discs += !splats[i].vertex;
    for (size_t p = 0; p < panel_count; p++) {
        b.chunk_capacity += chunks_of(&panels[p]);
        points += levels == 1 || !panels[p].coarse ? panels[p].plane.points : 0;
        radius = (double)panels[p].plane.cell * SPL_RADIUS_SPACING;
    }
    spl_assert((discs || panel_count) && (levels == 1 || discs == count));
    radius = discs ? (double)splats[discs / 2].radius : radius;
    points += discs;
    b.chunks = must_have(malloc(b.chunk_capacity * sizeof *b.chunks));
    struct spl_stream streams[SPL_STREAM_KNOWN_COUNT];
    for (int s = 0; s < SPL_STREAM_KNOWN_COUNT; s++) {
        streams[s] = spl_streams_known[s];
        streams[s].base = b.bases[s] = must_have(malloc(b.chunk_capacity * sizeof *b.bases[s]));
        streams[s].width = b.widths[s] = must_have(malloc(b.chunk_capacity));
    }
    for (int a = 0; a < 3; a++) {
        low[a] = high[a] = count ? splats[0].position[a] : panels[0].plane.origin[a];
        for (size_t p = 0; p < panel_count; p++) {
            low[a] = fmin(low[a], panels[p].plane.origin[a]);
            high[a] = fmax(high[a], panels[p].plane.origin[a]);
        }
        for (size_t i = 1; i < count; i++) {
            low[a] = fmin(low[a], splats[i].position[a]);
            high[a] = fmax(high[a], splats[i].position[a]);
        }
        middle[a] = 0.5 * (low[a] + high[a]);
        size = fmax(size, high[a] - low[a]);
    }
    b.nodes[0].size = (float)(size * 1.000001);
    memcpy(b.nodes[0].origin, low, sizeof low);
    struct spl_error err = {0};
    must(spl_dataset_writer_create(path, &b.writer, &err), &err);
    spl_dataset_writer_set_page_bytes(b.writer, make_dataset_page_bytes);
    if (levels == 1)
        add_node(&b, &b.nodes[0], splats, count, false);
    else
        add_two_levels(&b, splats, count);
    json_t *meta =
        json_pack("{s:I, s:I, s:i, s:f, s:{s:[fff], s:[fff]}, s:{s:[fff], s:[fff], s:[fff], s:f}, s:{s:b}, s:s*, "
                  "s:s*, s:[s], s:{}}",
                  "points", (json_int_t)points, "leaf_splats", (json_int_t)points, "levels", levels, "splat_radius",
                  radius, "bounds", "min", low[0], low[1], low[2], "max", high[0], high[1],
                  high[2], "default_view", "eye", middle[0] - size, middle[1] - 2 * size, middle[2] + size, "target",
                  middle[0], middle[1], middle[2], "up", 0.0, 0.0, 1.0, "fov", 50.0, "attributes", "color", 1, "unit",
                  make_dataset_unit, "crs", make_dataset_crs, "sources", "made by a test", "pack");
    must_have(meta);
    if (make_dataset_station)
        json_object_set_new(meta, "stations", json_pack("[[iiiiiiiiiiiiiiii]]", 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,
                                                        0, 0, 1));
    json_object_update(meta, (json_t *)make_dataset_meta);
    spl_dataset_writer_set_streams(b.writer, streams, SPL_STREAM_KNOWN_COUNT);
    must(spl_dataset_writer_finish(b.writer, b.nodes, b.node_count, b.chunks, b.chunk_count, meta, &err), &err);
    json_decref(meta);
    spl_dataset_writer_destroy(b.writer);
    free(b.chunks);
    for (int s = 0; s < SPL_STREAM_KNOWN_COUNT; s++) {
        free(b.bases[s]);
        free(b.widths[s]);
    }
}

void make_folder(char *path)
{
    const char *parent = getenv("TMPDIR");
    snprintf(path, 256, "%s/splatd-test-XXXXXX", parent ? parent : "/tmp");
    must_have(mkdtemp(path));
}

struct spl_dataset *make_dataset_levels(const struct make_splat *splats, size_t count, int levels)
{
    return make_dataset_panels(splats, count, NULL, 0, levels);
}

struct spl_dataset *make_dataset_panels(const struct make_splat *splats, size_t count,
                                        const struct make_panels *panels, size_t panel_count, int levels)
{
    char folder[256], path[300];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/made.spld", folder);
    make_dataset_file_panels(path, splats, count, panels, panel_count, levels);
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    int rc = spl_dataset_open(path, true, &dataset, &err);
    unlink(path);
    rmdir(folder);
    must(rc, &err);
    return dataset;
}

struct spl_dataset *make_dataset(const struct make_splat *splats, size_t count)
{
    return make_dataset_levels(splats, count, count <= node_splats_max ? 1 : 2);
}
