/* Every format of camera paths: one pose of api/cameras.md, whose world point must land on its pixel, and what each
 * reader refuses, by frame and field. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

#include "cloud/path.h"

#define POINT -0.57705449706900003, 3.3087614730900001, -1.46753054758
#define MATRIX                                                                                                         \
    "[0.78387787227503695,-0.30826946648440512,0.53898554469575628,2.5,"                                               \
    "0.60698607043454015,0.19761352719368059,-0.76975113132005719,-3.5,"                                               \
    "0.13077993598406572,0.93054759679636629,0.34202014332566873,1.75,0,0,0,1]"
#define COLMAP_Q "-0.55772847375664971 -0.76215345285486739 -0.30022022910563139 0.13389875988314353"
#define COLMAP_T "-0.06410832213881687 0.16613728300474614 4.6401280721795111"
#define EXTRINSIC                                                                                                      \
    "[0.78387787227503695,0.30826946648440512,-0.53898554469575628,0,"                                                 \
    "0.60698607043454015,-0.19761352719368059,0.76975113132005719,0,"                                                  \
    "0.13077993598406572,-0.93054759679636629,-0.34202014332566873,0,"                                                 \
    "-0.06410832213881687,0.16613728300474614,4.6401280721795111,1]"
#define TUM "10.5 2.5 -3.5 1.75 0.76215345285486739 0.30022022910563139 -0.13389875988314353 -0.55772847375664971"
#define INTRINSIC "{\"width\":640,\"height\":480,\"intrinsic_matrix\":[500,0,0,0,510,0,330.75,228,1]}"
#define OPEN3D(extrinsic, intrinsic)                                                                                   \
    "{\"class_name\":\"PinholeCameraTrajectory\",\"parameters\":[{\"extrinsic\":" extrinsic                            \
    ",\"intrinsic\":" intrinsic "}]}"
#define NERFSTUDIO(frames)                                                                                             \
    "{\"camera_type\":\"perspective\",\"render_width\":640,\"render_height\":480,\"fps\":24,\"is_cycle\":true,"        \
    "\"keyframes\":[],\"camera_path\":[" frames "]}"
#define OWN(key) "{\"keyframes\":[{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"fov\":60}}," key "]}"

static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 16 << 20};
/* Of the point through a lens with a vertical field of view of 60 degrees: (1.3, 0.7, 8) in the camera's frame. */
static const double fov_pixel[2] = {387.54998149518622, 276.37306695894642}, lens_pixel[2] = {412.5, 273.125};

static int parse(const char *text, struct spl_path_options options, struct spl_camera_path *path, struct spl_error *err)
{
    json_t *json = text[0] == '{' ? json_loads(text, JSON_REJECT_DUPLICATES, NULL) : json_string(text);
    assert_non_null(json);
    options.limits = &limits;
    *path = (struct spl_camera_path){0};
    int rc = spl_camera_path_from_json(json, &options, path, err);
    json_decref(json);
    return rc;
}

static void assert_pixel(const struct spl_camera_path *path, size_t i, double u, double v)
{
    double pixel[2], depth;
    assert_true(path->count > i);
    assert_true(spl_camera_project(&path->cameras[i], (double[3]){POINT}, pixel, &depth));
    if (fabs(pixel[0] - u) > 1e-6 || fabs(pixel[1] - v) > 1e-6 || fabs(depth - 8) > 1e-6)
        fail_msg("pixel %.17g %.17g at %.17g, wanted %.17g %.17g at 8", pixel[0], pixel[1], depth, u, v);
}

