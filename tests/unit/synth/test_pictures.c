/* Exact pictures as files: read back by the readers that others use, poses that mean what the pixels show, and nothing
 * half-written. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

#include <jansson.h>

#include "base/memory.h"
#include "image/load.h"
#include "support/folder.h"
#include "support/sanitised.h"
#include "synth/exact.h"
#include "synth/photos.h"
#include "synth/pictures.h"
#include "synth/synth.h"
#include "geom/vector.h"

#define assert_near(a, b, tolerance) assert_true(fabs((double)(a) - (double)(b)) <= (tolerance))


static struct spl_pictures_options options_for(const char *directory)
{
    return (struct spl_pictures_options){.scene = "courtyard",
                                         .directory = directory,
                                         .photo_width = 64,
                                         .photo_height = 48,
                                         .samples = 2,
                                         .seed = 1,
                                         .threads = 2};
}

static void write_pictures(const struct spl_pictures_options *o)
{
    struct spl_error err = {0};
    if (spl_pictures_write(o, &err))
        fail_msg("%s: %s", err.field, err.message);
}

static struct spl_image load(const char *path, enum spl_layer layer)
{
    struct spl_image image;
    struct spl_error err = {0};
    if (spl_image_load(path, layer, &image, &err))
        fail_msg("%s", err.message);
    return image;
}

/* A view of the courtyard's overview camera, small. */
static struct spl_named_view small_view(void)
{
    static char name[] = "small";
    struct spl_named_view view = {.name = name, .camera = {.near = 0.01, .far = INFINITY}};
    spl_camera_set_fov(&view.camera, 70, 64, 36, NULL);
    spl_camera_look_at(&view.camera, (double[3]){-9.3, -7.3, 1.7}, (double[3]){3, 2, 1.9}, (double[3]){0, 0, 1}, NULL);
    return view;
}

static void truth_reads_back_and_threads_do_not_matter(void **state)
{
    (void)state;
    struct spl_named_view view = small_view();
    const struct spl_view_list views = {.views = &view, .count = 1};
    struct spl_scene *scene = NULL;
    struct spl_image images[SPL_LAYER_COUNT];
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    for (unsigned threads = 1; threads <= 2; threads++) {
        struct spl_pictures_options o = options_for(in_folder("truth"));
        o.views = &views;
        o.threads = threads;
        write_pictures(&o);
        assert_int_equal(folder_count(in_folder("truth/truth")), 5);
        assert_int_equal(spl_exact_render(scene, &view.camera, o.samples, 1, images, NULL), 0);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            if (!images[layer].pixels)
                continue;
            char name[64];
            snprintf(name, sizeof name, "truth/truth/small.%s.%s", spl_layer_name(layer), layer ? "npy" : "png");
            struct spl_image read = load(in_folder(name), layer);
            assert_int_equal(read.width, 64);
            assert_int_equal(read.height, 36);
            assert_memory_equal(read.pixels, images[layer].pixels, 64 * 36 * spl_pixel_bytes(images[layer].type));
            spl_image_finish(&read);
            spl_image_finish(&images[layer]);
        }
    }
    spl_scene_destroy(scene);
}

/* Photographs read back as views are the cameras that took them: a place in the world falls on the pixel that shows it.
 */
