/* A photographer walks three short ways from a sample camera, none through a surface, and looks around in steps of the
 * golden angle. Places too close to something and pictures of little but sky are tried again; what is asked of a
 * picture falls with each try, and the sample camera itself is the last resort. */
#include "synth/photos.h"

#include <math.h>

#include "synth/random.h"
#include "geom/vector.h"

enum { tries = 64, ways = 3 };
static const double clearance = 0.5;   /* metres */
static const double field = 60;        /* degrees, vertical */
static const double seen_share = 0.85; /* of a picture's rays, at the first try */
static const double golden = 0.61803398874989485;

static double free_way(const struct spl_scene *scene, const double eye[3], const double direction[3])
{
    double t = INFINITY;
    uint32_t index;
    spl_bvh_hit(scene->nodes, scene->primitives, eye, direction, &t, &index);
    return t;
}

/* To the nearest of the surfaces in 26 directions. */
static double room_around(const struct spl_scene *scene, const double eye[3])
{
    double room = INFINITY;
    for (int i = 0; i < 27; i++) {
        double direction[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        if (i == 13)
            continue;
        normalise3(direction);
        room = fmin(room, free_way(scene, eye, direction));
    }
    return room;
}

static bool stands_above_something(const struct spl_scene *scene, const double eye[3])
{
    return isfinite(free_way(scene, eye, (double[3]){0, 0, -1}));
}

static void walk(const struct spl_scene *scene, const struct spl_named_camera *from, uint64_t *random, double eye[3])
{
    double ahead[3];
    sub3(from->target, from->eye, ahead);
    double reach = sqrt(dot3(ahead, ahead)) / 2;
    for (int i = 0; i < 3; i++)
        eye[i] = from->eye[i];
    for (int way = 0; way < ways; way++) {
        double angle = random_between(random, 0, 2 * M_PI), rise = random_between(random, -0.2, 0.2);
        double direction[3] = {cos(angle), sin(angle), rise};
        double length = random_between(random, 0, 0.8) * fmin(free_way(scene, eye, direction), reach);
        mad3(eye, length, direction, eye);
    }
}

/* The share of a grid of rays that meet something, 0 when one meets it within the clearance. */
static double share_seen(const struct spl_scene *scene, const struct spl_camera *camera)
{
    enum { across = 9, down = 7 };
    int seen = 0;
    for (int i = 0; i < across * down; i++) {
        double u = ((i % across + 0.5) / across * camera->width - camera->cx) / camera->fx;
        double v = ((i / across + 0.5) / down * camera->height - camera->cy) / camera->fy, direction[3];
        for (int a = 0; a < 3; a++)
            direction[a] = u * camera->rotation[a] + v * camera->rotation[3 + a] + camera->rotation[6 + a];
        double t = free_way(scene, camera->eye, direction);
        if (t < clearance)
            return 0;
        seen += isfinite(t);
    }
    return (double)seen / (across * down);
}

static void look(struct spl_camera *camera, const double eye[3], const double target[3], double fov, uint32_t width,
                 uint32_t height)
{
    struct spl_error err = {0};
    spl_camera_set_fov(camera, fov, width, height, &err);
    spl_camera_look_at(camera, eye, target, (double[3]){0, 0, 1}, &err);
    spl_assert(!err.code); /* neither straight up nor down, and the size was checked */
}

struct spl_camera spl_photo_place(const struct spl_scene *scene, uint64_t seed, size_t number, uint32_t width,
                                  uint32_t height)
{
    struct spl_camera camera = {.near = 0.01, .far = INFINITY};
    const struct spl_named_camera *from = &scene->cameras[number % scene->camera_count];
    uint64_t random = hash64(seed ^ hash64(number));
    double ahead[3], eye[3], target[3];
    sub3(from->target, from->eye, ahead);
    normalise3(ahead);
    bool grounded = stands_above_something(scene, from->eye), placed = false;
    for (int attempt = 0; attempt < tries && !placed; attempt++) {
        walk(scene, from, &random, eye);
        double turn = (double)number * golden + attempt * golden * golden, azimuth = 2 * M_PI * (turn - floor(turn));
        double pitch = asin(ahead[2]) + random_between(&random, -0.3, 0.3);
        pitch = fmax(-1.3, fmin(1.3, pitch));
        if (room_around(scene, eye) < clearance || (grounded && !stands_above_something(scene, eye)))
            continue;
        mad3(eye, 1, (double[3]){cos(pitch) * cos(azimuth), cos(pitch) * sin(azimuth), sin(pitch)}, target);
        look(&camera, eye, target, field, width, height);
        placed = share_seen(scene, &camera) > seen_share * (1 - (double)attempt / tries);
    }
    if (!placed)
        look(&camera, from->eye, from->target, from->fov, width, height);
    mad3(camera.eye, 1, scene->offset, camera.eye);
    return camera;
}

void spl_photo_print_camera(FILE *out, size_t id, const struct spl_camera *camera)
{
    fprintf(out, "%zu PINHOLE %u %u %.17g %.17g %.17g %.17g\n", id, camera->width, camera->height, camera->fx,
            camera->fy, camera->cx, camera->cy);
}

/* World to camera as (w, x, y, z), w >= 0; the largest component comes from a square root, the others by division. */
static void quaternion_of(const double r[9], double q[4])
{
    double squares[4] = {1 + r[0] + r[4] + r[8], 1 + r[0] - r[4] - r[8], 1 - r[0] + r[4] - r[8],
                         1 - r[0] - r[4] + r[8]}; /* of 2 q */
    int largest = 0;
    for (int i = 1; i < 4; i++)
        largest = squares[i] > squares[largest] ? i : largest;
    const double products[4][4] = {
        {squares[0], r[7] - r[5], r[2] - r[6], r[3] - r[1]},
        {r[7] - r[5], squares[1], r[1] + r[3], r[2] + r[6]},
        {r[2] - r[6], r[1] + r[3], squares[2], r[5] + r[7]},
        {r[3] - r[1], r[2] + r[6], r[5] + r[7], squares[3]},
    };
    double scale = 1 / (2 * sqrt(squares[largest]));
    scale = products[largest][0] < 0 ? -scale : scale;
    for (int i = 0; i < 4; i++)
        q[i] = products[largest][i] * scale;
}

void spl_photo_print_image(FILE *out, size_t id, const struct spl_camera *camera, const char *name)
{
    double q[4], t[3];
    quaternion_of(camera->rotation, q);
    for (int i = 0; i < 3; i++)
        t[i] = -dot3(&camera->rotation[3 * i], camera->eye);
    fprintf(out, "%zu %.17g %.17g %.17g %.17g %.17g %.17g %.17g %zu %s\n\n", id, q[0], q[1], q[2], q[3], t[0], t[1],
            t[2], id, name);
}
