/* One photograph for the detail of a splat, all that agree for its colour.
 *
 * The photograph is the one with the largest weight, where the photographs that a chunk likes best count for more:
 * neighbours then rarely switch for a gain that nobody sees. The colour is the mean over the candidates that agree,
 * weighted by the cube of their weights: it passes from one photograph's to the next's over many splats, so that a
 * switch leaves no step; candidates that disagree with the majority (people, cars, what the scan does not hold) are
 * left out, for the detail too. Parallel over chunks; deterministic. */
#include "pack/texture/colors.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"

enum { nearest = 6 };
static const float agree = 40;    /* levels, in every channel */
static const double favour = 0.6; /* what being the chunk's favourite adds at most, share of the weight */

struct pass {
    struct spl_chosen *chosen;
    const struct spl_splats *splats;
    const struct spl_candidates *candidates;
    const struct spl_gain *gains;
    uint32_t photos;
    const uint8_t (*own)[3];
    struct spl_stage *stage;
    atomic_uint_fast64_t unseen;
};

/* The weights of a chunk's photographs, in a list that holds as many as can occur. */
struct tally {
    uint16_t photo[SPL_CHUNK_SPLATS * SPL_CANDIDATES_MAX];
    double weight[SPL_CHUNK_SPLATS * SPL_CANDIDATES_MAX], largest;
    uint32_t count;
};

static double *find(struct tally *tally, uint16_t photo)
{
    for (uint32_t i = 0; i < tally->count; i++)
        if (tally->photo[i] == photo)
            return &tally->weight[i];
    tally->photo[tally->count] = photo;
    tally->weight[tally->count] = 0;
    return &tally->weight[tally->count++];
}

static void count_favourites(const struct pass *pass, uint64_t first, uint32_t count, struct tally *tally)
{
    uint32_t depth = pass->candidates->depth;
    tally->count = 0;
    tally->largest = 0;
    for (uint64_t k = first * depth; k < (first + count) * depth; k++) {
        const struct spl_candidate *candidate = &pass->candidates->list[k];
        if (candidate->photo == SPL_NO_PHOTO)
            continue;
        double *weight = find(tally, candidate->photo);
        *weight += spl_candidate_weight(candidate->score);
        tally->largest = fmax(tally->largest, *weight);
    }
}

static bool agrees(const float a[3], const float b[3])
{
    return fabsf(a[0] - b[0]) < agree && fabsf(a[1] - b[1]) < agree && fabsf(a[2] - b[2]) < agree;
}

static void choose(const struct pass *pass, uint64_t id, struct tally *tally)
{
    const struct spl_candidate *list = pass->candidates->list + id * pass->candidates->depth;
    float color[SPL_CANDIDATES_MAX][3];
    double weight[SPL_CANDIDATES_MAX], support[SPL_CANDIDATES_MAX], best = -1, sum[3] = {0}, total = 0;
    uint32_t n = 0, leader = 0;
    for (; n < pass->candidates->depth && list[n].photo != SPL_NO_PHOTO; n++) {
        weight[n] = spl_candidate_weight(list[n].score);
        spl_gain_apply(&pass->gains[list[n].photo], list[n].place, list[n].color, color[n]);
    }
    for (uint32_t i = 0; i < n; i++) { /* who has most on its side */
        support[i] = 0;
        for (uint32_t j = 0; j < n; j++)
            support[i] += agrees(color[i], color[j]) ? weight[j] : 0;
        leader = support[i] > support[leader] ? i : leader;
    }
    for (uint32_t i = 0; i < n; i++) {
        if (!agrees(color[i], color[leader]))
            continue;
        double share = pow(weight[i] / weight[0], 3), liked = weight[i];
        if (tally->largest > 0)
            liked *= 1 + favour * *find(tally, list[i].photo) / tally->largest;
        for (int c = 0; c < 3; c++)
            sum[c] += share * (double)color[i][c];
        total += share;
        if (liked > best) {
            best = liked;
            pass->chosen->photo[id] = list[i].photo;
        }
    }
    for (int c = 0; c < 3 && n; c++)
        pass->chosen->color[id][c] = (uint8_t)(sum[c] / total + 0.5);
}

/* The mean of the nearest seen splats of the chunk, weighted by 1 / distance^2. */
static void borrow(const struct pass *pass, const struct spl_world_splat *splats, uint32_t count, uint64_t first,
                   uint32_t i)
{
    double distance[nearest], sum[3] = {0}, total = 0;
    uint32_t from[nearest], found = 0;
    for (uint32_t j = 0; j < count; j++) {
        if (pass->chosen->photo[first + j] == SPL_NO_PHOTO)
            continue;
        double d = 0;
        for (int a = 0; a < 3; a++)
            d += pow(splats[j].position[a] - splats[i].position[a], 2);
        uint32_t at = found < nearest ? found++ : nearest;
        for (; at > 0 && distance[at - 1] > d; at--)
            if (at < nearest) {
                distance[at] = distance[at - 1];
                from[at] = from[at - 1];
            }
        if (at < nearest) {
            distance[at] = d;
            from[at] = j;
        }
    }
    for (uint32_t k = 0; k < found; k++) {
        double weight = 1 / (distance[k] + 1e-30);
        for (int c = 0; c < 3; c++)
            sum[c] += weight * pass->chosen->color[first + from[k]][c];
        total += weight;
    }
    for (int c = 0; c < 3 && found; c++)
        pass->chosen->color[first + i][c] = (uint8_t)(sum[c] / total + 0.5);
}

