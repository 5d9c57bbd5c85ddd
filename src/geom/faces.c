/* Which part of each face a camera asks for: its edges' rays, those at the end of its lens' reach, and what of the
 * face's own edges lies in the image, for these bound all others. */
#include "geom/faces.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "geom/distortion.h"
#include "geom/ray_list.h"
#include "geom/vector.h"

const double spl_face_axes[SPL_FACES][9] = {
    {0, 0, -1, 0, 1, 0, 1, 0, 0}, {0, 0, 1, 0, 1, 0, -1, 0, 0}, {1, 0, 0, 0, 0, 1, 0, -1, 0},
    {1, 0, 0, 0, 0, -1, 0, 1, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1},  {-1, 0, 0, 0, 1, 0, 0, 0, -1},
};

enum { edge_steps = 32, grow_steps = 128, FRONT = 4 };

static unsigned find_face(const double ray[3])
{
    const double x = fabs(ray[0]), y = fabs(ray[1]), z = fabs(ray[2]);
    if (z >= x && z >= y)
        return ray[2] >= 0 ? 4 : 5;
    return x >= y ? (ray[0] >= 0 ? 0 : 1) : ray[1] >= 0 ? 3 : 2;
}

unsigned spl_face_of(const double ray[3], double place[2])
{
    const unsigned face = find_face(ray);
    const double *axes = spl_face_axes[face], along = dot3(axes + 6, ray);
    place[0] = dot3(axes, ray) / along;
    place[1] = dot3(axes + 3, ray) / along;
    return face;
}

unsigned spl_faces_place(const struct spl_faces *faces, const double ray[3], double pixel[2], double *along)
{
    const unsigned face = spl_face_of(ray, pixel);
    const struct spl_camera *c = &faces->cameras[face];
    *along = dot3(spl_face_axes[face] + 6, ray);
    pixel[0] = c->cx + c->fx * pixel[0];
    pixel[1] = c->cy + c->fy * pixel[1];
    return face;
}

uint64_t spl_faces_get_pixels(const struct spl_faces *faces)
{
    uint64_t pixels = 0;
    for (int i = 0; i < SPL_FACES; i++)
        pixels += (uint64_t)faces->cameras[i].width * faces->cameras[i].height;
    return pixels;
}

/* What pixels ask for, of each face. */
struct parts {
    double low[SPL_FACES][2], high[SPL_FACES][2];
    double least; /* cosine of the widest angle off the axis */
};

static void grow(struct parts *parts, unsigned face, const double place[2])
{
    for (int i = 0; i < 2; i++) {
        if (place[i] < parts->low[face][i])
            parts->low[face][i] = place[i];
        if (place[i] > parts->high[face][i])
            parts->high[face][i] = place[i];
    }
}

static void add_ray(struct parts *parts, const double ray[3])
{
    double place[2];
    const unsigned face = spl_face_of(ray, place);
    grow(parts, face, place);
    parts->least = fmin(parts->least, ray[2]);
}

static bool is_inside(const struct spl_camera *camera, const double ray[3])
{
    double pixel[2];
    return spl_camera_place(camera, ray, pixel) && pixel[0] >= 0 && pixel[0] <= camera->width && pixel[1] >= 0 &&
           pixel[1] <= camera->height;
}

/* As spl_camera_get_ray(), of rings up to the poles; what lies beyond is the pole. */
static void get_ring_ray(const struct spl_camera *camera, double u, double v, double ray[3])
{
    const double a = (u - camera->cx) / camera->fx, e = fmin(fmax((v - camera->cy) / camera->fy, -M_PI_2), M_PI_2);
    ray[0] = sin(a) * cos(e);
    ray[1] = sin(e);
    ray[2] = cos(a) * cos(e);
}

static void add_image_edges(struct parts *parts, const struct spl_camera *camera)
{
    double ray[3];
    for (int i = 0; i < 4 * (edge_steps + 1); i++) {
        const double t = (double)(i % (edge_steps + 1)) / edge_steps, w = camera->width, h = camera->height;
        const int edge = i / (edge_steps + 1);
        const double x = edge < 2 ? t * w : edge == 2 ? 0 : w, y = edge < 2 ? (edge ? h : 0) : t * h;
        if (camera->projection == SPL_EQUIRECTANGULAR)
            get_ring_ray(camera, x, y, ray);
        else if (!spl_camera_get_ray(camera, x, y, ray))
            continue;
        add_ray(parts, ray);
    }
    if (camera->projection != SPL_EQUIRECTANGULAR)
        return;
    const double turn = 2 * M_PI * fabs(camera->fx);
    for (int i = 0; i < 16; i++) { /* where the first and the last ring turn, or cross from face to face */
        const double u = camera->cx + i / 2 * M_PI_4 * camera->fx;
        get_ring_ray(camera, u, i & 1 ? camera->height : 0, ray);
        if (u - floor(u / turn) * turn <= camera->width)
            add_ray(parts, ray);
    }
}

static void add_reach(struct parts *parts, const struct spl_camera *camera)
{
    const double end = camera->projection == SPL_FISHEYE ? camera->lens.reach : atan(camera->lens.reach);
    const double angle = end * (1 - 1e-9), flat = sin(angle), deep = cos(angle);
    for (int i = 0; i < 4 * edge_steps; i++) {
        const double around = 2 * M_PI * i / (4 * edge_steps);
        const double ray[3] = {cos(around) * flat, sin(around) * flat, deep};
        if (is_inside(camera, ray))
            add_ray(parts, ray);
    }
}