static const struct {
    const char *name, *text;
    const double *pixel;
    bool whole, closed;
    double fps;
} golden[] = {
    {"nerfstudio", NERFSTUDIO("{\"camera_to_world\":" MATRIX ",\"fov\":60,\"aspect\":1.333}"), fov_pixel, true, true,
     24},
    {"Open3D", OPEN3D(EXTRINSIC, INTRINSIC), lens_pixel, true, false, 0},
    {"COLMAP",
     "{\"cameras_txt\":\"# c\\n1 PINHOLE 640 480 500 510 331.25 228.5\\n\",\"images_txt\":\"7 " COLMAP_Q " " COLMAP_T
     " 1 a.png\\n\\n\"}",
     lens_pixel, true, false, 0},
    {"TUM", "# timestamp tx ty tz qx qy qz qw\r\n\n  " TUM "\n", fov_pixel, true, false, 0},
    {"splatd",
     "{\"frames\":[{\"camera\":{\"matrix\":" MATRIX ",\"convention\":\"opengl\",\"fx\":500,\"fy\":510,\"cx\":331.25,"
     "\"cy\":228.5},\"width\":640,\"height\":480}],\"fps\":12.5,\"closed\":1}",
     lens_pixel, true, true, 12.5},
    {"splatd, fov", "{\"keyframes\":[{\"camera\":{\"matrix\":" MATRIX ",\"convention\":\"opengl\",\"fov\":60}}]}",
     fov_pixel, false, false, 0},
    {"splatd, Open3D",
     "{\"frames\":[{\"camera\":{\"open3d\":{\"extrinsic\":" EXTRINSIC ",\"intrinsic\":" INTRINSIC "}}}]}", lens_pixel,
     true, false, 0},
};

static void test_golden_vectors(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof golden / sizeof *golden; i++) {
        struct spl_camera_path path;
        struct spl_error err = {0};
        for (int twice = 0; twice < 2; twice++) { /* the image's size scales every lens */
            struct spl_path_options options = {.width = 640u << twice, .height = 480u << twice};
            if (parse(golden[i].text, options, &path, &err))
                fail_msg("%s: %s", golden[i].name, err.message);
            assert_pixel(&path, 0, golden[i].pixel[0] * (1 << twice), golden[i].pixel[1] * (1 << twice));
            assert_int_equal(path.whole, golden[i].whole);
            assert_int_equal(path.closed, golden[i].closed);
            assert_true(path.fps == golden[i].fps && path.cameras[0].near == 0.01 && isinf(path.cameras[0].far));
            spl_camera_path_finish(&path);
        }
    }
}

static void test_own_sizes_and_defaults(void **state)
{
    (void)state;
    struct spl_camera_path path;
    const struct spl_camera_defaults defaults = {.up = {0, 0, 1}, .target = {1, 0, 0}, .fov = 90, .near = 2, .far = 9};
    for (int i = 0; i < 4; i++) { /* nerfstudio, Open3D, COLMAP say their size, TUM does not */
        assert_int_equal(parse(golden[i].text, (struct spl_path_options){.defaults = &defaults}, &path, NULL), 0);
        assert_int_equal(path.cameras[0].width, i < 3 ? 640 : 1280);
        assert_true(path.cameras[0].near == 2 && path.cameras[0].far == 9);
        assert_true(i < 3 || fabs(path.cameras[0].fx - 360) < 1e-9);
        spl_camera_path_finish(&path);
    }
    assert_int_equal(
        parse("{\"keyframes\":[{\"camera\":{}}]}", (struct spl_path_options){.defaults = &defaults}, &path, NULL),
        0); /* the default view is a key like another */
    assert_true(path.cameras[0].width == 1280 && path.cameras[0].rotation[6] == 1);
    spl_camera_path_finish(&path);
}

/* East is west where EPSG:7 has it. */
static int mirror(const struct spl_camera_places *places, uint32_t crs, const char *name, const double in[3],
                  double out[3], struct spl_error *err)
{
    (void)places;
    if (crs != 7)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "%s in %u", name, crs);
    for (int i = 0; in && i < 3; i++)
        out[i] = i ? in[i] : -in[i];
    return 0;
}

