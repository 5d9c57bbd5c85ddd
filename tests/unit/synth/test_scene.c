/* Rays against closed forms, the hierarchy against every primitive, and what scenes promise other tests. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/memory.h"
#include "cloud/views.h"
#include "synth/build.h"
#include "synth/random.h"
#include "synth/synth.h"
#include "geom/vector.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static struct spl_scene *courtyard(void)
{
    struct spl_scene *scene = NULL;
    struct spl_error err = {0};
    assert_int_equal(spl_scene_create("courtyard", &scene, &err), 0);
    return scene;
}

/* t of the hit, NAN for a miss. */
static double hit(const struct spl_scene *scene, const double o[3], const double d[3])
{
    double t = INFINITY;
    return spl_primitive_hit(&scene->primitives[scene->primitive_count - 1], o, d, &t) ? t : NAN;
}

static void unbuild(struct spl_scene *scene)
{
    free(scene->primitives);
    free(scene->objects);
    free(scene->stations);
}

static void plane_shapes_end_where_they_should(void **state)
{
    (void)state;
    struct spl_scene s = {0};
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1}, down[3] = {0, 0, -1}, twice_down[3] = {0, 0, -2};
    spl_build_rectangle(&s, (struct spl_skin){0}, (double[3]){1, 2, 3}, x, y, (double[2]){0.5, 0.25}, NULL);
    assert_near(hit(&s, (double[3]){1, 2, 7}, down), 4, 1e-15);
    assert_near(hit(&s, (double[3]){1, 2, 7}, twice_down), 2, 1e-15);
    assert_near(hit(&s, (double[3]){1, 2, 0}, z), 3, 1e-15); /* from behind */
    assert_near(hit(&s, (double[3]){1.499999, 2.249999, 4}, down), 1, 1e-15);
    assert_true(isnan(hit(&s, (double[3]){1.500001, 2, 4}, down)));
    assert_true(isnan(hit(&s, (double[3]){1, 2.250001, 4}, down)));
    assert_true(isnan(hit(&s, (double[3]){1, 2, 4}, z))); /* behind the origin */
    assert_true(isnan(hit(&s, (double[3]){0, 2, 4}, x))); /* parallel */
    assert_true(isnan(hit(&s, (double[3]){0, 2, 3}, x))); /* in the plane */
    spl_build_disc(&s, (struct spl_skin){0}, (double[3]){1, 2, 3}, (double[3]){0, 0, 5}, 0.5);
    assert_near(hit(&s, (double[3]){1.3, 2.39, 7}, down), 4, 1e-15);
    assert_true(isnan(hit(&s, (double[3]){1.4, 2.4, 7}, down)));
    unbuild(&s);
}

