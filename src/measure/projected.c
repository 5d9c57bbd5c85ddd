/* How the baseline is measured without a kernel of its own: the renderer says which splat is in front and how deep the
 * blended surface lies, and each pixel's place is looked up in that splat's photograph. A frame would blend the
 * look-ups of all splats within the margin; they are at the same place, so it differs only where neighbours chose
 * different photographs. Views wait in memory, a dozen bytes a pixel, while photographs come and go, each once. Sums
 * are formed by row and added up in order, so they do not depend on threads. */
#include "measure/projected.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "geom/tangent.h"
#include "image/load.h"
#include "measure/blocks.h"
#include "measure/summary.h"

enum { pixel_bytes = 12, compared_splats = 50000 };

/* What frames are compared: the projections, then the dataset's own. */
enum { colored = SPL_PROJECTED_COUNT, textured, frames };

struct tile {
    double error[frames]; /* squared, of 255 */
    uint32_t pixels;
};

struct compared {
    const struct spl_named_view *view;
    bool left_out;
    struct tile *tiles; /* rows of them */
    uint32_t across, down;
    uint16_t *photo; /* by pixel: SPL_TEXTURE_NO_PHOTO where there is nothing to look up */
    float *depth;
    uint8_t (*truth)[3], (*colored)[3];
};

struct work {
    const struct spl_projected_options *options;
    struct compared *compared;
    size_t count;
    double texture[SPL_PROJECTED_COUNT];
    uint64_t texture_values;
};

static const double most = 99; /* of a tile, dB: medians are between two */

/* A photograph's pyramid as it is, in BC7, in BC1. */
enum { forms = 3 };
struct source {
    const struct spl_named_view *view;
    uint16_t index;
    struct spl_pyramid form[forms];
};

static double least_footprint(int kind)
{
    return kind >= SPL_PROJECTED_HALF ? 2 : 1;
}

bool spl_projected_look(const struct spl_camera *camera, const double pixel[2], double depth,
                        const struct spl_named_view *photograph, const struct spl_pyramid *pyramid, double footprint,
                        float rgb[3])
{
    const double c[3] = {depth * (pixel[0] - camera->cx) / camera->fx, depth * (pixel[1] - camera->cy) / camera->fy,
                         depth};
    double p[3], place[2], there;
    for (int i = 0; i < 3; i++)
        p[i] = camera->eye[i] + camera->rotation[i] * c[0] + camera->rotation[3 + i] * c[1] +
               camera->rotation[6 + i] * c[2];
    if (!spl_distortion_project(&photograph->camera, &photograph->distortion, p, place, &there))
        return false;
    double spanned = depth / camera->fx * photograph->camera.fx / there;
    return spl_pyramid_sample(pyramid, place, fmax(spanned, footprint), rgb);
}

static double squared(const float rgb[3], const uint8_t truth[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += ((double)rgb[c] - truth[c]) * ((double)rgb[c] - truth[c]);
    return sum;
}

static double squared_bytes(const uint8_t rgb[3], const uint8_t truth[3])
{
    return squared((const float[3]){rgb[0], rgb[1], rgb[2]}, truth);
}

/* ---------------------------------------------------------------------------------------------------------- views */

static void finish_compared(struct compared *v)
{
    free(v->tiles);
    free(v->photo);
    free(v->depth);
    free(v->truth);
    free(v->colored);
}

static int load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    int rc = spl_image_load(view->photograph, SPL_LAYER_COLOR, out, err);
    if (!rc && (out->width != view->camera.width || out->height != view->camera.height)) {
        rc = spl_fail_field(err, SPL_E_INPUT, "width", "%s: %u x %u pixels; its camera says %u x %u", view->photograph,
                            out->width, out->height, view->camera.width, view->camera.height);
        spl_image_finish(out);
    }
    return rc;
}