static void choose_chunks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct pass *pass = context;
    struct spl_world_splat splats[SPL_CHUNK_SPLATS];
    struct tally tally;
    uint64_t unseen = 0;
    for (uint32_t chunk = (uint32_t)begin; chunk < end; chunk++) {
        uint64_t first = pass->splats->chunks[chunk].first_id;
        uint32_t count = pass->splats->chunks[chunk].count, without = 0;
        count_favourites(pass, first, count, &tally);
        for (uint32_t i = 0; i < count; i++) {
            pass->chosen->photo[first + i] = SPL_NO_PHOTO;
            choose(pass, first + i, &tally);
            without += pass->chosen->photo[first + i] == SPL_NO_PHOTO;
        }
        if (without && !pass->own)
            spl_splats_get(pass->splats, chunk, splats);
        for (uint32_t i = 0; i < count && without; i++) {
            float color[3];
            if (pass->chosen->photo[first + i] != SPL_NO_PHOTO)
                continue;
            if (!pass->own) {
                borrow(pass, splats, count, first, i);
                continue;
            }
            spl_gain_apply(&pass->gains[pass->photos], spl_gain_middle, pass->own[first + i], color);
            for (int c = 0; c < 3; c++)
                pass->chosen->color[first + i][c] = (uint8_t)(color[c] + 0.5f);
        }
        unseen += without;
    }
    atomic_fetch_add(&pass->unseen, unseen);
    spl_stage_add(pass->stage, end - begin, worker);
}

struct mean {
    double sum[3], count;
};

/* Chunks of which nothing was seen: the mean of their node, or of the nearest node above that was seen; the root's
 * where none was. Nodes lie breadth first, so a parent's mean is there before its children ask. */
static int fill_chunks(const struct pass *pass, struct spl_error *err)
{
    const struct spl_splats *splats = pass->splats;
    struct mean *means = spl_alloc(splats->node_count, sizeof *means, err);
    if (!means)
        return SPL_E_NOMEM;
    bool *dark = spl_alloc(splats->chunk_count, sizeof *dark, err);
    if (!dark) {
        free(means);
        return SPL_E_NOMEM;
    }
    for (uint32_t chunk = 0; chunk < splats->chunk_count; chunk++) {
        struct mean *mean = &means[splats->node_of[chunk]];
        uint64_t first = splats->chunks[chunk].first_id;
        dark[chunk] = true;
        for (uint64_t id = first; id < first + splats->chunks[chunk].count; id++) {
            if (pass->chosen->photo[id] == SPL_NO_PHOTO)
                continue;
            dark[chunk] = false;
            for (int c = 0; c < 3; c++)
                mean->sum[c] += pass->chosen->color[id][c];
            mean->count++;
        }
    }
    for (uint32_t n = 0; n < splats->node_count; n++)
        for (uint32_t k = 0; k < splats->nodes[n].child_count; k++) {
            struct mean *child = &means[splats->nodes[n].first_child + k];
            if (child->count == 0)
                *child = means[n];
        }
    for (uint32_t chunk = 0; chunk < splats->chunk_count; chunk++) {
        const struct mean *mean = &means[splats->node_of[chunk]];
        uint64_t first = splats->chunks[chunk].first_id;
        for (uint64_t id = first; dark[chunk] && id < first + splats->chunks[chunk].count; id++)
            for (int c = 0; c < 3; c++)
                pass->chosen->color[id][c] = (uint8_t)(mean->count > 0 ? mean->sum[c] / mean->count + 0.5 : 128);
    }
    free(means);
    free(dark);
    return SPL_OK;
}

int spl_chosen_init(struct spl_chosen *chosen, const struct spl_splats *splats, const struct spl_candidates *candidates,
                    const struct spl_gain *gains, uint32_t photos, const uint8_t (*own)[3], struct spl_stage *stage,
                    struct spl_error *err)
{
    *chosen = (struct spl_chosen){
        .photo = spl_alloc_raw(splats->count, sizeof *chosen->photo, err),
        .color = spl_alloc(splats->count, sizeof *chosen->color, err),
    };
    struct pass pass = {.chosen = chosen,
                        .splats = splats,
                        .candidates = candidates,
                        .gains = gains,
                        .photos = photos,
                        .own = own,
                        .stage = stage};
    int rc = chosen->photo && chosen->color ? SPL_OK : SPL_E_NOMEM;
    for (uint64_t id = 0; !rc && id < splats->count; id++) /* of panels whose cells are asked nobody has the ids */
        chosen->photo[id] = SPL_NO_PHOTO;
    if (!rc) {
        spl_parallel_for(stage->threads, splats->chunk_count, 16, choose_chunks, &pass);
        chosen->unseen = atomic_load(&pass.unseen);
        rc = own ? SPL_OK : fill_chunks(&pass, err);
    }
    if (rc)
        spl_chosen_finish(chosen);
    return rc;
}

void spl_chosen_finish(struct spl_chosen *chosen)
{
    free(chosen->photo);
    free(chosen->color);
    *chosen = (struct spl_chosen){0};
}