static void round_shapes_are_exact_from_near_and_far(void **state)
{
    (void)state;
    struct spl_scene s = {0};
    const double x[3] = {1, 0, 0};
    spl_build_sphere(&s, (struct spl_skin){0}, (double[3]){10, 0, 0}, 0.75);
    assert_near(hit(&s, (double[3]){0}, x), 9.25, 1e-14);
    assert_near(hit(&s, (double[3]){10, 0, 0}, x), 0.75, 1e-14); /* from inside */
    assert_near(hit(&s, (double[3]){0, 0.6, 0}, x), 10 - 0.45, 1e-14);
    assert_true(isnan(hit(&s, (double[3]){0, 0.7500001, 0}, x)));
    assert_true(isnan(hit(&s, (double[3]){11, 0, 0}, x)));
    assert_near(hit(&s, (double[3]){-1e6, 0.6, 0}, x), 1e6 + 9.55, 1e-9);

    spl_build_cone(&s, (struct spl_skin){0}, (double[3]){10, 0, -1}, (double[3]){10, 0, 1}, 0.004, 0.004);
    assert_near(hit(&s, (double[3]){0, 0.0024, 0.5}, x), 10 - 0.0032, 1e-12);
    assert_near(hit(&s, (double[3]){-1e6, 0.0024, 0.5}, x), 1e6 + 10 - 0.0032, 1e-9);
    assert_near(hit(&s, (double[3]){10, 0, 0}, x), 0.004, 1e-12);
    assert_true(isnan(hit(&s, (double[3]){0, 0, 1.001}, x)));                  /* beyond its end */
    assert_true(isnan(hit(&s, (double[3]){10, 0, -5}, (double[3]){0, 0, 1}))); /* through the open ends */
    assert_true(isnan(hit(&s, (double[3]){10.003, 0, -5}, (double[3]){0, 0, 1})));

    spl_build_cone(&s, (struct spl_skin){0}, (double[3]){10, 0, 0}, (double[3]){10, 0, 4}, 2, 0);
    assert_near(hit(&s, (double[3]){0, 0, 1}, x), 8.5, 1e-14);
    assert_near(hit(&s, (double[3]){0, 0, 3}, x), 9.5, 1e-14);
    assert_true(isnan(hit(&s, (double[3]){0, 0, 4.5}, x))); /* not its mirror image above the tip */
    assert_near(hit(&s, (double[3]){11, 0, 9}, (double[3]){0, 0, -1}), 7, 1e-14);
    double normal[3];
    spl_primitive_normal(&s.primitives[s.primitive_count - 1], (double[3]){8.5, 0, 1}, normal);
    assert_near(normal[0], -2 / sqrt(5), 1e-15);
    assert_near(normal[2], 1 / sqrt(5), 1e-15);
    unbuild(&s);
}

static void hits_lie_on_tilted_surfaces_and_in_their_boxes(void **state)
{
    (void)state;
    uint64_t random = 9;
    int hits = 0;
    for (int n = 0; n < 4000; n++) {
        struct spl_scene s = {0};
        double a[3], b[3], o[3], d[3], at[3], normal[3], from[3], bounds[2][3], t = INFINITY;
        for (int i = 0; i < 3; i++) {
            a[i] = random_between(&random, -1, 1);
            b[i] = random_between(&random, -1, 1);
            o[i] = random_between(&random, -5, 5);
        }
        double first = random_between(&random, 0.1, 1), last = random_between(&random, 0.1, 1);
        switch (n % 3) {
        case 0:
            spl_build_cone(&s, (struct spl_skin){0}, a, b, first, last);
            break;
        case 1:
            spl_build_sphere(&s, (struct spl_skin){0}, a, first);
            break;
        case 2:
            spl_build_disc(&s, (struct spl_skin){0}, a, b, first);
            break;
        }
        const struct spl_primitive *p = &s.primitives[0];
        for (int i = 0; i < 3; i++)
            d[i] = a[i] + 0.7 * random_between(&random, -1, 1) - o[i];
        spl_primitive_bounds(p, bounds);
        if (spl_primitive_hit(p, o, d, &t)) {
            hits++;
            mad3(o, t, d, at);
            spl_primitive_normal(p, at, normal);
            assert_near(dot3(normal, normal), 1, 1e-12);
            for (int i = 0; i < 3; i++)
                assert_true(at[i] >= bounds[0][i] && at[i] <= bounds[1][i]);
            sub3(at, p->center, from);
            double along = dot3(from, p->normal), across = sqrt(fmax(0, dot3(from, from) - along * along));
            if (n % 3 == 0) {
                assert_near(across, first + (last - first) * along / p->length, 1e-9);
                double generator[3], slope = (last - first) / p->length; /* from the base circle through the hit */
                for (int i = 0; i < 3; i++)
                    generator[i] = p->normal[i] + slope * (from[i] - along * p->normal[i]) / across;
                assert_near(dot3(normal, generator), 0, 1e-9);
            } else if (n % 3 == 1) {
                assert_near(sqrt(dot3(from, from)), first, 1e-12);
            } else {
                assert_near(along, 0, 1e-9);
                assert_true(across <= first);
            }
        }
        unbuild(&s);
    }
    assert_true(hits > 1000);
}

