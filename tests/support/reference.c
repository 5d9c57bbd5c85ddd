/* The reference renderer; see reference.h. Written from the comments of the kernels, not from their code: where both
 * agree, the comment holds. Floats are used where the GPU uses floats, in the same order of operations. */
#include "support/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/dictionary.h"
#include "dataset/texture.h"
#include "geom/octahedral.h"
#include "geom/tangent.h"
#include "support/naive_select.h"
#include "support/reference_fill.h"
#include "support/reference_maps.h"

struct sample {
    float first;   /* pushed depth, INFINITY = nothing */
    float own;     /* method nearest: depth of the winner, which is not bent */
    uint32_t id;
    uint32_t fragments; /* discs that cover it */
    uint32_t word;    /* method fill: depth, spacing, linear */
    uint32_t payload; /* of the winner, where one wins: colour */
    float normal_winner[3];
    uint64_t color[3], weight;
    uint64_t depth, normal[3];
    float mapped[3]; /* colour with those of maps */
};

struct scene {
    const struct spl_dataset *dataset;
    const struct spl_view *view;
    struct spl_camera camera; /* in samples, with what method fill draws around the image */
    uint32_t guard;           /* samples of it */
    struct naive_chunk *chunks;
    size_t chunk_count;
    struct sample *samples;
    uint32_t weight_max;
    float margin;
    uint32_t *atoms;    /* the dictionary, expanded */
    uint32_t *textures; /* of page textures_page */
    uint32_t textures_page;
    const struct spl_chunk *coded; /* whose codes `code` has; NULL = none */
    struct spl_chunk_code code;
    struct reference_map *maps; /* NULL = none is drawn */
    bool colored;               /* they give colours */
};

struct disc {
    float p[3], n[3], radius;
    uint32_t id;
    uint8_t color[3];
    float world[3], texture_scale; /* with atoms: its normal, and its radius over that of its texture */
    bool smooth;                   /* texels are interpolated */
    float line[3], end;            /* of its clip line: across it, view space, and where it lies, radii */
    uint32_t planes;               /* atoms that are drawn at most; 0 = plain */
    const struct spl_chunk_code *code;
    const struct spl_splat_code *atoms; /* its own, of `code` */
    const struct reference_map *trims;  /* may be NULL */
};

/* Are discs drawn, and are they summed up? Else the nearest wins. */
static bool draws_discs(const struct spl_view *view)
{
    return view->method == SPL_METHOD_SPLAT || view->method == SPL_METHOD_NEAREST;
}

static bool sums(const struct scene *s)
{
    return s->view->method == SPL_METHOD_SPLAT;
}

static void to_view(const struct spl_camera *camera, const float v[3], float out[3])
{
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i;
        out[i] = (float)r[0] * v[0] + (float)r[1] * v[1] + (float)r[2] * v[2];
    }
}

static void footprint(const struct scene *s, const struct disc *d, int first[2], int last[2], float center[2])
{
    /* No tight bound here: the sphere's, which the tight one must agree with. */
    double f[2] = {s->camera.fx, s->camera.fy}, c[2] = {s->camera.cx, s->camera.cy};
    int size[2] = {(int)s->camera.width, (int)s->camera.height};
    float inverse = 1.0f / d->p[2];
    for (int i = 0; i < 2; i++) {
        center[i] = (float)f[i] * (d->p[i] * inverse) + (float)c[i];
        double a = (double)d->p[2] * d->p[2] - (double)d->radius * d->radius, low = -1e9, high = 1e9;
        if (a > 0) {
            double b = (double)d->p[i] * d->p[2];
            double root = d->radius * sqrt((double)d->p[i] * d->p[i] + a);
            low = f[i] * (b - root) / a + c[i];
            high = f[i] * (b + root) / a + c[i];
        }
        low = fmin(low, center[i] - 1);
        high = fmax(high, center[i] + 1);
        first[i] = low < 0 ? 0 : low > size[i] ? size[i] : (int)low;
        last[i] = high >= size[i] ? size[i] - 1 : high < 0 ? -1 : (int)high;
    }
}

