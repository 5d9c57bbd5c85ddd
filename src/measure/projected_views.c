/* The views of the baseline. They wait in memory, a dozen bytes a pixel, while photographs come and go, each once: so
 * their number is chosen by what memory there is before anything is loaded. Sums are formed by tile and added up in
 * order, so they do not depend on threads. */
#include "measure/projected_views.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "image/load.h"
#include "measure/summary.h"

enum { pixel_bytes = 12 };
static const double most = 99; /* of a tile, dB: medians are between two */

double spl_compared_error(const float rgb[3], const uint8_t truth[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += ((double)rgb[c] - truth[c]) * ((double)rgb[c] - truth[c]);
    return sum;
}

double spl_compared_error_bytes(const uint8_t rgb[3], const uint8_t truth[3])
{
    return spl_compared_error((const float[3]){rgb[0], rgb[1], rgb[2]}, truth);
}

int spl_compared_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    int rc = spl_image_load(view->photograph, SPL_LAYER_COLOR, out, err);
    if (!rc && (out->width != view->camera.width || out->height != view->camera.height)) {
        rc = spl_fail_field(err, SPL_E_INPUT, "width", "%s: %u x %u pixels; its camera says %u x %u", view->photograph,
                            out->width, out->height, view->camera.width, view->camera.height);
        spl_image_finish(out);
    }
    return rc;
}

static void finish_view(struct spl_compared_view *v)
{
    free(v->tiles);
    free(v->photo);
    free(v->depth);
    free(v->truth);
    free(v->colored);
}

static int render(const struct spl_projected_options *o, const struct spl_named_view *named, uint32_t atoms,
                  uint32_t layers, struct spl_frame *frame, struct spl_error *err)
{
    struct spl_view view;
    spl_view_init(&view);
    view.camera = named->camera;
    view.layers = layers;
    view.disc.atoms = atoms;
    return spl_renderer_render(o->renderer, o->dataset, &view, frame, err);
}

struct spl_compared_tile *spl_compared_tile_at(const struct spl_compared_view *v, size_t pixel)
{
    size_t x = pixel % v->view->camera.width, y = pixel / v->view->camera.width;
    return &v->tiles[y / SPL_PROJECTED_TILE * v->across + x / SPL_PROJECTED_TILE];
}

/* Takes what the SPL_FRAME_COUNT and the photograph say of each pixel. */
static void take_pixels(const struct spl_projected_options *o, struct spl_compared_view *v,
                        const struct spl_image *photograph, const struct spl_frame *with,
                        const struct spl_frame *without)
{
    const struct spl_texture_origin *origin = o->origin;
    const uint8_t(*truth)[4] = photograph->pixels;
    const uint8_t(*full)[4] = with->images[SPL_LAYER_COLOR].pixels;
    const uint8_t(*plain)[4] = without->images[SPL_LAYER_COLOR].pixels;
    const uint32_t *id = with->images[SPL_LAYER_ID].pixels;
    const float *depth = with->images[SPL_LAYER_DEPTH].pixels;
    size_t pixels = (size_t)photograph->width * photograph->height;
    for (size_t i = 0; i < pixels; i++) {
        struct spl_compared_tile *tile = spl_compared_tile_at(v, i);
        memcpy(v->truth[i], truth[i], 3);
        memcpy(v->colored[i], plain[i], 3);
        v->depth[i] = depth[i];
        v->photo[i] = SPL_TEXTURE_NO_PHOTO;
        if (id[i] >= origin->splats || !(depth[i] > 0) || truth[i][3] < 255)
            continue;
        double error = spl_compared_error_bytes(plain[i], truth[i]);
        tile->pixels++;
        tile->error[SPL_FRAME_COLORED] += error;
        tile->error[SPL_FRAME_TEXTURED] += spl_compared_error_bytes(full[i], truth[i]);
        v->photo[i] = origin->photo[id[i]];
        for (int k = 0; v->photo[i] == SPL_TEXTURE_NO_PHOTO && k < SPL_PROJECTED_COUNT; k++)
            tile->error[k] += error;
    }
}

int spl_compared_view_take(const struct spl_projected_options *o, struct spl_compared_view *v, struct spl_error *err)
{
    struct spl_image photograph = {0};
    struct spl_frame with = {0}, without = {0};
    size_t pixels = (size_t)v->view->camera.width * v->view->camera.height;
    int rc = SPL_E_NOMEM;
    v->across = (v->view->camera.width + SPL_PROJECTED_TILE - 1) / SPL_PROJECTED_TILE;
    v->down = (v->view->camera.height + SPL_PROJECTED_TILE - 1) / SPL_PROJECTED_TILE;
    v->tiles = spl_alloc((size_t)v->across * v->down, sizeof *v->tiles, err);
    v->photo = spl_alloc_raw(pixels, sizeof *v->photo, err);
    v->depth = spl_alloc_raw(pixels, sizeof *v->depth, err);
    v->truth = spl_alloc_raw(pixels, sizeof *v->truth, err);
    v->colored = spl_alloc_raw(pixels, sizeof *v->colored, err);
    if (!v->tiles || !v->photo || !v->depth || !v->truth || !v->colored)
        return rc;
    if (!(rc = spl_compared_load(v->view, &photograph, err)) &&
        !(rc = render(o, v->view, 8, 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_ID | 1u << SPL_LAYER_DEPTH, &with, err)) &&
        !(rc = render(o, v->view, 0, 1u << SPL_LAYER_COLOR, &without, err)))
        take_pixels(o, v, &photograph, &with, &without);
    spl_image_finish(&photograph);
    spl_frame_finish(&with);
    spl_frame_finish(&without);
    return rc;
}