static void hierarchy_agrees_with_every_primitive(void **state)
{
    (void)state;
    struct spl_scene *scene = courtyard();
    uint64_t random = 77;
    for (int n = 0; n < 3000; n++) {
        double o[3] = {random_between(&random, -12, 12), random_between(&random, -10, 10),
                       random_between(&random, 0, 9)};
        double d[3] = {random_between(&random, -1, 1), random_between(&random, -1, 1), random_between(&random, -1, 1)};
        switch (n % 8) { /* the awkward ones: parallel to the axes, in a wall's or the ground's plane, from far away */
        case 0:
            d[n / 8 % 3] = 0;
            break;
        case 1:
            d[0] = d[1] = 0;
            break;
        case 2:
            o[2] = 0;
            d[2] = 0;
            break;
        case 3:
            o[1] = 8;
            d[1] = 0;
            break;
        case 4:
            for (int i = 0; i < 3; i++)
                o[i] -= 1e4 * d[i];
            break;
        default:
            break;
        }
        double t = INFINITY, expected = INFINITY;
        uint32_t index;
        for (size_t i = 0; i < scene->primitive_count; i++)
            spl_primitive_hit(&scene->primitives[i], o, d, &expected);
        bool found = spl_bvh_hit(scene->nodes, scene->primitives, o, d, &t, &index);
        assert_int_equal(found, isfinite(expected));
        assert_true(t == expected);
    }
    spl_scene_destroy(scene);
}

static void landmarks_are_where_tests_look_for_them(void **state)
{
    (void)state;
    struct spl_scene *scene = courtyard();
    struct spl_hit h;
    assert_true(spl_scene_hit(scene, (double[3]){2.5, -6, 1.6}, (double[3]){0, 2, 0}, &h));
    assert_int_equal(h.id, spl_scene_find_object(scene, "sphere"));
    assert_near(h.t, (4.5 - 0.75) / 2, 1e-12);
    assert_near(h.normal[1], -1, 1e-12);
    assert_true(spl_scene_hit(scene, (double[3]){0, 3.5, 1.7}, (double[3]){-1, 0, 0}, &h));
    assert_int_equal(h.id, spl_scene_find_object(scene, "red-panel"));
    assert_memory_equal(h.color, ((uint8_t[3]){255, 0, 0}), 3);
    assert_near(h.position[0], -9.94, 1e-12);
    assert_true(spl_scene_hit(scene, (double[3]){0, 0, 1.7}, (double[3]){0, 0, -1}, &h));
    assert_int_equal(h.id, spl_scene_find_object(scene, "ground"));
    assert_near(h.normal[2], 1, 0);
    assert_true(spl_scene_hit(scene, (double[3]){0, 0, -1}, (double[3]){0, 0, 1}, &h)); /* from below: normal turned */
    assert_near(h.normal[2], -1, 0);
    assert_false(spl_scene_hit(scene, (double[3]){0, 0, 1.7}, (double[3]){0, 0, 1}, &h));
    assert_int_equal(spl_scene_find_object(scene, "unicorn"), UINT32_MAX);
    uint64_t random = 5;
    for (int n = 0; n < 20000; n++) { /* no gaps between the parts of the façades */
        double azimuth = random_between(&random, 0, 2 * M_PI);
        double d[3] = {cos(azimuth), sin(azimuth), random_between(&random, -0.5, 0.4)};
        assert_true(spl_scene_hit(scene, (double[3]){0, 0.3, 1.7}, d, &h));
        assert_true(fabs(h.position[0]) < 10.3 && fabs(h.position[1]) < 8.3);
    }
    spl_scene_destroy(scene);
}

static void stations_stand_free_and_upright(void **state)
{
    (void)state;
    struct spl_scene *scene = courtyard();
    assert_int_equal(scene->station_count, 4);
    for (size_t i = 0; i < scene->station_count; i++) {
        const struct spl_station *s = &scene->stations[i];
        struct spl_hit h;
        uint64_t random = i;
        double x[3], y[3], z[3];
        for (int a = 0; a < 3; a++) {
            x[a] = s->rotation[3 * a];
            y[a] = s->rotation[3 * a + 1];
            z[a] = s->rotation[3 * a + 2];
        }
        double cross[3];
        cross3(x, y, cross);
        for (int a = 0; a < 3; a++)
            assert_near(cross[a], z[a], 1e-15);
        assert_true(z[2] > 0.999 && z[2] < 0.99999);
        for (int n = 0; n < 2000; n++) {
            double d[3];
            for (int a = 0; a < 3; a++)
                d[a] = random_between(&random, -1, 1);
            normalise3(d);
            assert_true(!spl_scene_hit(scene, s->position, d, &h) || h.t > 0.5);
        }
    }
    spl_scene_destroy(scene);
}