/* Squared distance to the centre; `offset` from it, radii, in view space; view depth. */
static float coverage(const struct scene *s, const struct disc *d, const float center[2], int x, int y, float *z,
                      float offset[3])
{
    float ox = (float)x + (0.5f - center[0]), oy = (float)y + (0.5f - center[1]);
    float near_center = (ox * ox + oy * oy) * (1 / (SPL_LOW_PASS * SPL_LOW_PASS));
    const float *p = d->p, *n = d->n;
    float ifx = 1 / (float)s->camera.fx, ify = 1 / (float)s->camera.fy, inverse = 1.0f / p[2];
    float rx = p[0] * inverse, ry = p[1] * inverse, facing = n[0] * rx + n[1] * ry + n[2];
    float tilt = 1.0f / (fabsf(facing) < 1e-6f ? 1e-6f : facing), scale = p[2] / d->radius;
    float spans = sqrtf(fmaxf(1 - n[2] * n[2], 0)) / scale, low = SPL_LOW_PASS_REACH * ifx;
    float reach = spans > low ? spans : low;
    float divisor = 1.0f + (n[0] * ifx * tilt * ox + n[1] * ify * tilt * oy);
    float k = 1.0f / (divisor > 1e-6f ? divisor : 1e-6f), w = k - 1, fall = scale * w;
    float qx = rx * scale * w + ifx * scale * ox * k, qy = ry * scale * w + ify * scale * oy * k;
    float distance = qx * qx + qy * qy + fall * fall;
    memcpy(offset, (float[]){qx, qy, fall}, 3 * sizeof *offset);
    *z = p[2] * (1 + (w < -reach ? -reach : w > reach ? reach : w));
    if (qx * d->line[0] + qy * d->line[1] + fall * d->line[2] >= d->end)
        return 1;
    return distance < near_center ? distance : near_center;
}

/* The point of view space at depth z of sample (x, y). */
static void view_point(const struct scene *s, int64_t x, int64_t y, float z, float p[3])
{
    p[0] = ((float)x + 0.5f - (float)s->camera.cx) * (1 / (float)s->camera.fx) * z;
    p[1] = ((float)y + 0.5f - (float)s->camera.cy) * (1 / (float)s->camera.fy) * z;
    p[2] = z;
}

/* A channel of an atom's texel, + 128, at the level of `side` texels. */
static uint32_t texel_of(const struct scene *s, uint32_t atom, int channel, int column, int row, int side)
{
    int size = (int)spl_dataset_get_dictionary(s->dataset)->size;
    const uint32_t *level = s->atoms + (size_t)atom * spl_dictionary_atom_words((uint32_t)size) + 1;
    for (; size > side; size /= 2)
        level += size * size;
    return level[row * side + column] >> (16 - 8 * channel) & 255;
}

/* A channel of the splat's texture, 8 bit. */
static uint32_t sum_texel(const struct scene *s, const struct disc *d, int channel, int column, int row, int side)
{
    const struct spl_dictionary *dictionary = spl_dataset_get_dictionary(s->dataset);
    double sum = d->color[channel];
    for (uint32_t t = 0; t < d->atoms->count && t < d->planes; t++) {
        uint32_t atom = d->atoms->atom[t];
        double weight = 255.0 * spl_code_weight(&d->code->plane[t], d->atoms->weight[t]) * dictionary->scale[atom];
        sum += weight * ((double)texel_of(s, atom, channel, column, row, side) - 128);
    }
    return (uint32_t)fmin(fmax(sum + 0.5, 0), 255.5);
}

/* The colour of the splat's texture at `offset`. The level's texels are half a sample to a sample wide and the nearest
 * one counts; in chunks whose finest are wider than a sample they are interpolated, in steps of a 16th. */
static void sample_texture(const struct scene *s, const struct disc *d, const float offset[3], uint32_t color[3])
{
    const struct spl_dictionary *dictionary = spl_dataset_get_dictionary(s->dataset);
    int size = (int)dictionary->size, side = SPL_TEXTURE_SIDE_MIN;
    float diameter = 2 * d->radius / d->texture_scale * (float)s->camera.fx / d->p[2], u[3], v[3], uv[3], vv[3];
    while (side < size && (float)side <= diameter)
        side *= 2;
    spl_tangent_frame(d->world, u, v);
    to_view(&s->camera, u, uv);
    to_view(&s->camera, v, vv);
    float scale = 0.5f * (float)side * d->texture_scale, at[2] = {0.5f * (float)side, 0.5f * (float)side};
    for (int i = 0; i < 3; i++) {
        at[0] += offset[i] * (uv[i] * scale);
        at[1] += offset[i] * (vv[i] * scale);
    }
    bool magnified = d->smooth;
    int corner[2], part[2];
    for (int i = 0; i < 2; i++) {
        float most = (float)side - (magnified ? 1 : 0.5f),
              value = fminf(fmaxf(at[i] - (magnified ? 0.5f : 0), 0), most);
        corner[i] = (int)value;
        corner[i] -= magnified && corner[i] == side - 1;
        part[i] = magnified ? (int)((value - (float)corner[i]) * 16 + 0.5f) : 0;
    }
    for (int c = 0; c < 3; c++) {
        uint32_t sum = 128;
        for (int k = 0; k < (magnified ? 4 : 1); k++)
            sum += sum_texel(s, d, c, corner[0] + k % 2, corner[1] + k / 2, side) *
                   (uint32_t)((k % 2 ? part[0] : 16 - part[0]) * (k / 2 ? part[1] : 16 - part[1]));
        color[c] = sum >> 8;
    }
}

