/* Measures rows of the table. A row is a condition, its value and a method, at lod 1 and the defaults of everything
 * else; its truth is exact and its scan's seed fixed, so its figures change only when the packer or the renderer does.
 * Where there are two devices the second one's frame is held against the same row. */
#include "conditions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "measure.h"
#include "shared.h"
#include "support/motion.h"
#include "themes.h"

static const double step_px = 1.5;
enum { CROP = 512, CROP_ABOVE = 2048 }; /* pixels a side */

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "conditions: %s\n", err->message);
    exit(1);
}

static bool begins(const char *text, const char *beginning)
{
    return !strncmp(text, beginning, strlen(beginning));
}

bool conditions_wants(const struct conditions *c, const char *condition)
{
    bool named = !*c->only;
    for (const char *const *only = c->only; *only; only++)
        named |= begins(condition, *only);
    return named != c->others;
}

bool conditions_wants_any(const struct conditions *c, const char *beginning)
{
    bool wanted = conditions_wants(c, beginning);
    for (const char *const *only = c->only; *only && !c->others; only++)
        wanted |= begins(*only, beginning);
    return wanted;
}

/* The view from 1.5 pixels further right, as seen at the harmonic mean of the truth's depths. */
static struct spl_view step_aside(const struct spl_view *view, const struct spl_image *depth)
{
    const float *z = depth->pixels;
    double near = 0, count = 0;
    for (size_t i = 0; i < (size_t)depth->width * depth->height; i++)
        if (isfinite(z[i])) {
            near += 1 / (double)z[i];
            count++;
        }
    struct spl_view aside = *view;
    for (int a = 0; a < 3 && count; a++)
        aside.camera.eye[a] += view->camera.rotation[a] * step_px / view->camera.fx * count / near;
    return aside;
}

/* Of an image that is large both ways only the middle is held against the truth, which takes seconds a megapixel. */
static struct spl_view crop_view(const struct spl_view *view)
{
    struct spl_view crop = *view;
    struct spl_camera *c = &crop.camera;
    if (c->width <= CROP_ABOVE || c->height <= CROP_ABOVE)
        return crop;
    c->cx -= (c->width - CROP) / 2;
    c->cy -= (c->height - CROP) / 2;
    c->width = c->height = CROP;
    return crop;
}

static void crop_frame(struct spl_frame *frame, const struct spl_camera *to)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        struct spl_image *image = &frame->images[layer];
        if (!image->pixels || (image->width == to->width && image->height == to->height))
            continue;
        size_t bytes = spl_pixel_bytes(image->type), x = (image->width - to->width) / 2;
        size_t y = (image->height - to->height) / 2;
        uint8_t *pixels = image->pixels;
        for (size_t row = 0; row < to->height; row++)
            memmove(pixels + row * to->width * bytes, pixels + ((y + row) * image->width + x) * bytes,
                    to->width * bytes);
        image->width = to->width;
        image->height = to->height;
    }
}

/* Image and truth side by side, over grey, as DIRECTORY/CONDITION-VALUE-METHOD.png. */
static void save_picture(const char *directory, const struct row *row, const struct spl_image *image,
                         const struct spl_image *truth)
{
    struct spl_image both = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 2 * image->width, image->height, NULL};
    uint8_t *out = both.pixels = malloc(8 * (size_t)image->width * image->height);
    struct spl_encoded encoded = {0};
    struct spl_error err = {0};
    char path[512];
    if (!out)
        abort();
    for (size_t y = 0; y < both.height; y++)
        for (size_t x = 0; x < both.width; x++) {
            const struct spl_image *from = x < image->width ? image : truth;
            const uint8_t *p = (const uint8_t *)from->pixels + 4 * (y * image->width + x % image->width);
            for (int k = 0; k < 3; k++)
                *out++ = (uint8_t)((p[3] * p[k] + (255 - p[3]) * 128 + 127) / 255);
            *out++ = 255;
        }
    must(spl_image_encode(&both, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &encoded, &err), &err);
    int length = snprintf(path, sizeof path, "%s/%s-%s-%s.png", directory, row->condition, row->value, row->method);
    for (int i = (int)strlen(directory) + 1; i < length && i < (int)sizeof path; i++)
        if (path[i] == ' ' || path[i] == '/')
            path[i] = '_';
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(encoded.bytes, encoded.length, 1, file) != 1)
        fprintf(stderr, "%s: cannot be written\n", path);
    if (file)
        fclose(file);
    spl_encoded_finish(&encoded);
    spl_image_finish(&both);
}

