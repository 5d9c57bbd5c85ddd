/* COLMAP's binary model, little-endian: cameras.bin (count; id, model, width, height, parameters) and images.bin
 * (count; id, quaternion, translation, camera, name up to a NUL, its points).
 *
 * Counts are held against what the file has left before they are believed; points are passed over unread. What is wrong
 * is named with file, offset and field. Any thread; no state. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cloud/colmap_model.h"

enum {
    camera_bytes_min = 4 + 4 + 8 + 8 + 3 * 8,
    image_bytes_min = 4 + 7 * 8 + 4 + 2 + 8,
    point_bytes = 24,
    name_max = 1024,
};

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are taken as they lie in the file");

static int take(struct spl_source *source, void *out, size_t bytes, const char *field, struct spl_error *err)
{
    const uint8_t *at;
    size_t available;
    int rc = spl_source_peek(source, bytes, &at, &available, err);
    if (rc)
        return rc;
    if (available < bytes)
        return spl_source_fail_at(source, spl_source_tell(source), field, err, "the file ends within %s", field);
    memcpy(out, at, bytes);
    spl_source_take(source, bytes);
    return SPL_OK;
}

static int take_count(struct spl_source *source, uint64_t *count, size_t bytes_each, const char *field,
                      struct spl_error *err)
{
    uint64_t at = spl_source_tell(source);
    int rc = take(source, count, sizeof *count, field, err);
    if (!rc && *count > spl_source_left(source) / bytes_each)
        rc = spl_source_fail_at(source, at, field, err, "%llu %s do not fit into the %llu bytes that are left",
                                (unsigned long long)*count, field, (unsigned long long)spl_source_left(source));
    return rc;
}

static int take_values(struct spl_source *source, struct spl_value *value, unsigned count, const char *field,
                       struct spl_error *err)
{
    value->given = true;
    value->count = count;
    return take(source, value->n, count * sizeof *value->n, field, err);
}

/* The same fault, with its place in front. */
static int fail_at(const struct spl_source *source, uint64_t at, int rc, const struct spl_error *why,
                   struct spl_error *err)
{
    return rc == SPL_E_INPUT ? spl_source_fail_at(source, at, why->field, err, "%s", why->message)
                             : spl_source_fail(source, rc, why->field, err, "%s", why->message);
}

static int read_camera(struct spl_colmap *model, struct spl_source *source, struct spl_error *err)
{
    struct spl_colmap_camera camera = {0};
    struct spl_error why = {0}, place = {0};
    uint64_t at = spl_source_tell(source), size[2] = {0};
    uint32_t id = 0;
    int32_t number = 0;
    unsigned count = 0;
    int rc;
    if ((rc = take(source, &id, sizeof id, "CAMERA_ID", err)) ||
        (rc = take(source, &number, sizeof number, "MODEL", err)) ||
        (rc = take(source, size, sizeof size, "WIDTH", err)))
        return rc;
    const char *name = spl_colmap_model_from_id(number, &count);
    if (!name)
        return spl_source_fail_at(source, at, "MODEL", err,
                                  "camera %u has model number %d, whose parameters are not known; known are %s", id,
                                  number, spl_colmap_model_names);
    if ((rc = take_values(source, &camera.params, count, "PARAMS", err)))
        return rc;
    if ((rc = spl_value_from_choice(&camera.model, SPL_KIND_MODEL, "MODEL", name, &why))) {
        fail_at(source, at, rc, &why, &place);
        if ((rc = spl_view_list_refuse(model->photographs, rc, &place, err)))
            return rc;
        camera.refused = true;
    }
    camera.id = id;
    camera.width = (struct spl_value){.given = true, .count = 1, .n = {(double)size[0]}};
    camera.height = (struct spl_value){.given = true, .count = 1, .n = {(double)size[1]}};
    why = (struct spl_error){0};
    rc = spl_colmap_add_camera(model, &camera, &why);
    return rc ? fail_at(source, at, rc, &why, err) : SPL_OK;
}

static int read_name(struct spl_source *source, char name[name_max], struct spl_error *err)
{
    const uint8_t *bytes;
    size_t available;
    int rc = spl_source_peek(source, name_max, &bytes, &available, err);
    if (rc)
        return rc;
    available = available < name_max ? available : name_max;
    const uint8_t *end = memchr(bytes, 0, available);
    if (!end || end == bytes)
        return spl_source_fail_at(source, spl_source_tell(source), "NAME", err,
                                  end ? "the image has no name" : "no name ends within %d bytes", name_max);
    memcpy(name, bytes, (size_t)(end - bytes) + 1);
    spl_source_take(source, (size_t)(end - bytes) + 1);
    return SPL_OK;
}

static int read_image(struct spl_colmap *model, struct spl_source *source, struct spl_error *err)
{
    struct spl_colmap_image image = {0};
    struct spl_error why = {0}, place = {0};
    uint64_t at = spl_source_tell(source), points = 0;
    uint32_t id = 0, camera = 0;
    char name[name_max];
    int rc;
    if ((rc = take(source, &id, sizeof id, "IMAGE_ID", err)) ||
        (rc = take_values(source, &image.q, 4, "QUATERNION", err)) ||
        (rc = take_values(source, &image.t, 3, "TRANSLATION", err)) ||
        (rc = take(source, &camera, sizeof camera, "CAMERA_ID", err)) || (rc = read_name(source, name, err)) ||
        (rc = take_count(source, &points, point_bytes, "POINTS2D", err)))
        return rc;
    spl_source_seek(source, spl_source_tell(source) + points * point_bytes);
    image.camera = camera;
    image.name = name;
    if (!(rc = spl_colmap_add_image(model, source->path, &image, &why)))
        return SPL_OK;
    fail_at(source, at, rc, &why, &place);
    return spl_view_list_refuse(model->photographs, rc, &place, err);
}

static int read_part(struct spl_colmap *model, const char *name, size_t bytes_min,
                     int (*read)(struct spl_colmap *, struct spl_source *, struct spl_error *), struct spl_error *err)
{
    struct spl_source source;
    uint64_t count = 0;
    char *path = spl_view_list_print(err, "%s/%s", model->folder, name);
    int rc = path ? spl_source_open(&source, path, err) : SPL_E_NOMEM;
    free(path);
    if (rc)
        return rc;
    rc = take_count(&source, &count, bytes_min, "count", err);
    for (uint64_t i = 0; !rc && i < count; i++)
        rc = read(model, &source, err);
    if (!rc && spl_source_left(&source))
        rc = spl_source_fail_at(&source, spl_source_tell(&source), "count", err, "%llu bytes follow the last of %llu",
                                (unsigned long long)spl_source_left(&source), (unsigned long long)count);
    spl_source_close(&source);
    return rc;
}

int spl_view_list_load_colmap_bin(struct spl_view_list *list, const char *folder,
                                  const struct spl_photograph_options *photographs, struct spl_error *err)
{
    struct spl_colmap model = {.list = list, .folder = folder, .photographs = photographs};
    int rc = read_part(&model, "cameras.bin", camera_bytes_min, read_camera, err);
    if (!rc)
        rc = read_part(&model, "images.bin", image_bytes_min, read_image, err);
    free(model.cameras);
    return rc;
}