static int render(const struct work *w, const struct spl_named_view *named, uint32_t atoms, uint32_t layers,
                  struct spl_frame *frame, struct spl_error *err)
{
    struct spl_view view;
    spl_view_init(&view);
    view.camera = named->camera;
    view.layers = layers;
    view.atoms = atoms;
    return spl_renderer_render(w->options->renderer, w->options->dataset, &view, frame, err);
}

static struct tile *find_tile(const struct compared *v, size_t pixel)
{
    size_t x = pixel % v->view->camera.width, y = pixel / v->view->camera.width;
    return &v->tiles[y / SPL_PROJECTED_TILE * v->across + x / SPL_PROJECTED_TILE];
}

/* Takes what the frames and the photograph say of each pixel. */
static void take_pixels(const struct work *w, struct compared *v, const struct spl_image *photograph,
                        const struct spl_frame *with, const struct spl_frame *without)
{
    const struct spl_texture_origin *origin = w->options->origin;
    const uint8_t(*truth)[4] = photograph->pixels;
    const uint8_t(*full)[4] = with->images[SPL_LAYER_COLOR].pixels;
    const uint8_t(*plain)[4] = without->images[SPL_LAYER_COLOR].pixels;
    const uint32_t *id = with->images[SPL_LAYER_ID].pixels;
    const float *depth = with->images[SPL_LAYER_DEPTH].pixels;
    size_t pixels = (size_t)photograph->width * photograph->height;
    for (size_t i = 0; i < pixels; i++) {
        struct tile *tile = find_tile(v, i);
        memcpy(v->truth[i], truth[i], 3);
        memcpy(v->colored[i], plain[i], 3);
        v->depth[i] = depth[i];
        v->photo[i] = SPL_TEXTURE_NO_PHOTO;
        if (id[i] >= origin->splats || !(depth[i] > 0) || truth[i][3] < 255)
            continue;
        double error = squared_bytes(plain[i], truth[i]);
        tile->pixels++;
        tile->error[colored] += error;
        tile->error[textured] += squared_bytes(full[i], truth[i]);
        v->photo[i] = origin->photo[id[i]];
        for (int k = 0; v->photo[i] == SPL_TEXTURE_NO_PHOTO && k < SPL_PROJECTED_COUNT; k++)
            tile->error[k] += error;
    }
}

static int take_view(struct work *w, struct compared *v, struct spl_error *err)
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
    if (!(rc = load(v->view, &photograph, err)) &&
        !(rc = render(w, v->view, 8, 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_ID | 1u << SPL_LAYER_DEPTH, &with, err)) &&
        !(rc = render(w, v->view, 0, 1u << SPL_LAYER_COLOR, &without, err)))
        take_pixels(w, v, &photograph, &with, &without);
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
static int choose_views(struct work *w, struct spl_error *err)
{
    const struct spl_projected_options *o = w->options;
    uint64_t bytes = 0, largest = 0;
    size_t of_kind[2] = {0}, passed[2] = {0};
    w->compared = spl_alloc(o->photographs->count, sizeof *w->compared, err);
    if (!w->compared)
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
            w->compared[w->count++] = (struct compared){.view = view, .left_out = left_out};
        }
    uint64_t needed = bytes + largest * (4 * forms + pixel_bytes) * 4 / 3;
    return needed > o->memory_bytes
               ? spl_fail_field(err, SPL_E_LIMIT, "memory",
                                "%zu views and the largest photograph need %llu MiB; the limit is %llu: fewer views",
                                w->count, (unsigned long long)(needed >> 20),
                                (unsigned long long)(o->memory_bytes >> 20))
               : 0;
}

/* ------------------------------------------------------------------------------------------------------ photographs */

struct rows {
    const struct compared *view;
    const struct source *source;
};