static void test_other_coordinates(void **state)
{
    (void)state;
    const struct spl_camera_places places = {mirror};
    const struct spl_camera_defaults defaults = {.up = {0, 0, 1}, .fov = 90, .near = 2, .far = 9, .places = &places};
    const struct spl_path_options options = {.defaults = &defaults};
#define POSE "\"eye\":[1,2,3],\"target\":[4,5,6]"
#define KEY "{\"camera\":{" POSE "}}"
    static const char *const same[] = {
        "{\"crs\":\"EPSG:7\",\"keyframes\":[" KEY "," KEY "]}",
        "{\"crs\":\"EPSG:7\",\"frames\":[" KEY ",{\"crs\":\"EPSG:7\",\"camera\":{" POSE "}}]}",
        "{\"crs\":\"EPSG:9\",\"frames\":[{\"crs\":\"EPSG:7\",\"camera\":{" POSE "}},"
        "{\"camera\":{" POSE ",\"crs\":\"EPSG:7\"}}]}",
    };
    struct spl_camera_path path;
    struct spl_error err = {0};
    for (size_t i = 0; i < sizeof same / sizeof *same; i++) {
        if (parse(same[i], options, &path, &err))
            fail_msg("%s: %s", same[i], err.message);
        for (size_t k = 0; k < 2; k++)
            assert_true(path.cameras[k].eye[0] == -1 && path.cameras[k].eye[1] == 2 && path.cameras[k].eye[2] == 3);
        spl_camera_path_finish(&path);
    }
    assert_int_equal(parse("{\"crs\":\"EPSG:8\",\"frames\":[" KEY "]}", options, &path, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "frames[0].crs");
#undef KEY
#undef POSE
}

static void test_times_and_order(void **state)
{
    (void)state;
    struct spl_camera_path path;
    const char *tum = "1 0 0 0 0 0 0 1\n1.5 1 0 0 0 0 0 2\n2 2 0 0 0 0 0 -1\n";
    assert_int_equal(parse(tum, (struct spl_path_options){0}, &path, NULL), 0);
    assert_true(path.count == 3 && path.times[1] == 1.5 && path.fps == 2 && path.cameras[2].rotation[8] == 1);
    spl_camera_path_finish(&path);
    const char *own = "{\"keyframes\":[{\"time\":0,\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"fov\":60}},"
                      "{\"time\":2.5,\"camera\":{\"eye\":[4,0,0],\"target\":[9,0,0],\"fov\":60}}]}";
    assert_int_equal(parse(own, (struct spl_path_options){0}, &path, NULL), 0);
    assert_true(path.count == 2 && path.times[1] == 2.5 && path.cameras[1].eye[0] == 4);
    spl_camera_path_finish(&path);
    const char *colmap =
        "{\"cameras_txt\":\"1 SIMPLE_PINHOLE 64 48 50 32 24\",\"images_txt\":\"1 1 0 0 0 -9 0 0 1 b.png"
        "\\n\\n2 1 0 0 0 -4 0 0 1 a.png\\n\\n\"}";
    assert_int_equal(parse(colmap, (struct spl_path_options){0}, &path, NULL), 0);
    assert_true(path.count == 2 && path.cameras[0].eye[0] == 4 && path.cameras[1].eye[0] == 9);
    spl_camera_path_finish(&path);
}

/* The size is that of the projection; between keys, which are all of one, it stays what it is. */
static void test_paths_all_around(void **state)
{
    (void)state;
#define AROUND(projection)                                                                                             \
    "{\"keyframes\":[{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,5],\"projection\":\"" projection "\"}},"             \
    "{\"camera\":{\"eye\":[4,0,0],\"target\":[4,9,0],\"projection\":\"" projection "\"}}]}"
    static const struct {
        const char *text;
        uint32_t width, height, wanted[2];
    } rows[] = {{AROUND("equirectangular"), 1440, 720, {0}}, {AROUND("cube"), 1920, 320, {0}},
                {AROUND("fisheye"), 720, 720, {0}},
                {AROUND("equirectangular"), 256, 128, {256}}, {AROUND("cube"), 198, 33, {0, 33}},
                {AROUND("fisheye"), 90, 90, {0, 90}},
                {"{\"camera_type\":\"equirectangular\",\"render_width\":512,\"render_height\":256,\"camera_path\":["
                 "{\"camera_to_world\":" MATRIX ",\"fov\":60},{\"camera_to_world\":" MATRIX "}]}", 512, 256, {0}}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_camera_path path;
        struct spl_camera between[3];
        struct spl_error err = {0};
        const struct spl_path_options options = {.width = rows[i].wanted[0], .height = rows[i].wanted[1]};
        if (parse(rows[i].text, options, &path, &err))
            fail_msg("%s: %s: %s", rows[i].text, err.field, err.message);
        assert_int_equal(spl_camera_path_sample(&path, &(struct spl_path_motion){0}, 3, between, NULL), 0);
        for (int k = 0; k < 3; k++) {
            assert_true(spl_camera_is_bent(&between[k]) && between[k].projection == path.cameras[0].projection);
            assert_true(between[k].width == rows[i].width && between[k].height == rows[i].height);
            if (i < 2) /* upright, though the first key's target is not level */
                assert_true(fabs(between[k].rotation[5] + 1) < 1e-12);
        }
        spl_camera_path_finish(&path);
    }
}

static void test_bad_paths_are_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *field;
    } cases[] = {
        {"{}", "path"},
        {"{\"camera_path\":5}", "camera_path"},
        {NERFSTUDIO(""), "camera_path"},
        {NERFSTUDIO("7"), "camera_path[0].camera_to_world"},
        {NERFSTUDIO("{\"camera_to_world\":[1,2],\"fov\":60}"), "camera_path[0].camera_to_world"},
        {NERFSTUDIO("{\"camera_to_world\":" MATRIX ",\"fov\":60},{\"camera_to_world\":" MATRIX "}"),
         "camera_path[1].fov"},
        {NERFSTUDIO("{\"camera_to_world\":" MATRIX ",\"fov\":180}"), "camera_path[0].fov"},
        {NERFSTUDIO("{\"camera_to_world\":[2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"fov\":60}"),
         "camera_path[0].camera_to_world"},
        {"{\"camera_type\":\"fisheye\",\"camera_path\":[]}", "camera_type"},
        {"{\"camera_path\":[],\"render_height\":9}", "render_width"},
        {"{\"camera_path\":[],\"render_width\":9.5,\"render_height\":9}", "width"},
        {"{\"camera_path\":[],\"render_width\":8192,\"render_height\":8192}", "width"},
        {"{\"camera_path\":[],\"render_width\":9,\"render_height\":9,\"fps\":0}", "fps"},
        {"{\"camera_path\":[],\"render_width\":9,\"render_height\":9,\"fps\":\"24\"}", "fps"},
        {"{\"class_name\":\"x\"}", "parameters"},
        {OPEN3D("[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]", "{}"), "parameters[0].width"},
        {OPEN3D("[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0]", INTRINSIC), "parameters[0].extrinsic"},
        {OPEN3D("[1,0,0,5,0,1,0,0,0,0,1,0,0,0,0,1]", INTRINSIC), "parameters[0].extrinsic"},
        {OPEN3D("[1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1]", INTRINSIC), "parameters[0].extrinsic"},
        {OPEN3D(EXTRINSIC, "{\"width\":640,\"height\":480,\"intrinsic_matrix\":[500,0,330,0,510,228,0,0,1]}"),
         "parameters[0].intrinsic_matrix"},
        {OPEN3D(EXTRINSIC, "{\"width\":640,\"height\":480,\"intrinsic_matrix\":[-5,0,0,0,510,0,330,228,1]}"),
         "parameters[0].fx"},
        {"{\"cameras_txt\":\"\",\"images_txt\":\"\"}", "cameras_txt"},
        {"{\"cameras_txt\":\"1 PINHOLE 640 480 500 510 331 228\"}", "images_txt"},
        {"{\"cameras_txt\":\"1 PINHOLE 640 480 500 510 331\",\"images_txt\":\"1 1 0 0 0 0 0 0 1 a\\n\\n\"}", "params"},
        {"{\"cameras_txt\":\"1 PINHOLE 64 48 50 50 32 24\",\"images_txt\":\"#\"}", "images"},
        {"{\"cameras_txt\":\"1 PINHOLE 64 48 50 50 32 24\",\"images_txt\":\"1 0 0 0 0 0 0 0 1 a\\n\\n\"}", "q"},
        {"# nothing\n", "path"},
        {"1 2 3 4 0 0 0", "qw"},
        {"1 2 3 4 0 0 0 1 9", ""},
        {"1 2 x 4 0 0 0 1", "ty"},
        {"1 2 nan 4 0 0 0 1", "ty"},
        {"1 2 3 4 0 0 0 0", "qw"},
        {"1 2e12 3 4 0 0 0 1", "eye"},
        {"2 2 3 4 0 0 0 1\n2 2 3 4 0 0 0 1", "timestamp"},
        {"{\"keyframes\":{}}", "keyframes"},
        {"{\"keyframes\":[]}", "keyframes"},
        {"{\"keyframes\":[],\"frames\":[]}", "frames"},
        {"{\"keyframes\":[],\"fps\":0}", "fps"},
        {"{\"keyframes\":[],\"fps\":1e-300}", "fps"},
        {"{\"keyframes\":[],\"closed\":2}", "closed"},
        {OWN("{}"), "keyframes[1].camera"},
        {OWN("{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"projection\":\"equirectangular\"}}"),
         "keyframes[1].camera.projection"},
        {OWN("{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"model\":\"SIMPLE_RADIAL\",\"params\":[900,640,360,0.1]}"
             "}"),
         "keyframes[1].camera.params"},
        {OWN("{\"camera\":{\"gltf\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"perspective\":{\"yfov\":1,"
             "\"znear\":1,\"aspectRatio\":1}}}}"),
         "keyframes[1].camera.gltf.perspective.aspectRatio"},
        {OWN("5"), "keyframes[1].views"},
        {OWN("{\"camera\":{\"eye\":[0,0,0],\"target\":[0,0,0],\"fov\":60}}"), "keyframes[1].camera.target"},
        {OWN("{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"fov\":60},\"time\":\"x\"}"), "keyframes[1].time"},
        {OWN("{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"fov\":60},\"time\":4}"), "keyframes[1].time"},
        {OWN("{\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],\"fov\":60},\"colour\":4}"), "keyframes[1].colour"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_camera_path path;
        struct spl_error err = {0};
        int rc = parse(cases[i].text, (struct spl_path_options){0}, &path, &err);
        if (!rc || strcmp(err.field, cases[i].field) || !err.message[0])
            fail_msg("%s: wanted field '%s', got '%s': %s", cases[i].text, cases[i].field, err.field, err.message);
        assert_true(path.count == 0 && !path.cameras && !path.times);
    }
}