/* Method nearest: a fragment whose depth is bent to `bent`; each layer's least payload among equals. */
static void bend(struct sample *at, const struct disc *d, float z, float bent)
{
    uint32_t payload = d->color[0] | d->color[1] << 8 | (uint32_t)d->color[2] << 16;
    if (bent > at->first)
        return;
    bool nearer = bent < at->first;
    at->first = bent;
    at->payload = nearer || payload < at->payload ? payload : at->payload;
    at->own = nearer || z < at->own ? z : at->own;
    if (nearer || d->id < at->id) {
        at->id = d->id;
        memcpy(at->normal_winner, d->n, sizeof d->n);
    }
}

static void depth_disc(struct scene *s, const struct disc *d, bool shade)
{
    int first[2], last[2];
    float center[2], z, from_center[3];
    footprint(s, d, first, last, center);
    float pixel = SPL_LOW_PASS * d->p[2] / (float)s->camera.fx;
    float inverse = 1.0f / d->p[2], rx = d->p[0] * inverse, ry = d->p[1] * inverse;
    float facing = d->n[0] * rx + d->n[1] * ry + d->n[2], slant = 1.0f / fmaxf(fabsf(facing), 1e-6f);
    slant = slant < 1 ? 1 : slant > SPL_MARGIN_SLANT ? SPL_MARGIN_SLANT : slant;
    float margin = s->margin * (d->radius > pixel ? d->radius : pixel) * slant;
    for (int y = first[1]; y <= last[1]; y++) {
        for (int x = first[0]; x <= last[0]; x++) {
            float distance = coverage(s, d, center, x, y, &z, from_center);
            if (!(distance < 1))
                continue;
            float p[3];
            view_point(s, x, y, z, p);
            if (!(sums(s) && shade) && d->trims && reference_map_trims(d->trims, p, d->n, d->radius))
                continue;
            struct sample *at = &s->samples[(size_t)y * s->camera.width + (size_t)x];
            float pushed = z + margin;
            if (!sums(s)) {
                bend(at, d, z, z + margin * distance);
                continue;
            }
            if (!shade) {
                at->fragments++;
                if (pushed < at->first)
                    at->first = pushed;
                continue;
            }
            if (z > at->first || pushed < at->first) /* the latter was trimmed */
                continue;
            if (pushed == at->first && d->id < at->id)
                at->id = d->id;
            uint32_t weight = (uint32_t)((1 - distance) * (float)s->weight_max + 0.5f);
            weight = weight ? weight : 1;
            uint32_t offset = (uint32_t)((at->first - z) / at->first * 262144.0f + 0.5f);
            at->weight += weight;
            at->depth += (uint64_t)weight * (offset > 262143 ? 262143 : offset);
            uint32_t color[3] = {d->color[0], d->color[1], d->color[2]};
            if (d->planes)
                sample_texture(s, d, from_center, color);
            for (int i = 0; i < 3; i++) {
                at->color[i] += (uint64_t)weight * color[i];
                at->normal[i] += (uint64_t)weight * (uint32_t)(d->n[i] * 127.0f + 127.5f);
            }
        }
    }
}

static void project(const struct scene *s, const float p[3], float out[2])
{
    out[0] = (float)s->camera.fx * (p[0] / p[2]) + (float)s->camera.cx;
    out[1] = (float)s->camera.fy * (p[1] / p[2]) + (float)s->camera.cy;
}

/* `behind`: steps of depth that are added. */
static void put(struct scene *s, const float place[2], float z, const struct disc *d, uint32_t low_bits)
{
    if (!(place[0] >= 0 && place[1] >= 0 && place[0] < (float)s->camera.width && place[1] < (float)s->camera.height))
        return;
    struct sample *at = &s->samples[(size_t)place[1] * s->camera.width + (size_t)place[0]];
    uint32_t payload = d->color[0] | d->color[1] << 8 | (uint32_t)d->color[2] << 16;
    memcpy(&at->word, &z, 4);
    if (s->view->method == SPL_METHOD_FILL) { /* the low bits of the depth say more */
        at->word = (at->word & ~SPL_FILL_DEPTH_BITS) | low_bits;
        memcpy(&z, &at->word, 4);
    }
    if (z > at->first)
        return;
    bool nearer = z < at->first;
    at->first = z;
    at->payload = nearer || payload < at->payload ? payload : at->payload;
    if (nearer || d->id < at->id) {
        at->id = d->id;
        memcpy(at->normal_winner, d->n, sizeof d->n);
    }
}

