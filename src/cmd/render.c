/* splatd render: one view of a dataset as an image file.
 *
 * Everything that can be refused without a device is refused before one is opened. */
#include "cmd/render.h"

#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include <splatd/render.h>

#include "base/reading.h"
#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/waiting.h"
#include "dataset/dataset.h"
#include "geom/camera_json.h"
#include "geom/ground.h"
#include "geom/ray_list.h"
#include "image/vectors.h"
#include "render/soft_params.h"
#include "service/request/request.h"

static int read_rays(struct spl_cmd_render *a, struct spl_error *err)
{
    const bool json = !strcasecmp(spl_cmd_ending(a->rays_file), "json");
    FILE *file;
    struct stat status;
    struct spl_error why = {0};
    int rc = spl_open_for_reading(a->rays_file, &file, err);
    if (rc)
        return rc;
    if (json) {
        json_error_t where;
        json_t *list = spl_json_load_stream(file, &where);
        if (!list)
            rc = spl_fail_field(err, SPL_E_INPUT, "rays", "%s: broken JSON at line %d, column %d: %s", a->rays_file,
                                where.line, where.column, spl_json_fault(&where));
        else if ((rc = spl_rays_from_json(list, &a->rays, &why)))
            spl_fail_field(err, rc, "rays", "%s: %s", a->rays_file, why.message);
        json_decref(list);
    } else {
        rc = fstat(fileno(file), &status)
                 ? spl_fail_errno(err, errno, "%s: cannot be read", a->rays_file)
                 : spl_rays_from_npy(file, (uint64_t)status.st_size, a->rays_file, &a->rays, err);
    }
    fclose(file);
    return rc;
}

/* Where a map's pixels lie, for GeoTIFF and world files. */
static int find_ground(struct spl_cmd_render *a, const struct spl_dataset_info *info, struct spl_error *err)
{
    const enum spl_format format = a->drawing.encode.format;
    if (a->world_file && (!spl_format_world_file(format) || !strcmp(a->drawing.output, "-")))
        return spl_fail(err, SPL_E_USAGE, "--world-file is for JPEG, PNG and WebP files");
    if (!a->world_file && format != SPL_FORMAT_TIFF)
        return SPL_OK;
    int rc = spl_camera_get_ground(&a->drawing.view.camera, &a->drawing.encode.ground, err);
    a->drawing.encode.ground.epsg = info->epsg;
    a->drawing.encode.crs = info->crs;
    return rc;
}