/* The row's figures on the suite's renderer, flicker on the first one only; false after a failure was reported. */
static bool measure(struct conditions *c, const struct world *world, const struct spl_view views[2],
                    struct spl_image truths[2][SPL_LAYER_COUNT], bool first, struct row *row)
{
    struct place place = {row->condition, row->value, row->method, NULL};
    struct motion motion = {0};
    bool rendered = true;
    for (int i = 0; i < (first ? 2 : 1) && rendered; i++) {
        struct spl_frame frame;
        rendered = world_render(c->suite, world, &place, &views[i], &frame);
        if (!rendered)
            break;
        check_kinds(c->suite, world, &views[i], &frame, place);
        const struct spl_view crop = crop_view(&views[i]);
        crop_frame(&frame, &crop.camera);
        motion_add(&motion, &frame.images[SPL_LAYER_COLOR], &truths[i][SPL_LAYER_COLOR]);
        if (i == 0) {
            struct spl_metrics m = measure_frame(world, &crop, &frame, truths[0]);
            const double figures[FIGURE_COUNT] = {
                [FIGURE_PSNR] = m.psnr,
                [FIGURE_SSIM] = m.ssim,
                [FIGURE_HOLES] = m.holes,
                [FIGURE_SEE_THROUGH] = m.see_through,
                [FIGURE_HALO] = m.halo,
                [FIGURE_DEPTH_BEYOND] = m.depth_beyond,
                [FIGURE_DEPTH_MEDIAN] = m.depth_median,
                [FIGURE_NORMAL_MEDIAN] = m.normal_median,
            };
            memcpy(row->figures, figures, FIGURE_FLICKER * sizeof *figures);
            if (c->pictures && first && frame.images[SPL_LAYER_COLOR].width <= 1024)
                save_picture(c->pictures, row, &frame.images[SPL_LAYER_COLOR], &truths[0][SPL_LAYER_COLOR]);
        }
        spl_frame_finish(&frame);
    }
    motion_finish(&motion, first ? &row->figures[FIGURE_FLICKER] : NULL, NULL);
    return rendered;
}

/* How a view is drawn for a row. */
struct drawing {
    const char *name;
    enum spl_method method;
    uint32_t atoms;
    enum spl_maps maps;
    const struct world *world;     /* where it is not the one that has the scene; may be NULL */
    double figures[FIGURE_COUNT];  /* NAN until they are measured */
};

static struct drawing drawing_of(const char *name, enum spl_method method, uint32_t atoms, enum spl_maps maps)
{
    struct drawing drawing = {.name = name, .method = method, .atoms = atoms, .maps = maps};
    for (int f = 0; f < FIGURE_COUNT; f++)
        drawing.figures[f] = NAN;
    return drawing;
}

/* One row a drawing; of strips, to whose sides the filter looks as far as along them, `fill` in the whole form only. */
static void measure_rows(struct conditions *c, const struct world *world, const struct spl_view *view,
                         struct drawing *drawings, size_t count, const struct row *name)
{
    if (!conditions_wants(c, name->condition) || (name->whole && !c->suite->whole))
        return;
    struct spl_image truths[2][SPL_LAYER_COUNT];
    struct spl_view crop = crop_view(view);
    truth_render(world, &crop.camera, truths[0]);
    struct spl_view views[2] = {*view, step_aside(view, &truths[0][SPL_LAYER_DEPTH])};
    crop = crop_view(&views[1]);
    truth_render(world, &crop.camera, truths[1]);
    for (size_t i = 0; i < count; i++) {
        struct row row = *name;
        bool strip = view->camera.width > 64 * view->camera.height || view->camera.height > 64 * view->camera.width;
        row.method = drawings[i].name;
        row.whole |= strip && drawings[i].method == SPL_METHOD_FILL;
        if ((row.whole && !c->suite->whole) || (c->method && strcmp(c->method, row.method)))
            continue;
        views[0].method = views[1].method = drawings[i].method;
        views[0].disc.atoms = views[1].disc.atoms = drawings[i].atoms;
        views[0].maps = views[1].maps = drawings[i].maps;
        const struct world *drawn = drawings[i].world ? drawings[i].world : world;
        bool measured = measure(c, drawn, views, truths, true, &row);
        if (measured)
            memcpy(drawings[i].figures, row.figures, sizeof row.figures);
        if (measured && c->update)
            table_put(c->table, &row);
        if (measured)
            table_judge(c->table, &c->suite->report, &row, spl_renderer_get_device(c->suite->renderer)->backend);
        if (!c->suite->other || (drawings[i].method == SPL_METHOD_FILL && !c->suite->whole))
            continue; /* filled frames are the slowest, and check_drivers() compares them pixel by pixel */
        struct spl_renderer *renderer = c->suite->renderer;
        c->suite->renderer = c->suite->other;
        if (measure(c, drawn, views, truths, false, &row))
            table_judge(c->table, &c->suite->report, &row, spl_renderer_get_device(c->suite->other)->backend);
        c->suite->renderer = renderer;
    }
    truth_finish(truths[0]);
    truth_finish(truths[1]);
}

