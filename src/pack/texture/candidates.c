/* Which photographs show a splat, and how well: frontal, near, sharp, unoccluded, in the frame.
 *
 * weight = pixels a metre (no more than a texture can hold) * cos^2 of the angle * sharpness, less towards the frame's
 * edge, and a quarter beside an occluder's silhouette, where a pose that is a pixel off would put the occluder's colour
 * on what lies behind it. The disc's colour is a mean of taps, weighted 1 - d^2 as frames weight it. */
#include "pack/texture/candidates.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/tangent.h"
#include "render/frustum.h"

enum { taps = 4, texels_across = 32 };
static const double grazing = 0.12;     /* cosine below which nothing is taken: 83 degrees */
static const double frame_share = 0.03; /* of the image's width, in which the weight falls */

double spl_candidate_weight(uint16_t score)
{
    return exp2(score / 1024.0 - 32);
}

uint16_t spl_candidate_score(double weight)
{
    double code = (log2(weight) + 32) * 1024 + 0.5;
    return (uint16_t)fmin(fmax(code, 0), UINT16_MAX);
}

int spl_candidates_init(struct spl_candidates *candidates, uint64_t splats, uint32_t depth, struct spl_error *err)
{
    *candidates = (struct spl_candidates){.depth = depth, .splats = splats};
    candidates->list = spl_alloc_raw(splats * depth, sizeof *candidates->list, err);
    if (!candidates->list)
        return SPL_E_NOMEM;
    for (uint64_t i = 0; i < splats * depth; i++)
        candidates->list[i] = (struct spl_candidate){.photo = SPL_NO_PHOTO};
    return SPL_OK;
}

void spl_candidates_finish(struct spl_candidates *candidates)
{
    free(candidates->list);
    *candidates = (struct spl_candidates){0};
}

/* Equal scores: the lower index, so that the outcome does not hang on the order of photographs looked at. */
static bool is_better(const struct spl_candidate *a, const struct spl_candidate *b)
{
    return b->photo == SPL_NO_PHOTO || a->score > b->score || (a->score == b->score && a->photo < b->photo);
}

void spl_candidates_add(struct spl_candidates *candidates, uint64_t splat, const struct spl_candidate *candidate)
{
    struct spl_candidate *list = candidates->list + splat * candidates->depth, moving = *candidate;
    for (uint32_t i = 0; i < candidates->depth; i++)
        if (is_better(&moving, &list[i])) {
            struct spl_candidate other = list[i];
            list[i] = moving;
            moving = other;
            if (moving.photo == SPL_NO_PHOTO)
                break;
        }
}

/* False where too little of the disc is in the picture. */
static bool find_color(const struct spl_photo *photo, const struct spl_world_splat *s, double footprint,
                       uint8_t color[3])
{
    float u[3], v[3], sum[3] = {0}, total = 0, all = 0;
    spl_tangent_frame(s->splat.normal, u, v);
    for (int i = 0; i < taps * taps; i++) {
        double a = (2 * (i % taps) + 1.0) / taps - 1, b = (2 * (i / taps) + 1.0) / taps - 1, p[3], pixel[2], depth;
        float rgb[3], weight = (float)(1 - a * a - b * b);
        if (weight <= 0)
            continue;
        all += weight;
        for (int c = 0; c < 3; c++)
            p[c] = s->position[c] + (double)s->splat.radius * (a * (double)u[c] + b * (double)v[c]);
        if (!spl_distortion_project(&photo->view->camera, &photo->view->distortion, p, pixel, &depth) ||
            !spl_pyramid_sample(&photo->pixels, pixel, footprint, rgb))
            continue;
        for (int c = 0; c < 3; c++)
            sum[c] += weight * rgb[c];
        total += weight;
    }
    if (total < all / 2)
        return false;
    for (int c = 0; c < 3; c++)
        color[c] = (uint8_t)(sum[c] / total + 0.5f);
    return true;
}

/* Distance from the eye and the cosine of the angle to it. */
static double find_facing(const struct spl_camera *camera, const struct spl_world_splat *s, double *facing)
{
    double square = 0, along = 0;
    for (int a = 0; a < 3; a++) {
        double to_eye = camera->eye[a] - s->position[a];
        square += to_eye * to_eye;
        along += to_eye * (double)s->splat.normal[a];
    }
    *facing = fmin(fabs(along) / sqrt(square), 1);
    return sqrt(square);
}

