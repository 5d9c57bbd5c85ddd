/* The screen-space filter again; written from the comments of the kernels. A level is an array of cells that hold what
 * the kernels' words do, in members. Inverse depths are cut to as many bits as the words have, so that both see the
 * same. */
#include "support/reference_fill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "dataset/format.h"
#include "shared.h"

struct cell {
    float w;       /* inverse depth, 0 = nothing */
    float spacing; /* radius, multiples of the filter's */
    uint32_t x, y; /* the sample */
    uint32_t id;
    double color[3], normal[3];
    bool hole, maybe; /* the latter: it may be a crack's */
};

struct filter {
    struct cell *nearest[SPL_FILL_LEVELS_MAX + 1], *means[SPL_FILL_LEVELS_MAX + 1];
    uint32_t width[SPL_FILL_LEVELS_MAX + 1], height[SPL_FILL_LEVELS_MAX + 1];
    float focal, radius, reach, margin, threshold;
    bool parallel; /* rays: spacings on the image are the same at all depths */
    const struct spl_view *view;
    const struct fill_plan *plan;
};

static uint32_t bits_of(float f)
{
    uint32_t u;
    memcpy(&u, &f, 4);
    return u;
}

static float float_of(uint32_t u)
{
    float f;
    memcpy(&f, &u, 4);
    return f;
}

static float cut(float w, uint32_t bits)
{
    return float_of(bits_of(w) & ~((1u << bits) - 1));
}

/* A kernel of three spacings, or of the pixels asked for across; at least one and a half samples, at most 128, or 64
 * pixels where each of its samples is looked at or a pixel has many. Levels double what they look at. */
struct fill_plan fill_plan_of(const struct spl_view *view, double spacing)
{
    bool constant = view->fill.visibility == SPL_VISIBILITY_CONSTANT;
    double side = view->supersample, around = 64 * (side > 1 ? side : 1);
    double most = constant || around > 128 ? around : 128;
    struct fill_plan plan = {.rings = 2, .guard = 4};
    plan.kernel = view->fill.kernel > 0 ? view->fill.kernel * side / 2 : 3 * spacing;
    plan.kernel = plan.kernel < 1.5 ? 1.5 : plan.kernel > most ? most : plan.kernel;
    while (plan.rings < SPL_FILL_LEVELS_MAX - 1 && plan.kernel >= pow(2, plan.rings - 0.25))
        plan.rings++;
    while (plan.guard < plan.kernel && plan.guard < around)
        plan.guard *= 2;
    plan.levels = view->fill.pyramid ? view->fill.pyramid : plan.rings;
    return plan;
}

uint32_t reference_fill_code(float radius, double median)
{
    float ratio = radius / (float)(median / 16);
    for (uint32_t code = 0; code < 31; code++) { /* 1, 1.5, 2, 3, …: the one whose float's bits are nearest */
        float middle = float_of((code << 22) + 0x3f800000u + (1u << 21));
        if (ratio < middle)
            return code;
    }
    return 31;
}

/* `to` takes the nearest of its 2 x 2; equals: larger spacing, then later row and column, as the words' low bits say.
 */
static void pull(struct filter *f, uint32_t level)
{
    for (uint32_t y = 0; y < f->height[level]; y++) {
        for (uint32_t x = 0; x < f->width[level]; x++) {
            struct cell *to = &f->nearest[level][y * f->width[level] + x];
            uint64_t best = 0;
            for (uint32_t i = 0; i < 4; i++) {
                uint32_t cx = 2 * x + i % 2, cy = 2 * y + i / 2, low = (1u << level) - 1;
                if (cx >= f->width[level - 1] || cy >= f->height[level - 1])
                    continue;
                const struct cell *from = &f->nearest[level - 1][cy * f->width[level - 1] + cx];
                uint64_t rank = (uint64_t)bits_of(cut(from->w, 5 + 2 * level)) << 32 |
                                (uint64_t)((from->y & low) << level | (from->x & low)) << 8 | (from->w > 0);
                if (from->w > 0 && rank > best) {
                    best = rank;
                    *to = *from;
                    to->w = cut(from->w, 5 + 2 * level);
                }
            }
        }
    }
}

