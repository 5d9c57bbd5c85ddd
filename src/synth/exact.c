/* Every pixel is sampled along a (0,2)-sequence in base 2: van der Corput's numbers against Sobol's second dimension,
 * shifted by a hash of the pixel. Each 4^k first places of it hold one in every cell of the 2^k × 2^k grid, and of
 * every other grid of as many rectangles, so edges of any direction converge fast. A pixel has enough when its four
 * quarters, which are such sequences themselves, agree; their spread is some four times the error of the whole.
 *
 * Quarters of few places may agree by chance, or all have missed a wire. So a pixel that shows several surfaces takes
 * 256 places at least, and one whose neighbours show several or another one takes 64, in a second pass. Both passes
 * write a pixel from what belongs to that pixel or from the finished first pass, hence the bytes are the same for any
 * number of threads. */
#include "synth/exact.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "synth/beam.h"
#include "synth/lens.h"
#include "synth/light.h"
#include "synth/random.h"
#include "geom/vector.h"

enum {
    base_samples = 16,   /* a pixel without edges gets these */
    beside_samples = 64, /* one beside an edge, at least these */
    edge_samples = 256,  /* one in which surfaces meet */
    rows_at_once = 4,
};
static const double spread_max = 0.75; /* levels that a quarter may lie off the mean: the mean is closer than half */
static const uint32_t nothing = UINT32_MAX;

struct picture {
    const struct spl_scene *scene;
    const struct spl_lens *lens;
    uint32_t samples; /* at most, a pixel */
    uint8_t *color;
    float *distance, *normal, *coverage;
    uint32_t *id, *surface; /* the primitive at the pixel's centre */
    bool *mixed;            /* several surfaces in the pixel */
};

struct sum {
    double light[3], hits, count;
};

struct pixel {
    const struct picture *picture;
    struct spl_beam beam;
    double x, y; /* its upper left corner */
    uint32_t shift[2];
    uint32_t surface; /* of the first sample */
    bool mixed;
};

/* The 2^-32ths of place i of the sequence. */
static void place(uint32_t i, uint32_t out[2])
{
    out[0] = out[1] = 0;
    uint32_t direction = (uint32_t)1 << 31;
    for (uint32_t bit = (uint32_t)1 << 31; i; i >>= 1, bit >>= 1, direction ^= direction >> 1)
        if (i & 1) {
            out[0] ^= bit;
            out[1] ^= direction;
        }
}

static bool cast(const struct pixel *p, double x, double y, double direction[3], double *t, uint32_t *index)
{
    const struct spl_lens *lens = p->picture->lens;
    spl_lens_ray(lens, x, y, direction);
    *t = lens->farthest;
    return spl_beam_hit(&p->beam, direction, t, index);
}

static void add_sample(struct pixel *p, double x, double y, struct sum *sum)
{
    const struct spl_scene *scene = p->picture->scene;
    double direction[3], position[3], color[3], t;
    uint32_t index = nothing;
    bool hit = cast(p, x, y, direction, &t, &index);
    p->mixed |= index != p->surface;
    sum->count++;
    if (!hit)
        return;
    const struct spl_primitive *primitive = &scene->primitives[index];
    mad3(p->beam.origin, t, direction, position);
    spl_material_shade(&scene->materials[primitive->material], primitive, position, color);
    for (int i = 0; i < 3; i++)
        sum->light[i] += light_of_level(color[i]);
    sum->hits++;
}

static struct sum sample(struct pixel *p, uint32_t from, uint32_t to)
{
    struct sum sum = {0};
    for (uint32_t i = from; i < to; i++) {
        uint32_t at[2];
        place(i, at);
        add_sample(p, p->x + (double)(at[0] ^ p->shift[0]) * 0x1p-32, p->y + (double)(at[1] ^ p->shift[1]) * 0x1p-32,
                   &sum);
    }
    return sum;
}

static struct sum total_of(const struct sum parts[4])
{
    struct sum total = {0};
    for (int part = 0; part < 4; part++) {
        for (int i = 0; i < 3; i++)
            total.light[i] += parts[part].light[i];
        total.hits += parts[part].hits;
        total.count += parts[part].count;
    }
    return total;
}

