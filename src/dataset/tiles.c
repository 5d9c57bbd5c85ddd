/* Tiles of a collection, opened for who reads of them; see tiles.h. One that nobody uses is closed when another is to
 * be opened and there are enough; of these the one that was used longest ago. A tile must be the very one that the
 * collection was made of, which its version and the sizes of all its pages say: a tile that is replaced is none,
 * until the collection is made anew (tiles_faults.c). Any thread.
 *
 * Invariant: a tile is opened by one thread, which holds no mutex meanwhile: who wants another one does not wait for a
 * disk or a server that does not answer. open_count counts those that are being opened as well. */
#include "dataset/tiles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/condition.h"
#include "base/memory.h"
#include "base/work.h"
#include "dataset/open.h"
#include "dataset/remote.h"
#include "dataset/remote_url.h"

static const uint64_t rest_ns = 2 * SPL_NS_PER_S, look_around_ns = 100 * SPL_NS_PER_MS;

static bool is_same_stream(const struct spl_stream *a, const struct spl_stream *b)
{
    return !strcmp(a->name, b->name) && !strcmp(a->type, b->type) && !strcmp(a->unit, b->unit) &&
           a->first == b->first && a->steps_a_unit == b->steps_a_unit;
}

/* What of the tile is not as the collection says, or NULL. */
static const char *judge(const struct spl_dataset *dataset, const struct spl_tile *tile, const struct spl_dataset *own)
{
    const struct spl_page_row *rows = dataset->tiles->rows + tile->first_page;
    if (own->info.pages != tile->page_count || own->info.levels != tile->levels)
        return "has another number of pages or levels";
    if (own->textures || own->maps || own->info.has_surface != dataset->info.has_surface ||
        own->info.stream_count != dataset->info.stream_count)
        return "has other attributes";
    for (uint32_t s = 0; s < own->info.stream_count; s++)
        if (!is_same_stream(&own->streams[s], &dataset->streams[s]))
            return "has other attributes";
    for (uint32_t p = 0; p < tile->page_count; p++)
        if (own->rows[p].first_node != rows[p].first_node - tile->first_node ||
            own->rows[p].first_chunk != rows[p].first_chunk - tile->first_chunk ||
            own->rows[p].first_id != rows[p].first_id - tile->first_id ||
            own->pages[p]->bytes != spl_dataset_get_page_bytes(dataset, tile->first_page + p))
            return "has pages of other sizes";
    const struct spl_page_row *end = &own->rows[tile->page_count], *next = &rows[tile->page_count];
    return end->first_node == next->first_node - tile->first_node &&
                   end->first_chunk == next->first_chunk - tile->first_chunk &&
                   end->first_id == next->first_id - tile->first_id
               ? NULL
               : "has pages of other sizes";
}

/* A message without where the tile lies, which clients have no business with, and without its name in front, as who
 * passes it on has named it. */
static const char *shorten(const char *location, const char *file, const char *message, char *out, size_t size)
{
    static const char opening[] = "cannot read ";
    const size_t few = 8; /* letters, which may be anything */
    const size_t length = strlen(location);
    size_t used = 0, stem = 0;
    *out = '\0';
    for (const char *from = message; *from && used + 1 < size;) {
        const size_t left = strlen(from), same = left > few && left < length ? left : length; /* it may be cut */
        const bool here = length && !strncmp(from, location, same);
        used += (size_t)snprintf(out + used, size - used, "%.*s", here ? (int)strlen(file) : 1, here ? file : from);
        from += here ? same : 1;
    }
    const char *rest = strncmp(out, opening, strlen(opening)) ? out : out + strlen(opening);
    const char *name = spl_remote_get_stem(file, &stem); /* an open one goes by its id */
    size_t said = strncmp(rest, file, strlen(file)) ? stem : strlen(file);
    return !strncmp(rest, name, said) && !strncmp(rest + said, ": ", 2) ? rest + said + 2 : out;
}

