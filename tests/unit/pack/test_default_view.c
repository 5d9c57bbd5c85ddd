/* The default view: inside of what lies around one, before what faces somewhere, all of it in images of any shape, and
 * what the user says in its place. Whole packs of small clouds. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/collect.h>
#include <splatd/pack.h>

#include "base/array.h"
#include "clouds.h"
#include "dataset/dataset.h"
#include "pack/median.h"

static char folder[] = "/tmp/splatd-view-XXXXXX";
static char scan[64], packed[64];

struct cloud {
    size_t count, capacity;
    float (*at)[6]; /* position, normal */
};

static void add(struct cloud *cloud, double x, double y, double z, double nx, double ny, double nz)
{
    assert_int_equal(spl_array_reserve(cloud->at, cloud->capacity, cloud->count + 1, NULL), 0);
    const double all[6] = {x, y, z, nx, ny, nz};
    for (int i = 0; i < 6; i++)
        cloud->at[cloud->count][i] = (float)all[i];
    cloud->count++;
}

/* A rectangle from corner `a` along u and v, a point every `step`. */
static void add_sheet(struct cloud *cloud, const double a[3], const double u[3], const double v[3], double step,
                      const double normal[3])
{
    double lu = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), lv = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (double s = 0; s <= lu; s += step)
        for (double t = 0; t <= lv; t += step)
            add(cloud, a[0] + u[0] * s / lu + v[0] * t / lv, a[1] + u[1] * s / lu + v[1] * t / lv,
                a[2] + u[2] * s / lu + v[2] * t / lv, normal[0], normal[1], normal[2]);
}

static void add_box(struct cloud *cloud, double x, double y, double z, double step, bool open)
{
    static const double none[3] = {0};
    const double o[3] = {0}, top[3] = {0, 0, z}, right[3] = {x, 0, 0}, back[3] = {0, y, 0}, u[3] = {x, 0, 0},
                 v[3] = {0, y, 0}, w[3] = {0, 0, z};
    add_sheet(cloud, o, u, v, step, none);
    if (!open)
        add_sheet(cloud, top, u, v, step, none);
    add_sheet(cloud, o, u, w, step, none);
    add_sheet(cloud, back, u, w, step, none);
    add_sheet(cloud, o, v, w, step, none);
    add_sheet(cloud, right, v, w, step, none);
}

static int pack_with(const struct cloud *cloud, bool normals, struct spl_pack_options *options, struct spl_error *err)
{
    FILE *f = fopen(scan, "wb");
    assert_non_null(f);
    fprintf(f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty float x\nproperty float y\nproperty "
            "float z\n%send_header\n",
            cloud->count, normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "");
    for (size_t i = 0; i < cloud->count; i++)
        fwrite(cloud->at[i], sizeof(float), normals ? 6 : 3, f);
    assert_int_equal(fclose(f), 0);
    const char *input = scan;
    options->size = sizeof *options;
    options->inputs = &input;
    options->input_count = 1;
    options->output = packed;
    options->threads = 2;
    return spl_pack(options, NULL, err);
}