/* Rows of tiles. */
static void look_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct rows *r = context;
    const struct compared *v = r->view;
    const struct spl_camera *camera = &v->view->camera;
    (void)worker;
    for (size_t y = begin * SPL_PROJECTED_TILE; y < end * SPL_PROJECTED_TILE && y < camera->height; y++)
        for (uint32_t x = 0; x < camera->width; x++) {
            size_t i = y * camera->width + x;
            const double pixel[2] = {x + 0.5, (double)y + 0.5};
            for (int k = 0; v->photo[i] == r->source->index && k < SPL_PROJECTED_COUNT; k++) {
                float rgb[3];
                bool found = spl_projected_look(camera, pixel, (double)v->depth[i], r->source->view,
                                                &r->source->form[k % forms], least_footprint(k), rgb);
                find_tile(v, i)->error[k] +=
                    found ? squared(rgb, v->truth[i]) : squared_bytes(v->colored[i], v->truth[i]);
            }
        }
}

static void look(struct work *w, const struct source *source)
{
    for (size_t i = 0; i < w->count; i++) {
        struct rows rows = {&w->compared[i], source};
        spl_parallel_for(w->options->threads, w->compared[i].down, 1, look_rows, &rows);
    }
}

/* Adds how far one splat's texture is from the photograph's own in each form. */
static void compare_texture(struct work *w, const struct source *source, const double centre[3],
                            const struct spl_splat *splat)
{
    const struct spl_camera *camera = &source->view->camera;
    uint32_t size = w->options->texture_size;
    float u[3], v[3];
    spl_tangent_frame(splat->normal, u, v);
    for (uint32_t t = 0; t < size * size; t++) {
        double a = ((2 * (t % size) + 1.0) / size - 1) * (double)splat->radius;
        double b = ((2 * (t / size) + 1.0) / size - 1) * (double)splat->radius;
        double p[3], pixel[2], depth;
        float rgb[SPL_PROJECTED_COUNT][3];
        bool found = true;
        for (int i = 0; i < 3; i++)
            p[i] = centre[i] + a * (double)u[i] + b * (double)v[i];
        if (!spl_distortion_project(camera, &source->view->distortion, p, pixel, &depth))
            continue;
        double footprint = 2 * (double)splat->radius / size * camera->fx / depth;
        for (int k = 0; found && k < SPL_PROJECTED_COUNT; k++)
            found = spl_pyramid_sample(&source->form[k % forms], pixel, fmax(footprint, least_footprint(k)), rgb[k]);
        if (!found)
            continue;
        w->texture_values += 3;
        for (int k = 0; k < SPL_PROJECTED_COUNT; k++)
            for (int c = 0; c < 3; c++) {
                double difference = (double)(rgb[k][c] - rgb[SPL_PROJECTED_WHOLE][c]);
                w->texture[k] += difference * difference;
            }
    }
}

static void compare_textures(struct work *w, const struct source *source)
{
    const struct spl_dataset *dataset = w->options->dataset;
    const struct spl_texture_origin *origin = w->options->origin;
    uint64_t stride = origin->splats / compared_splats + 1;
    uint32_t nodes;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &(uint32_t){0});
    for (uint32_t n = 0; n < nodes; n++, node++) {
        const uint32_t *page = spl_dataset_get_page(dataset, node->page, &(size_t){0});
        for (uint32_t c = node->first_chunk; c < node->first_chunk + node->chunk_count; c++)
            for (uint32_t i = 0; i < chunks[c].count; i++) {
                uint64_t id = (uint64_t)chunks[c].first_id + i;
                struct spl_splat splat;
                double centre[3];
                if (id % stride || origin->photo[id] != source->index)
                    continue;
                spl_chunk_decode(&chunks[c], page, i, &splat);
                for (int a = 0; a < 3; a++)
                    centre[a] = node->origin[a] + (double)splat.position[a];
                compare_texture(w, source, centre, &splat);
            }
    }
}