static void photographs_have_the_poses_of_their_model(void **state)
{
    (void)state;
    enum { count = 9 };
    struct spl_pictures_options o = options_for(in_folder("photos"));
    o.photos = count;
    write_pictures(&o);
    struct spl_view_list views;
    struct spl_error err = {0};
    if (spl_view_list_load(&views, in_folder("photos/photos/sparse/0"), &err))
        fail_msg("%s", err.message);
    assert_int_equal(views.count, count);
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    for (size_t i = 0; i < count; i++) {
        const struct spl_camera camera = views.views[i].camera, taken = spl_photo_place(scene, 1, i, 64, 48);
        for (int k = 0; k < 9; k++)
            assert_near(camera.rotation[k], taken.rotation[k], 1e-14);
        for (int k = 0; k < 3; k++)
            assert_near(camera.eye[k], taken.eye[k], 1e-12);
        assert_true(camera.fx == taken.fx && camera.cx == taken.cx && camera.width == 64);
        struct spl_image picture = load(views.views[i].photograph, SPL_LAYER_COLOR), images[SPL_LAYER_COUNT];
        assert_int_equal(spl_exact_render(scene, &camera, 2, 1, images, NULL), 0);
        const float *depth = images[SPL_LAYER_DEPTH].pixels;
        size_t seen = 0, same = 0;
        for (uint32_t at = 0; at < 64 * 48; at++) {
            const uint8_t *a = (uint8_t *)picture.pixels + 4 * at, *b = (uint8_t *)images[0].pixels + 4 * at;
            same += !memcmp(a, b, 4);
            if (isnan(depth[at]))
                continue;
            double x = at % 64 + 0.5, y = at / 64 + 0.5, world[3], pixel[2],
                   back; /* the place, by camera.h's formula */
            double local[3] = {(x - taken.cx) / taken.fx, (y - taken.cy) / taken.fy, 1};
            for (int k = 0; k < 3; k++)
                world[k] =
                    taken.eye[k] + (double)depth[at] * (taken.rotation[k] * local[0] +
                                                        taken.rotation[3 + k] * local[1] + taken.rotation[6 + k]);
            assert_true(spl_camera_project(&camera, world, pixel, &back));
            assert_near(pixel[0], x, 0.01);
            assert_near(pixel[1], y, 0.01);
            seen++;
        }
        assert_true(seen > 64 * 48 / 10);
        assert_true(same > 64 * 48 * 99 / 100); /* a pose that differs by rounding may move a sample over an edge */
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
            spl_image_finish(&images[layer]);
        spl_image_finish(&picture);
    }
    spl_scene_destroy(scene);
    spl_view_list_finish(&views);
}

/* The red panel of the courtyard, whose place other tests fix as well: 1.5 x 1 m around (-9.94, 3.5, 1.7). */
static void a_marked_place_is_where_the_ids_show_it(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    struct spl_image images[SPL_LAYER_COUNT];
    struct spl_camera camera = {.near = 0.01, .far = INFINITY};
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    uint32_t panel = spl_scene_find_object(scene, "red-panel");
    spl_camera_set_fov(&camera, 20, 400, 300, NULL);
    spl_camera_look_at(&camera, (double[3]){-3, 2.9, 1.4}, (double[3]){-9.94, 3.5, 1.7}, (double[3]){0, 0, 1}, NULL);
    assert_int_equal(spl_exact_render(scene, &camera, 1, 2, images, NULL), 0);
    const uint32_t *id = images[SPL_LAYER_ID].pixels;
    const double corners[4][3] = {{-9.94, 2.75, 1.2}, {-9.94, 4.25, 1.2}, {-9.94, 2.75, 2.2}, {-9.94, 4.25, 2.2}};
    for (int i = 0; i < 4; i++) {
        double pixel[2], depth;
        int found = 0;
        assert_true(spl_camera_project(&camera, corners[i], pixel, &depth));
        for (int y = -4; y < 4; y++) /* the pixels around a corner are a quarter red */
            for (int x = -4; x < 4; x++)
                found += id[(long)(pixel[1] + 0.5 + y) * 400 + (long)(pixel[0] + 0.5 + x)] == panel;
        assert_in_range(found, 9, 28);
    }
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        spl_image_finish(&images[layer]);
    spl_scene_destroy(scene);
}