/* Whether the quarters agree in coverage and in covered light. */
static bool agree(const struct sum parts[4], const struct sum *total)
{
    for (int part = 0; part < 4; part++) {
        if (fabs(parts[part].hits / parts[part].count - total->hits / total->count) * 255 > spread_max)
            return false;
        for (int i = 0; i < 3; i++) {
            double a = parts[part].light[i] / parts[part].count, b = total->light[i] / total->count;
            /* Without a power where light is further apart than the steepest part of the curve makes of it. */
            if (a != b && (fabs(a - b) > spread_max / 255 || fabs(level_of_light(a) - level_of_light(b)) > spread_max))
                return false;
        }
    }
    return true;
}

static void begin_pixel(struct pixel *p, const struct picture *picture, uint32_t x, uint32_t y)
{
    double corners[4][3];
    uint64_t hash = hash64((uint64_t)y << 32 | x);
    p->picture = picture;
    p->x = x;
    p->y = y;
    p->shift[0] = (uint32_t)hash;
    p->shift[1] = (uint32_t)(hash >> 32);
    p->surface = nothing;
    p->mixed = false;
    spl_lens_corners(picture->lens, x, y, corners);
    spl_beam_init(&p->beam, picture->scene, picture->lens->origin, picture->lens->nearest, corners);
}

/* Colour and coverage from `least` samples or more. */
static void integrate(struct pixel *p, uint32_t least, size_t at)
{
    const struct picture *picture = p->picture;
    struct sum parts[4] = {0}, total;
    if (picture->samples == 1) {
        add_sample(p, p->x + 0.5, p->y + 0.5, &parts[0]);
        total = parts[0];
    } else {
        uint32_t count = picture->samples < base_samples ? picture->samples : base_samples;
        for (uint32_t i = 0; i < 4; i++)
            parts[i] = sample(p, i * count / 4, (i + 1) * count / 4);
        total = total_of(parts);
        while (count < picture->samples && (count < (p->mixed ? edge_samples : least) || !agree(parts, &total))) {
            parts[0] = total;
            for (uint32_t i = 1; i < 4; i++)
                parts[i] = sample(p, i * count, (i + 1) * count);
            total = total_of(parts);
            count *= 4;
        }
    }
    uint8_t *color = picture->color + 4 * at;
    for (int i = 0; i < 3; i++)
        color[i] = total.hits > 0 ? (uint8_t)lround(level_of_light(total.light[i] / total.hits)) : 0;
    color[3] = (uint8_t)lround(255 * total.hits / total.count);
    picture->coverage[at] = (float)(total.hits / total.count);
}

/* What the ray through the centre meets. */
static void probe(struct pixel *p, size_t at)
{
    const struct picture *picture = p->picture;
    const struct spl_primitive *primitives = picture->scene->primitives;
    double direction[3], position[3], normal[3] = {0}, t;
    bool hit = cast(p, p->x + 0.5, p->y + 0.5, direction, &t, &p->surface);
    if (hit) {
        mad3(p->beam.origin, t, direction, position);
        spl_primitive_normal(&primitives[p->surface], position, normal);
    }
    double side = dot3(normal, direction) > 0 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        picture->normal[3 * at + (size_t)i] = hit ? (float)(side * normal[i]) : 0;
    picture->distance[at] = hit ? (float)t : NAN;
    picture->id[at] = hit ? primitives[p->surface].object : nothing;
    picture->surface[at] = p->surface;
}

static void first_pass(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct picture *picture = context;
    struct pixel p;
    for (size_t y = begin; y < end; y++)
        for (uint32_t x = 0; x < picture->lens->width; x++) {
            size_t at = y * picture->lens->width + x;
            begin_pixel(&p, picture, x, (uint32_t)y);
            probe(&p, at);
            integrate(&p, 0, at);
            picture->mixed[at] = p.mixed;
        }
}