static void test_what_is_no_trajectory_says_so(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"listen = 127.0.0.1:8080\n", "timestamp: 'listen' is no number; text, so it was read as a TUM trajectory"},
        {"1 2 3 4 0 0 0\n", "line 1: qw: 7 numbers; a line of a TUM trajectory has 8: timestamp tx"},
        {"1\n", "line 1: tx: 1 numbers"},
        {"1 2 3 4 0 0 0 1 9 9\n", "line 1: 10 numbers"},
        {"0 2 3 4 0 0 0 1\n1 2 x 4 0 0 0 1\n", "line 2: ty: 'x' is no number"},
        {OWN("{\"camera\":{},\"blur\":4}"),
         "unknown field 'blur' of a view; known are camera, time, width, height, near"},
        {OWN("{\"camera\":{\"eye\":[1,2,3]},\"t\":4}"),
         "'t' belongs into the \"camera\" object; known beside it are camera, time"},
        {OWN("{\"camera\":{\"eye\":[1,2,3],\"taget\":[0,0,0]}}"),
         "unknown field 'taget' of a camera; did you mean 'target'? known are"},
        {OWN("{\"camera\":{\"eye\":[1,2,3],\"lookAt\":[0,0,0]}}"),
         "unknown field 'lookAt' of a camera: it is called target"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_camera_path path;
        struct spl_error err = {0};
        assert_int_equal(parse(cases[i][0], (struct spl_path_options){0}, &path, &err), SPL_E_INPUT);
        if (!strstr(err.message, cases[i][1]))
            fail_msg("%s: '%s' does not say '%s'", cases[i][0], err.message, cases[i][1]);
    }
}