static void photographers_stand_free(void **state)
{
    (void)state;
    skip_under_tsan();
    for (size_t s = 0; spl_synth_scene_name(s); s++) {
        struct spl_scene *scene = NULL;
        assert_int_equal(spl_scene_create(spl_synth_scene_name(s), &scene, NULL), 0);
        for (size_t i = 0; i < 24; i++) {
            struct spl_camera camera = spl_photo_place(scene, 7, i, 90, 60), again = camera;
            assert_int_equal(spl_camera_check(&camera, NULL), 0);
            again = spl_photo_place(scene, 7, i, 90, 60);
            assert_memory_equal(&camera, &again, sizeof camera);
            double eye[3];
            sub3(camera.eye, scene->offset, eye);
            for (int k = 0; k < 6; k++) {
                struct spl_hit hit;
                double direction[3] = {0};
                direction[k / 2] = k % 2 ? 1 : -1;
                assert_true(!spl_scene_hit(scene, eye, direction, &hit) || hit.t > 0.1);
            }
        }
        spl_scene_destroy(scene);
    }
}

/* The second pose of the list is the second station's, to the bit. */
static void check_pose(const struct spl_scene *scene)
{
    const struct spl_station *station = &scene->stations[1];
    json_t *json = json_load_file(in_folder("panoramas/panoramas/panoramas.json"), 0, NULL);
    json_t *list = json_object_get(json, "panoramas"), *pose = json_array_get(list, 1);
    assert_true(json_is_string(json_object_get(json, "mapping")));
    assert_int_equal(json_array_size(list), scene->station_count);
    assert_string_equal(json_string_value(json_object_get(pose, "name")), "station-2");
    assert_string_equal(json_string_value(json_object_get(pose, "color")), "station-2.color.png");
    assert_string_equal(json_string_value(json_object_get(pose, "range")), "station-2.range.npy");
    assert_int_equal(json_integer_value(json_object_get(pose, "width")), 256);
    assert_int_equal(json_integer_value(json_object_get(pose, "height")), 128);
    for (size_t i = 0; i < 3; i++)
        assert_true(json_number_value(json_array_get(json_object_get(pose, "position"), i)) ==
                    station->position[i] + scene->offset[i]);
    assert_int_equal(json_array_size(json_object_get(pose, "rotation")), 9);
    for (size_t i = 0; i < 9; i++)
        assert_true(json_number_value(json_array_get(json_object_get(pose, "rotation"), i)) == station->rotation[i]);
    json_decref(json);
}

static void panoramas_come_with_poses(void **state)
{
    (void)state;
    struct spl_pictures_options o = options_for(in_folder("panoramas"));
    o.panorama_width = 256;
    write_pictures(&o);
    assert_int_equal(folder_count(in_folder("panoramas/panoramas")), 9); /* four stations, one list */
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    check_pose(scene);
    struct spl_image color = load(in_folder("panoramas/panoramas/station-2.color.png"), SPL_LAYER_COLOR);
    struct spl_image range = load(in_folder("panoramas/panoramas/station-2.range.npy"), SPL_LAYER_RANGE);
    assert_int_equal(color.width, 256);
    assert_int_equal(color.height, 128);
    /* Straight down through the nadir lies the ground, as far below as the tripod is high. */
    const struct spl_station *station = &scene->stations[1];
    double direction[3], place[2], down[3] = {0, 0, -1};
    struct spl_lens lens = spl_lens_of_panorama(station->position, station->rotation, 256);
    assert_true(spl_lens_place(&lens, down, place));
    size_t at = (size_t)place[1] * 256 + (size_t)place[0];
    assert_near(((float *)range.pixels)[at], station->position[2], 0.01);
    /* The red panel is red where the formula says that it is. */
    sub3((double[3]){-9.94, 3.5, 1.7}, station->position, direction);
    assert_true(spl_lens_place(&lens, direction, place));
    at = (size_t)place[1] * 256 + (size_t)place[0];
    assert_memory_equal((uint8_t *)color.pixels + 4 * at, "\xff\0\0\xff", 4);
    assert_near(((float *)range.pixels)[at], sqrt(dot3(direction, direction)), 0.2);
    spl_image_finish(&color);
    spl_image_finish(&range);
    spl_scene_destroy(scene);
}