/* The cube's twelve edges, for both faces that meet there. A step beyond what is inside counts as well. */
static void add_face_edges(struct parts *parts, const struct spl_camera *camera)
{
    for (int i = 0; i < 12 * (edge_steps + 1); i++) {
        const int edge = i / (edge_steps + 1), along = edge / 4;
        const double step = 2.0 / edge_steps, t = step * (i % (edge_steps + 1)) - 1;
        double ray[3];
        ray[along] = t;
        ray[(along + 1) % 3] = edge & 1 ? 1 : -1;
        ray[(along + 2) % 3] = edge & 2 ? 1 : -1;
        if (!is_inside(camera, ray))
            continue;
        for (unsigned face = 0; face < SPL_FACES; face++) {
            const double *axes = spl_face_axes[face], place[2] = {dot3(axes, ray), dot3(axes + 3, ray)};
            if (axes[6 + along] != 0 || dot3(axes + 6, ray) < 0)
                continue;
            for (int side = -1; side <= 1; side++) {
                const double moved = fmin(fmax(t + side * step, -1), 1) - t;
                grow(parts, face, (double[]){place[0] + axes[along] * moved, place[1] + axes[3 + along] * moved});
            }
        }
        parts->least = fmin(parts->least, ray[2] / sqrt(dot3(ray, ray)));
    }
}

/* Focal length of the faces: what a pixel of the camera asks for along the radius, and around it, at most twice its
 * own. A face itself is finer towards its edges than in its middle: the front by the angle off the axis, the others by
 * what is left of it to 90 degrees. */
static double find_focal(const struct spl_camera *camera, double widest)
{
    const double focal = fmax(fabs(camera->fx), fabs(camera->fy)), end = fmin(widest, M_PI_2);
    const bool fisheye = camera->projection == SPL_FISHEYE;
    double needed = 1;
    if (camera->projection == SPL_EQUIRECTANGULAR || camera->projection == SPL_CUBE || camera->projection == SPL_RAYS)
        return focal;
    for (int i = 1; i <= grow_steps; i++) {
        const double angle = end * i / grow_steps, sine = sin(angle);
        const double finer = angle > M_PI_4 ? sine : cos(angle);
        const double r = fmin(fisheye ? angle : tan(angle), camera->lens.reach);
        double growth, image = spl_distortion_get_image(&camera->lens, r, &growth);
        if (!fisheye)
            growth *= 1 + r * r; /* by the angle */
        needed = fmax(needed, fmax(growth * finer * finer, image / sine * finer));
    }
    return fmin(needed, 2) * focal;
}

int spl_faces_init(struct spl_faces *faces, const struct spl_camera *camera, uint32_t side_px, struct spl_error *err)
{
    return spl_faces_init_of(faces, camera, NULL, side_px, err);
}

/* Who is to blame for too large a face. */
static const char *blame(const struct spl_camera *camera)
{
    return camera->projection == SPL_RAYS ? "resolution" : camera->lens.kind ? "params" : "width";
}

int spl_faces_init_of(struct spl_faces *faces, const struct spl_camera *camera, const struct spl_rays *rays,
                      uint32_t side_px, struct spl_error *err)
{
    const bool sphere = camera->width >= 6.283185 * fabs(camera->fx) && camera->height >= 3.141592 * fabs(camera->fy);
    const bool whole = (camera->projection == SPL_EQUIRECTANGULAR && sphere) || camera->projection == SPL_CUBE;
    struct parts parts;
    memset(faces, 0, sizeof *faces);
    for (int i = 0; i < SPL_FACES; i++)
        for (int k = 0; k < 2; k++) {
            parts.low[i][k] = whole ? -1 : INFINITY;
            parts.high[i][k] = whole ? 1 : -INFINITY;
        }
    parts.least = 1;
    if (rays) {
        memcpy(parts.low, rays->low, sizeof parts.low);
        memcpy(parts.high, rays->high, sizeof parts.high);
    } else if (!whole) {
        add_image_edges(&parts, camera);
        add_reach(&parts, camera);
        add_face_edges(&parts, camera);
        if (is_inside(camera, (double[]){0, 0, 1}))
            grow(&parts, FRONT, (double[]){0, 0});
    }
    double focal = find_focal(camera, acos(fmax(parts.least, -1)));
    if (camera->projection != SPL_CUBE)
        focal = ceil(focal);
    for (int i = 0; i < SPL_FACES; i++) {
        struct spl_camera *face = &faces->cameras[i];
        double from[2], size[2];
        if (!(parts.low[i][0] <= parts.high[i][0]))
            continue;
        /* of a pixel, on the axis; of a cube's as its own pixels lie */
        const double middle = camera->projection == SPL_CUBE && fmod(2 * focal, 2) == 0 ? 0 : 0.5;
        for (int k = 0; k < 2; k++) {
            from[k] = floor(parts.low[i][k] * focal + middle) - SPL_FACE_MARGIN;
            size[k] = ceil(parts.high[i][k] * focal + middle) + SPL_FACE_MARGIN - from[k];
            if (!(size[k] <= side_px))
                return spl_fail_field(
                    err, SPL_E_LIMIT, blame(camera),
                    "pixels as fine as the image's are %.0f on a side of the cube around the eye; at most "
                    "%u are drawn",
                    size[k], side_px);
        }
        *face = *camera;
        face->projection = SPL_PERSPECTIVE;
        face->lens = (struct spl_distortion){0};
        face->fx = face->fy = focal;
        face->cx = middle - from[0];
        face->cy = middle - from[1];
        face->width = (uint32_t)size[0];
        face->height = (uint32_t)size[1];
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++) {
                const double *axis = spl_face_axes[i] + 3 * row, *r = camera->rotation + column;
                face->rotation[3 * row + column] = axis[0] * r[0] + axis[1] * r[3] + axis[2] * r[6];
            }
    }
    return SPL_OK;
}