/* Along a line on each wall and the ground: colours change, by little at a time, and not with a period. */
static void textures_are_band_limited_and_do_not_repeat(void **state)
{
    (void)state;
    struct spl_scene *scene = courtyard();
    const struct {
        const char *object;
        double eye[3], toward[3], along[3];
        double period;
    } lines[] = {
        {"facade-north", {-9, 5, 3.3}, {0, 1, 0}, {1, 0, 0}, 0.25},
        {"facade-east", {9.5, 5, 3.9}, {1, 0, 0}, {0, -1, 0}, 1.4},
        {"facade-south", {6, -5, 3.4}, {0, -1, 0}, {-1, 0, 0}, 0.9},
        {"facade-west", {-9, -5, 3.4}, {-1, 0, 0}, {0, 1, 0}, 0.4},
        {"ground", {-8, -3.3, 1}, {0, 0, -1}, {1, 0, 0}, 0.6},
    };
    const double step = 0.0002;
    enum { steps = 10000 };
    uint8_t(*colors)[3] = calloc(steps, sizeof *colors);
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        int distinct = 0, repeated = 0;
        size_t period = (size_t)llround(lines[i].period / step);
        for (size_t k = 0; k < steps; k++) {
            struct spl_hit h;
            double o[3];
            mad3(lines[i].eye, (double)k * step, lines[i].along, o);
            assert_true(spl_scene_hit(scene, o, lines[i].toward, &h));
            assert_string_equal(scene->objects[h.id], lines[i].object);
            memcpy(colors[k], h.color, 3);
            for (int c = 0; k && c < 3; c++)
                assert_true(abs(colors[k][c] - colors[k - 1][c]) <= 12);
            distinct += k && memcmp(colors[k], colors[k - 1], 3);
            repeated += k >= period && !memcmp(colors[k], colors[k - period], 3);
        }
        assert_true(distinct > 100);
        assert_true(repeated < steps / 4);
    }
    free(colors);
    spl_scene_destroy(scene);
}

/* Whether all of a ball of that radius around the point is empty, by `rays` rays. */
static bool is_free(const struct spl_scene *scene, const double at[3], double radius, int rays)
{
    uint64_t random = 31;
    for (int n = 0; n < rays; n++) {
        double d[3];
        struct spl_hit h;
        for (int a = 0; a < 3; a++)
            d[a] = random_between(&random, -1, 1);
        normalise3(d);
        if (spl_scene_hit(scene, at, d, &h) && h.t < radius)
            return false;
    }
    return true;
}

/* The share of a 16:9 view that shows a surface. */
static double surface_share(const struct spl_scene *scene, const struct spl_named_camera *c)
{
    double forward[3], right[3], above[3], tall = tan(c->fov * M_PI / 360);
    int hits = 0;
    sub3(c->target, c->eye, forward);
    normalise3(forward);
    cross3(forward, (double[3]){0, 0, 1}, right);
    assert_true(normalise3(right) > 0.01); /* not straight up or down */
    cross3(right, forward, above);
    for (int i = 0; i < 32 * 18; i++) {
        double d[3], x = ((i % 32 + 0.5) / 16 - 1) * tall * 16 / 9, y = ((i / 32 + 0.5) / 9 - 1) * tall;
        struct spl_hit h;
        mad3(forward, x, right, d);
        mad3(d, y, above, d);
        hits += spl_scene_hit(scene, c->eye, d, &h);
    }
    return hits / (32.0 * 18);
}

