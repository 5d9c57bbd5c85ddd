/* Which piece of a shared frame is whose; see spread.h.
 *
 * Invariant: a piece is in one of the stretches, among those put back, held by one renderer, or drawn; `left` counts
 * those that are not drawn. Everything but `view` and `renderers` is guarded by the mutex. */
#include "render/spread.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "render/view.h"

/* Pieces a renderer: with fewer one waits longer for the last, with more each lists anew what lies at borders. */
enum { pieces_each = 4, least_side = 64, widest_border = 4 /* as many times what is drawn around is a piece */ };
static const size_t none = SIZE_MAX;

struct stretch {
    size_t first, end;
};

struct told {
    struct spl_frame_whole whole;
    struct spl_frame_stats drawn; /* by all its pieces */
    bool *had;                    // by slot: what any piece was drawn of; may be NULL
};

struct spl_spread {
    pthread_mutex_t mutex;
    unsigned renderers;
    struct spl_view view;   /* as it is drawn: resampling is of who drew the last piece */
    struct spl_frame frame;
    uint32_t tile_width, tile_height; /* 0 = the first take() lays them out, and pieces */
    uint32_t columns;                 /* of tiles */
    uint32_t width, height;           /* of a piece */
    size_t across, down;              /* pieces of a tile, of which the last may be empty */
    size_t left;                      /* pieces that are not drawn */
    struct stretch stretches[SPL_SPREAD_MAX];
    size_t held[SPL_SPREAD_MAX], back[SPL_SPREAD_MAX], back_count;
    struct told *told;                /* of each tile */
    size_t tiles;
    uint64_t pixels_left;
    double total_ms[SPL_SPREAD_MAX];
};

bool spl_spread_can(const struct spl_view *view)
{
    return !view->rays && !spl_camera_is_bent(&view->camera);
}

int spl_spread_create(const struct spl_view *view, unsigned renderers, struct spl_spread **out, struct spl_error *err)
{
    spl_assert(renderers && renderers <= SPL_SPREAD_MAX && spl_spread_can(view));
    struct spl_spread *spread = *out = spl_alloc(1, sizeof *spread, err);
    if (!spread)
        return SPL_E_NOMEM;
    spread->renderers = renderers;
    spread->view = *view;
    spl_view_resize(&spread->view);
    spread->frame.stats.complete = true;
    spread->pixels_left = (uint64_t)spread->view.camera.width * spread->view.camera.height;
    for (unsigned i = 0; i < renderers; i++)
        spread->held[i] = none;
    pthread_mutex_init(&spread->mutex, NULL);
    return SPL_OK;
}

void spl_spread_destroy(struct spl_spread *spread)
{
    if (!spread)
        return;
    spl_frame_finish(&spread->frame);
    pthread_mutex_destroy(&spread->mutex);
    for (size_t i = 0; i < spread->tiles; i++)
        free(spread->told[i].had);
    free(spread->told);
    free(spread);
}

static uint32_t divide_up(uint32_t a, uint32_t b)
{
    return a / b + (a % b != 0);
}

/* What of `all` is left behind `from`, at most `most`. */
static uint32_t rest(uint32_t all, uint32_t from, uint32_t most)
{
    const uint32_t behind = from < all ? all - from : 0;
    return behind < most ? behind : most;
}

/* The tile of a piece, and the piece, column by column, so that what lies above and below is of one stretch; empty
 * where tiles are smaller than others. */
static void find(const struct spl_spread *spread, size_t number, struct spl_spread_piece *out)
{
    const struct spl_camera *camera = &spread->view.camera;
    const size_t cuts = spread->across * spread->down, cut = number % cuts;
    const uint32_t index = (uint32_t)(number / cuts);
    const uint32_t x = (uint32_t)(cut / spread->down) * spread->width;
    const uint32_t y = (uint32_t)(cut % spread->down) * spread->height;
    struct spl_piece tile = {.x = index % spread->columns * spread->tile_width,
                             .y = index / spread->columns * spread->tile_height};
    tile.width = rest(camera->width, tile.x, spread->tile_width);
    tile.height = rest(camera->height, tile.y, spread->tile_height);
    *out = (struct spl_spread_piece){.tile = tile, .index = index, .whole = spread->told[index].whole};
    out->piece = (struct spl_piece){.x = tile.x + x,
                                    .y = tile.y + y,
                                    .width = rest(tile.width, x, spread->width),
                                    .height = rest(tile.height, y, spread->height)};
}

static bool is_none(const struct spl_piece *piece)
{
    return !piece->width || !piece->height;
}

static bool is_empty(const struct spl_spread *spread, size_t number)
{
    struct spl_spread_piece found;
    find(spread, number, &found);
    return is_none(&found.piece);
}

