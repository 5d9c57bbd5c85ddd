/* Textures are made photograph by photograph and read chunk by chunk: in between they lie in an unlinked file beside
 * the output, since those of 600,000 splats at 32 x 32 are 1.8 GB. Space on disk that runs out is an error of a write,
 * never a signal. Taking and comparing are parallel over chunks. */
#include "pack/texture/textures.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"

int spl_textures_init(struct spl_textures *textures, const char *output, uint64_t splats, uint32_t size,
                      struct spl_error *err)
{
    char *path = NULL;
    *textures = (struct spl_textures){.fd = -1, .size = size, .values = spl_texture_values(size)};
    if (asprintf(&path, "%s" SPL_UNFINISHED "-textures", output, (long)getpid()) < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", output);
    int rc = SPL_OK;
    textures->fd = spl_file_create(path, 0600);
    if (textures->fd < 0)
        rc = spl_fail_errno(err, errno, "cannot create %s", path);
    else
        unlink(path);
    free(path);
    textures->has = rc ? NULL : spl_alloc(splats, sizeof *textures->has, err);
    rc = rc ? rc : textures->has ? SPL_OK : SPL_E_NOMEM;
    if (rc)
        spl_textures_finish(textures);
    return rc;
}

void spl_textures_finish(struct spl_textures *textures)
{
    if (textures->fd >= 0)
        close(textures->fd);
    free(textures->has);
    free(textures->id);
    *textures = (struct spl_textures){.fd = -1};
}

struct take {
    struct spl_textures *textures; /* NULL: compare */
    const struct spl_splats *splats;
    const struct spl_candidates *candidates;
    const struct spl_chosen *chosen;
    const struct spl_gain *gains;
    const struct spl_photo *photo;
    uint16_t index;
    struct spl_stage *stage;
    atomic_int failed; /* errno */
};

static struct spl_tone find_tone(const struct take *take, uint64_t id)
{
    const struct spl_candidate *list = take->candidates->list + id * take->candidates->depth;
    uint32_t k = 0;
    while (k + 1 < take->candidates->depth && list[k].photo != take->index)
        k++;
    return spl_tone_find(&take->gains[take->index], &list[k], take->chosen->color[id]);
}

/* Whether the photograph is that of any splat; a line has no area for a texture. */
static bool is_chosen(const struct take *take, uint32_t chunk)
{
    const struct spl_chunk *header = &take->splats->chunks[chunk];
    for (uint32_t i = 0; i < header->count && spl_chunk_kind(header) == SPL_CHUNK_DISCS; i++)
        if (take->chosen->photo[header->first_id + i] == take->index)
            return true;
    return false;
}

static void take_chunks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct take *take = context;
    struct spl_world_splat splats[SPL_CHUNK_SPLATS];
    uint8_t texture[SPL_TEXTURE_VALUES_MAX];
    for (uint32_t chunk = (uint32_t)begin; chunk < end && !atomic_load(&take->failed); chunk++) {
        if (!is_chosen(take, chunk))
            continue;
        uint32_t count = spl_splats_get(take->splats, chunk, splats);
        for (uint32_t i = 0; i < count; i++) {
            uint64_t id = take->splats->chunks[chunk].first_id + (uint64_t)i;
            if (take->chosen->photo[id] != take->index)
                continue;
            struct spl_tone tone = find_tone(take, id);
            if (!spl_texture_resample(take->photo, &tone, &splats[i], take->textures->size, texture))
                continue;
            size_t bytes = take->textures->values;
            ssize_t written = pwrite(take->textures->fd, texture, bytes, (off_t)(id * bytes));
            if (written != (ssize_t)bytes) {
                atomic_store(&take->failed, written < 0 && errno ? errno : ENOSPC);
                return;
            }
            take->textures->has[id] = true;
        }
    }
    spl_stage_add(take->stage, end - begin, worker);
}

int spl_textures_take(struct spl_textures *textures, const struct spl_splats *splats,
                      const struct spl_candidates *candidates, const struct spl_chosen *chosen,
                      const struct spl_gain *gains, const struct spl_photo *photo, uint16_t index,
                      struct spl_stage *stage, struct spl_error *err)
{
    struct take take = {.textures = textures,
                        .splats = splats,
                        .candidates = candidates,
                        .chosen = chosen,
                        .gains = gains,
                        .photo = photo,
                        .index = index,
                        .stage = stage};
    spl_parallel_for(stage->threads, splats->chunk_count, 16, take_chunks, &take);
    int failed = atomic_load(&take.failed);
    return failed ? spl_fail_errno(err, failed, "cannot write %llu bytes of textures beside the output",
                                   (unsigned long long)(splats->count * textures->values))
                  : SPL_OK;
}

int spl_textures_list(struct spl_textures *textures, uint64_t splats, struct spl_error *err)
{
    textures->count = 0;
    for (uint64_t id = 0; id < splats; id++)
        textures->count += textures->has[id];
    textures->id = spl_alloc_raw(textures->count, sizeof *textures->id, err);
    if (!textures->id)
        return SPL_E_NOMEM;
    for (uint64_t id = 0, n = 0; id < splats; id++)
        if (textures->has[id])
            textures->id[n++] = (uint32_t)id;
    return SPL_OK;
}

void spl_textures_compare(const struct spl_splats *splats, const struct spl_candidates *candidates,
                          const struct spl_chosen *chosen, const struct spl_gain *gains, const struct spl_photo *photo,
                          uint16_t index, uint32_t stride, struct spl_resample_error error[3])
{
    const struct take take = {
        .splats = splats, .candidates = candidates, .chosen = chosen, .gains = gains, .photo = photo, .index = index};
    struct spl_world_splat decoded[SPL_CHUNK_SPLATS];
    uint8_t texture[SPL_TEXTURE_VALUES_MAX];
    uint32_t met = 0;
    for (uint32_t chunk = 0; chunk < splats->chunk_count; chunk++) {
        if (splats->nodes[splats->node_of[chunk]].child_count || !is_chosen(&take, chunk))
            continue;
        uint32_t count = spl_splats_get(splats, chunk, decoded);
        for (uint32_t i = 0; i < count; i++) {
            uint64_t id = splats->chunks[chunk].first_id + (uint64_t)i;
            if (chosen->photo[id] != index || met++ % stride)
                continue;
            struct spl_tone tone = find_tone(&take, id);
            for (uint32_t k = 0; k < 3; k++)
                if (spl_texture_resample(photo, &tone, &decoded[i], 8u << k, texture))
                    spl_texture_compare(photo, &tone, &decoded[i], 8u << k, texture, &error[k]);
        }
    }
}