/* A wall's inside is a wall, too: a camera or station in a box would see it from within. The nearest surface seen from
 * a free place is seen from its outside, where it has one: that of boxes, cones and spheres. */
static void every_scene_keeps_its_promises(void **state)
{
    (void)state;
    size_t count = 0;
    for (; spl_synth_scene_name(count); count++) {
        struct spl_scene *scene = NULL;
        const char *name = spl_synth_scene_name(count);
        assert_int_equal(spl_scene_create(name, &scene, NULL), 0);
        assert_true(strlen(spl_synth_scene_help(count)) > 20);
        assert_int_equal(scene->camera_count, 8);
        assert_true(scene->station_count >= 1 && scene->scanner.returns >= 1);
        assert_true(scene->scanner.noise > 0 && scene->scanner.aperture > 0 && scene->scanner.range > 0);
        for (size_t i = 0; i < scene->object_count; i++) {
            assert_int_equal(spl_scene_find_object(scene, scene->objects[i]), i); /* names are unique */
            bool used = false;
            for (size_t p = 0; p < scene->primitive_count && !used; p++)
                used = scene->primitives[p].object == i;
            if (!used)
                fail_msg("%s has nothing of object %s", name, scene->objects[i]);
        }
        for (size_t i = 0; i < scene->camera_count; i++) {
            const struct spl_named_camera *c = &scene->cameras[i];
            double share = surface_share(scene, c);
            if (share < 0.3 || !is_free(scene, c->eye, 0.1, 2000))
                fail_msg("%s: camera %s sees %.2f surface, or stands in something", name, c->name, share);
            for (size_t k = 0; k < i; k++)
                assert_string_not_equal(c->name, scene->cameras[k].name);
        }
        for (size_t i = 0; i < scene->station_count && scene->scanner.kind == SPL_SCANNER_TERRESTRIAL; i++)
            if (!is_free(scene, scene->stations[i].position, 0.4, 2000))
                fail_msg("%s: station %zu stands in something", name, i);
        for (int a = 0; a < 3; a++)
            assert_true(scene->offset[a] == floor(scene->offset[a]));
        spl_scene_destroy(scene);
    }
    assert_true(count >= 8);
    assert_null(spl_synth_scene_help(count));
}

/* What is thin, sparse or at fault by design is where its scene says. */
static void special_places_are_what_they_claim(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    struct spl_hit front, back, h;
    assert_int_equal(spl_scene_create("thin-walls", &scene, NULL), 0);
    const double x[4] = {-4.5, -1.5, 1.5, 4.5}, gaps[4] = {0.005, 0.01, 0.02, 0.05};
    for (int i = 0; i < 4; i++) {
        assert_true(spl_scene_hit(scene, (double[3]){x[i], -0.5, 1}, (double[3]){0, 1, 0}, &front));
        assert_true(spl_scene_hit(scene, (double[3]){x[i], 0.5, 1}, (double[3]){0, -1, 0}, &back));
        assert_near(back.position[1] - front.position[1], gaps[i], 1e-12);
        assert_true(front.color[0] > front.color[2] && back.color[2] > back.color[0]);
    }
    /* Along the middle sheet's plane there is nothing of it. */
    assert_true(spl_scene_hit(scene, (double[3]){0, -4.6, 1.2}, (double[3]){0, 1, 0}, &h));
    assert_string_not_equal(scene->objects[h.id], "sheets");
    spl_scene_destroy(scene);

    assert_int_equal(spl_scene_create("steps", &scene, NULL), 0);
    const double risers[10] = {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1};
    for (int i = 0; i < 10; i++)
        for (int k = 0; k < 3; k++) { /* from above onto the middle of each tread */
            double from[3] = {-6.75 + 1.5 * i, 3.2 - 0.35 * (2.5 - k), 9};
            assert_true(spl_scene_hit(scene, from, (double[3]){0, 0, -1}, &h));
            assert_near(h.position[2], risers[i] * (k + 1), 1e-12);
        }
    spl_scene_destroy(scene);

    assert_int_equal(spl_scene_create("railway", &scene, NULL), 0);
    assert_true(spl_scene_hit(scene, (double[3]){39, 1.5, 3}, (double[3]){0, 0, 1}, &h)); /* under the bridge */
    assert_string_equal(scene->objects[h.id], "bridge");
    assert_near(h.position[2], 7.55, 1e-9);
    assert_true(spl_scene_hit(scene, (double[3]){0, 0, 1}, (double[3]){0, 0.7525, -1}, &h)); /* gauge over its height */
    assert_string_equal(scene->objects[h.id], "rails");
    spl_scene_destroy(scene);

    assert_int_equal(spl_scene_create("interior", &scene, NULL), 0);
    uint64_t random = 3;
    for (int n = 0; n < 20000; n++) { /* tight: no ray leaves */
        double d[3], at[3] = {n % 2 ? 2.4 : 8, n % 2 ? 1.6 : 2.6, 1.3};
        for (int a = 0; a < 3; a++)
            d[a] = random_between(&random, -1, 1);
        assert_true(spl_scene_hit(scene, at, d, &h));
    }
    spl_scene_destroy(scene);
}

