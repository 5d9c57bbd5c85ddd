/* Photographs inside an E57 file (images2D): pinholes, which look along -z with y up, and panoramas around the eye, of
 * which each face of 90 degrees that shows something is a view. What has no projection (a visual reference) is no view.
 *
 * Names are the images', with their number in the file, since most writers call all of them the same; of what no file
 * name can carry '_' remains. A spherical or cylindrical image without a pose has that of its scan. Any thread. */
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/reading.h"
#include "cloud/e57/document.h"
#include "cloud/view_list.h"
#include "geom/quaternion.h"
#include "geom/size.h"

enum { name_bytes = 60, section_header = 16, block = 1 << 16 };

struct reading {
    struct spl_view_list *list;
    const char *path;
    const struct spl_e57_document *document;
    const struct spl_e57_image *image;
    size_t number; /* of the image, from 1 */
    const struct spl_photograph_options *photographs;
};

bool spl_view_list_is_e57(const char *path)
{
    char magic[8] = "";
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a FIFO is not waited for */
    bool is = file >= 0 && read(file, magic, sizeof magic) == sizeof magic && !memcmp(magic, "ASTM-E57", sizeof magic);
    if (file >= 0)
        close(file);
    return is;
}

static int fail(const struct reading *r, const char *field, struct spl_error *err, const char *what, double value)
{
    return spl_fail_field(err, SPL_E_INPUT, field, "%s: image %zu ('%s'): %s: %g %s", r->path, r->number,
                          r->image->name, field, value, what);
}

/* The pose's rotation, row-major. */
static int find_turn(const struct reading *r, const struct spl_e57_pose *pose, double turn[9], struct spl_error *err)
{
    const double *q = pose->rotation;
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 1e-6 && length < 1e6))
        return fail(r, "rotation", err, "is the length of its quaternion, which is no rotation", length);
    spl_quaternion_to_matrix(q, turn);
    return SPL_OK;
}

/* NAME-N, of what a file name can carry; the caller frees it. */
static char *make_name(const struct reading *r, struct spl_error *err)
{
    char name[name_bytes + 1];
    size_t length = strlen(r->image->name);
    while (length > name_bytes || (length && (r->image->name[length] & 0xc0) == 0x80))
        length--; /* whole characters */
    memcpy(name, r->image->name, length);
    name[length] = 0;
    for (char *c = name; *c; c++)
        *c = *c == '/' || (c == name && *c == '.') ? '_' : *c;
    return spl_view_list_print(err, "%s-%zu", *name ? name : "image", r->number);
}

static char *describe(const struct reading *r, struct spl_error *err)
{
    return spl_view_list_print(err, "%s: image %zu ('%s')", r->path, r->number, r->image->name);
}

static struct spl_inner_photograph make_inner(const struct reading *r)
{
    const struct spl_e57_image *image = r->image;
    return (struct spl_inner_photograph){.path = (char *)r->path, // borrowed: what is added is a copy
                                         .at = image->at,
                                         .bytes = image->bytes,
                                         .width = (uint32_t)image->width,
                                         .height = (uint32_t)image->height};
}

static int check_sizes(const struct reading *r, struct spl_error *err)
{
    const struct spl_e57_image *i = r->image;
    double most = i->kind == SPL_E57_PINHOLE ? (double)spl_view_list_limits.pixels : SPL_PANORAMA_PIXELS_MAX;
    const double sizes[2] = {i->width, i->height}, pixels[2] = {i->pixel_width, i->pixel_height};
    if (i->coding == SPL_E57_NO_CODING)
        return spl_fail_field(err, SPL_E_INPUT, "jpegImage", "%s: image %zu ('%s') has neither jpegImage nor pngImage",
                              r->path, r->number, i->name);
    for (int k = 0; k < 2; k++) {
        if (!(sizes[k] >= 1 && sizes[k] <= spl_view_list_limits.side_px && sizes[k] == floor(sizes[k])) ||
            i->width * i->height > most)
            return fail(r, k ? "imageHeight" : "imageWidth", err, "pixels are no image that can be taken", sizes[k]);
        if (!(pixels[k] > 0 && isfinite(pixels[k])))
            return fail(r, k ? "pixelHeight" : "pixelWidth", err, "is no size", pixels[k]);
    }
    return SPL_OK;
}