static void point(struct scene *s, const struct disc *d, uint32_t low_bits)
{
    float place[2];
    project(s, d->p, place);
    put(s, place, d->p[2], d, low_bits);
}

/* From one vertex to the other, a sample a column or, where the line is upright, a row; `middle` as in fill_lines.comp. */
static void line(struct scene *s, const struct disc ends[2], const float from[3], const float to[3], float middle)
{
    float a[2], b[2];
    project(s, from, a);
    project(s, to, b);
    int main_axis = fabsf(b[1] - a[1]) > fabsf(b[0] - a[0]), other = 1 - main_axis;
    float inverse = 1 / (b[main_axis] - a[main_axis]), w0 = 1 / from[2], w1 = 1 / to[2];
    int size = (int)(main_axis ? s->camera.height : s->camera.width);
    for (int k = 0; k < size; k++) {
        float t = ((float)k + 0.5f - a[main_axis]) * inverse, place[2];
        if (t < 0 || t > 1)
            continue;
        place[main_axis] = (float)k;
        place[other] = a[other] + t * (b[other] - a[other]);
        float z = 1 / (w0 + t * (w1 - w0));
        put(s, place, z, &ends[!(t * w1 * z < middle)], SPL_FILL_LINEAR);
    }
}

/* A piece, without what lies beyond the planes near and far. */
static void piece(struct scene *s, const struct disc ends[2])
{
    const float *p = ends[0].p, *q = ends[1].p, near = (float)s->camera.near, far = (float)s->camera.far;
    float from[3], to[3], skip = 0, rest = 0;
    if (fmaxf(p[2], q[2]) <= near || fminf(p[2], q[2]) >= far)
        return;
    if (p[2] < near || p[2] > far)
        skip = (fminf(fmaxf(p[2], near), far) - p[2]) / (q[2] - p[2]);
    if (q[2] < near || q[2] > far)
        rest = (fminf(fmaxf(q[2], near), far) - q[2]) / (p[2] - q[2]);
    for (int c = 0; c < 3; c++) {
        from[c] = p[c] + skip * (q[c] - p[c]);
        to[c] = q[c] + rest * (p[c] - q[c]);
    }
    from[2] = fminf(fmaxf(p[2], near), far);
    to[2] = fminf(fmaxf(q[2], near), far);
    line(s, ends, from, to, (0.5f - skip) / (1 - skip - rest));
}

/* The codes of a chunk into s->code. */
static void load_code(struct scene *s, uint32_t page, const struct spl_chunk *chunk, uint32_t index)
{
    if (s->coded == chunk)
        return;
    if (!s->atoms) {
        s->atoms = spl_alloc_raw(spl_dataset_get_info(s->dataset)->dictionary_bytes, 1, NULL);
        spl_assert(s->atoms);
        spl_dictionary_expand(spl_dataset_get_dictionary(s->dataset), s->atoms);
    }
    if (!s->coded || s->textures_page != page) {
        free(s->textures);
        s->textures = spl_alloc_raw(spl_dataset_get_texture_bytes(s->dataset, page), 1, NULL);
        spl_assert(s->textures && !spl_dataset_read_textures(s->dataset, page, s->textures, NULL));
        s->textures_page = page;
    }
    uint32_t texture = spl_dataset_get_chunk_textures(s->dataset)[index];
    spl_texture_decode(s->textures + spl_texture_word(texture), spl_texture_planes(texture), chunk->count, &s->code);
    s->coded = chunk;
}