static void views_are_printed_in_world_coordinates(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_view_list list;
    struct spl_scene *scene = NULL;
    char path[] = "/tmp/splatd-views-XXXXXX", *json = NULL;
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(spl_synth_print_views("powerline", 320, 200, &json, &err), 0);
    assert_int_equal(write(fd, json, strlen(json)), strlen(json));
    close(fd);
    free(json);
    if (spl_view_list_load(&list, path, &err))
        fail_msg("%s", err.message);
    unlink(path);
    assert_int_equal(spl_scene_create("powerline", &scene, NULL), 0);
    assert_int_equal(list.count, scene->camera_count);
    for (size_t i = 0; i < list.count; i++) {
        const struct spl_named_camera *c = &scene->cameras[i];
        assert_string_equal(list.views[i].name, c->name);
        assert_int_equal(list.views[i].camera.width, 320);
        assert_int_equal(list.views[i].camera.height, 200);
        assert_near(list.views[i].camera.fy, 100 / tan(c->fov * M_PI / 360), 1e-9);
        double target[3], pixel[2], depth;
        for (int a = 0; a < 3; a++) {
            assert_true(list.views[i].camera.eye[a] == c->eye[a] + scene->offset[a]);
            target[a] = c->target[a] + scene->offset[a];
        }
        assert_true(spl_camera_project(&list.views[i].camera, target, pixel, &depth));
        assert_near(pixel[0], 160, 1e-6);
        assert_near(pixel[1], 100, 1e-6);
    }
    spl_scene_destroy(scene);
    spl_view_list_finish(&list);
    assert_int_equal(spl_synth_print_views("powerline", 0, 200, &json, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "size");
    err = (struct spl_error){0};
    assert_int_equal(spl_synth_print_views("nowhere", 320, 200, &json, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "scene");
}

static void objects_have_classes(void **state)
{
    (void)state;
    static const struct {
        const char *object;
        int class;
    } rows[] = {
        {"leaves", 5},         {"oak-branches", 5}, {"ground", 2},      {"ground-wire", 13}, {"contact-wires", 14},
        {"facade-north", 6},   {"field-rape", 2},   {"sphere", 1},      {"underground", 1},  {"wallpaper", 1},
        {"study-ceiling", 64}, {"chair-2", 65},     {"study-walls", 6}, {"pylon-1", 15},     {"", 1}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if (spl_scene_class(rows[i].object) != rows[i].class)
            fail_msg("%s is of class %d", rows[i].object, spl_scene_class(rows[i].object));
}

/* Whatever is left is where it was, and behind what is gone one sees on. */
static void parts_of_scenes(void **state)
{
    (void)state;
    struct spl_scene *all = NULL, *bare = NULL, *crown = NULL, *same = NULL;
    struct spl_error err = {0};
    assert_int_equal(spl_scene_create("courtyard", &all, NULL), 0);
    assert_int_equal(spl_scene_create_part("courtyard", "class:5", NULL, &bare, NULL), 0);
    assert_int_equal(spl_scene_create_part("courtyard", NULL, "leaves,branches", &crown, NULL), 0);
    assert_int_equal(bare->primitive_count + crown->primitive_count, all->primitive_count);
    assert_int_equal(spl_scene_create_part("courtyard", "wires", "class:5,class:14", &same, NULL), 0);
    assert_int_equal(same->primitive_count, crown->primitive_count);
    const uint32_t leaves = spl_scene_find_object(all, "leaves"), branches = spl_scene_find_object(all, "branches");
    const double eye[3] = {-1, 0.1, 1.6};
    size_t green = 0;
    for (int i = 0; i < 400; i++) {
        const double to[3] = {-4 + 0.1 * (i % 20 - 10) - eye[0], 2.6 - eye[1], 3.3 + 0.1 * (i / 20 - 10) - eye[2]};
        struct spl_hit a = {0}, b = {0}, c = {0};
        bool whole = spl_scene_hit(all, eye, to, &a), without = spl_scene_hit(bare, eye, to, &b);
        bool only = spl_scene_hit(crown, eye, to, &c);
        assert_true(whole == (without || only));
        assert_true(!without || (b.id != leaves && b.id != branches));
        assert_true(!only || c.id == leaves || c.id == branches);
        const struct spl_hit *nearest = only && (!without || c.t < b.t) ? &c : &b;
        assert_true(!whole || (a.t == nearest->t && a.id == nearest->id && !memcmp(a.color, nearest->color, 3)));
        green += only && without && c.t < b.t;
    }
    assert_true(green > 100);
    spl_scene_destroy(all);
    spl_scene_destroy(bare);
    spl_scene_destroy(crown);
    spl_scene_destroy(same);
    static const struct {
        const char *without, *only, *field, *word;
    } wrong[] = {{"unicorn", NULL, "without", "facade-north"}, {NULL, "leaves,", "only", "''"},
                 {"class:99", NULL, "without", "class:99"},     {"class:", NULL, "without", "class:"},
                 {"class: 5", NULL, "without", "class: 5"},     {NULL, "class:5x", "only", "class:5x"},
                 {"leaves", "leaves", "only", "nothing"},       {"", NULL, "without", "''"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct spl_scene *none = NULL;
        err = (struct spl_error){0};
        assert_int_equal(spl_scene_create_part("courtyard", wrong[i].without, wrong[i].only, &none, &err), SPL_E_USAGE);
        assert_null(none);
        assert_string_equal(err.field, wrong[i].field);
        if (!strstr(err.message, wrong[i].word))
            fail_msg("'%s' does not say '%s'", err.message, wrong[i].word);
    }
}

static void unknown_scenes_and_refused_memory_are_errors(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("nowhere", &scene, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "scene");
    assert_non_null(strstr(err.message, "courtyard"));
    for (long n = 1;; n++) {
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int result = spl_scene_create_part("railway", "rails", NULL, &scene, &err);
        spl_memory_fail_after(0);
        if (!result)
            break;
        assert_int_equal(result, SPL_E_NOMEM);
        assert_int_equal(err.code, SPL_E_NOMEM);
        assert_null(scene);
    }
    spl_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plane_shapes_end_where_they_should),
        cmocka_unit_test(round_shapes_are_exact_from_near_and_far),
        cmocka_unit_test(hits_lie_on_tilted_surfaces_and_in_their_boxes),
        cmocka_unit_test(hierarchy_agrees_with_every_primitive),
        cmocka_unit_test(landmarks_are_where_tests_look_for_them),
        cmocka_unit_test(stations_stand_free_and_upright),
        cmocka_unit_test(textures_are_band_limited_and_do_not_repeat),
        cmocka_unit_test(every_scene_keeps_its_promises),
        cmocka_unit_test(special_places_are_what_they_claim),
        cmocka_unit_test(views_are_printed_in_world_coordinates),
        cmocka_unit_test(objects_have_classes),
        cmocka_unit_test(parts_of_scenes),
        cmocka_unit_test(unknown_scenes_and_refused_memory_are_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