/* Whether the sample of `c` is nearer than z; then it blocks its sector, where it is near enough. */
static bool block(const struct filter *f, const struct cell *c, float z, int dx, int dy, bool constant, float steep[8])
{
    float angle = (f->parallel ? 1 : c->w) * c->spacing * f->radius, kernel = (float)f->plan->kernel;
    float squared = (float)(dx * dx + dy * dy);
    float reach = constant ? kernel : fminf(angle * f->reach, kernel),
          nearer = (f->parallel ? z - 1 / c->w : z * c->w - 1) - f->margin * angle;
    if (c->w <= 0 || nearer <= 0)
        return false;
    if (squared > 0 && squared <= reach * reach) {
        double turn = atan2(dy, dx) / (M_PI / 4);
        int sector = (int)floor(turn + 8 + 1e-9) % 8;
        steep[sector] = fmaxf(steep[sector], nearer * f->focal / sqrtf(squared));
    }
    return true;
}

static float coarse_reach(const struct filter *f, int x, int y)
{
    int level = (int)f->plan->rings, w = (int)f->width[level], h = (int)f->height[level];
    float angle = 0;
    for (int i = 0; i < 4; i++) {
        int cx = (x >> level) + (i & 1 ? 2 * (x >> (level - 1) & 1) - 1 : 0);
        int cy = (y >> level) + (i & 2 ? 2 * (y >> (level - 1) & 1) - 1 : 0);
        cx = cx < 0 ? 0 : cx < w ? cx : w - 1;
        cy = cy < 0 ? 0 : cy < h ? cy : h - 1;
        const struct cell *c = &f->nearest[level][cy * w + cx];
        angle = fmaxf(angle, (f->parallel ? (float)(c->w > 0) : c->w) * c->spacing);
    }
    return fminf(angle * f->radius * f->reach, (float)f->plan->kernel);
}

/* Of the eight sectors around a sample at depth z, those that are open. */
static float find_open(const struct filter *f, int x, int y, float z)
{
    float steep[8] = {0}, open = 0;
    bool constant = f->view->fill.visibility == SPL_VISIBILITY_CONSTANT;
    if (constant) {
        int k = (int)f->plan->kernel;
        for (int cy = y - k; cy <= y + k; cy++)
            for (int cx = x - k; cx <= x + k; cx++)
                if (cx >= 0 && cy >= 0 && cx < (int)f->width[0] && cy < (int)f->height[0] && (cx != x || cy != y))
                    block(f, &f->nearest[0][cy * (int)f->width[0] + cx], z, cx - x, cy - y, true, steep);
    } else {
        float reach = coarse_reach(f, x, y);
        int level = 1;
        while (level + 1 < (int)f->plan->rings && (float)(2 << level) <= reach)
            level++;
        for (bool nearer = true; level >= 0 && nearer; level--) {
            nearer = false;
            for (int i = 0; i < 9; i++) {
                int cx = (x >> level) + i % 3 - 1, cy = (y >> level) + i / 3 - 1;
                if (cx < 0 || cy < 0 || cx >= (int)f->width[level] || cy >= (int)f->height[level])
                    continue;
                const struct cell *c = &f->nearest[level][cy * (int)f->width[level] + cx];
                float none[8] = {0};
                nearer |= block(f, c, z, (int)c->x - x, (int)c->y - y, false, i == 4 ? none : steep);
            }
        }
    }
    for (int i = 0; i < 8; i++) {
        float s = fminf(steep[i], 1e6f);
        open += 1 - s / sqrtf(s * s + 1);
    }
    return open;
}

/* The nearest of the cells whose inverse depth is below `most`, NULL = there is none; and the inverse depth from which
 * on cells belong to its surface, which is `samples` wide. */
static const struct cell *find_surface(const struct filter *f, const struct cell *const cells[4], float samples,
                                       float most, float *least)
{
    const struct cell *near = NULL;
    for (int i = 0; i < 4; i++)
        if (cells[i] && cells[i]->w > 0 && cells[i]->w < most && !cells[i]->hole && (!near || cells[i]->w > near->w))
            near = cells[i];
    if (near) {
        float slope = samples * SPL_FILL_SLOPE * (1 / f->focal) * (f->parallel ? near->w : 1);
        *least = near->w / (1 + (slope + f->margin * f->radius * near->w * near->spacing));
    }
    return near;
}

/* The mean of four cells, weighted, of those on the surface of the nearest, or of the next behind it where there are
 * `votes` and more of them are for what is behind. */
