/* How the baseline is measured without a kernel of its own: the renderer says which splat is in front and how deep the
 * blended surface lies, and each pixel's place is looked up in that splat's photograph. A frame would blend the
 * look-ups of all splats within the margin; they are at the same place, so it differs only where neighbours chose
 * different photographs. Photographs come and go, each once, while the views wait (projected_views.h). */
#include "measure/projected.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "geom/tangent.h"
#include "measure/blocks.h"
#include "measure/projected_views.h"

enum { compared_splats = 50000 };

struct work {
    const struct spl_projected_options *options;
    struct spl_compared_views compared;
    double texture[SPL_PROJECTED_COUNT];
    uint64_t texture_values;
};

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

struct rows {
    const struct spl_compared_view *view;
    const struct source *source;
};

/* Rows of tiles. */
static void look_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct rows *r = context;
    const struct spl_compared_view *v = r->view;
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
                spl_compared_tile_at(v, i)->error[k] +=
                    found ? spl_compared_error(rgb, v->truth[i]) : spl_compared_error_bytes(v->colored[i], v->truth[i]);
            }
        }
}

static void look(struct work *w, const struct source *source)
{
    for (size_t i = 0; i < w->compared.count; i++) {
        struct rows rows = {&w->compared.views[i], source};
        spl_parallel_for(w->options->threads, w->compared.views[i].down, 1, look_rows, &rows);
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
    uint64_t nodes;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &(uint64_t){0});
    for (uint64_t n = 0; n < nodes; n++, node++) {
        const uint32_t *page = spl_dataset_get_page(dataset, node->page, &(size_t){0});
        for (uint64_t c = node->first_chunk; c < node->first_chunk + node->chunk_count; c++)
            for (uint32_t i = 0; i < chunks[c].count && spl_chunk_kind(&chunks[c]) == SPL_CHUNK_DISCS; i++) {
                uint64_t id = chunks[c].first_id + i;
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
    int rc = spl_compared_load(source.view, &pixels, err);
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

int spl_projected_measure(const struct spl_projected_options *o, struct spl_projected_report *report,
                          struct spl_error *err)
{
    struct work w = {.options = o};
    const struct spl_dataset_info *info = spl_dataset_get_info(o->dataset);
    *report = (struct spl_projected_report){0};
    if (info->ids != o->origin->splats)
        return spl_fail_field(err, SPL_E_INPUT, "splats", "%s has %llu splats, the textures are of %llu: pack again",
                              info->id, (unsigned long long)info->ids, (unsigned long long)o->origin->splats);
    int rc = spl_compared_views_choose(o, 4 * forms, &w.compared, err);
    for (size_t i = 0; !rc && i < w.compared.count; i++)
        rc = spl_compared_view_take(o, &w.compared.views[i], err);
    for (uint32_t i = 0; !rc && i < o->origin->photographs; i++)
        rc = *o->origin->names[i] ? take_photograph(&w, (uint16_t)i, err) : 0;
    if (!rc)
        rc = spl_compared_views_summarise(&w.compared, false, &report->packed, err);
    if (!rc)
        rc = spl_compared_views_summarise(&w.compared, true, &report->left_out, err);
    spl_compared_views_finish(&w.compared);
    for (int k = 0; k < SPL_PROJECTED_COUNT; k++)
        report->texture[k] = spl_compared_psnr(w.texture[k], w.texture_values);
    return rc;
}