/* Pieces are about as wide as high: they see less of a dataset than stripes, and have less border. Most of what is
 * drawn is their own. */
static void cut_tiles(struct spl_spread *spread, const struct spl_tiling *tiling, size_t tiles)
{
    const uint32_t border = widest_border * 2 * tiling->reach.apron / (uint32_t)spread->view.supersample;
    const uint32_t least = 2 * (border < least_side ? least_side : border);
    const size_t wanted = spread->renderers > 1 ? pieces_each * spread->renderers : 1;
    uint32_t width = tiling->width, height = tiling->height;
    for (size_t pieces = tiles; pieces < wanted && (width >= least || height >= least); pieces *= 2)
        if (width > height)
            width = divide_up(width, 2);
        else
            height = divide_up(height, 2);
    spread->width = width < tiling->width ? divide_up(width, least_side) * least_side : width;
    spread->height = height < tiling->height ? divide_up(height, least_side) * least_side : height;
    spread->across = divide_up(tiling->width, spread->width);
    spread->down = divide_up(tiling->height, spread->height);
}

static int lay_out(struct spl_spread *spread, const struct spl_tiling *tiling, struct spl_error *err)
{
    const struct spl_camera *camera = &spread->view.camera;
    const uint32_t columns = divide_up(camera->width, tiling->width);
    const size_t tiles = (size_t)columns * divide_up(camera->height, tiling->height);
    if (spread->tile_width) {
        spl_assert(tiling->width == spread->tile_width && tiling->height == spread->tile_height);
        return SPL_OK;
    }
    if (!(spread->told = spl_alloc(tiles, sizeof *spread->told, err)))
        return SPL_E_NOMEM;
    spread->tiles = tiles;
    spread->tile_width = tiling->width;
    spread->tile_height = tiling->height;
    spread->columns = columns;
    spread->frame.stats.tiles = (uint32_t)tiles;
    cut_tiles(spread, tiling, tiles);
    const size_t pieces = tiles * spread->across * spread->down;
    for (unsigned i = 0; i < spread->renderers; i++)
        spread->stretches[i] = (struct stretch){pieces * i / spread->renderers, pieces * (i + 1) / spread->renderers};
    for (size_t i = 0; i < pieces; i++)
        spread->left += !is_empty(spread, i);
    return SPL_OK;
}

/* What was put back, its own, or the end of the longest of the others'. */
static size_t choose(struct spl_spread *spread, unsigned number)
{
    struct stretch *own = &spread->stretches[number], *longest = own;
    if (spread->back_count)
        return spread->back[--spread->back_count];
    if (own->first < own->end)
        return own->first++;
    for (unsigned i = 0; i < spread->renderers; i++)
        if (spread->stretches[i].end - spread->stretches[i].first > longest->end - longest->first)
            longest = &spread->stretches[i];
    return longest->first < longest->end ? --longest->end : none;
}

int spl_spread_take(struct spl_spread *spread, unsigned number, const struct spl_tiling *tiling,
                    struct spl_spread_piece *out, struct spl_error *err)
{
    *out = (struct spl_spread_piece){0};
    pthread_mutex_lock(&spread->mutex);
    spl_assert(number < spread->renderers && spread->held[number] == none);
    int rc = lay_out(spread, tiling, err);
    while (!rc && is_none(&out->piece) && (spread->held[number] = choose(spread, number)) != none)
        find(spread, spread->held[number], out);
    if (is_none(&out->piece))
        *out = (struct spl_spread_piece){0};
    spread->pixels_left -= (uint64_t)out->piece.width * out->piece.height;
    pthread_mutex_unlock(&spread->mutex);
    return rc;
}

static void add(struct spl_frame_stats *all, const struct spl_frame_stats *more)
{
    all->splats_drawn += more->splats_drawn;
    all->chunks_drawn += more->chunks_drawn;
    all->nodes_drawn += more->nodes_drawn;
    all->panels_drawn += more->panels_drawn;
    all->meshes_drawn += more->meshes_drawn;
    all->lines_drawn += more->lines_drawn;
    all->soft_drawn += more->soft_drawn;
    all->pages_loaded += more->pages_loaded;
    all->complete &= more->complete;
    all->pending |= more->pending;
    all->select_ms += more->select_ms;
    all->upload_ms += more->upload_ms;
    all->clear_ms += more->clear_ms;
    all->depth_ms += more->depth_ms;
    all->shade_ms += more->shade_ms;
    all->soft_ms += more->soft_ms;
    all->resolve_ms += more->resolve_ms;
    all->readback_ms += more->readback_ms;
}

void spl_spread_tell(struct spl_spread *spread, uint32_t index, const struct spl_frame_whole *whole,
                     const struct spl_frame_stats *drawn)
{
    pthread_mutex_lock(&spread->mutex);
    if (!spread->told[index].whole.pixels) {
        spread->told[index].whole = *whole;
        spread->told[index].drawn = *drawn;
    }
    pthread_mutex_unlock(&spread->mutex);
}

