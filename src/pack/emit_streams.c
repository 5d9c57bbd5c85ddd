/* Values of points and of inner nodes' splats into streams of codes; see emit_streams.h. Encoding runs on every worker,
 * the rest on the packer's thread. */
#include "pack/emit_streams.h"

#include <stdlib.h>

#include "base/memory.h"
#include "pack/kept.h"

/* What an attribute of the dataset is of a point, of an inner node's splat and of a panel. */
static double class_of_point(const struct spl_points *points, size_t i)
{
    return points->color_class[i] >> 24;
}

static double class_of_inner(const struct spl_inner_splat *splat)
{
    return splat->color_class >> 24;
}

static double class_of_panel(const struct spl_panel_values *values)
{
    return values->classification;
}

static double uncertainty_of_point(const struct spl_points *points, size_t i)
{
    return (double)points->uncertainty[i];
}

static double uncertainty_of_inner(const struct spl_inner_splat *splat)
{
    return (double)spl_inner_get_uncertainty(splat);
}

static double uncertainty_of_panel(const struct spl_panel_values *values)
{
    return values->uncertainty;
}

static bool has_class(const struct spl_points *points)
{
    return points->has_class;
}

static bool has_surface(const struct spl_points *points)
{
    return !points->no_surface;
}

static const struct attribute {
    bool (*has)(const struct spl_points *points);
    double (*of_point)(const struct spl_points *points, size_t i);
    double (*of_inner)(const struct spl_inner_splat *splat);
    double (*of_panel)(const struct spl_panel_values *values);
} attributes[SPL_STREAM_KNOWN_COUNT] = {
    [SPL_STREAM_CLASS] = {has_class, class_of_point, class_of_inner, class_of_panel},
    [SPL_STREAM_UNCERTAINTY] = {has_surface, uncertainty_of_point, uncertainty_of_inner, uncertainty_of_panel},
};

void spl_emitted_streams_init(struct spl_emitted_streams *streams, const struct spl_points *points)
{
    *streams = (struct spl_emitted_streams){0};
    for (int a = 0; a < SPL_STREAM_KNOWN_COUNT; a++)
        if (attributes[a].has(points)) {
            streams->which[streams->count] = a;
            streams->list[streams->count++] = spl_streams_known[a];
        }
    int scalars[SPL_POINT_SCALARS];
    streams->scalar_count = spl_points_list_scalars(points, scalars);
    for (uint32_t s = 0; s < streams->scalar_count; s++) {
        const struct spl_scalar_values *scalar = &points->scalar[scalars[s]];
        const char *name = spl_kept_name(points->keep, scalars[s]);
        streams->which[streams->count] = SPL_STREAM_KNOWN_COUNT + scalars[s];
        streams->list[streams->count++] = (struct spl_stream){.name = name,
                                                              .type = scalar->plain ? "uint" : "steps",
                                                              .unit = spl_kept_unit(name),
                                                              .first = scalar->first,
                                                              .steps_a_unit = scalar->steps_a_unit};
    }
}

void spl_emitted_streams_finish(struct spl_emitted_streams *streams)
{
    for (uint32_t s = 0; s < streams->count; s++) {
        free(streams->bases[s]);
        free(streams->widths[s]);
    }
    *streams = (struct spl_emitted_streams){0};
}

static void take_attribute(const struct attribute *attribute, const struct spl_points *points,
                           const struct spl_tree_node *node, const struct spl_cut *items, uint32_t count,
                           double *values)
{
    for (uint32_t i = 0; i < count; i++)
        values[i] = spl_tree_node_has_points(node) ? attribute->of_point(points, node->begin + items[i].index)
                                                   : attribute->of_inner(&node->splats[items[i].index]);
}

/* The `s`-th of `scalars` that the points have. */
static void take_scalar(const struct spl_scalar_values *scalar, uint32_t s, uint32_t scalars,
                        const struct spl_tree_node *node, const struct spl_cut *items, uint32_t count, double *values)
{
    for (uint32_t i = 0; i < count; i++)
        values[i] = spl_tree_node_has_points(node) ? spl_scalar_number(scalar, node->begin + items[i].index)
                                                   : node->numbers[(size_t)items[i].index * scalars + s];
}

uint32_t spl_emitted_streams_encode(const struct spl_emitted_streams *streams, const struct spl_points *points,
                                    const struct spl_tree_node *node, const struct spl_cut *items, uint32_t count,
                                    struct spl_stream_code *codes, uint32_t *words)
{
    uint32_t used = 0;
    uint32_t first_scalar = streams->count - streams->scalar_count;
    for (uint32_t s = 0; s < streams->count; s++) {
        double values[SPL_CHUNK_SPLATS];
        if (s < first_scalar)
            take_attribute(&attributes[streams->which[s]], points, node, items, count, values);
        else
            take_scalar(&points->scalar[streams->which[s] - SPL_STREAM_KNOWN_COUNT], s - first_scalar,
                        streams->scalar_count, node, items, count, values);
        used +=
            spl_stream_encode(spl_stream_type_from_name(streams->list[s].type), values, count, &codes[s], words + used);
    }
    return used;
}

uint32_t spl_emitted_streams_encode_panels(const struct spl_emitted_streams *streams,
                                           const struct spl_node_panels *panels, size_t first, uint32_t count,
                                           struct spl_stream_code *codes, uint32_t *words)
{
    uint32_t used = 0;
    uint32_t first_scalar = streams->count - streams->scalar_count;
    for (uint32_t s = 0; s < streams->count; s++) {
        double values[SPL_PANELS_MAX];
        for (uint32_t i = 0; i < count; i++)
            values[i] = s < first_scalar
                            ? attributes[streams->which[s]].of_panel(&panels->values[first + i])
                            : panels->numbers[(first + i) * streams->scalar_count + s - first_scalar];
        used +=
            spl_stream_encode(spl_stream_type_from_name(streams->list[s].type), values, count, &codes[s], words + used);
    }
    return used;
}

int spl_emitted_streams_reserve(struct spl_emitted_streams *streams, size_t chunks, struct spl_error *err)
{
    for (uint32_t s = 0; s < streams->count; s++) {
        uint32_t *bases = spl_realloc(streams->bases[s], chunks, sizeof *bases, err);
        if (!bases)
            return SPL_E_NOMEM;
        streams->list[s].base = streams->bases[s] = bases;
        uint8_t *widths = spl_realloc(streams->widths[s], chunks, sizeof *widths, err);
        if (!widths)
            return SPL_E_NOMEM;
        streams->list[s].width = streams->widths[s] = widths;
    }
    return SPL_OK;
}

void spl_emitted_streams_keep(struct spl_emitted_streams *streams, uint64_t first, const struct spl_chunk *chunks,
                              struct spl_stream_code (*codes)[SPL_STREAMS_MAX], uint32_t count, uint64_t *header_bits)
{
    for (uint32_t c = 0; c < count; c++)
        for (uint32_t s = 0; s < streams->count; s++) {
            uint32_t width = codes[c][s].width, splats = chunks[c].count;
            streams->bases[s][first + c] = codes[c][s].base;
            streams->widths[s][first + c] = codes[c][s].width;
            streams->bits[s] += (uint64_t)width * splats;
            *header_bits += 32ull * spl_stream_words(width, splats) - width * splats + 8 * SPL_STREAM_CHUNK_BYTES;
        }
}