/* Splat or vertex `index` of a chunk as it is drawn; false where it lies before or behind what is. */
static bool load_disc(struct scene *s, const struct naive_chunk *drawn, uint32_t index, struct disc *d,
                      uint32_t *low_bits)
{
    uint64_t count;
    size_t bytes;
    const struct spl_node *node = &spl_dataset_get_nodes(s->dataset, &count)[drawn->node];
    const struct spl_chunk *chunk = &spl_dataset_get_chunks(s->dataset, &count)[drawn->chunk];
    const uint32_t *page = spl_dataset_get_page(s->dataset, node->page, &bytes);
    struct spl_chunk local = *chunk;
    struct spl_splat splat;
    local.origin[0] = local.origin[1] = local.origin[2] = 0;
    local.radius_min = (float)(chunk->radius_min * drawn->scale);
    local.radius_step = (float)(chunk->radius_step * drawn->scale);
    spl_chunk_decode(&local, page, index, &splat);
    *d = (struct disc){.radius = splat.radius,
                       .id = (uint32_t)chunk->first_id + index,
                       .texture_scale = (float)drawn->scale};
    memcpy(d->color, splat.color, sizeof d->color);
    memcpy(d->world, splat.normal, sizeof d->world);
    d->end = splat.clip.offset / d->texture_scale;
    to_view(&s->camera, splat.clip.direction, d->line);
    d->planes = drawn->planes;
    d->smooth = drawn->smooth;
    if (d->planes) {
        load_code(s, node->page, chunk, drawn->chunk);
        d->code = &s->code;
        d->atoms = &s->code.splat[index];
    }
    if (s->maps) {
        uint16_t own = spl_dataset_get_chunk_stations(s->dataset)[drawn->chunk].seen_by[0];
        d->trims = own & SPL_STATION_TRIMS ? &s->maps[(own & SPL_STATION_ROW) - 1] : NULL;
    }
    to_view(&s->camera, splat.position, d->p);
    to_view(&s->camera, splat.normal, d->n);
    for (int i = 0; i < 3; i++) {
        double origin = 0;
        for (int a = 0; a < 3; a++)
            origin += s->camera.rotation[3 * i + a] * (node->origin[a] - s->camera.eye[a] + chunk->origin[a]);
        d->p[i] += (float)origin;
    }
    double median = spl_dataset_get_info(s->dataset)->splat_radius;
    float radius = fminf(splat.radius, SPL_FILL_STRAY * local.radius_min);
    *low_bits = reference_fill_code(radius, median) << 1 | (splat.linear ? SPL_FILL_LINEAR : 0);
    return d->p[2] >= (float)s->camera.near && d->p[2] <= (float)s->camera.far;
}

/* Pieces from one vertex to the next, wherever they lie. */
static void for_each_piece(struct scene *s)
{
    for (size_t c = 0; c < s->chunk_count; c++)
        for (uint32_t index = 0; s->chunks[c].lines && index + 1 < s->chunks[c].count; index++) {
            struct disc ends[2];
            uint32_t goes_on, ignored;
            load_disc(s, &s->chunks[c], index, &ends[0], &goes_on);
            load_disc(s, &s->chunks[c], index + 1, &ends[1], &ignored);
            if (goes_on & SPL_FILL_LINEAR)
                piece(s, ends);
        }
}

static void for_each_disc(struct scene *s, bool shade)
{
    for (size_t c = 0; c < s->chunk_count; c++) {
        for (uint32_t index = 0; !s->chunks[c].lines && index < s->chunks[c].count; index++) {
            struct disc d;
            uint32_t low_bits;
            if (!load_disc(s, &s->chunks[c], index, &d, &low_bits))
                continue;
            if (!draws_discs(s->view))
                point(s, &d, low_bits);
            else
                depth_disc(s, &d, shade);
        }
    }
}

static uint32_t most_fragments(const struct scene *s)
{
    uint32_t most = 0;
    for (size_t i = 0; i < (size_t)s->camera.width * s->camera.height; i++)
        most = s->samples[i].fragments > most ? s->samples[i].fragments : most;
    return most;
}

static float depth_of(const struct scene *s, const struct sample *at)
{
    if (!sums(s))
        return s->view->method == SPL_METHOD_NEAREST ? at->own : at->first;
    return (float)((double)at->first * (1 - (double)at->depth / (double)at->weight / 262144.0));
}

static void normal_of(const struct scene *s, const struct sample *at, double out[3])
{
    double length = 0;
    for (int i = 0; i < 3; i++) {
        out[i] = sums(s) ? (double)at->normal[i] / (double)at->weight - 127.5 : at->normal_winner[i];
        length += out[i] * out[i];
    }
    for (int i = 0; i < 3; i++)
        out[i] /= sqrt(length);
}

/* What stands for the sample: where it is empty and at most one of the eight around it is, that of them whose depth is
 * closest to their mean. */
