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
#include "render/advance.h"
#include "support/naive_select.h"
#include "support/reference_fill.h"
#include "support/reference_lines.h"
#include "support/reference_maps.h"
#include "support/reference_marks.h"
#include "support/reference_panels.h"
#include "support/reference_scene.h"

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

static bool draws_panels(const struct spl_view *view)
{
    return draws_discs(view) && (view->shapes == SPL_SHAPES_PANELS || view->shapes == SPL_SHAPES_ALL);
}

static bool draws_meshes(const struct spl_view *view)
{
    return draws_discs(view) && view->shapes == SPL_SHAPES_ALL;
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
    float inverse = 1.0f / ray_scale(&s->camera, d->p[2]);
    for (int i = 0; i < 2; i++) {
        center[i] = (float)f[i] * (d->p[i] * inverse) + (float)c[i];
        double a = (double)d->p[2] * d->p[2] - (double)d->radius * d->radius, low = -1e9, high = 1e9;
        if (s->camera.projection == SPL_ORTHOGRAPHIC) {
            low = f[i] * ((double)d->p[i] - d->radius) + c[i];
            high = f[i] * ((double)d->p[i] + d->radius) + c[i];
        } else if (a > 0) {
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

/* What a slope of the disc's plane along parallel rays, depth by sample, is multiplied with, so that the disc is seen
 * SPL_THIN samples wide. */
static float ease(const struct scene *s, const float slope[2], float scale)
{
    float steep = sqrtf(slope[0] * slope[0] + slope[1] * slope[1]);
    float low = SPL_LOW_PASS_REACH / SPL_LOW_PASS * (1 / (float)s->camera.fx);
    return fminf(fmaxf(2 / (SPL_THIN * scale), low) / fmaxf(steep, 1e-30f), 1);
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
    if (s->camera.projection == SPL_ORTHOGRAPHIC) { /* depth is linear along the plane's image */
        float each = 1.0f / d->radius, flat = 1.0f / (fabsf(n[2]) < 1e-6f ? 1e-6f : n[2]);
        float slope[2] = {n[0] * ifx * flat, n[1] * ify * flat}, eased = ease(s, slope, each);
        float deep = -(slope[0] * ox + slope[1] * oy), drop = eased * deep;
        float most = fmaxf(sqrtf(fmaxf(1 - n[2] * n[2], 0)) / each, low);
        memcpy(offset, (float[]){ifx * each * ox, ify * each * oy, each * drop}, 3 * sizeof *offset);
        *z = p[2] + (deep < -most ? -most : deep > most ? most : deep);
        float there = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        bool clipped = offset[0] * d->line[0] + offset[1] * d->line[1] + offset[2] * d->line[2] >= d->end;
        return clipped ? 1 : fminf(there, near_center);
    }
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
    float diameter = 2 * d->radius / d->texture_scale * (float)s->camera.fx / ray_scale(&s->camera, d->p[2]), u[3],
          v[3], uv[3], vv[3];
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

/* A normal as the word by which kernels tell the least of several. */
static uint32_t normal_word(const float n[3])
{
    float e[2];
    spl_octahedral_encode(n, &e[0], &e[1]);
    return (uint32_t)((e[0] + 1) * 32767 + 0.5f) | (uint32_t)((e[1] + 1) * 32767 + 0.5f) << 16;
}

/* Method nearest: a fragment whose depth is bent to `bent`, `off` 63rds off its disc's centre and above them its size;
 * each layer's least payload among equals. */
static void bend(struct sample *at, const struct disc *d, float z, float bent, uint32_t off)
{
    uint32_t payload = d->color[0] | d->color[1] << 8 | (uint32_t)d->color[2] << 16 | off << 24;
    if (bent > at->first)
        return;
    bool nearer = bent < at->first;
    at->first = bent;
    at->payload = nearer || payload < at->payload ? payload : at->payload;
    at->own = nearer || z < at->own ? z : at->own;
    if (nearer || d->id < at->id)
        at->id = d->id;
    if (nearer || normal_word(d->n) < normal_word(at->normal_winner))
        memcpy(at->normal_winner, d->n, sizeof d->n);
}

/* A fragment of `d` at (x, y): its depth, squared distance to the centre, how far it lies off, how far back it is
 * pushed. */
struct fragment {
    float z, distance, offset[3], margin, behind;
    float centre; /* depth that the margin is told as a share of: of a disc its centre's, of what else its own */
    bool back;  /* it turns its back to the eye */
    bool lines; /* it is of a line, which has no sides */
    bool whole; /* of a line or a panel, whose samples all weigh 1 in method nearest */
    uint32_t size; /* of a disc, there: how often its radius was halved */
};

/* Words of depths of method splat end in 7 bits: the share that they are pushed back by, 2 bits of mantissa and
 * exponents -16 to -1 rounded down, then whether a back is seen. */
static float with_side(const struct scene *s, float pushed, float margin, float z, bool back)
{
    const float share = margin / (z + margin);
    uint32_t word;
    int exponent;
    const float mantissa = frexpf(share, &exponent); /* 0.5 to 1 */
    const int steps = share > 0 ? 4 * (exponent + 15) + (int)(8 * mantissa) - 4 : 0;
    memcpy(&word, &pushed, 4);
    const uint32_t side = (uint32_t)(steps < 0 ? 0 : steps > 63 ? 63 : steps) << 1 | back;
    word = ((word + s->side_bits) & ~s->side_bits) | (side & s->side_bits);
    memcpy(&pushed, &word, 4);
    return pushed;
}

/* Turns what is seen at depth z the other side to the eye than what set `first`, behind it? */
static bool is_hidden(const struct scene *s, float first, float z, bool back)
{
    uint32_t word;
    memcpy(&word, &first, 4);
    const int steps = word >> 1 & 63;
    const float share = steps ? ldexpf((float)(4 + steps % 4) / 8, steps / 4 - 15) : 0;
    return s->side_bits && (word & 1) != back && z > first * (1 - share);
}

static void draw(struct scene *s, const struct disc *d, struct sample *at, const struct fragment *f, bool shade)
{
    float z = f->z, pushed = z + f->margin + f->behind;
    bool light = f->distance >= 1; /* a cell that stands for a panel */
    if (!sums(s)) {
        bend(at, d, z, z + (light ? 0 : f->margin * f->distance) + f->behind,
             f->whole ? 0 : (uint32_t)(f->distance * 63) | f->size << 6);
        return;
    }
    pushed = with_side(s, pushed, f->margin, f->centre, f->back);
    if (!shade) {
        at->light += light;
        at->fragments += !light;
        if (pushed < at->first)
            at->first = pushed;
        return;
    }
    if (z + f->behind > at->first || pushed < at->first) /* the latter was trimmed */
        return;
    if (!f->lines && is_hidden(s, at->first, z + f->behind, f->back))
        return;
    if (pushed == at->first && d->id < at->id)
        at->id = d->id;
    uint32_t weight = (uint32_t)((1 - f->distance) * (float)s->weight_max + 0.5f);
    weight = weight ? weight : 1;
    uint32_t offset = (uint32_t)((at->first - z) / at->first * 262144.0f + 0.5f);
    at->weight += weight;
    at->depth += (uint64_t)weight * (offset > 262143 ? 262143 : offset);
    uint32_t color[3] = {d->color[0], d->color[1], d->color[2]};
    if (d->planes)
        sample_texture(s, d, f->offset, color);
    for (int i = 0; i < 3; i++) {
        at->color[i] += (uint64_t)weight * color[i];
        at->normal[i] += (uint64_t)weight * (uint32_t)(d->n[i] * 127.0f + 127.5f);
    }
}

static struct sample *sample_of(struct scene *s, int64_t x, int64_t y)
{
    return &s->samples[y * s->camera.width + x];
}

static float margin_of(const struct scene *s, float radius, float z, float slant)
{
    float pixel = SPL_LOW_PASS * ray_scale(&s->camera, z) * (1 / (float)s->camera.fx);
    return s->margin * (radius > pixel ? radius : pixel) * slant;
}

static void to_world(const struct scene *s, const float p[3], double world[3])
{
    for (int a = 0; a < 3; a++) {
        world[a] = s->camera.eye[a];
        for (int i = 0; i < 3; i++)
            world[a] += s->camera.rotation[3 * i + a] * (double)p[i];
    }
}

/* Is what lies at `p`, view space, left out? Discs are asked of their samples. */
static bool is_dropped(const struct scene *s, uint64_t id, const float p[3])
{
    double world[3];
    if (!s->view->clip.count)
        return false;
    to_world(s, p, world);
    return !reference_is_drawn(s->dataset, &s->view->clip, id, world);
}

/* Of a disc at a sample that lies `offset` off its centre, within its rim. */
static bool is_cut(const struct scene *s, const struct disc *d, const float offset[3])
{
    const float off = sqrtf(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]);
    float p[3];
    for (int i = 0; i < 3; i++)
        p[i] = d->p[i] + d->radius / fmaxf(off, 1) * offset[i];
    return is_dropped(s, d->id, p);
}

static void depth_disc(struct scene *s, const struct disc *d, bool shade)
{
    int first[2], last[2];
    float center[2], p[3];
    footprint(s, d, first, last, center);
    float inverse = 1.0f / d->p[2], rx = d->p[0] * inverse, ry = d->p[1] * inverse;
    float facing = d->n[0] * rx + d->n[1] * ry + d->n[2];
    facing = s->camera.projection == SPL_ORTHOGRAPHIC ? d->n[2] : facing;
    float slant = 1.0f / fmaxf(fabsf(facing), 1e-6f);
    slant = slant < 1 ? 1 : slant > SPL_MARGIN_SLANT ? SPL_MARGIN_SLANT : slant;
    struct fragment f = {.margin = margin_of(s, d->radius, d->p[2], slant),
                         .centre = d->p[2],
                         .back = facing > 0,
                         .behind = s->sided && facing > 0 ? d->radius : 0};
    float radius = (float)s->camera.fx * fminf(fabsf(facing), 1) * d->radius / ray_scale(&s->camera, d->p[2]);
    for (radius /= SPL_SMOOTH_RADIUS; radius >= 1 && f.size < 2; radius /= 2)
        f.size++;
    for (int y = first[1]; y <= last[1]; y++) {
        for (int x = first[0]; x <= last[0]; x++) {
            f.distance = coverage(s, d, center, x, y, &f.z, f.offset);
            if (!(f.distance < 1) || is_cut(s, d, f.offset))
                continue;
            view_point(s, x, y, f.z, p);
            if (!(sums(s) && shade) && d->trims && reference_map_trims(d->trims, p, d->n, d->radius))
                continue;
            draw(s, d, sample_of(s, x, y), &f, shade);
        }
    }
}

/* Is what lies at `p`, view space, not drawn, since it is soft? */
static bool is_soft(const struct scene *s, uint64_t id, const float p[3])
{
    double world[3];
    if (!s->view->soft.what.count)
        return false;
    to_world(s, p, world);
    return reference_is_soft(s->dataset, &s->view->soft, id, world);
}

/* A chunk of panels that is drawn. */
struct panels {
    struct scene *scene;
    struct reference_plane plane;
    const struct reference_map *trims; /* may be NULL */
    bool shade;
};

static void draw_fragment(void *context, const struct reference_fragment *from)
{
    const struct panels *panels = context;
    struct scene *s = panels->scene;
    if (is_soft(s, from->id, (const float[3]){0})) /* terms of shapes cut panels into cells */
        return;
    const struct reference_plane *plane = &panels->plane;
    float radius = plane->chunk->radius_min;
    struct disc d = {.id = from->id};
    memcpy(d.n, from->normal, sizeof d.n);
    memcpy(d.color, sums(s) ? from->smooth : from->color, sizeof d.color);
    float p[3];
    view_point(s, from->x, from->y, from->z, p);
    if (is_dropped(s, from->id, from->middle ? from->middle : p))
        return;
    if (!(sums(s) && panels->shade) && panels->trims && reference_map_trims(panels->trims, p, d.n, radius))
        return;
    struct fragment f = {.z = from->z,
                         .centre = from->z,
                         .distance = from->light,
                         .margin = margin_of(s, radius, from->z, from->slant),
                         .back = from->behind,
                         .behind = s->sided && from->behind ? radius : 0,
                         .whole = true};
    draw(s, &d, sample_of(s, from->x, from->y), &f, panels->shade);
}

/* A piece of a line that has a width. */
static void wide_piece(struct scene *s, const struct disc ends[2], const struct reference_piece *cut, bool shade)
{
    const struct reference_capsule c = reference_capsule(&s->camera, cut);
    for (int64_t y = 0; y < s->camera.height; y++)
        for (int64_t x = 0; x < s->camera.width; x++) {
            struct fragment f = {.lines = true, .whole = true};
            bool second;
            f.distance = reference_capsule_sample(&c, (int)x, (int)y, &f.z, &second);
            f.margin = margin_of(s, cut->half, f.z, 1);
            f.centre = f.z;
            float p[3];
            view_point(s, (int)x, (int)y, f.z, p);
            if (f.distance < 1 && !is_dropped(s, UINT64_MAX, p))
                draw(s, &ends[second], sample_of(s, x, y), &f, shade);
        }
}

static void project(const struct scene *s, const float p[3], float out[2])
{
    float scale = ray_scale(&s->camera, p[2]);
    out[0] = (float)s->camera.fx * (p[0] / scale) + (float)s->camera.cx;
    out[1] = (float)s->camera.fy * (p[1] / scale) + (float)s->camera.cy;
}

/* Of several at one depth the least wins, of each layer's own word. */
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
    if (nearer || normal_word(d->n) < normal_word(at->normal_winner))
        memcpy(at->normal_winner, d->n, sizeof d->n);
    if (nearer || d->id < at->id)
        at->id = d->id;
}

static void point(struct scene *s, const struct disc *d, uint32_t low_bits)
{
    float place[2];
    project(s, d->p, place);
    put(s, place, d->p[2], d, low_bits);
}

/* From one vertex to the other, a sample a column or, where the line is upright, a row; `middle` as in fill_lines.comp.
 */
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
        bool parallel = s->camera.projection == SPL_ORTHOGRAPHIC;
        float z = parallel ? from[2] + t * (to[2] - from[2]) : 1 / (w0 + t * (w1 - w0));
        put(s, place, z, &ends[!((parallel ? t : t * w1 * z) < middle)], SPL_FILL_LINEAR);
    }
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

/* The map that trims a chunk; NULL: none does. */
static const struct reference_map *trims_of(const struct scene *s, uint32_t chunk)
{
    uint16_t own = s->maps ? spl_dataset_get_chunk_stations(s->dataset)[chunk].seen_by[0] : 0;
    return own & SPL_STATION_TRIMS ? &s->maps[(own & SPL_STATION_ROW) - 1] : NULL;
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
    d->trims = trims_of(s, drawn->chunk);
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

/* Pieces from one vertex to the next, wherever they lie; of discs' methods those that have a width. */
static void for_each_piece(struct scene *s, bool shade)
{
    for (size_t c = 0; c < s->chunk_count; c++)
        for (uint32_t index = 0; s->chunks[c].lines && index + 1 < s->chunks[c].count; index++) {
            struct disc ends[2];
            struct reference_piece cut = {.half = (float)(s->chunks[c].width / 2)};
            uint32_t goes_on, ignored;
            load_disc(s, &s->chunks[c], index, &ends[0], &goes_on);
            load_disc(s, &s->chunks[c], index + 1, &ends[1], &ignored);
            if (!(goes_on & SPL_FILL_LINEAR) || !reference_cut(&s->camera, ends[0].p, ends[1].p, &cut))
                continue;
            if (!draws_discs(s->view))
                line(s, ends, cut.from, cut.to, cut.middle);
            else if (s->chunks[c].width > 0)
                wide_piece(s, ends, &cut, shade);
        }
}

/* Panels or meshes, or their cells as discs or points. */
static void draw_panels(struct scene *s, const struct naive_chunk *drawn, bool shade)
{
    uint64_t count;
    size_t bytes;
    const struct spl_node *node = &spl_dataset_get_nodes(s->dataset, &count)[drawn->node];
    const struct spl_chunk *chunk = &spl_dataset_get_chunks(s->dataset, &count)[drawn->chunk];
    const uint32_t *page = spl_dataset_get_page(s->dataset, node->page, &bytes);
    struct panels panels = {s, reference_plane(&s->camera, node, chunk, page), trims_of(s, drawn->chunk), shade};
    if (spl_chunk_kind(chunk) == SPL_CHUNK_MESHES ? draws_meshes(s->view) : draws_panels(s->view)) {
        reference_panel_fragments(&panels.plane, draw_fragment, &panels);
        return;
    }
    for (uint32_t i = 0; i < chunk->count * SPL_PANEL_SIDE * SPL_PANEL_SIDE; i++) {
        struct reference_cell cell;
        struct disc d = {
            .radius = SPL_RADIUS_SPACING * chunk->step, .end = 1, .texture_scale = 1, .trims = panels.trims};
        if (!reference_panel_cell(&panels.plane, i, &cell) || cell.p[2] < (float)s->camera.near ||
            cell.p[2] > (float)s->camera.far || is_soft(s, cell.id, cell.p) ||
            (!draws_discs(s->view) && is_dropped(s, cell.id, cell.p)))
            continue;
        d.id = cell.id;
        memcpy(d.p, cell.p, sizeof d.p);
        memcpy(d.n, cell.n, sizeof d.n);
        memcpy(d.color, cell.color, sizeof d.color);
        if (draws_discs(s->view))
            depth_disc(s, &d, shade);
        else
            point(s, &d, reference_fill_code(d.radius, spl_dataset_get_info(s->dataset)->splat_radius) << 1);
    }
}

static void for_each_disc(struct scene *s, bool shade)
{
    for (size_t c = 0; c < s->chunk_count; c++) {
        if (s->chunks[c].panels) {
            draw_panels(s, &s->chunks[c], shade);
            continue;
        }
        for (uint32_t index = 0; !s->chunks[c].lines && index < s->chunks[c].count; index++) {
            struct disc d;
            uint32_t low_bits;
            if (!load_disc(s, &s->chunks[c], index, &d, &low_bits) || is_soft(s, d.id, d.p) ||
                (!draws_discs(s->view) && is_dropped(s, d.id, d.p)))
                continue;
            if (!draws_discs(s->view))
                point(s, &d, low_bits);
            else if (!draws_lines(s->view) || !s->chunks[c].lined || !(low_bits & SPL_FILL_LINEAR))
                depth_disc(s, &d, shade);
        }
    }
    if (draws_lines(s->view))
        for_each_piece(s, shade);
}

static uint32_t choose_weight(const struct scene *s)
{
    uint32_t most = 0, light = 0;
    for (size_t i = 0; i < (size_t)s->camera.width * s->camera.height; i++) {
        most = s->samples[i].fragments > most ? s->samples[i].fragments : most;
        light = s->samples[i].light > light ? s->samples[i].light : light;
    }
    return naive_weight(most, light);
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
    reference_fill(samples, &s->camera,
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
    s.advance = spl_camera_advance(&s.camera, spl_dataset_get_info(dataset));
    s.camera.width *= (uint32_t)view->supersample;
    s.camera.height *= (uint32_t)view->supersample;
    s.camera.fx *= view->supersample;
    s.camera.fy *= view->supersample;
    s.camera.cx *= view->supersample;
    s.camera.cy *= view->supersample;
    s.margin = (float)view->disc.margin;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const bool mapped = info->maps && view->maps == SPL_MAPS_ON && draws_discs(view);
    s.sided = mapped || info->has_sides || info->panels || info->meshes;
    double deep = s.camera.projection == SPL_ORTHOGRAPHIC ? 0 : 1; /* that the least margin is held against */
    for (int a = 0; a < 3 && s.camera.projection == SPL_ORTHOGRAPHIC; a++)
        deep += fmax(s.camera.rotation[6 + a] * (info->bounds_min[a] - s.camera.eye[a]),
                     s.camera.rotation[6 + a] * (info->bounds_max[a] - s.camera.eye[a]));
    s.side_bits = view->disc.margin * (double)SPL_LOW_PASS / s.camera.fx < (double)SPL_SIDE_SHARE * deep ? 0 : 127;
    const struct naive_options options = {.dataset = dataset,
                                          .camera = &s.camera,
                                          .lod = view->lod,
                                          .panels = draws_panels(view),
                                          .meshes = draws_meshes(view),
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
    static const enum spl_pixel_type types[SPL_LAYER_COUNT] = {
        SPL_PIXEL_RGBA8, SPL_PIXEL_F32, SPL_PIXEL_F32, SPL_PIXEL_F32X3, SPL_PIXEL_U32, SPL_PIXEL_F32, SPL_PIXEL_U32};
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
        s.weight_max = choose_weight(&s);
        if (sums(&s))
            for_each_disc(&s, true);
        if (view->method == SPL_METHOD_FILL)
            fill(&s, &plan);
        if (mapped && view->layers >> SPL_LAYER_COLOR & 1)
            reference_add_maps(&s);
        for (uint32_t y = 0; y < view->camera.height; y++)
            for (uint32_t x = 0; x < view->camera.width; x++)
                reference_resolve_pixel(&s, x, y, frame);
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