static void put(const char *folder, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_true(file && fputs(text, file) >= 0 && !fclose(file));
}

/* A binary model's images.bin or cameras.bin: a count of 1, then words of the sizes that they have. */
static void put_binary(const char *folder, bool images)
{
    static const double pose[7] = {-0.55772847375664971, -0.76215345285486739, -0.30022022910563139,
                                   0.13389875988314353,  -0.06410832213881687, 0.16613728300474614,
                                   4.6401280721795111};
    static const double lens[4] = {500, 510, 331.25, 228.5};
    const uint64_t one = 1, none = 0, size[2] = {640, 480};
    const uint32_t id = 7, pinhole = 1;
    char path[256];
    snprintf(path, sizeof path, "%s/%s.bin", folder, images ? "images" : "cameras");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    size_t put = fwrite(&one, 8, 1, file) + fwrite(&id, 4, 1, file);
    if (images)
        put += fwrite(pose, 56, 1, file) + fwrite(&id, 4, 1, file) + fwrite("a.png", 6, 1, file) +
               fwrite(&none, 8, 1, file);
    else
        put += fwrite(&pinhole, 4, 1, file) + fwrite(size, 16, 1, file) + fwrite(lens, 32, 1, file);
    assert_int_equal(put, images ? 6 : 5);
    assert_int_equal(fclose(file), 0);
}