static bool is_packed(const struct spl_texture_origin *origin, const char *name)
{
    for (uint32_t i = 0; i < origin->photographs; i++)
        if (!strcmp(origin->names[i], name))
            return true;
    return false;
}

/* Of the views of one kind every so-manieth, options->views at most. */
int spl_compared_views_choose(const struct spl_projected_options *o, uint64_t source_bytes,
                              struct spl_compared_views *out, struct spl_error *err)
{
    uint64_t bytes = 0, largest = 0;
    size_t of_kind[2] = {0}, passed[2] = {0};
    out->views = spl_alloc(o->photographs->count, sizeof *out->views, err);
    if (!out->views)
        return SPL_E_NOMEM;
    for (int round = 0; round < 2; round++)
        for (size_t i = 0; i < o->photographs->count; i++) {
            const struct spl_named_view *view = &o->photographs->views[i];
            uint64_t pixels = (uint64_t)view->camera.width * view->camera.height;
            int left_out = !is_packed(o->origin, view->name);
            largest = pixels > largest ? pixels : largest;
            if (view->distortion.kind != SPL_DISTORTION_NONE)
                continue;
            if (!round) {
                of_kind[left_out]++;
                continue;
            }
            size_t take = of_kind[left_out] < o->views ? of_kind[left_out] : o->views, n = passed[left_out]++;
            if (n * take / of_kind[left_out] == (n + 1) * take / of_kind[left_out])
                continue;
            bytes += pixels * pixel_bytes;
            out->views[out->count++] = (struct spl_compared_view){.view = view, .left_out = left_out};
        }
    uint64_t needed = bytes + largest * (source_bytes + pixel_bytes) * 4 / 3;
    return needed > o->memory_bytes
               ? spl_fail_field(err, SPL_E_LIMIT, "memory",
                                "%zu views and the largest photograph need %llu MiB; the limit is %llu: fewer views",
                                out->count, (unsigned long long)(needed >> 20),
                                (unsigned long long)(o->memory_bytes >> 20))
               : 0;
}

double spl_compared_psnr(double sum, uint64_t values)
{
    return values == 0 ? NAN : sum > 0 ? -10 * log10(sum / (65025.0 * (double)values)) : INFINITY;
}

/* Sums and medians of one kind of views. */
int spl_compared_views_summarise(const struct spl_compared_views *views, bool left_out, struct spl_projected_views *out,
                                 struct spl_error *err)
{
    double sum[SPL_FRAME_COUNT] = {0}, *psnr = NULL;
    size_t room = 1, full = 0;
    for (size_t i = 0; i < views->count; i++)
        room += (size_t)views->views[i].across * views->views[i].down;
    if (!(psnr = spl_alloc_raw(room, sizeof *psnr * SPL_FRAME_COUNT, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < views->count; i++) {
        const struct spl_compared_view *v = &views->views[i];
        if (v->left_out != left_out)
            continue;
        out->views++;
        for (const struct spl_compared_tile *t = v->tiles; t < v->tiles + (size_t)v->across * v->down; t++) {
            bool whole = t->pixels == SPL_PROJECTED_TILE * SPL_PROJECTED_TILE;
            out->pixels += t->pixels;
            for (int k = 0; k < SPL_FRAME_COUNT; k++) {
                sum[k] += t->error[k];
                if (whole)
                    psnr[k * room + full] = fmin(spl_compared_psnr(t->error[k], 3 * t->pixels), most);
            }
            full += whole;
        }
    }
    for (int k = 0; k < SPL_FRAME_COUNT; k++) {
        struct spl_projected_figure *figure = k == SPL_FRAME_COLORED    ? &out->colored
                                              : k == SPL_FRAME_TEXTURED ? &out->textured
                                                                        : &out->projected[k];
        figure->psnr = spl_compared_psnr(sum[k], 3 * out->pixels);
        figure->tile = full ? spl_summarise(psnr + k * room, full).median : NAN;
    }
    free(psnr);
    return 0;
}

void spl_compared_views_finish(struct spl_compared_views *views)
{
    for (size_t i = 0; i < views->count; i++)
        finish_view(&views->views[i]);
    free(views->views);
}