static int add_pinhole(const struct reading *r, struct spl_error *err)
{
    const struct spl_e57_image *i = r->image;
    struct spl_camera camera = {.near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY};
    const struct spl_inner_photograph inner = make_inner(r);
    struct spl_error why = {0};
    double turn[9], m[16] = {[15] = 1};
    int rc = find_turn(r, &i->pose, turn, err);
    if (rc)
        return rc;
    if (!i->pose.given)
        return spl_fail_field(err, SPL_E_INPUT, "pose", "%s: image %zu ('%s') has no pose", r->path, r->number,
                              i->name);
    if (!(i->focal_length > 0 && isfinite(i->focal_length)))
        return fail(r, "focalLength", err, "is no focal length", i->focal_length);
    for (int k = 0; k < 3; k++) {
        memcpy(&m[4 * k], &turn[3 * k], 3 * sizeof *m);
        m[4 * k + 3] = i->pose.translation[k];
    }
    camera.width = (uint32_t)i->width;
    camera.height = (uint32_t)i->height;
    camera.fx = i->focal_length / i->pixel_width;
    camera.fy = i->focal_length / i->pixel_height;
    camera.cx = i->principal[0];
    camera.cy = i->principal[1];
    if ((rc = spl_camera_set_matrix(&camera, m, SPL_AXES_OPENGL, &why)) || (rc = spl_camera_check(&camera, &why)))
        return spl_fail_field(err, rc, why.field, "%s: image %zu ('%s'): %s", r->path, r->number, i->name, why.message);
    char *name = make_name(r, err), *shown = describe(r, err);
    rc = name && shown ? spl_view_list_add_inner(r->list, r->path, name, &camera, r->photographs ? shown : NULL,
                                                 r->photographs ? &inner : NULL, err)
                       : SPL_E_NOMEM;
    free(name);
    free(shown);
    return rc;
}

/* The pose of a panorama: its own, else that of the scan that it belongs to; NULL: neither. */
static const struct spl_e57_pose *find_pose(const struct reading *r)
{
    const struct spl_e57_document *d = r->document;
    for (size_t i = 0; !r->image->pose.given && *r->image->scan_guid && i < d->scan_count; i++)
        if (!strcmp(d->scans[i].guid, r->image->scan_guid))
            return &d->scans[i].pose;
    return r->image->pose.given ? &r->image->pose : NULL;
}

static int add_faces(const struct reading *r, struct spl_error *err)
{
    const struct spl_e57_image *i = r->image;
    const struct spl_e57_pose *pose = find_pose(r);
    struct spl_panorama panorama = {.cylinder = i->kind == SPL_E57_CYLINDRICAL,
                                    .width = (uint32_t)i->width,
                                    .height = (uint32_t)i->height,
                                    .across = 1 / i->pixel_width,
                                    .down = 1 / i->pixel_height,
                                    .horizon = i->height / 2};
    if (!pose)
        return spl_fail_field(err, SPL_E_INPUT, "pose",
                              "%s: image %zu ('%s') has no pose, and names no scan that has one", r->path, r->number,
                              i->name);
    if (panorama.cylinder && !(i->radius > 0 && isfinite(i->radius) && isfinite(i->principal[1])))
        return fail(r, "radius", err, "is no radius", i->radius);
    if (panorama.cylinder) {
        panorama.down = i->radius / i->pixel_height;
        panorama.horizon = i->principal[1];
    }
    if (i->width > 2 * M_PI * panorama.across + 1)
        return fail(r, "pixelWidth", err, "times its width is more than once around", i->pixel_width);
    double turn[9];
    struct spl_inner_photograph inner = make_inner(r);
    struct spl_error why = {0};
    int rc = find_turn(r, pose, turn, err);
    if (rc)
        return rc;
    inner.is_panorama = true;
    inner.panorama = panorama;
    char *name = make_name(r, err), *shown = describe(r, err);
    const struct spl_face_options faces = {.path = r->path,
                                           .name = name,
                                           .photograph = shown,
                                           .rotation = turn,
                                           .position = pose->translation,
                                           .inner = &inner,
                                           .panorama = (uint32_t)r->number,
                                           .photographs = r->photographs};
    rc = name && shown ? spl_view_list_add_faces(r->list, &faces, &why) : SPL_E_NOMEM;
    if (why.code)
        spl_fail_field(err, rc, why.field, "%s", why.message);
    free(name);
    free(shown);
    return rc;
}