int spl_tiles_fail(const struct spl_dataset *dataset, const struct spl_tile *tile, const struct spl_error *why,
                   struct spl_error *err)
{
    const int rc = why->code;
    const bool passes = rc == SPL_E_CANCELLED || rc == SPL_E_NOMEM || rc == SPL_E_TIMEOUT;
    const bool advised = passes || (dataset->remote && rc == SPL_E_IO); /* of a server the message says what to do */
    char text[sizeof why->message], shown[1024];
    char *location = spl_remote_make_beside(dataset->tiles->beside, tile->file);
    spl_fail(err, passes ? rc : SPL_E_CORRUPT, "%s: its tile %s cannot be read: %s%s", spl_dataset_get_name(dataset),
             tile->file,
             shorten(location ? spl_remote_show(location, shown, sizeof shown) : "", tile->file, why->message, text,
                     sizeof text),
             advised ? "" : "; put it back, or make the collection anew (splatd collect; of a job splatd pack --join)");
    free(location);
    return passes ? rc : SPL_E_CORRUPT;
}

/* A tile that is not there, or another one: has the collection on its server been made anew? Then it is opened anew by
 * who looks after it. Not asked by every view that meets such a tile. */
static void look_for_change(const struct spl_dataset *dataset)
{
    char first;
    const uint64_t now_ns = spl_now_ns();
    if (!dataset->remote || now_ns < atomic_load(&dataset->tiles->look_ns))
        return;
    atomic_store(&dataset->tiles->look_ns, now_ns + rest_ns);
    dataset->source.far->forget(dataset->source.context, 0, sizeof first);
    spl_dataset_read(dataset, 0, &first, sizeof first, NULL);
}

/* Without the mutex. */
static int open_tile(const struct spl_dataset *dataset, struct spl_tile *tile, struct spl_dataset **own,
                     struct spl_error *err)
{
    struct spl_tiles *tiles = dataset->tiles;
    struct spl_expected expected = {.version = tile->version, .pages = tile->page_count};
    char landed[SPL_SOURCE_ORIGIN_MAX] = "";
    if (dataset->remote && dataset->source.far->get_landed)
        dataset->source.far->get_landed(dataset->source.context, landed);
    const struct spl_dataset_opening how = {.cancelled = dataset->cancelled,
                                            .page_cache = tiles->page_cache,
                                            .remote_deadline_ms = tiles->remote_deadline_ms,
                                            .expected = &expected,
                                            .landed = landed,
                                            .moved_ns = &tile->moved_ns};
    struct spl_error why = {0};
    char *location = spl_remote_make_beside(tiles->beside, tile->file);
    int rc = location ? spl_dataset_open_as(location, &how, own, &why)
                      : spl_fail(&why, SPL_E_NOMEM, "out of memory for where it lies");
    free(location);
    const char *what = rc ? expected.differs : judge(dataset, tile, *own);
    if (what || rc == SPL_E_NOT_FOUND)
        look_for_change(dataset);
    if (what)
        rc = spl_fail(err, SPL_E_CORRUPT,
                      "%s: its tile %s %s: make the collection anew (splatd collect; of a job splatd pack --join)",
                      spl_dataset_get_name(dataset), tile->file, what);
    else if (rc)
        rc = spl_tiles_fail(dataset, tile, &why, err);
    if (rc) {
        spl_dataset_close(*own);
        *own = NULL;
        return rc;
    }
    (*own)->verified = dataset->verified; /* pages are held against their checksums when they are read */
    spl_dataset_strip(*own);
    return SPL_OK;
}

/* The mutex is held; the caller closes what it returns without it. */
static struct spl_dataset *take(struct spl_tiles *tiles, struct spl_tile *tile)
{
    struct spl_dataset *own = tile->open;
    tile->open = NULL;
    tile->spoilt = false;
    tiles->open_count--;
    return own;
}

static struct spl_dataset *take_oldest(struct spl_tiles *tiles)
{
    struct spl_tile *oldest = NULL;
    for (uint32_t i = 0; i < tiles->count; i++) {
        struct spl_tile *tile = &tiles->list[i];
        if (tile->open && !tile->users && (!oldest || tile->used < oldest->used))
            oldest = tile;
    }
    return oldest ? take(tiles, oldest) : NULL;
}