static struct cell mean(const struct filter *f, const struct cell *const cells[4], const float weights[4],
                        float samples, const float *votes)
{
    struct cell out = {0};
    float sum = 0, weight = 0, most = INFINITY, least, front = 0, behind = 0;
    const struct cell *near = find_surface(f, cells, samples, most, &least);
    if (!near)
        return out;
    for (int i = 0; i < 4 && votes; i++)
        *(cells[i]->w >= least ? &front : &behind) += cells[i]->w > 0 ? votes[i] : 0;
    if (behind > front) {
        most = least;
        near = find_surface(f, cells, samples, most, &least);
    }
    for (int i = 0; i < 4; i++) {
        if (!cells[i] || cells[i]->hole || !(cells[i]->w > 0) || cells[i]->w < least || cells[i]->w >= most)
            continue;
        sum += weights[i] * cells[i]->w;
        weight += weights[i];
        for (int c = 0; c < 3; c++) {
            out.color[c] += weights[i] * cells[i]->color[c];
            out.normal[c] += weights[i] * cells[i]->normal[c];
        }
    }
    double length = 0;
    for (int c = 0; c < 3; c++) {
        out.color[c] = floor(out.color[c] / weight + 0.5);
        length += out.normal[c] * out.normal[c];
    }
    for (int c = 0; c < 3 && length > 0; c++)
        out.normal[c] /= sqrt(length);
    out.w = cut(sum / weight, 5);
    out.spacing = near->spacing;
    out.id = near->id;
    return out;
}

static void gather(struct filter *f, uint32_t level)
{
    for (uint32_t y = 0; y < f->height[level]; y++) {
        for (uint32_t x = 0; x < f->width[level]; x++) {
            const struct cell *children[4] = {0};
            for (uint32_t i = 0; i < 4; i++)
                if (2 * x + i % 2 < f->width[level - 1] && 2 * y + i / 2 < f->height[level - 1])
                    children[i] = &f->means[level - 1][(2 * y + i / 2) * f->width[level - 1] + 2 * x + i % 2];
            f->means[level][y * f->width[level] + x] =
                mean(f, children, (float[]){1, 1, 1, 1}, (float)(1u << level), NULL);
        }
    }
}

static struct cell above(const struct filter *f, uint32_t level, int x, int y)
{
    int w = (int)f->width[level + 1], h = (int)f->height[level + 1];
    const struct cell *cells[4];
    for (int i = 0; i < 4; i++) {
        int cx = x / 2 + (i & 1 ? 2 * (x & 1) - 1 : 0), cy = y / 2 + (i & 2 ? 2 * (y & 1) - 1 : 0);
        cx = cx < 0 ? 0 : cx < w ? cx : w - 1;
        cy = cy < 0 ? 0 : cy < h ? cy : h - 1;
        cells[i] = &f->means[level + 1][cy * w + cx];
    }
    return mean(f, cells, (float[]){9, 3, 3, 1}, (float)(2u << level), (float[]){5, 3, 3, 1});
}

/* How far something lies from (x, y) along (dx, dy), of `most` samples; else 0. */
static int look_along(const struct filter *f, int x, int y, int dx, int dy, int most)
{
    for (int n = 1; n <= most; n++) {
        const int cx = x + n * dx, cy = y + n * dy;
        if (cx < 0 || cy < 0 || cx >= (int)f->width[0] || cy >= (int)f->height[0])
            continue;
        const struct cell *c = &f->means[0][cy * (int)f->width[0] + cx];
        if (c->hole || c->w > 0)
            return n;
    }
    return 0;
}

/* On three of the four lines through (x, y) it lies between things that are no farther apart than three quarters of
 * what the points of `surface` are, or two samples. */