static const struct sample *standing_for(const struct scene *s, int64_t x, int64_t y)
{
    const struct sample *own = &s->samples[(size_t)y * s->camera.width + (size_t)x], *around[8], *found = own;
    int covered = 0;
    float sum = 0, closest = INFINITY;
    if (!sums(s) || own->first < INFINITY)
        return own;
    for (int64_t j = y > 0 ? y - 1 : y; j <= y + 1 && j < s->camera.height; j++)
        for (int64_t i = x > 0 ? x - 1 : x; i <= x + 1 && i < s->camera.width; i++) {
            const struct sample *beside = &s->samples[(size_t)j * s->camera.width + (size_t)i];
            if (beside->first == INFINITY)
                continue;
            around[covered++] = beside;
            sum += beside->first;
        }
    for (int i = 0; covered >= 7 && i < covered; i++) {
        float off = fabsf((float)covered * around[i]->first - sum);
        if (off < closest) {
            closest = off;
            found = around[i];
        }
    }
    return found;
}

/* Of method nearest: channel `c` of the mean over the samples around on its surface, 4 : 1 : 1/2. */
static float smooth_color(const struct scene *s, const struct sample *at, int c)
{
    int64_t index = at - s->samples, width = s->camera.width, x = index % width, y = index / width;
    double sum = 0, weights = 0;
    for (int64_t j = -1; j <= 1; j++)
        for (int64_t i = -1; i <= 1; i++) {
            bool inside = x + i >= 0 && x + i < width && y + j >= 0 && y + j < s->camera.height;
            const struct sample *beside = inside ? at + j * width + i : at;
            double weight = i && j ? 0.5 : i || j ? 1 : 4;
            if (!(fabsf(beside->first - at->first) <= SPL_SMOOTH_SHARE * at->first))
                continue;
            sum += weight * (beside->payload >> 8 * c & 255);
            weights += weight;
        }
    return (float)(sum / weights);
}

/* Channel `c` of what a sample contributes. */
static uint64_t color_of(const struct scene *s, const struct sample *at, int c)
{
    if (s->colored)
        return (uint64_t)(at->mapped[c] + 0.5f);
    if (sums(s))
        return (at->color[c] + at->weight / 2) / at->weight;
    return s->view->method == SPL_METHOD_NEAREST ? (uint64_t)(smooth_color(s, at, c) + 0.5f) : at->payload >> 8 * c & 255;
}

/* Method nearest keeps how far a depth was bent as a share of it, a float of four bits behind its first. */
static float surface_of(const struct scene *s, const struct sample *at)
{
    if (at->first == INFINITY)
        return 0;
    if (sums(s))
        return depth_of(s, at);
    int exponent;
    double share = ((double)at->first - (double)at->own) / (double)at->first, mantissa = frexp(share, &exponent);
    return share < 1 / 65536.0 ? at->first : (float)(at->first * (1 - ldexp(round(mantissa * 32) / 32, exponent)));
}

/* How far the surface goes from (x, y) to the next sample along an axis: by the means of both sides, each weighted by
 * how far off the other one's depth is; at the same depth where a side holds nothing. */
static void surface_step(const struct scene *s, const float *depths, int64_t x, int64_t y, int axis, float step[3])
{
    int64_t width = s->camera.width, height = s->camera.height;
    float z = depths[y * width + x], p[3], off[2], side[2][3];
    view_point(s, x, y, z, p);
    for (int i = 0; i < 2; i++) {
        int64_t bx = x + (axis ? 0 : 2 * i - 1), by = y + (axis ? 2 * i - 1 : 0);
        float beside = bx >= 0 && bx < width && by >= 0 && by < height ? depths[by * width + bx] : 0, q[3];
        view_point(s, bx, by, beside > 0 ? beside : z, q);
        off[i] = beside > 0 ? fabsf(beside - z) + 1e-6f * z : 1e30f;
        for (int c = 0; c < 3; c++)
            side[i][c] = i ? q[c] - p[c] : p[c] - q[c];
    }
    for (int c = 0; c < 3; c++)
        step[c] = side[1][c] + (side[0][c] - side[1][c]) * (off[1] / (off[0] + off[1]));
}

/* Colours of every sample, of all stations: who asks for this has each chunk seen by all there are. */
static void add_maps(struct scene *s)
{
    int64_t width = s->camera.width, count = width * s->camera.height;
    float *depths = spl_alloc((size_t)count, sizeof *depths, NULL);
    uint32_t maps = spl_dataset_get_info(s->dataset)->maps;
    for (int64_t i = 0; i < count; i++)
        depths[i] = surface_of(s, &s->samples[i]);
    for (int64_t i = 0; i < count; i++) {
        struct sample *at = &s->samples[i];
        if (!(depths[i] > 0))
            continue;
        struct reference_sample sample = {.radius = fmaxf(at->first - depths[i], 0) / fmaxf(s->margin, 1e-6f)};
        float weights = SPL_MAP_BASE, sum[3];
        for (int c = 0; c < 3; c++)
            sum[c] = SPL_MAP_BASE * (sums(s) ? (float)at->color[c] / (float)at->weight : smooth_color(s, at, c));
        view_point(s, i % width, i / width, depths[i], sample.p);
        surface_step(s, depths, i % width, i / width, 0, sample.right);
        surface_step(s, depths, i % width, i / width, 1, sample.down);
        for (uint32_t m = 0; m < maps; m++) {
            float color[3], weight = reference_map_color(&s->maps[m], &sample, color);
            weights += weight;
            for (int c = 0; c < 3; c++)
                sum[c] += weight * color[c];
        }
        for (int c = 0; c < 3; c++)
            at->mapped[c] = sum[c] / weights;
    }
    free(depths);
    s->colored = true;
}

