/* Tiles of a collection that cannot be read: missing, another one, damaged. A view that needs one draws the tile's leaf
 * instead of it and says that it is not complete; so each is remembered for a while, in which nobody looks for it, and
 * then tried again. So is one whose server does not answer, which views that can do without it do not wait for until
 * something of it has come. Any thread.
 *
 * Invariant: a tile has a fault from what was found wrong on until the same is found right, however long it rests: who
 * tries it again in between learns it anew. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/log.h"
#include "dataset/remote_counts.h"
#include "dataset/remote_url.h"
#include "dataset/open.h"
#include "dataset/tiles.h"

static const uint64_t pause_least_ns = 2 * SPL_NS_PER_S, pause_most_ns = 60 * SPL_NS_PER_S;

/* The mutex is held. */
static void end_fault(struct spl_tiles *tiles, struct spl_tile *tile)
{
    free(tile->fault);
    tile->fault = NULL;
    tile->pause_ns = 0;
    atomic_store(&tile->late, false);
    atomic_store(&tile->without_until_ns, 0);
    atomic_fetch_sub(&tiles->fault_count, 1);
}

/* True where it is news. The mutex is held. */
static bool begin_fault(struct spl_tiles *tiles, struct spl_tile *tile, uint64_t what, bool late, const char *message)
{
    const uint64_t now_ns = spl_now_ns();
    const bool other = !tile->fault || strcmp(tile->fault, message);
    const bool news = other && !(late && atomic_load(&tile->late)); // how often it was asked is none
    if (other) {
        char *fault = strdup(message);
        atomic_fetch_add(&tiles->fault_count, fault && !tile->fault);
        free(fault ? tile->fault : NULL);
        tile->fault = fault ? fault : tile->fault;
    }
    if (now_ns >= atomic_load(&tile->without_until_ns)) { // else it is told by several who read it at once
        tile->pause_ns = tile->pause_ns ? 2 * tile->pause_ns : pause_least_ns;
        if (tile->pause_ns > pause_most_ns)
            tile->pause_ns = pause_most_ns;
        atomic_store(&tile->without_until_ns, now_ns + tile->pause_ns);
    }
    tile->faulty = what;
    atomic_store(&tile->late, late);
    return news;
}

void spl_tiles_note(const struct spl_dataset *dataset, struct spl_tile *tile, uint64_t what, int rc,
                    const struct spl_error *why)
{
    struct spl_tiles *tiles = dataset->tiles;
    bool news = false;
    if (rc && rc != SPL_E_CORRUPT && rc != SPL_E_TIMEOUT)
        return;
    if (!rc && !atomic_load(&tiles->fault_count))
        return;
    pthread_mutex_lock(&tiles->mutex);
    if (rc)
        news = begin_fault(tiles, tile, what, rc == SPL_E_TIMEOUT, why->message);
    else if ((news = tile->fault && (tile->faulty == what || (atomic_load(&tile->late) && what != SPL_TILE_THERE) ||
                                     (tile->faulty == SPL_TILE_THERE && what == SPL_TILE_OPENED))))
        end_fault(tiles, tile);
    pthread_mutex_unlock(&tiles->mutex);
    if (!news)
        return;
    if (rc) {
        spl_remote_count(tile_faults, 1);
        spl_log_warn("%s; views draw what it is from afar instead, and are not complete", why->message);
    } else {
        spl_log_info("%s: its tile %s can be read again", spl_dataset_get_name(dataset), tile->file);
    }
}

bool spl_dataset_is_without(const struct spl_dataset *dataset, uint32_t part)
{
    if (!part || !atomic_load(&dataset->tiles->fault_count))
        return false;
    const uint64_t until_ns = atomic_load(&dataset->tiles->list[part - 1].without_until_ns);
    return until_ns && spl_now_ns() < until_ns;
}

bool spl_dataset_is_late(const struct spl_dataset *dataset, uint32_t part)
{
    return part && atomic_load(&dataset->tiles->fault_count) && atomic_load(&dataset->tiles->list[part - 1].late);
}

bool spl_dataset_tell_late(const struct spl_dataset *dataset, uint32_t part, char *out, size_t size)
{
    struct spl_tiles *tiles = dataset->tiles;
    bool found = part != 0;
    if (!tiles || (!part && !atomic_load(&tiles->fault_count)))
        return false;
    pthread_mutex_lock(&tiles->mutex);
    if (part && tiles->list[part - 1].fault)
        snprintf(out, size, "%s", tiles->list[part - 1].fault);
    else if (part) // a few bytes a second come of it
        snprintf(out, size, "%s: its tile %s was still being read", spl_dataset_get_name(dataset),
                 tiles->list[part - 1].file);
    for (uint32_t i = 0; i < tiles->count && !found; i++)
        if ((found = tiles->list[i].fault && atomic_load(&tiles->list[i].late)))
            snprintf(out, size, "%s", tiles->list[i].fault);
    pthread_mutex_unlock(&tiles->mutex);
    return found;
}

void spl_dataset_find_late(const struct spl_dataset *dataset, uint32_t part)
{
    struct spl_error why = {0}, told = {0};
    if (spl_dataset_is_late(dataset, part))
        return;
    spl_fail(&why, SPL_E_TIMEOUT, "nothing of it came for as long as a view could wait");
    spl_tiles_fail(dataset, &dataset->tiles->list[part - 1], &why, &told);
    spl_tiles_note(dataset, &dataset->tiles->list[part - 1], SPL_TILE_OPENED, SPL_E_TIMEOUT, &told);
}

void spl_dataset_spoil_tile(const struct spl_dataset *dataset, uint32_t page, const struct spl_error *why)
{
    struct spl_tile *tile = spl_tiles_find(dataset, page);
    struct spl_error told = {0};
    spl_tiles_fail(dataset, tile, why, &told);
    spl_tiles_note(dataset, tile, spl_tile_page(page, true), SPL_E_CORRUPT, &told);
}

uint32_t spl_dataset_list_faulty(const struct spl_dataset *dataset, struct spl_faulty_tile *out, size_t capacity)
{
    struct spl_tiles *tiles = dataset->tiles;
    uint32_t count = 0;
    if (!tiles || !atomic_load(&tiles->fault_count))
        return 0;
    pthread_mutex_lock(&tiles->mutex);
    for (uint32_t i = 0; i < tiles->count; i++) {
        const struct spl_tile *tile = &tiles->list[i];
        if (!tile->fault)
            continue;
        if (count < capacity) {
            out[count].file = tile->file;
            snprintf(out[count].reason, sizeof out[count].reason, "%s", tile->fault);
        }
        count++;
    }
    pthread_mutex_unlock(&tiles->mutex);
    return count;
}

void spl_dataset_look_for_tiles(const struct spl_dataset *dataset)
{
    const struct spl_tiles *tiles = dataset->tiles;
    for (uint32_t i = 0; tiles && tiles->beside && !dataset->remote && i < tiles->count; i++) {
        struct spl_tile *tile = &tiles->list[i];
        char *path = spl_remote_make_beside(tiles->beside, tile->file);
        struct spl_error why = {0}, told = {0};
        struct stat status;
        int rc = SPL_OK;
        if (path && stat(path, &status) && errno == ENOENT) {
            spl_fail(&why, SPL_E_NOT_FOUND, "%s: there is no such file", path);
            rc = spl_tiles_fail(dataset, tile, &why, &told);
        }
        if (path)
            spl_tiles_note(dataset, tile, SPL_TILE_THERE, rc, &told);
        free(path);
    }
}