static bool is_crack(const struct filter *f, int x, int y, const struct cell *surface)
{
    static const int lines[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
    const float reach = (f->parallel ? 1 : surface->w) * surface->spacing * (f->radius * f->reach);
    const float share = SPL_FILL_CRACK_REACH * fminf(reach, (float)f->plan->kernel);
    const float wide = fminf(fmaxf(share, 2), SPL_FILL_CRACK);
    int between = 0;
    for (int i = 0; i < 4; i++) {
        const int ahead = look_along(f, x, y, lines[i][0], lines[i][1], (int)wide),
                  behind = look_along(f, x, y, -lines[i][0], -lines[i][1], (int)wide);
        between += ahead && behind && ahead + behind <= (int)wide + 1;
    }
    return between >= 3;
}

static void finish_sample(const struct filter *f, struct fill_sample *s, int x, int y)
{
    const struct cell *state = &f->means[0][y * (int)f->width[0] + x];
    uint32_t plain = s->word == SPL_NOTHING ? SPL_NOTHING : (s->word & ~SPL_FILL_DEPTH_BITS) | 32;
    struct cell c = above(f, 0, x, y);
    uint32_t surface = c.w > 0 ? bits_of(1 / c.w) : SPL_NOTHING;
    bool linear = s->word != SPL_NOTHING && s->word & SPL_FILL_LINEAR;
    s->word = plain;
    const bool fills = state->hole || (state->maybe && c.w > 0 && is_crack(f, x, y, &c));
    if (!fills || c.w <= 0 || (linear && plain <= surface))
        return;
    s->word = surface;
    s->id = c.id;
    memcpy(s->color, c.color, sizeof c.color);
    memcpy(s->normal, c.normal, sizeof c.normal);
}

void reference_fill(struct fill_sample *samples, const struct spl_camera *camera, double median,
                    const struct spl_view *view, const struct fill_plan *plan)
{
    const uint32_t width = camera->width, height = camera->height;
    const double focal[2] = {camera->fx, camera->fy};
    struct filter f = {.view = view, .plan = plan, .focal = (float)focal[0]};
    f.parallel = camera->projection == SPL_ORTHOGRAPHIC;
    f.reach = (float)(3 / 1.128379f * (focal[0] > focal[1] ? focal[0] : focal[1]));
    f.margin = (float)(1 / 1.128379f);
    f.radius = (float)(median / 16);
    f.threshold = (float)(8 * view->fill.threshold);
    for (uint32_t level = 0; level <= SPL_FILL_LEVELS_MAX; level++) {
        f.width[level] = (width + (1u << level) - 1) >> level;
        f.height[level] = (height + (1u << level) - 1) >> level;
        f.nearest[level] = calloc((size_t)f.width[level] * f.height[level], sizeof **f.nearest);
        f.means[level] = calloc((size_t)f.width[level] * f.height[level], sizeof **f.means);
        spl_assert(f.nearest[level] && f.means[level]);
    }
    for (uint32_t i = 0; i < width * height; i++) {
        const struct fill_sample *s = &samples[i];
        struct cell *c = &f.nearest[0][i];
        if (s->word == SPL_NOTHING || s->word & SPL_FILL_LINEAR)
            continue;
        *c = (struct cell){
            .w = cut(1 / float_of(s->word & ~SPL_FILL_DEPTH_BITS), 5), .x = i % width, .y = i / width, .id = s->id};
        c->spacing = float_of(((s->word >> 1 & 31) << 22) + 0x3f800000u);
        memcpy(c->color, s->color, sizeof c->color);
        memcpy(c->normal, s->normal, sizeof c->normal);
    }
    for (uint32_t level = 1; level <= plan->rings; level++)
        pull(&f, level);
    for (uint32_t i = 0; i < width * height; i++) {
        const struct cell *own = &f.nearest[0][i];
        f.means[0][i] = *own;
        bool keeps = own->w > 0 && view->fill.visibility == SPL_VISIBILITY_NONE;
        const float open = find_open(&f, (int)(i % width), (int)(i / width), own->w > 0 ? 1 / own->w : 1e30f);
        f.means[0][i].hole = !keeps && open < f.threshold;
        f.means[0][i].maybe = !(own->w > 0) && !f.means[0][i].hole && open < SPL_FILL_MAYBE_OPEN;
    }
    for (uint32_t level = 1; level <= plan->levels; level++)
        gather(&f, level);
    for (uint32_t level = plan->levels; level-- > 1;)
        for (uint32_t i = 0; i < f.width[level] * f.height[level]; i++)
            if (!(f.means[level][i].w > 0))
                f.means[level][i] = above(&f, level, (int)(i % f.width[level]), (int)(i / f.width[level]));
    for (uint32_t i = 0; i < width * height; i++)
        finish_sample(&f, &samples[i], (int)(i % width), (int)(i / width));
    for (uint32_t level = 0; level <= SPL_FILL_LEVELS_MAX; level++) {
        free(f.nearest[level]);
        free(f.means[level]);
    }
}