static void resolve_pixel(struct scene *s, uint32_t x, uint32_t y, struct spl_frame *frame)
{
    uint32_t side = (uint32_t)s->view->supersample, covered = 0, id = UINT32_MAX, near_count = 0,
             width = s->view->camera.width;
    float nearest = INFINITY;
    uint64_t color[3] = {0};
    double normal[3] = {0}, depth = 0;
    size_t pixel = (size_t)y * width + x;
    for (uint32_t pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < side * side; i++) {
            const struct sample *at = standing_for(s, x * side + i % side + s->guard, y * side + i / side + s->guard);
            if (at->first == INFINITY)
                continue;
            if (pass == 1) {
                if (at->first <= nearest * 1.01f) {
                    depth += depth_of(s, at);
                    near_count++;
                }
                continue;
            }
            covered++;
            if (at->first < nearest || (at->first == nearest && at->id < id))
                id = at->id;
            nearest = fminf(nearest, at->first);
            double n[3];
            normal_of(s, at, n);
            for (int c = 0; c < 3; c++) {
                color[c] += color_of(s, at, c);
                normal[c] += n[c];
            }
        }
    }
    const struct spl_image *images = frame->images;
    if (images[SPL_LAYER_COLOR].pixels) {
        uint8_t *out = (uint8_t *)images[SPL_LAYER_COLOR].pixels + 4 * pixel;
        const uint8_t *back = s->view->background;
        uint32_t back_weight = back[3] * (side * side - covered), weight = 255 * covered + back_weight;
        for (int c = 0; c < 3; c++)
            out[c] = weight ? (uint8_t)((255 * color[c] + back_weight * back[c] + weight / 2) / weight) : 0;
        out[3] = (uint8_t)((weight + side * side / 2) / (side * side));
    }
    float z = covered ? (float)(depth / near_count) : NAN;
    if (images[SPL_LAYER_DEPTH].pixels)
        ((float *)images[SPL_LAYER_DEPTH].pixels)[pixel] = z;
    if (images[SPL_LAYER_RANGE].pixels) {
        double rx = ((x + 0.5) * side + s->guard - s->camera.cx) / s->camera.fx,
               ry = ((y + 0.5) * side + s->guard - s->camera.cy) / s->camera.fy;
        ((float *)images[SPL_LAYER_RANGE].pixels)[pixel] = (float)(z * sqrt(1 + rx * rx + ry * ry));
    }
    if (images[SPL_LAYER_NORMAL].pixels) {
        float *out = (float *)images[SPL_LAYER_NORMAL].pixels + 3 * pixel;
        const double *r = s->camera.rotation;
        double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        for (int i = 0; i < 3; i++)
            out[i] = covered ? (float)((r[i] * normal[0] + r[3 + i] * normal[1] + r[6 + i] * normal[2]) / length) : 0;
    }
    if (images[SPL_LAYER_ID].pixels)
        ((uint32_t *)images[SPL_LAYER_ID].pixels)[pixel] = id;
    if (images[SPL_LAYER_COVERAGE].pixels)
        ((float *)images[SPL_LAYER_COVERAGE].pixels)[pixel] = (float)covered / (float)(side * side);
}