double spl_candidate_slack(const struct spl_photo *photo, const struct spl_world_splat *s)
{
    double facing, distance = find_facing(&photo->view->camera, s, &facing);
    double step = photo->depth.pixels ? distance / photo->depth_camera.fx : 0;
    return (double)s->splat.radius + 2 * step * (1 + sqrt(1 - facing * facing) / fmax(facing, grazing));
}

double spl_candidate_judge(const struct spl_photo *photo, const struct spl_world_splat *s,
                           struct spl_candidate *candidate)
{
    const struct spl_camera *camera = &photo->view->camera;
    double pixel[2], depth, facing, radius = (double)s->splat.radius;
    if (!spl_distortion_project(camera, &photo->view->distortion, s->position, pixel, &depth))
        return 0;
    double edge = fmin(fmin(pixel[0], camera->width - pixel[0]), fmin(pixel[1], camera->height - pixel[1]));
    double distance = find_facing(camera, s, &facing), density = camera->fx / distance;
    if (!(edge > 0) || !(facing > grazing))
        return 0;
    enum spl_sight sight = spl_photo_see(photo, s->position, spl_candidate_slack(photo, s));
    if (sight == SPL_SIGHT_HIDDEN || !find_color(photo, s, radius * density / 2, candidate->color))
        return 0;
    candidate->place[0] = (uint8_t)(pixel[0] / camera->width * 255 + 0.5);
    candidate->place[1] = (uint8_t)(pixel[1] / camera->height * 255 + 0.5);
    double weight = fmin(density, texels_across / (2 * radius)) * facing * facing * photo->sharpness;
    weight *= fmin(1, 0.1 + edge / (frame_share * camera->width));
    return sight == SPL_SIGHT_CLEAR ? weight : weight / 4;
}

struct look {
    struct spl_candidates *candidates;
    const struct spl_splats *splats;
    const struct spl_photo *photo;
    uint16_t index;
    struct spl_stage *stage;
    atomic_uint_fast64_t seen;
};

static bool reaches(const struct look *look, uint32_t chunk)
{
    const struct spl_node *node = &look->splats->nodes[look->splats->node_of[chunk]];
    const struct spl_camera *camera = &look->photo->depth_camera;
    double least[3], size[3];
    if (!look->photo->depth.pixels)
        return true;
    for (int a = 0; a < 3; a++) {
        least[a] = node->origin[a] + (double)node->box_min[a] - camera->eye[a];
        size[a] = (double)node->box_max[a] - (double)node->box_min[a];
    }
    struct spl_view_box box = spl_view_box(camera, least, size);
    return spl_view_box_visible(camera, &box, 1);
}

static void look_at_chunks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct look *look = context;
    struct spl_world_splat splats[SPL_CHUNK_SPLATS];
    uint64_t seen = 0;
    for (uint32_t chunk = (uint32_t)begin; chunk < end; chunk++) {
        if (!reaches(look, chunk))
            continue;
        uint32_t count = spl_splats_get(look->splats, chunk, splats);
        for (uint32_t i = 0; i < count; i++) {
            struct spl_candidate candidate = {.photo = look->index};
            double weight = spl_candidate_judge(look->photo, &splats[i], &candidate);
            if (!(weight > 0))
                continue;
            candidate.score = spl_candidate_score(weight);
            spl_candidates_add(look->candidates, look->splats->chunks[chunk].first_id + (uint64_t)i, &candidate);
            seen++;
        }
    }
    atomic_fetch_add(&look->seen, seen);
    spl_stage_add(look->stage, end - begin, worker);
}

uint64_t spl_candidates_look(struct spl_candidates *candidates, const struct spl_splats *splats,
                             const struct spl_photo *photo, uint16_t index, struct spl_stage *stage)
{
    struct look look = {.candidates = candidates, .splats = splats, .photo = photo, .index = index, .stage = stage};
    spl_parallel_for(stage->threads, splats->chunk_count, 16, look_at_chunks, &look);
    return atomic_load(&look.seen);
}