static struct spl_dataset *open_packed(const struct cloud *cloud, bool normals, const char *unit)
{
    struct spl_pack_options options = {.unit = unit};
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    if (pack_with(cloud, normals, &options, &err) || spl_dataset_open(packed, true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

/* Share of the cloud's first `count` points in the image, and of the image's narrower fit that they take up. */
static double share_in_view(const struct spl_dataset *dataset, const struct cloud *cloud, size_t count, uint32_t width,
                            uint32_t height, double *fill)
{
    struct spl_camera camera;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    size_t inside = 0;
    assert_int_equal(spl_dataset_get_default_camera(dataset, width, height, &camera, NULL), 0);
    for (size_t i = 0; i < count; i++) {
        double pixel[2], depth, at[3] = {(double)cloud->at[i][0], (double)cloud->at[i][1], (double)cloud->at[i][2]};
        if (!spl_camera_project(&camera, at, pixel, &depth))
            continue;
        inside += pixel[0] >= 0 && pixel[0] < width && pixel[1] >= 0 && pixel[1] < height;
        for (int c = 0; c < 2; c++) {
            low[c] = fmin(low[c], pixel[c]);
            high[c] = fmax(high[c], pixel[c]);
        }
    }
    *fill = fmax((high[0] - low[0]) / width, (high[1] - low[1]) / height);
    return (double)inside / (double)count;
}

static void a_room_is_seen_from_inside_lengthwise(void **state)
{
    (void)state;
    struct cloud cloud = {0};
    add_box(&cloud, 10, 5, 3, 0.15, false);
    static const char *const units[] = {"m", "unknown"};
    for (int k = 0; k < 2; k++) {
        struct spl_dataset *dataset = open_packed(&cloud, false, units[k]);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        const double *eye = info->default_eye, *target = info->default_target;
        assert_true(eye[0] > 0.2 && eye[0] < 9.8 && eye[1] > 0.2 && eye[1] < 4.8 && eye[2] > 1 && eye[2] < 2.2);
        double dx = target[0] - eye[0], dy = target[1] - eye[1];
        assert_true(fabs(dx) > 3 && fabs(dx) > 1.5 * fabs(dy));
        assert_true(dx > 0 ? eye[0] < 4 : eye[0] > 6);
        spl_dataset_close(dataset);
    }
    free(cloud.at);
}

/* The cloud as PTX of `stations` scans, each a part of it, that say that they were all taken from `at`. */
static struct spl_dataset *open_stations(const struct cloud *cloud, size_t stations, const double at[3])
{
    char ptx[80];
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    snprintf(ptx, sizeof ptx, "%s/in.ptx", folder);
    FILE *f = fopen(ptx, "w");
    assert_non_null(f);
    for (size_t k = 0; k < stations; k++) {
        fprintf(f, "%zu\n1\n%g %g %g\n1 0 0\n0 1 0\n0 0 1\n", (cloud->count - k + stations - 1) / stations, at[0],
                at[1], at[2]);
        fprintf(f, "1 0 0 0\n0 1 0 0\n0 0 1 0\n%g %g %g 1\n", at[0], at[1], at[2]);
        for (size_t i = k; i < cloud->count; i += stations)
            fprintf(f, "%.6f %.6f %.6f 0.5\n", (double)cloud->at[i][0] - at[0], (double)cloud->at[i][1] - at[1],
                    (double)cloud->at[i][2] - at[2]);
    }
    assert_int_equal(fclose(f), 0);
    const char *input = ptx;
    struct spl_pack_options options = {
        .size = sizeof options, .inputs = &input, .input_count = 1, .output = packed, .threads = 2};
    if (spl_pack(&options, NULL, &err) || spl_dataset_open(packed, true, &dataset, &err))
        fail_msg("%s", err.message);
    unlink(ptx);
    return dataset;
}

static void shift(struct cloud *cloud, double x, double y, double z)
{
    for (size_t i = 0; i < cloud->count; i++) {
        cloud->at[i][0] += (float)x;
        cloud->at[i][1] += (float)y;
        cloud->at[i][2] += (float)z;
    }
}

/* Scans that were brought into one system say that they were taken from its origin: a point of the floor, often. A
 * scanner does not lie there, nor do several stand in one place. */
static void an_origin_is_no_place_of_an_eye(void **state)
{
    (void)state;
    static const struct {
        double floor; /* beneath the origin */
        size_t stations;
        bool stood;
    } cases[] = {{0, 1, false}, {0.25, 1, false}, {-0.05, 1, false}, {0, 3, false}, {1.2, 2, false}, {1.2, 1, true}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (int storeys = 1; storeys <= 2; storeys++) {
            struct cloud cloud = {0};
            add_box(&cloud, 10, 5, 3, 0.15, false);
            shift(&cloud, -4, -2.5, 0);
            if (storeys == 2) { /* and one beneath */
                shift(&cloud, 4, 2.5, 3.2);
                add_box(&cloud, 10, 5, 3, 0.15, false);
                shift(&cloud, -4, -2.5, -3.2);
            }
            shift(&cloud, 0, 0, -cases[k].floor);
            struct spl_dataset *dataset = open_stations(&cloud, cases[k].stations, (double[]){0, 0, 0});
            const double *eye = spl_dataset_get_info(dataset)->default_eye;
            const double over = eye[2] + cases[k].floor + (eye[2] + cases[k].floor < -0.2 ? 3.2 : 0);
            if (cases[k].stood != (eye[0] == 0 && eye[1] == 0 && eye[2] == 0) || !(over > 1 && over < 2.2))
                fail_msg("case %zu, %d storeys: %g,%g,%g", k, storeys, eye[0], eye[1], eye[2]);
            assert_true(eye[0] > -3.8 && eye[0] < 5.8 && fabs(eye[1]) < 2.3);
            spl_dataset_close(dataset);
            free(cloud.at);
        }
}

/* A street has no ceiling, but who stands above its origin sees all of it; of a lawn with a house, next to nothing. */
static void one_stands_above_an_origin_or_goes_away(void **state)
{
    (void)state;
    static const double none[3] = {0};
    struct cloud street = {0}, house = {0};
    add_sheet(&street, (double[]){-30, -5, 0}, (double[]){60, 0, 0}, (double[]){0, 10, 0}, 0.25, none);
    add_sheet(&street, (double[]){-30, -5, 0}, (double[]){60, 0, 0}, (double[]){0, 0, 9}, 0.25, none);
    add_sheet(&street, (double[]){-30, 5, 0}, (double[]){60, 0, 0}, (double[]){0, 0, 9}, 0.25, none);
    struct spl_dataset *dataset = open_stations(&street, 1, none);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_true(fabs(info->default_eye[0]) < 1e-9 && fabs(info->default_eye[1]) < 1e-9);
    assert_true(info->default_eye[2] > 1.5 && info->default_eye[2] < 1.7);
    assert_true(fabs(info->default_target[0]) > 5 && fabs(info->default_target[1]) < 2);
    spl_dataset_close(dataset);

    struct cloud corridor = {0};
    add_box(&corridor, 20, 1.2, 2.4, 0.05, false);
    shift(&corridor, -3, -0.6, 0);
    dataset = open_stations(&corridor, 1, none);
    info = spl_dataset_get_info(dataset);
    assert_true(fabs(info->default_eye[0]) < 1e-9 && info->default_eye[2] > 1 && info->default_eye[2] < 1.7);
    assert_true(info->default_target[0] > 2);
    spl_dataset_close(dataset);
    free(corridor.at);

    add_box(&house, 6, 4, 4, 0.1, false);
    shift(&house, -3, -2, 0);
    add_sheet(&house, (double[]){-12, -12, 0}, (double[]){24, 0, 0}, (double[]){0, 24, 0}, 0.2, none);
    dataset = open_stations(&house, 1, none);
    info = spl_dataset_get_info(dataset);
    assert_true(hypot(info->default_eye[0], info->default_eye[1]) > 6 && info->default_eye[2] > 2);
    spl_dataset_close(dataset);
    free(street.at);
    free(house.at);
}

/* An ellipsoid, 4 wide and 5.6 high, whose normals show outwards or, where `way` is -1, inwards. */
static void add_egg(struct cloud *cloud, double way, double scale)
{
    enum { points = 12000 };
    for (int i = 0; i < points; i++) {
        const double z = 1 - 2 * (i + 0.5) / points, r = sqrt(1 - z * z), a = i * M_PI * (3 - sqrt(5));
        const double n[3] = {r * cos(a) / 2, r * sin(a) / 2, z / 2.8};
        const double length = way / sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        add(cloud, scale * r * cos(a) * 2, scale * r * sin(a) * 2, scale * (z + 1) * 2.8, n[0] * length, n[1] * length,
            n[2] * length);
    }
}

/* Is the eye within the bounds of the points? */
static bool seen_from_inside(const struct cloud *cloud, bool normals, const char *unit)
{
    struct spl_dataset *dataset = open_packed(cloud, normals, unit);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    bool inside = true;
    for (int c = 0; c < 3; c++)
        inside &= info->default_eye[c] > info->bounds_min[c] && info->default_eye[c] < info->bounds_max[c];
    spl_dataset_close(dataset);
    return inside;
}

/* Closed all around, as a room is; normals say which of both it is, and so does what has neither floor nor walls. */
static void a_thing_is_seen_from_outside_and_a_room_from_inside(void **state)
{
    (void)state;
    static const struct {
        double egg, room, scale; /* which way normals show, 0: there is none */
        bool normals;
        const char *unit;
        bool inside;
    } cases[] = {
        {1, 0, 1, true, "unknown", false}, {1, 0, 1, true, "m", false},       {-1, 0, 1, true, "unknown", true},
        {-1, 0, 1, true, "m", true},       {1, 0, 1, false, "unknown", false}, {1, 0, 0.025, false, "unknown", false},
        {1, 0, 20, false, "mm", false},    {0, 1, 1, true, "unknown", true},  {0, -1, 1, true, "unknown", false},
        {0, -1, 1, true, "m", false},      {0, 1, 1000, false, "unknown", true}, /* no less than one in metres */
        {0, 1, 1, false, "m", true},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct cloud cloud = {0};
        if (cases[k].egg != 0)
            add_egg(&cloud, cases[k].egg, cases[k].scale);
        else
            add_box(&cloud, 10, 5, 3, 0.15, false);
        for (size_t i = 0; cases[k].room != 0 && i < cloud.count; i++) {
            float *at = cloud.at[i];
            const double size[3] = {10, 5, 3};
            int axis = 0;
            for (int c = 0; c < 3; c++) /* of the side that it lies on */
                if (fmin((double)at[c], size[c] - (double)at[c]) <
                    fmin((double)at[axis], size[axis] - (double)at[axis]))
                    axis = c;
            at[3 + axis] = (float)((double)at[axis] < 0.5 * size[axis] ? cases[k].room : -cases[k].room);
            for (int c = 0; c < 3; c++)
                at[c] *= (float)cases[k].scale;
        }
        if (seen_from_inside(&cloud, cases[k].normals, cases[k].unit) != cases[k].inside)
            fail_msg("case %zu is seen from %s", k, cases[k].inside ? "outside" : "inside");
        free(cloud.at);
    }
}

/* A tray has no ceiling: one looks into it from above. */
static void what_is_open_is_seen_from_outside(void **state)
{
    (void)state;
    struct cloud cloud = {0};
    add_box(&cloud, 10, 5, 1, 0.15, true);
    struct spl_dataset *dataset = open_packed(&cloud, false, "m");
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_true(info->default_eye[2] > 2);
    spl_dataset_close(dataset);
    free(cloud.at);
}

static void all_of_it_is_in_images_of_any_shape(void **state)
{
    (void)state;
    static const double z[3] = {0, 0, 1};
    static const uint32_t sizes[][2] = {{1280, 720}, {390, 844}, {500, 500}, {2000, 300}};
    struct cloud cloud = {0};
    add_sheet(&cloud, (double[]){0, 0, 0}, (double[]){60, 0, 0}, (double[]){0, 20, 0}, 0.5, z);
    size_t count = cloud.count;
    struct spl_dataset *alone = open_packed(&cloud, false, "m");
    for (int k = 0; k < 40; k++) /* birds */
        add(&cloud, 30 + 5 * k, 10, 300 + 11 * k, 0, 0, 0);
    struct spl_dataset *with = open_packed(&cloud, false, "m");
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        double fill, fill_with;
        assert_true(share_in_view(alone, &cloud, count, sizes[s][0], sizes[s][1], &fill) > 0.99);
        assert_true(share_in_view(with, &cloud, count, sizes[s][0], sizes[s][1], &fill_with) > 0.99);
        assert_true(fill > 0.7 && fill <= 1.05);
        assert_true(fill_with > 0.9 * fill);
    }
    spl_dataset_close(alone);
    spl_dataset_close(with);
    free(cloud.at);
}

/* Few points that stand over the edge are in the image, too, where the others hardly become smaller for them. */
static void what_stands_over_is_in_it(void **state)
{
    (void)state;
    static const double z[3] = {0, 0, 1};
    struct cloud cloud = {0};
    double fill, before;
    add_sheet(&cloud, (double[]){0, 0, 0}, (double[]){60, 0, 0}, (double[]){0, 20, 0}, 0.5, z);
    const size_t sheet = cloud.count;
    for (int k = 1; k <= 6; k++) {
        add(&cloud, -0.5 * k, 10, 0, 0, 0, 0);
        add(&cloud, 60 + 0.5 * k, 10, 0, 0, 0, 0);
    }
    struct spl_dataset *dataset = open_packed(&cloud, false, "m");
    assert_true(share_in_view(dataset, &cloud, cloud.count, 1280, 720, &fill) >= 1);
    assert_true(fill > 0.9);
    share_in_view(dataset, &cloud, sheet, 1280, 720, &before);
    spl_dataset_close(dataset);
    for (int k = 0; k < 7; k++) /* a hair of it far out, for which nothing is made small */
        add(&cloud, 65 + 2 * k, 10, 0, 0, 0, 0);
    dataset = open_packed(&cloud, false, "m");
    assert_true(share_in_view(dataset, &cloud, sheet, 1280, 720, &fill) >= 1);
    if (fill < 0.95 * before)
        fail_msg("%g of the image after %g", fill, before);
    spl_dataset_close(dataset);
    free(cloud.at);
}

/* Heights that mean none, more of them than a hundredth, far below a slope. */
static void heights_that_mean_none_do_not_count(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    struct cloud cloud = {0};
    double before, fill;
    add_sheet(&cloud, (double[]){0, 0, 0}, (double[]){60, 0, 5}, (double[]){0, 20, 0}, 0.5, up);
    const size_t sheet = cloud.count;
    struct spl_dataset *dataset = open_packed(&cloud, false, "m");
    share_in_view(dataset, &cloud, sheet, 1280, 720, &before);
    spl_dataset_close(dataset);
    for (size_t k = 0; k < sheet / 30; k++)
        add(&cloud, (double)cloud.at[31 * k % sheet][0], (double)cloud.at[31 * k % sheet][1], -9999, 0, 0, 0);
    dataset = open_packed(&cloud, false, "m");
    assert_true(share_in_view(dataset, &cloud, sheet, 1280, 720, &fill) >= 1);
    if (fill < 0.95 * before)
        fail_msg("%g of the image, %g without them", fill, before);
    spl_dataset_close(dataset);
    free(cloud.at);
}

/* A dense street before few points of the bushes behind it, which a tile's root has nearly all of: packed in two tiles
 * that are collected, it is framed as packed whole. */
static void a_collection_is_seen_as_a_pack_is(void **state)
{
    (void)state;
    static const double z[3] = {0, 0, 1};
    char tile[2][80], city[80];
    struct spl_error err = {0};
    struct cloud whole = {0};
    uint64_t random = 7;
    for (int t = 0; t < 2; t++) {
        struct cloud half = {0};
        add_sheet(&half, (double[]){30 * t, 0, 0}, (double[]){29.95, 0, 0}, (double[]){0, 8, 0}, 0.1, z);
        for (int k = 0; k < 240; k++)
            add(&half, 30 * (t + uniform(&random)), 8 + 62 * uniform(&random), 0.5 * uniform(&random), 0, 0, 0);
        for (size_t i = 0; i < half.count; i++)
            add(&whole, (double)half.at[i][0], (double)half.at[i][1], (double)half.at[i][2], 0, 0, 0);
        if (pack_with(&half, false, &(struct spl_pack_options){.unit = "m"}, &err))
            fail_msg("%s", err.message);
        snprintf(tile[t], sizeof tile[t], "%s/tile-%d.spld", folder, t);
        assert_int_equal(rename(packed, tile[t]), 0);
        free(half.at);
    }
    snprintf(city, sizeof city, "%s/city.spld", folder);
    const char *const inputs[] = {tile[0], tile[1]};
    if (spl_collect(&SPL_SIZED(spl_collect_options, .inputs = inputs, .input_count = 2, .output = city), &err))
        fail_msg("%s", err.message);
    struct spl_dataset *pack = open_packed(&whole, false, "m"), *collection = NULL;
    if (spl_dataset_open(city, true, &collection, &err))
        fail_msg("%s", err.message);
    const struct spl_dataset_info *a = spl_dataset_get_info(pack), *b = spl_dataset_get_info(collection);
    double away = 0, eyes = 0, targets = 0;
    for (int c = 0; c < 3; c++) {
        away += pow(a->default_eye[c] - a->default_target[c], 2);
        eyes += pow(a->default_eye[c] - b->default_eye[c], 2);
        targets += pow(a->default_target[c] - b->default_target[c], 2);
    }
    if (!(sqrt(eyes) < 0.03 * sqrt(away) && sqrt(targets) < 0.03 * sqrt(away)))
        fail_msg("of a distance of %g the eye is %g away, and the target %g", sqrt(away), sqrt(eyes), sqrt(targets));
    assert_true(fabs(a->default_fov - b->default_fov) < 1);
    spl_dataset_close(pack);
    spl_dataset_close(collection);
    for (int t = 0; t < 2; t++)
        unlink(tile[t]);
    unlink(city);
    free(whole.at);
}

/* A facade whose front is known, turned to every side. */
static void what_faces_somewhere_is_seen_from_there(void **state)
{
    (void)state;
    for (int k = 0; k < 4; k++) {
        struct cloud cloud = {0};
        double angle = 0.3 + k * M_PI / 2, u[3] = {12 * cos(angle), 12 * sin(angle), 0};
        const double normal[3] = {sin(angle), -cos(angle), 0};
        add_sheet(&cloud, (double[]){0, 0, 0}, u, (double[]){0, 0, 6}, 0.2, normal);
        struct spl_dataset *dataset = open_packed(&cloud, true, "m");
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        double arm[3], length = 0, along = 0;
        for (int c = 0; c < 3; c++) {
            arm[c] = info->default_eye[c] - info->default_target[c];
            length += arm[c] * arm[c];
            along += arm[c] * normal[c];
        }
        assert_true(along > 0.88 * sqrt(length)); /* within 28 degrees, 10 of them from above */
        spl_dataset_close(dataset);
        free(cloud.at);
    }
}

static void what_is_said_stands(void **state)
{
    (void)state;
    struct cloud cloud = {0};
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    add_box(&cloud, 10, 5, 3, 0.3, false);
    const struct spl_saved_view first = {.eye = {1, 2, 3}, .target = {4, 2, 3}, .fov = 50};
    const struct spl_saved_view views[] = {{.name = "door", .eye = {1, 1, 1}, .target = {2, 2, 1}, .up = {0, 1, 0}},
                                           {.name = "back", .eye = {9, 1, 1}, .target = {2, 2, 1}, .fov = 70,
                                            .settings = "{ \"class\": \"2\", \"clip\": [\"z<2\"] }"}};
    struct spl_pack_options options = {
        .title = "The hall", .description = "Two\nlines", .default_view = &first, .views = views, .view_count = 2};
    assert_int_equal(pack_with(&cloud, false, &options, &err), 0);
    assert_int_equal(spl_dataset_open(packed, true, &dataset, &err), 0);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_camera camera;
    assert_string_equal(info->title, "The hall");
    assert_string_equal(info->description, "Two\nlines");
    assert_true(info->default_eye[0] == 1 && info->default_target[0] == 4 && info->default_up[2] == 1);
    assert_true(info->default_fov == 50 && info->default_fit[0] == 50);
    assert_int_equal(info->view_count, 2);
    assert_string_equal(info->views[0].name, "back");
    assert_string_equal(info->views[0].settings, "{\"class\":\"2\",\"clip\":[\"z<2\"]}");
    assert_string_equal(info->views[1].settings, "");
    assert_true(info->views[0].up[2] == 1 && info->views[1].up[1] == 1 && info->views[1].fov == 60);
    assert_int_equal(spl_dataset_get_default_camera(dataset, 300, 600, &camera, &err), 0);
    assert_true(fabs(camera.fy - 150 / tan(25 * M_PI / 180)) < 1e-9); /* 50 degrees across */
    spl_dataset_close(dataset);
    free(cloud.at);
}

static void what_is_said_wrongly_is_refused_by_name(void **state)
{
    (void)state;
    struct cloud cloud = {0};
    add(&cloud, 0, 0, 0, 0, 0, 0);
    static char long_title[202];
    memset(long_title, 'a', sizeof long_title - 1);
    static const struct spl_saved_view blind = {.eye = {1, 2, 3}, .target = {1, 2, 3}},
                                       wide = {.eye = {1, 0, 0}, .fov = 180}, turned = {.eye = {1, 0, 0}, .fov = -1},
                                       nameless = {.eye = {1, 0, 0}},
                                       unsettled = {.name = "a", .eye = {1, 0, 0}, .settings = "[]"},
                                       hidden = {.name = ".a", .eye = {1, 0, 0}}, far = {.eye = {NAN, 0, 0}};
    static const struct spl_saved_view twice[] = {{.name = "a", .eye = {1, 0, 0}}, {.name = "a", .eye = {2, 0, 0}}};
    const struct {
        struct spl_pack_options options;
        const char *field;
    } wrong[] = {
        {{.title = long_title}, "title"},
        {{.title = "two\nlines"}, "title"},
        {{.title = "\xff"}, "title"},
        {{.description = "a\tb"}, "description"},
        {{.default_view = &blind}, "default-view"},
        {{.default_view = &wide}, "default-view"},
        {{.default_view = &turned}, "default-view"},
        {{.default_view = &far}, "default-view"},
        {{.views = &nameless, .view_count = 1}, "view"},
        {{.views = &unsettled, .view_count = 1}, "view"},
        {{.views = &hidden, .view_count = 1}, "view"},
        {{.views = twice, .view_count = 2}, "view"},
        {{.views = twice, .view_count = SPL_SAVED_VIEWS_MAX + 1}, "view"},
    };
    unlink(packed);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct spl_error err = {0};
        struct spl_pack_options options = wrong[i].options;
        assert_int_equal(pack_with(&cloud, false, &options, &err), SPL_E_USAGE);
        assert_string_equal(err.field, wrong[i].field);
        assert_int_equal(access(packed, F_OK), -1);
    }
    free(cloud.at);
}

/* Up is what it is told to be, or z, before a scan is opened; of tiles it is theirs. */
static void views_along_up_are_refused_at_once(void **state)
{
    (void)state;
    static const struct spl_saved_view down = {.name = "plan", .eye = {0, 0, 50}, .target = {0, 0, 1}},
                                       along_y = {.name = "side", .eye = {0, 9, 0}},
                                       turned = {.name = "map", .eye = {0, 0, 50}, .up = {0, 1, 0}},
                                       plan = {.name = "plan", .eye = {0, 0, 50}, .view_height = 9},
                                       side = {.name = "side", .eye = {0, 9, 0}, .view_height = 9},
                                       stiff = {.name = "stiff", .eye = {0, 0, 50}, .up = {0, 0, 2}, .view_height = 9};
    const struct {
        struct spl_pack_options options;
        const char *field, *says; /* NULL: the scan is missing, which is all that is wrong */
    } cases[] = {
        {{.default_view = &down}, "default-view", "--default-view: from eye 0,0,50 to target 0,0,1 with up 0,0,1: "},
        {{.views = &down, .view_count = 1}, "view", "--view plan: from eye 0,0,50 to target 0,0,1 with up 0,0,1: "},
        {{.default_view = &along_y, .up = {0, -7, 0}}, "default-view", "from eye 0,9,0 to target 0,0,0 with up 0,-7,0"},
        {{.views = &along_y, .view_count = 1, .up = {0, -7, 0}}, "view", "give another, such as up="},
        {{.default_view = &down, .up = {0, -7, 0}}, NULL, NULL},
        {{.default_view = &along_y, .views = &turned, .view_count = 1}, NULL, NULL},
        {{.views = &plan, .view_count = 1}, NULL, NULL}, /* a plan's up is +y then, as in views that are asked for */
        {{.views = &side, .view_count = 1, .up = {0, -7, 0}}, NULL, NULL},
        {{.views = &stiff, .view_count = 1}, "view", "--view stiff: from eye 0,0,50 to target 0,0,0 with up 0,0,2: "},
    };
    const char *const gone[] = {"/nonexistent/gone.ply"};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        struct spl_pack_options options = cases[i].options;
        options.size = sizeof options;
        options.inputs = gone;
        options.input_count = 1;
        options.output = packed;
        int rc = spl_pack(&options, NULL, &err);
        if ((rc == SPL_E_USAGE) != !!cases[i].field || !strstr(err.message, cases[i].says ? cases[i].says : "gone.ply"))
            fail_msg("case %zu: %s", i, err.message);
        assert_true(!cases[i].field || !strcmp(err.field, cases[i].field));
    }

    struct cloud cloud = {0};
    struct spl_error err = {0};
    char all[96];
    add_box(&cloud, 10, 5, 3, 0.3, false);
    assert_int_equal(pack_with(&cloud, false, &(struct spl_pack_options){.up = {0, -1, 0}}, &err), 0);
    free(cloud.at);
    snprintf(all, sizeof all, "%s/all.spld", folder);
    const char *const tiles[] = {packed};
    struct spl_collect_options collect = {
        .size = sizeof collect, .inputs = tiles, .input_count = 1, .output = all, .default_view = &along_y};
    assert_int_equal(spl_collect(&collect, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "default-view");
    assert_non_null(strstr(err.message, "with up 0,-1,0"));
    assert_int_equal(access(all, F_OK), -1);
    collect.default_view = &down;
    err = (struct spl_error){0};
    assert_int_equal(spl_collect(&collect, &err), 0);
    unlink(all);
}

static int set_up(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(scan, sizeof scan, "%s/in.ply", folder);
    snprintf(packed, sizeof packed, "%s/out.spld", folder);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(scan);
    unlink(packed);
    return rmdir(folder);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* A scan as wide as coordinates go: an eye that sees all of it from outside would stand where no camera can. */
static void as_wide_as_coordinates_go(void **state)
{
    (void)state;
    static const double most = 0.99e12, none[3] = {0};
    for (int corner = 0; corner < 2; corner++) {
        struct cloud cloud = {0};
        const double wide = corner ? most : 2 * most;
        add_sheet(&cloud, (double[3]){corner ? 0 : -most, -most, 0}, (double[3]){wide, 0, 0}, (double[3]){0, wide, 0},
                  2e10, none);
        struct spl_dataset *dataset = open_packed(&cloud, false, NULL);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        double fill;
        for (int c = 0; c < 3; c++)
            assert_true(fabs(info->default_eye[c]) <= 1e12 && fabs(info->default_target[c]) <= 1e12);
        assert_true(share_in_view(dataset, &cloud, cloud.count, 160, 90, &fill) > 0.8 && fill < 1.5);
        spl_dataset_close(dataset);
        free(cloud.at);
    }
}

/* Of few and many, of all kinds and of two alone, rising and at random. */
static void a_quantile_is_that_of_sorted_values(void **state)
{
    (void)state;
    enum { most = 1000 };
    uint64_t random = 5;
    for (size_t count = 1; count <= most; count += count < 40 ? 1 : 160)
        for (int kinds = 1; kinds < 100; kinds += 13)
            for (size_t nth = 0; nth < count; nth += 1 + count / 17) {
                double values[most], sorted[most];
                for (size_t i = 0; i < count; i++) {
                    random = random * 6364136223846793005u + 1442695040888963407u;
                    values[i] = sorted[i] = kinds == 14 ? (double)i : (double)((random >> 33) % (unsigned)kinds);
                }
                qsort(sorted, count, sizeof *sorted, compare_doubles);
                float singles[most];
                for (size_t i = 0; i < count; i++)
                    singles[i] = (float)values[i];
                assert_true((double)spl_middle(singles, count) == sorted[count / 2]);
                assert_true(spl_nth(values, count, nth) == sorted[nth]);
                for (size_t i = 0; i < count; i++)
                    assert_true(i < nth ? values[i] <= sorted[nth] : values[i] >= sorted[nth]);
                qsort(values, count, sizeof *values, compare_doubles);
                assert_memory_equal(values, sorted, count * sizeof *values);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_room_is_seen_from_inside_lengthwise),
        cmocka_unit_test(an_origin_is_no_place_of_an_eye),
        cmocka_unit_test(one_stands_above_an_origin_or_goes_away),
        cmocka_unit_test(a_thing_is_seen_from_outside_and_a_room_from_inside),
        cmocka_unit_test(what_is_open_is_seen_from_outside),
        cmocka_unit_test(all_of_it_is_in_images_of_any_shape),
        cmocka_unit_test(what_stands_over_is_in_it),
        cmocka_unit_test(heights_that_mean_none_do_not_count),
        cmocka_unit_test(a_collection_is_seen_as_a_pack_is),
        cmocka_unit_test(what_faces_somewhere_is_seen_from_there),
        cmocka_unit_test(as_wide_as_coordinates_go),
        cmocka_unit_test(a_quantile_is_that_of_sorted_values),
        cmocka_unit_test(what_is_said_stands),
        cmocka_unit_test(what_is_said_wrongly_is_refused_by_name),
        cmocka_unit_test(views_along_up_are_refused_at_once),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