static int take_photograph(struct work *w, uint16_t index, struct spl_error *err)
{
    const struct spl_projected_options *o = w->options;
    struct source source = {.index = index};
    struct spl_image pixels = {0};
    for (size_t i = 0; i < o->photographs->count && !source.view; i++)
        if (!strcmp(o->photographs->views[i].name, o->origin->names[index]))
            source.view = &o->photographs->views[i];
    if (!source.view)
        return spl_fail_field(err, SPL_E_INPUT, "cameras",
                              "photograph '%s' was packed, but the list of cameras has none of this name",
                              o->origin->names[index]);
    if (o->progress)
        o->progress(o->context, source.view->name);
    int rc = load(source.view, &pixels, err);
    if (!rc)
        rc = spl_pyramid_init(&source.form[0], &pixels, err);
    if (!rc)
        rc = spl_blocks_code(&source.form[0], spl_block_bc7, o->threads, &source.form[1], err);
    if (!rc)
        rc = spl_blocks_code(&source.form[0], spl_block_bc1, o->threads, &source.form[2], err);
    if (!rc) {
        look(w, &source);
        compare_textures(w, &source);
    }
    for (int f = 0; f < forms; f++)
        spl_pyramid_finish(&source.form[f]);
    return rc;
}

static double to_psnr(double sum, uint64_t values)
{
    return values == 0 ? NAN : sum > 0 ? -10 * log10(sum / (65025.0 * (double)values)) : INFINITY;
}

/* Sums and medians of one kind of views. */
static int finish_views(const struct work *w, bool left_out, struct spl_projected_views *out, struct spl_error *err)
{
    double sum[frames] = {0}, *psnr = NULL;
    size_t room = 1, full = 0;
    for (size_t i = 0; i < w->count; i++)
        room += (size_t)w->compared[i].across * w->compared[i].down;
    if (!(psnr = spl_alloc_raw(room, sizeof *psnr * frames, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < w->count; i++) {
        const struct compared *v = &w->compared[i];
        if (v->left_out != left_out)
            continue;
        out->views++;
        for (const struct tile *t = v->tiles; t < v->tiles + (size_t)v->across * v->down; t++) {
            bool whole = t->pixels == SPL_PROJECTED_TILE * SPL_PROJECTED_TILE;
            out->pixels += t->pixels;
            for (int k = 0; k < frames; k++) {
                sum[k] += t->error[k];
                if (whole)
                    psnr[k * room + full] = fmin(to_psnr(t->error[k], 3 * t->pixels), most);
            }
            full += whole;
        }
    }
    for (int k = 0; k < frames; k++) {
        struct spl_projected_figure *figure = k == colored    ? &out->colored
                                              : k == textured ? &out->textured
                                                              : &out->projected[k];
        figure->psnr = to_psnr(sum[k], 3 * out->pixels);
        figure->tile = full ? spl_summarise(psnr + k * room, full).median : NAN;
    }
    free(psnr);
    return 0;
}

int spl_projected_measure(const struct spl_projected_options *o, struct spl_projected_report *report,
                          struct spl_error *err)
{
    struct work w = {.options = o};
    const struct spl_dataset_info *info = spl_dataset_get_info(o->dataset);
    *report = (struct spl_projected_report){0};
    if (info->splats != o->origin->splats)
        return spl_fail_field(err, SPL_E_INPUT, "splats", "%s has %llu splats, the textures are of %llu: pack again",
                              info->id, (unsigned long long)info->splats, (unsigned long long)o->origin->splats);
    int rc = choose_views(&w, err);
    for (size_t i = 0; !rc && i < w.count; i++)
        rc = take_view(&w, &w.compared[i], err);
    for (uint32_t i = 0; !rc && i < o->origin->photographs; i++)
        rc = *o->origin->names[i] ? take_photograph(&w, (uint16_t)i, err) : 0;
    if (!rc)
        rc = finish_views(&w, false, &report->packed, err);
    if (!rc)
        rc = finish_views(&w, true, &report->left_out, err);
    for (size_t i = 0; i < w.count; i++)
        finish_compared(&w.compared[i]);
    free(w.compared);
    for (int k = 0; k < SPL_PROJECTED_COUNT; k++)
        report->texture[k] = to_psnr(w.texture[k], w.texture_values);
    return rc;
}
