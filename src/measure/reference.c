/* References. Files are read twice, once before anything is rendered: a run of an hour must not end at the last view
 * because its photograph is missing or has another size. Own renders are made when they are wanted and not kept: a
 * resumed run makes at most one of them again. The renderer's thread. */
#include "measure/reference.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <xxhash.h>

#include "dataset/dataset.h"
#include "image/load.h"
#include "render/frustum.h"

static const struct file {
    enum spl_layer layer;
    const char *ending;
} files[] = {
    {SPL_LAYER_COLOR, "color.png"},
    {SPL_LAYER_DEPTH, "depth.npy"},
    {SPL_LAYER_NORMAL, "normal.npy"},
    {SPL_LAYER_COVERAGE, "coverage.npy"},
};
enum { FILES = sizeof files / sizeof *files, SELF_SUPERSAMPLE = 4 };

const char *spl_reference_name(enum spl_reference_kind kind)
{
    static const char *const names[] = {"self", "exact", "photographs"};
    return names[kind];
}

static void finish_images(struct spl_image images[SPL_LAYER_COUNT])
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&images[i]);
}

static int load_file(const struct spl_named_view *view, const char *path, enum spl_layer layer, struct spl_image *image,
                     struct spl_error *err)
{
    int rc = spl_image_load(path, layer, image, err);
    if (rc)
        return rc;
    if (image->width == view->camera.width && image->height == view->camera.height)
        return SPL_OK;
    rc = spl_fail_field(err, SPL_E_INPUT, "reference", "%s: the reference has %ux%u pixels, its view '%s' %ux%u", path,
                        image->width, image->height, view->name, view->camera.width, view->camera.height);
    spl_image_finish(image);
    return rc;
}

static int load_exact(const struct spl_reference *r, const struct spl_named_view *view, struct spl_image *images,
                      struct spl_error *err)
{
    for (size_t i = 0; i < FILES; i++) {
        char path[4096];
        if ((size_t)snprintf(path, sizeof path, "%s/%s.%s", r->folder, view->name, files[i].ending) >= sizeof path)
            return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", r->folder);
        struct stat status;
        if (stat(path, &status)) {
            if (files[i].layer != SPL_LAYER_COLOR && errno == ENOENT)
                continue;
            return spl_fail_errno(err, errno, "view '%s' has no reference: %s", view->name, path);
        }
        int rc = load_file(view, path, files[i].layer, &images[files[i].layer], err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

static int load_photograph(const struct spl_named_view *view, struct spl_image *images, struct spl_error *err)
{
    if (!view->photograph)
        return spl_fail_field(err, SPL_E_INPUT, "photograph", "view '%s' names no photograph", view->name);
    struct stat status;
    if (stat(view->photograph, &status))
        return spl_fail_errno(err, errno, "the photograph of view '%s' is missing: %s", view->name, view->photograph);
    return load_file(view, view->photograph, SPL_LAYER_COLOR, &images[SPL_LAYER_COLOR], err);
}

static int render_self(const struct spl_reference *r, const struct spl_named_view *named,
                       struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_image *images,
                       struct spl_error *err)
{
    struct spl_view view;
    spl_view_init(&view);
    view.camera = named->camera;
    view.lod = 0;
    view.supersample = SELF_SUPERSAMPLE;
    view.background[3] = 0;
    if (r->soft)
        view.soft = *r->soft;
    for (size_t i = 0; i < FILES; i++)
        view.layers |= 1u << files[i].layer;
    struct spl_frame frame;
    struct spl_error why = {0};
    int rc = spl_renderer_render(renderer, dataset, &view, &frame, &why);
    if (rc == SPL_E_LIMIT && r->soft)
        return spl_fail_field(err, rc, why.field,
                              "the reference of view '%s' cannot be drawn: %.300s; the first of --soft-model makes it",
                              named->name, why.message);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    struct spl_faulty_tile faulty;
    if (!frame.stats.complete && spl_dataset_list_faulty(dataset, &faulty, 1))
        rc = spl_fail(err, SPL_E_INPUT, "the reference of view '%s' needs every tile: %.400s", named->name,
                      faulty.reason);
    else if (!frame.stats.complete)
        rc = spl_fail(err, SPL_E_LIMIT,
                      "the reference of view '%s' needs every page of the dataset on the device; raise "
                      "--memory-limit, or compare with images of your own",
                      named->name);
    memcpy(images, frame.images, sizeof frame.images);
    return rc;
}

int spl_reference_get(const struct spl_reference *r, size_t index, struct spl_renderer *renderer,
                      const struct spl_dataset *dataset, struct spl_image images[SPL_LAYER_COUNT],
                      struct spl_error *err)
{
    memset(images, 0, SPL_LAYER_COUNT * sizeof *images);
    const struct spl_named_view *view = &r->views->views[index];
    int rc = r->kind == SPL_REFERENCE_EXACT         ? load_exact(r, view, images, err)
             : r->kind == SPL_REFERENCE_PHOTOGRAPHS ? load_photograph(view, images, err)
                                                    : render_self(r, view, renderer, dataset, images, err);
    if (rc)
        finish_images(images);
    return rc;
}

int spl_reference_check(const struct spl_reference *r, uint64_t *hash, struct spl_error *err)
{
    *hash = 0;
    for (size_t v = 0; r->kind != SPL_REFERENCE_SELF && v < r->views->count; v++) {
        struct spl_image images[SPL_LAYER_COUNT];
        int rc = spl_reference_get(r, v, NULL, NULL, images, err);
        if (rc)
            return rc;
        for (int i = 0; i < SPL_LAYER_COUNT; i++)
            if (images[i].pixels)
                *hash = XXH3_64bits_withSeed(
                    images[i].pixels, (size_t)images[i].width * images[i].height * spl_pixel_bytes(images[i].type),
                    *hash + (uint64_t)i + 1);
        finish_images(images);
    }
    return SPL_OK;
}

int spl_reference_check_poses(const struct spl_view_list *views, const struct spl_dataset_info *info,
                              struct spl_error *err)
{
    double size[3], diagonal = 0;
    for (int i = 0; i < 3; i++) {
        size[i] = info->bounds_max[i] - info->bounds_min[i];
        diagonal += size[i] * size[i];
    }
    diagonal = sqrt(diagonal) + 2 * info->splat_radius;
    for (size_t v = 0; v < views->count; v++) {
        const struct spl_camera *camera = &views->views[v].camera;
        double least[3], outside = 0;
        for (int i = 0; i < 3; i++) {
            least[i] = info->bounds_min[i] - camera->eye[i];
            double d = fmax(fmax(least[i], camera->eye[i] - info->bounds_max[i]), 0);
            outside += d * d;
        }
        outside = sqrt(outside);
        struct spl_view_box box = spl_view_box(camera, least, size);
        bool seen = spl_view_box_visible(camera, &box, 1) &&
                    diagonal * fmax(camera->fx, camera->fy) > fmax(outside, camera->near);
        if (!seen)
            return spl_fail_field(
                err, SPL_E_INPUT, "camera",
                "view '%s' shows nothing of %s: its eye %g %g %g is %g outside the bounds %g %g %g to "
                "%g %g %g, near %g, far %g",
                views->views[v].name, info->id, camera->eye[0], camera->eye[1], camera->eye[2], outside,
                info->bounds_min[0], info->bounds_min[1], info->bounds_min[2], info->bounds_max[0], info->bounds_max[1],
                info->bounds_max[2], camera->near, camera->far);
    }
    return SPL_OK;
}