static void what_is_wrong_is_named_and_nothing_is_written(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_named_view view = small_view();
    view.camera.width = 1u << 30;
    const struct spl_view_list views = {.views = &view, .count = 1};
    const struct {
        const char *field;
        struct spl_pictures_options o;
    } cases[] = {
        {"scene", {.scene = "nowhere", .samples = 2, .photos = 1, .photo_width = 9, .photo_height = 9}},
        {"samples", {.scene = "courtyard", .samples = 0, .panorama_width = 256}},
        {"samples", {.scene = "courtyard", .samples = 65, .panorama_width = 256}},
        {"photos", {.scene = "courtyard", .samples = 2, .photos = 10000, .photo_width = 9, .photo_height = 9}},
        {"photo-size", {.scene = "courtyard", .samples = 2, .photos = 1, .photo_width = 0, .photo_height = 9}},
        {"photo-size", {.scene = "courtyard", .samples = 2, .photos = 1, .photo_width = 1 << 20, .photo_height = 999}},
        {"panoramas", {.scene = "courtyard", .samples = 2, .panorama_width = 255}},
        {"panoramas", {.scene = "courtyard", .samples = 2, .panorama_width = 301}},
        {"panoramas", {.scene = "courtyard", .samples = 2, .panorama_width = 8194}},
        {"width", {.scene = "courtyard", .samples = 2, .views = &views, .panorama_width = 256}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_pictures_options o = cases[i].o;
        struct spl_error errors[2] = {0};
        o.directory = in_folder("nothing");
        assert_true(spl_pictures_check(&o, &errors[0]) < 0);
        assert_true(spl_pictures_write(&o, &errors[1]) < 0);
        assert_string_equal(errors[0].field, cases[i].field);
        assert_string_equal(errors[1].field, cases[i].field);
        assert_int_equal(access(in_folder("nothing"), F_OK), -1);
    }
}

/* Whatever allocation is refused: the files that are there are whole, and none is left under its temporary name. */
static void failures_leave_whole_files_only(void **state)
{
    (void)state;
    bool done = false;
    for (long n = 1; !done; n += n < 40 ? 3 : 40) {
        struct spl_pictures_options o = options_for(in_folder("refused"));
        struct spl_error err = {0};
        o.photos = 1;
        o.photo_width = o.photo_height = 16;
        spl_memory_fail_after(n);
        int result = spl_pictures_write(&o, &err);
        spl_memory_fail_after(0);
        done = !result;
        assert_true(done || (result == SPL_E_NOMEM && err.code == SPL_E_NOMEM));
        size_t images = folder_count(in_folder("refused/photos/images"));
        assert_int_equal(access(in_folder("refused/photos/images/0001.png"), F_OK) == 0, images);
        assert_true(images <= 1);
        assert_true(done == (access(in_folder("refused/photos/sparse/0/images.txt"), F_OK) == 0));
    }
    /* A file where a directory should be. */
    struct spl_pictures_options o = options_for(in_folder("refused/photos/images/0001.png"));
    struct spl_error err = {0};
    o.panorama_width = 256;
    assert_true(spl_pictures_write(&o, &err) < 0);
    assert_non_null(strstr(err.message, "0001.png"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(truth_reads_back_and_threads_do_not_matter),
        cmocka_unit_test(photographs_have_the_poses_of_their_model),
        cmocka_unit_test(a_marked_place_is_where_the_ids_show_it),
        cmocka_unit_test(photographers_stand_free),
        cmocka_unit_test(panoramas_come_with_poses),
        cmocka_unit_test(what_is_wrong_is_named_and_nothing_is_written),
        cmocka_unit_test(failures_leave_whole_files_only),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