static int write_world_file(const struct spl_cmd_render *a, struct spl_error *err)
{
    char path[4096], text[SPL_WORLD_FILE_BYTES];
    const char *output = a->drawing.output, *ending = spl_cmd_ending(output);
    if (!a->world_file)
        return SPL_OK;
    size_t length = *ending ? (size_t)(ending - 1 - output) : strlen(output);
    if ((size_t)snprintf(path, sizeof path, "%.*s%s", (int)length, output,
                         spl_format_world_file(a->drawing.encode.format)) >= sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the name of the world file is longer than %zu bytes", sizeof path - 1);
    spl_ground_print_world_file(&a->drawing.encode.ground, text);
    return spl_cmd_write_output(path, text, strlen(text), err);
}

/* A plan whose eye is below the ground, a view that looks away. */
static bool is_behind(const struct spl_camera *camera, const double low[3], const double high[3])
{
    double depth = 0; /* of the corner that is farthest ahead */
    for (int i = 0; i < 3; i++) {
        const double ahead = camera->rotation[6 + i];
        depth += ahead * ((ahead > 0 ? high : low)[i] - camera->eye[i]);
    }
    return depth <= 0 && !spl_camera_is_bent(camera);
}

static void report(const struct spl_device_info *device, const struct spl_dataset *dataset,
                   const struct spl_frame_stats *stats, const struct spl_cmd_render *a,
                   const struct spl_encoded *encoded)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const double *low = info->bounds_min, *high = info->bounds_max;
    const struct {
        uint64_t count;
        const char *what;
    } others[] = {{stats->panels_drawn, "panels"}, {stats->meshes_drawn, "meshes"}, {stats->lines_drawn, "lines"}};
    uint64_t drawn = stats->splats_drawn + stats->soft_drawn;
    fprintf(stderr, "splatd: %s %s%s: %llu splats", device->backend, device->name,
            device->software ? " (software)" : "", (unsigned long long)stats->splats_drawn);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        drawn += others[i].count;
        if (others[i].count)
            fprintf(stderr, ", %llu %s", (unsigned long long)others[i].count, others[i].what);
    }
    if (spl_view_shows_soft(&a->drawing.view))
        fprintf(stderr, ", %llu soft spheres", (unsigned long long)stats->soft_drawn);
    fprintf(stderr, " in %.1f ms", stats->total_ms);
    const uint32_t faulty = spl_dataset_list_faulty(dataset, NULL, 0);
    if (!stats->complete && faulty)
        fprintf(stderr,
                "; coarser than asked for: %u of its tiles are missing, damaged or other ones than were collected",
                faulty);
    else if (!stats->complete)
        fprintf(stderr, "; coarser%s than asked for: not everything fits the memory limit",
                info->maps && a->drawing.view.maps == SPL_MAPS_ON ? ", or with fewer maps of stations," : "");
    fputc('\n', stderr);
    const bool clipped = spl_cmd_warn_clip(&a->drawing.view, dataset);
    if (!drawn && !clipped)
        fprintf(stderr,
                "splatd: nothing %sis in view; the dataset's bounds are %.10g,%.10g,%.10g to %.10g,%.10g,%.10g%s\n",
                a->drawing.view.clip.count ? "that the clip leaves " : "", low[0], low[1], low[2], high[0], high[1],
                high[2], is_behind(&a->drawing.view.camera, low, high) ? ", all of it behind the eye" : "");
    else if (drawn)
        spl_cmd_warn_soft(&a->drawing.view, dataset, stats);
    if (encoded->saturated)
        fprintf(stderr, "splatd: %llu pixels lie beyond 65535 steps; a smaller --depth-scale reaches farther\n",
                (unsigned long long)encoded->saturated);
    if (encoded->far > 0 && a->drawing.layer != SPL_LAYER_COVERAGE)
        fprintf(stderr, "splatd: colours from %g (light) to %g %s (dark)\n", (double)encoded->near,
                (double)encoded->far, spl_unit_word(info));
}

static int render(struct spl_cmd_render *a, struct spl_error *err)
{
    struct spl_dataset *dataset = NULL;
    struct spl_renderer *renderer = NULL;
    struct spl_frame frame = {0};
    struct spl_encoded encoded = {0};
    int rc = a->rays_file ? read_rays(a, err) : SPL_OK;
    struct spl_cmd_waiting waiting;
    spl_cmd_waiting_begin(&waiting, a->dataset);
    rc = rc ? rc : spl_dataset_open(a->dataset, !a->drawing.no_verify, &dataset, err);
    spl_cmd_waiting_end(&waiting);
    if (!rc)
        rc = spl_cmd_render_set_camera(a, dataset, err);
    if (!rc)
        rc = find_ground(a, spl_dataset_get_info(dataset), err);
    if (!rc)
        spl_cmd_drawing_set_unit(&a->drawing, dataset);
    if (!rc)
        rc = spl_renderer_create(&a->drawing.renderer, &renderer, err);
    if (!rc)
        rc = spl_renderer_add(renderer, dataset, err);
    if (!rc)
        rc = spl_renderer_render(renderer, dataset, &a->drawing.view, &frame, err);
    if (!rc)
        rc = a->listed ? spl_image_list_json(&frame.images[a->drawing.layer], &encoded, err)
                       : spl_image_encode(&frame.images[a->drawing.layer], &a->drawing.encode, &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(a->drawing.output, encoded.bytes, encoded.length, err);
    if (!rc)
        rc = write_world_file(a, err);
    if (!rc)
        report(spl_renderer_get_device(renderer), dataset, &frame.stats, a, &encoded);
    spl_encoded_finish(&encoded);
    spl_frame_finish(&frame);
    if (renderer && dataset)
        spl_renderer_remove(renderer, dataset);
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    spl_rays_destroy(a->rays);
    return rc;
}

int spl_cmd_render(int argc, char **argv)
{
    struct spl_cmd_render a;
    struct spl_error err = {0};
    int rc = spl_cmd_render_parse(&a, argc, argv, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    return rc || render(&a, &err) ? spl_cmd_fail(&err) : 0;
}