static void test_a_binary_model(void **state)
{
    (void)state;
    char folder[] = "/tmp/splatd-path-XXXXXX", path[256];
    struct spl_path_options options = {.width = 1280, .height = 960, .limits = &limits};
    struct spl_camera_path loaded = {0};
    struct spl_error err = {0};
    assert_non_null(mkdtemp(folder));
    put_binary(folder, false);
    assert_int_equal(spl_camera_path_load(folder, &options, &loaded, &err), SPL_E_NOT_FOUND);
    assert_non_null(strstr(err.message, "images.bin"));
    put_binary(folder, true);
    assert_int_equal(spl_camera_path_load(folder, &options, &loaded, NULL), 0);
    assert_int_equal(loaded.count, 1);
    assert_true(loaded.whole);
    assert_pixel(&loaded, 0, 825, 546.25); /* the lens is scaled to the size that is asked for */
    spl_camera_path_finish(&loaded);
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, i == 0 ? "cameras.bin" : i == 1 ? "images.bin" : "");
        remove(path);
    }
}

static void test_files(void **state)
{
    (void)state;
    char folder[] = "/tmp/splatd-path-XXXXXX", path[256];
    struct spl_path_options options = {.width = 640, .height = 480, .limits = &limits};
    struct spl_camera_path loaded = {0};
    struct spl_error err = {0};
    assert_non_null(mkdtemp(folder));
    put(folder, "cameras.txt", "1 PINHOLE 640 480 500 510 331.25 228.5\n");
    put(folder, "images.txt", "7 " COLMAP_Q " " COLMAP_T " 1 a.png\n\n");
    put(folder, "nerf.json", golden[0].text);
    put(folder, "tum.txt", TUM);
    put(folder, "bad.json", "{\"camera_path\":");
    static char marked[4000]; /* as editors on Windows write UTF-8 */
    snprintf(marked, sizeof marked, "\xef\xbb\xbf%s", golden[0].text);
    put(folder, "marked.json", marked);
    put(folder, "marked.txt", "\xef\xbb\xbf" TUM);
    const char *const names[] = {"", "/nerf.json", "/tum.txt", "/marked.json", "/marked.txt"};
    for (int i = 0; i < 5; i++) {
        snprintf(path, sizeof path, "%s%s", folder, names[i]);
        assert_int_equal(spl_camera_path_load(path, &options, &loaded, &err), 0);
        assert_pixel(&loaded, 0, i ? fov_pixel[0] : 412.5, i ? fov_pixel[1] : 273.125);
        spl_camera_path_finish(&loaded);
    }
    snprintf(path, sizeof path, "%s/bad.json", folder);
    assert_int_equal(spl_camera_path_load(path, &options, &loaded, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "bad.json: broken JSON at line 1"));
    assert_int_equal(spl_camera_path_load("/nowhere", &options, &loaded, NULL), SPL_E_NOT_FOUND);
    put(folder, "bad.json", "\xef\xbb\xbf{\"a\":1,\"a\":2}");
    struct spl_error twice = {0};
    assert_int_equal(spl_camera_path_load(path, &options, &loaded, &twice), SPL_E_INPUT);
    assert_non_null(strstr(twice.message, "bad.json: broken JSON at line 1"));
    assert_non_null(strstr(twice.message, "duplicate"));
    const char *const all[] = {"cameras.txt", "images.txt", "nerf.json", "tum.txt", "bad.json", "marked.json",
                               "marked.txt", ""};
    for (int i = 0; i < 8; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, all[i]);
        remove(path);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_other_coordinates),
        cmocka_unit_test(test_golden_vectors),  cmocka_unit_test(test_own_sizes_and_defaults),
        cmocka_unit_test(test_paths_all_around),
        cmocka_unit_test(test_times_and_order), cmocka_unit_test(test_bad_paths_are_named),
        cmocka_unit_test(test_what_is_no_trajectory_says_so),
        cmocka_unit_test(test_files),           cmocka_unit_test(test_a_binary_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