static void fill(struct scene *s, const struct fill_plan *plan)
{
    size_t count = (size_t)s->camera.width * s->camera.height;
    struct fill_sample *samples = spl_alloc(count, sizeof *samples, NULL);
    spl_assert(samples);
    for (size_t i = 0; i < count; i++) {
        const struct sample *at = &s->samples[i];
        samples[i] = (struct fill_sample){.word = SPL_NOTHING, .id = at->id};
        if (at->first < INFINITY)
            memcpy(&samples[i].word, &at->first, 4);
        for (int c = 0; c < 3; c++) {
            samples[i].color[c] = at->payload >> 8 * c & 255;
            samples[i].normal[c] = at->normal_winner[c];
        }
    }
    reference_fill(samples, s->camera.width, s->camera.height, s->camera.fx,
                   spl_dataset_get_info(s->dataset)->splat_radius, s->view, plan);
    for (size_t i = 0; i < count; i++) {
        struct sample *at = &s->samples[i];
        at->first = INFINITY;
        if (samples[i].word == SPL_NOTHING)
            continue;
        memcpy(&at->first, &samples[i].word, 4);
        at->id = samples[i].id;
        at->payload = 0;
        for (int c = 0; c < 3; c++) {
            at->payload |= (uint32_t)samples[i].color[c] << 8 * c;
            at->normal_winner[c] = (float)samples[i].normal[c];
        }
    }
    free(samples);
}

int reference_render(const struct spl_dataset *dataset, const struct spl_view *view, struct spl_frame *frame,
                     struct spl_error *err)
{
    memset(frame, 0, sizeof *frame);
    struct scene s = {.dataset = dataset, .view = view, .camera = view->camera};
    s.camera.width *= (uint32_t)view->supersample;
    s.camera.height *= (uint32_t)view->supersample;
    s.camera.fx *= view->supersample;
    s.camera.fy *= view->supersample;
    s.camera.cx *= view->supersample;
    s.camera.cy *= view->supersample;
    s.margin = (float)view->disc.margin;
    const bool mapped =
        spl_dataset_get_info(dataset)->maps && view->maps == SPL_MAPS_ON && draws_discs(view);
    const struct naive_options options = {.dataset = dataset,
                                          .camera = &s.camera,
                                          .lod = view->lod,
                                          .atoms = view->method == SPL_METHOD_SPLAT && !mapped ? view->disc.atoms : 0};
    struct fill_plan plan = {0};
    int rc = SPL_OK;
    if (view->method == SPL_METHOD_FILL) {
        s.chunks = naive_select(&options, &s.chunk_count);
        plan = fill_plan_of(view, naive_spacing(s.chunks, s.chunk_count));
        free(s.chunks);
        s.guard = plan.guard;
        s.camera.width += 2 * plan.guard;
        s.camera.height += 2 * plan.guard;
        s.camera.cx += plan.guard;
        s.camera.cy += plan.guard;
    }
    s.maps = mapped ? reference_maps(dataset, &s.camera) : NULL;
    s.chunks = naive_select(&options, &s.chunk_count);
    size_t count = (size_t)s.camera.width * s.camera.height;
    s.samples = rc ? NULL : spl_alloc(count, sizeof *s.samples, err);
    if (!rc && !s.samples)
        rc = SPL_E_NOMEM;
    static const enum spl_pixel_type types[SPL_LAYER_COUNT] = {SPL_PIXEL_RGBA8, SPL_PIXEL_F32, SPL_PIXEL_F32,
                                                               SPL_PIXEL_F32X3, SPL_PIXEL_U32, SPL_PIXEL_F32};
    for (int i = 0; i < SPL_LAYER_COUNT && !rc; i++) {
        if (!(view->layers >> i & 1))
            continue;
        struct spl_image *image = &frame->images[i];
        *image = (struct spl_image){
            .layer = i, .type = types[i], .width = view->camera.width, .height = view->camera.height};
        image->pixels = spl_alloc((size_t)image->width * image->height, spl_pixel_bytes(types[i]), err);
        rc = image->pixels ? SPL_OK : SPL_E_NOMEM;
    }
    if (!rc) {
        for (size_t i = 0; i < count; i++)
            s.samples[i] = (struct sample){.first = INFINITY, .id = UINT32_MAX};
        for_each_disc(&s, false);
        if (view->method == SPL_METHOD_FILL)
            for_each_piece(&s);
        s.weight_max = naive_weight(most_fragments(&s));
        if (sums(&s))
            for_each_disc(&s, true);
        if (view->method == SPL_METHOD_FILL)
            fill(&s, &plan);
        if (mapped && view->layers >> SPL_LAYER_COLOR & 1)
            add_maps(&s);
        for (uint32_t y = 0; y < view->camera.height; y++)
            for (uint32_t x = 0; x < view->camera.width; x++)
                resolve_pixel(&s, x, y, frame);
    }
    for (uint32_t m = 0; mapped && m < spl_dataset_get_info(dataset)->maps; m++)
        free(s.maps[m].words);
    free(s.maps);
    free(s.chunks);
    free(s.samples);
    free(s.textures);
    free(s.atoms);
    if (rc)
        spl_frame_finish(frame);
    return rc;
}