void conditions_measure(struct conditions *c, const struct world *world, const struct spl_view *view,
                        const char *condition, const char *value, bool whole_only)
{
    struct drawing drawings[SPL_METHOD_COUNT];
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        drawings[method] = drawing_of(spl_method_name((enum spl_method)method), (enum spl_method)method,
                                      view->disc.atoms, view->maps);
    measure_rows(c, world, view, drawings, SPL_METHOD_COUNT, &(struct row){condition, value, NULL, whole_only, {0}});
}

void conditions_measure_textures(struct conditions *c, const struct world *world, const struct spl_view *view,
                                 const char *condition, const char *value, bool whole_only)
{
    struct drawing drawings[] = {drawing_of("coloured", SPL_METHOD_SPLAT, 0, view->maps),
                                 drawing_of("textured", SPL_METHOD_SPLAT, SPL_TEXTURE_ATOMS, view->maps)};
    measure_rows(c, world, view, drawings, 2, &(struct row){condition, value, NULL, whole_only, {0}});
}

void conditions_measure_maps(struct conditions *c, const struct world *world, const struct spl_view *view,
                             const char *condition, const char *value, bool whole_only, double harm)
{
    struct drawing drawings[] = {drawing_of("unmapped", SPL_METHOD_SPLAT, 0, SPL_MAPS_OFF),
                                 drawing_of("mapped", SPL_METHOD_SPLAT, 0, SPL_MAPS_ON)};
    measure_rows(c, world, view, drawings, 2, &(struct row){condition, value, NULL, whole_only, {0}});
    double gain = drawings[1].figures[FIGURE_PSNR] - drawings[0].figures[FIGURE_PSNR];
    if (!isnan(gain))
        report_at_least(&c->suite->report, "maps-do-no-harm", &(struct place){condition, value, NULL, NULL}, gain,
                        -harm, "dB that maps gain");
}

void conditions_measure_primitives(struct conditions *c, const struct world worlds[2], const struct spl_view *view,
                                   const char *condition, const char *value, bool whole_only,
                                   const struct worse *allowed)
{
    static const struct {
        enum figure figure;
        const char *check, *unit;
    } checks[] = {{FIGURE_HOLES, "primitives-leave-no-holes", "share of pixels beyond the splats' own"},
                  {FIGURE_HALO, "primitives-keep-silhouettes", "share of empty pixels beyond the splats' own"},
                  {FIGURE_DEPTH_BEYOND, "primitives-lie-where-points-do", "share of pixels beyond the splats' own"}};
    struct drawing drawings[] = {drawing_of("discs", SPL_METHOD_SPLAT, view->disc.atoms, view->maps),
                                 drawing_of("primitives", SPL_METHOD_SPLAT, view->disc.atoms, view->maps)};
    const double limits[] = {allowed->holes, allowed->halo, allowed->beyond};
    const struct place place = {condition, value, NULL, NULL};
    const double *of[2] = {drawings[0].figures, drawings[1].figures};
    drawings[1].world = &worlds[1];
    measure_rows(c, &worlds[0], view, drawings, 2, &(struct row){condition, value, NULL, whole_only, {0}});
    if (isnan(of[0][FIGURE_PSNR]) || isnan(of[1][FIGURE_PSNR]))
        return; /* not asked for, or a failure that was reported */
    report_at_least(&c->suite->report, "primitives-do-no-harm", &place, of[1][FIGURE_PSNR] - of[0][FIGURE_PSNR],
                    -allowed->db, "dB that primitives gain");
    for (size_t i = 0; i < sizeof checks / sizeof *checks; i++)
        if (!isnan(of[0][checks[i].figure]) || !isnan(of[1][checks[i].figure]))
            report_at_most(&c->suite->report, checks[i].check, &place,
                           of[1][checks[i].figure] - of[0][checks[i].figure], limits[i], checks[i].unit);
}