int spl_view_list_load_e57(struct spl_view_list *list, const char *path,
                           const struct spl_photograph_options *photographs, struct spl_error *err)
{
    struct spl_source source;
    struct spl_e57_pages pages = {0};
    struct spl_e57_document document = {0};
    int rc = spl_source_open(&source, path, err);
    if (rc)
        return rc;
    if (!(rc = spl_e57_pages_init(&pages, &source, err)))
        rc = spl_e57_document_read(&document, &pages, err);
    if (!rc && photographs && photographs->images)
        rc = spl_fail_field(err, SPL_E_USAGE, "images", "%s holds its photographs itself: leave --images out", path);
    for (size_t i = 0; !rc && i < document.image_count; i++) {
        const struct reading r = {list, path, &document, &document.images[i], i + 1, photographs};
        struct spl_error why = {0};
        if (r.image->kind == SPL_E57_NO_IMAGE || r.image->kind == SPL_E57_VISUAL)
            continue;
        if (!(rc = check_sizes(&r, &why)))
            rc = r.image->kind == SPL_E57_PINHOLE ? add_pinhole(&r, &why) : add_faces(&r, &why);
        rc = spl_view_list_refuse(photographs, rc, &why, err);
    }
    spl_e57_document_finish(&document);
    spl_e57_pages_finish(&pages);
    spl_source_close(&source);
    return rc;
}

static void pass_over(void *context, const struct spl_error *why)
{
    (void)context, (void)why;
}

bool spl_panoramas_are_inside(const char *path)
{
    struct spl_view_list list = {0};
    const struct spl_photograph_options all = {.refuse = pass_over};
    bool are = spl_view_list_is_e57(path) && !spl_view_list_load_e57(&list, path, &all, NULL) && list.count;
    spl_view_list_finish(&list);
    return are;
}

/* Copies a blob's bytes to a file in memory. */
static int copy_blob(struct spl_e57_pages *pages, const struct spl_inner_photograph *inner, FILE *file,
                     struct spl_error *err)
{
    const struct spl_source *source = pages->source;
    uint64_t at, end = spl_e57_logical_bytes(pages);
    uint8_t *bytes = spl_alloc_raw(block, 1, err);
    int rc = bytes ? SPL_OK : SPL_E_NOMEM;
    if (!rc && (!spl_e57_to_logical(pages, inner->at, &at) || end - at < section_header ||
                inner->bytes > end - at - section_header))
        rc = spl_source_fail_at(source, inner->at, "image", err, "%llu bytes do not fit the file",
                                (unsigned long long)inner->bytes);
    if (!rc && !(rc = spl_e57_read(pages, at, bytes, section_header, err)) &&
        (bytes[0] != 0 || spl_e57_get64(bytes + 8) < section_header + inner->bytes))
        rc = spl_source_fail_at(source, inner->at, "image", err, "is no section of %llu bytes",
                                (unsigned long long)inner->bytes);
    for (uint64_t done = 0; !rc && done < inner->bytes;) {
        size_t count = inner->bytes - done < block ? (size_t)(inner->bytes - done) : block;
        if (!(rc = spl_e57_read(pages, at + section_header + done, bytes, count, err)) &&
            fwrite(bytes, 1, count, file) != count)
            rc = spl_fail(err, SPL_E_NOMEM, "%s: no memory for an image of %llu bytes", inner->path,
                          (unsigned long long)inner->bytes);
        done += count;
    }
    free(bytes);
    return rc;
}

int spl_view_open_inner(const struct spl_named_view *view, FILE **file, struct spl_error *err)
{
    const struct spl_inner_photograph *inner = view->inner;
    struct spl_source source;
    struct spl_e57_pages pages = {0};
    if (!inner->at)
        return spl_open_for_reading(inner->path, file, err);
    int rc = spl_source_open(&source, inner->path, err);
    if (rc)
        return rc;
    int memory = memfd_create("photograph", MFD_CLOEXEC);
    *file = memory < 0 ? NULL : fdopen(memory, "w+b");
    if (!*file)
        rc = spl_fail(err, SPL_E_NOMEM, "%s: no memory for an image", inner->path);
    if (memory >= 0 && !*file)
        close(memory);
    if (!rc && !(rc = spl_e57_pages_init(&pages, &source, err)))
        rc = copy_blob(&pages, inner, *file, err);
    if (!rc && (fflush(*file) || fseek(*file, 0, SEEK_SET)))
        rc = spl_fail(err, SPL_E_NOMEM, "%s: no memory for an image", inner->path);
    if (rc && *file) {
        fclose(*file);
        *file = NULL;
    }
    spl_e57_pages_finish(&pages);
    spl_source_close(&source);
    return rc;
}