/* Called and left with the mutex. */
static int open_for_all(const struct spl_dataset *dataset, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_tiles *tiles = dataset->tiles;
    struct spl_dataset *surplus = NULL, *own = NULL;
    if (spl_remaining_ns(tile->rests_until_ns))
        return spl_fail(err, SPL_E_TIMEOUT,
                        "%s: its tile %s cannot be read: its server was given up a moment ago; come back later",
                        spl_dataset_get_name(dataset), tile->file);
    if (tiles->open_count >= tiles->open_most)
        surplus = take_oldest(tiles);
    tiles->open_count++;
    tile->opening = true;
    pthread_mutex_unlock(&tiles->mutex);
    spl_dataset_close(surplus);
    int rc = open_tile(dataset, tile, &own, err);
    pthread_mutex_lock(&tiles->mutex);
    tile->opening = false;
    tile->open = own;
    tiles->open_count -= !own;
    if (rc == SPL_E_TIMEOUT)
        tile->rests_until_ns = spl_now_ns() + rest_ns;
    pthread_cond_broadcast(&tiles->opened);
    return rc;
}

int spl_tiles_borrow(const struct spl_dataset *dataset, struct spl_tile *tile, const struct spl_dataset **out,
                     struct spl_error *err)
{
    struct spl_tiles *tiles = dataset->tiles;
    struct spl_error why = {0};
    int rc = SPL_OK;
    bool opened = false;
    *out = NULL;
    if (!tiles->beside)
        return spl_fail(err, SPL_E_UNSUPPORTED,
                        "%s: its tile %s cannot be read: a collection's tiles are files beside it, on a disk or a "
                        "server",
                        spl_dataset_get_name(dataset), tile->file);
    spl_remote_begin(); /* opening is many reads, and looks at the flag between them */
    pthread_mutex_lock(&tiles->mutex);
    while (tile->opening && !(rc = spl_dataset_check_cancelled(dataset, &why))) // who opens it has a deadline
        spl_condition_wait(&tiles->opened, &tiles->mutex, spl_now_ns() + look_around_ns);
    if (!rc && !tile->open) {
        opened = !spl_remaining_ns(tile->rests_until_ns);
        rc = open_for_all(dataset, tile, &why);
    }
    if (!rc) {
        tile->users++;
        tile->used = ++tiles->borrowings;
        *out = tile->open;
    }
    pthread_mutex_unlock(&tiles->mutex);
    spl_remote_end();
    if (opened)
        spl_tiles_note(dataset, tile, SPL_TILE_OPENED, rc, &why);
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

void spl_tiles_give_back(const struct spl_dataset *dataset, struct spl_tile *tile, bool spoilt)
{
    struct spl_tiles *tiles = dataset->tiles;
    struct spl_dataset *surplus = NULL;
    pthread_mutex_lock(&tiles->mutex);
    if (spoilt)
        tile->spoilt = true;
    const bool replaced = tile->fault && !atomic_load(&tile->late); // it may be put back
    const bool stays = !tile->spoilt && !replaced && tiles->open_count <= tiles->open_most;
    if (!--tile->users && !stays)
        surplus = take(tiles, tile);
    pthread_mutex_unlock(&tiles->mutex);
    spl_dataset_close(surplus);
}

void spl_tiles_destroy(struct spl_tiles *tiles)
{
    if (!tiles)
        return;
    for (uint32_t i = 0; tiles->list && i < tiles->count; i++) {
        spl_dataset_close(tiles->list[i].open);
        free(tiles->list[i].file);
        free(tiles->list[i].fault);
    }
    spl_page_cache_let_go(tiles->page_cache);
    pthread_cond_destroy(&tiles->opened);
    pthread_mutex_destroy(&tiles->mutex);
    free(tiles->list);
    free(tiles->rows);
    free(tiles->page_bytes);
    free(tiles->beside);
    free(tiles);
}