int spl_spread_note_had(struct spl_spread *spread, uint32_t index, const struct spl_resident_dataset *resident,
                        uint64_t walk, struct spl_error *err)
{
    pthread_mutex_lock(&spread->mutex);
    struct told *told = &spread->told[index];
    if (!told->had)
        told->had = spl_alloc(resident->slot_count, sizeof *told->had, err);
    for (uint32_t slot = 0; slot < resident->slot_count && told->had; slot++)
        told->had[slot] |= resident->pages[slot].last_frame == walk && resident->pages[slot].filled;
    pthread_mutex_unlock(&spread->mutex);
    return told->had ? SPL_OK : SPL_E_NOMEM;
}

bool spl_spread_find_short(struct spl_spread *spread, uint32_t *index, struct spl_piece *tile, const bool **had)
{
    pthread_mutex_lock(&spread->mutex);
    bool found = false;
    for (; !spread->left && !spread->frame.stats.complete && *index < spread->tiles; ++*index) {
        struct spl_spread_piece first;
        find(spread, *index * spread->across * spread->down, &first);
        *tile = first.tile;
        *had = spread->told[*index].had;
        if ((found = *had && spread->told[*index].whole.pixels))
            break;
    }
    pthread_mutex_unlock(&spread->mutex);
    return found;
}

void spl_spread_tell_anew(struct spl_spread *spread, uint32_t index, const struct spl_frame_stats *drawn)
{
    pthread_mutex_lock(&spread->mutex);
    spread->told[index].drawn = *drawn;
    pthread_mutex_unlock(&spread->mutex);
}

bool spl_spread_done(struct spl_spread *spread, unsigned number, struct spl_frame_stats *counted)
{
    pthread_mutex_lock(&spread->mutex);
    spl_assert(spread->held[number] != none && spread->left);
    spread->held[number] = none;
    add(&spread->frame.stats, counted);
    bool last = !--spread->left;
    pthread_mutex_unlock(&spread->mutex);
    *counted = (struct spl_frame_stats){.complete = true, .total_ms = counted->total_ms};
    return last;
}

void spl_spread_leave(struct spl_spread *spread, unsigned number, double total_ms)
{
    struct spl_spread_piece held;
    pthread_mutex_lock(&spread->mutex);
    spread->total_ms[number] += total_ms;
    if (spread->held[number] != none) {
        find(spread, spread->held[number], &held);
        spread->pixels_left += (uint64_t)held.piece.width * held.piece.height;
        spread->back[spread->back_count++] = spread->held[number];
        spread->held[number] = none;
    }
    pthread_mutex_unlock(&spread->mutex);
}

int spl_spread_get_images(struct spl_spread *spread,
                          int (*make)(struct spl_frame *frame, const struct spl_view *view, struct spl_error *err),
                          struct spl_image images[SPL_LAYER_COUNT], struct spl_error *err)
{
    pthread_mutex_lock(&spread->mutex);
    int rc = make(&spread->frame, &spread->view, err);
    for (int layer = 0; layer < SPL_LAYER_COUNT && !rc; layer++)
        images[layer] = spread->frame.images[layer];
    pthread_mutex_unlock(&spread->mutex);
    return rc;
}

void spl_spread_hand_out(struct spl_spread *spread, struct spl_frame *frame)
{
    pthread_mutex_lock(&spread->mutex);
    for (unsigned i = 0; i < spread->renderers; i++)
        if (spread->frame.stats.total_ms < spread->total_ms[i])
            spread->frame.stats.total_ms = spread->total_ms[i];
    for (size_t i = 0; i < spread->tiles; i++)
        if (spread->told[i].whole.pixels)
            add(&spread->frame.stats, &spread->told[i].drawn);
    *frame = spread->frame;
    spread->frame = (struct spl_frame){0};
    pthread_mutex_unlock(&spread->mutex);
}

void spl_spread_hand_out_images(struct spl_spread *spread, struct spl_image images[SPL_LAYER_COUNT])
{
    pthread_mutex_lock(&spread->mutex);
    memcpy(images, spread->frame.images, sizeof spread->frame.images);
    memset(spread->frame.images, 0, sizeof spread->frame.images);
    pthread_mutex_unlock(&spread->mutex);
}

uint64_t spl_spread_get_left(struct spl_spread *spread)
{
    const uint64_t side = (uint64_t)spread->view.supersample;
    pthread_mutex_lock(&spread->mutex);
    uint64_t left = spread->pixels_left;
    pthread_mutex_unlock(&spread->mutex);
    return (left * side * side + spread->renderers - 1) / spread->renderers;
}