static bool beside_an_edge(const struct picture *picture, uint32_t x, uint32_t y)
{
    uint32_t width = picture->lens->width, height = picture->lens->height;
    uint32_t surface = picture->surface[(size_t)y * width + x];
    for (uint32_t v = y ? y - 1 : 0; v <= y + 1 && v < height; v++)
        for (uint32_t u = x ? x - 1 : 0; u <= x + 1 && u < width; u++) {
            size_t at = (size_t)v * width + u;
            if (picture->mixed[at] || picture->surface[at] != surface)
                return true;
        }
    return false;
}

static void second_pass(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct picture *picture = context;
    struct pixel p;
    for (size_t y = begin; y < end; y++)
        for (uint32_t x = 0; x < picture->lens->width; x++) {
            size_t at = y * picture->lens->width + x;
            if (picture->mixed[at] || !beside_an_edge(picture, x, (uint32_t)y))
                continue;
            begin_pixel(&p, picture, x, (uint32_t)y);
            integrate(&p, beside_samples, at);
        }
}

static void *add_image(struct spl_image images[SPL_LAYER_COUNT], enum spl_layer layer, enum spl_pixel_type type,
                       const struct spl_lens *lens, struct spl_error *err)
{
    images[layer] = (struct spl_image){.layer = layer, .type = type, .width = lens->width, .height = lens->height};
    return images[layer].pixels = spl_alloc_raw((size_t)lens->width * lens->height, spl_pixel_bytes(type), err);
}

int spl_exact_trace(const struct spl_scene *scene, const struct spl_lens *lens, uint32_t samples, unsigned threads,
                    struct spl_image images[SPL_LAYER_COUNT], struct spl_error *err)
{
    memset(images, 0, SPL_LAYER_COUNT * sizeof *images);
    uint64_t pixels = (uint64_t)lens->width * lens->height;
    if (!samples || samples > SPL_EXACT_SAMPLES_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "samples", "%u samples a pixel side; it must be 1 to %d", samples,
                              SPL_EXACT_SAMPLES_MAX);
    if (!pixels || pixels > SPL_EXACT_PIXELS_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "width", "an exact image of %u x %u pixels; it may have 1 to %d",
                              lens->width, lens->height, SPL_EXACT_PIXELS_MAX);
    struct picture p = {.scene = scene, .lens = lens, .samples = 1};
    while (p.samples < samples * samples) /* a power of four */
        p.samples *= 4;
    int result = SPL_E_NOMEM;
    p.color = add_image(images, SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, lens, err);
    p.distance = add_image(images, lens->panorama ? SPL_LAYER_RANGE : SPL_LAYER_DEPTH, SPL_PIXEL_F32, lens, err);
    p.normal = add_image(images, SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, lens, err);
    p.id = add_image(images, SPL_LAYER_ID, SPL_PIXEL_U32, lens, err);
    p.coverage = add_image(images, SPL_LAYER_COVERAGE, SPL_PIXEL_F32, lens, err);
    p.surface = spl_alloc_raw(pixels, sizeof *p.surface, err);
    p.mixed = spl_alloc_raw(pixels, sizeof *p.mixed, err);
    if (!p.color || !p.distance || !p.normal || !p.id || !p.coverage || !p.surface || !p.mixed)
        goto done;
    spl_parallel_for(threads, lens->height, rows_at_once, first_pass, &p);
    if (p.samples > base_samples)
        spl_parallel_for(threads, lens->height, rows_at_once, second_pass, &p);
    result = 0;
done:
    free(p.surface);
    free(p.mixed);
    for (int i = 0; result && i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&images[i]);
    return result;
}

int spl_exact_render(const struct spl_scene *scene, const struct spl_camera *camera, uint32_t samples, unsigned threads,
                     struct spl_image images[SPL_LAYER_COUNT], struct spl_error *err)
{
    memset(images, 0, SPL_LAYER_COUNT * sizeof *images);
    int result = spl_camera_check(camera, err);
    if (result)
        return result;
    struct spl_lens lens = spl_lens_of_camera(camera, scene->offset);
    return spl_exact_trace(scene, &lens, samples, threads, images, err);
}
