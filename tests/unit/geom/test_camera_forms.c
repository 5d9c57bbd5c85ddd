/* The cameras of other programs, as their files have them: the golden pose of test_camera.c (yaw 35, pitch 70, roll 8
 * degrees), whose world point lands on its pixel in each form; and what each form refuses, by the member's name. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "geom/camera_json.h"
#include "geom/size.h"

#define NODE                                                                                                           \
    "[0.78387787227503695,0.60698607043454015,0.13077993598406572,0,"                                                  \
    "-0.30826946648440512,0.19761352719368059,0.93054759679636629,0,"                                                  \
    "0.53898554469575628,-0.76975113132005719,0.34202014332566873,0,2.5,-3.5,1.75,1]"
#define EXTRINSIC                                                                                                      \
    "[0.78387787227503695,0.30826946648440512,-0.53898554469575628,0,"                                                 \
    "0.60698607043454015,-0.19761352719368059,0.76975113132005719,0,"                                                  \
    "0.13077993598406572,-0.93054759679636629,-0.34202014332566873,0,"                                                 \
    "-0.06410832213881687,0.16613728300474614,4.6401280721795111,1]"
#define EXTRINSIC_ROWS                                                                                                 \
    "[[0.78387787227503695,0.60698607043454015,0.13077993598406572,-0.06410832213881687],"                             \
    "[0.30826946648440512,-0.19761352719368059,-0.93054759679636629,0.16613728300474614],"                             \
    "[-0.53898554469575628,0.76975113132005719,-0.34202014332566873,4.6401280721795111],[0,0,0,1]]"
#define POSE                                                                                                           \
    "\"matrix\":[0.78387787227503695,0.30826946648440512,-0.53898554469575628,2.5,"                                    \
    "0.60698607043454015,-0.19761352719368059,0.76975113132005719,-3.5,"                                               \
    "0.13077993598406572,-0.93054759679636629,-0.34202014332566873,1.75,0,0,0,1],\"convention\":\"opencv\""
#define SIZE "\"width\":640,\"height\":480"
#define I16 "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]"
#define LENS "\"perspective\":{\"yfov\":1,\"znear\":0.5}"
#define GLTF(members) "{\"camera\":{\"gltf\":{" members "}," SIZE "}}"
#define PERSPECTIVE(members) GLTF("\"matrix\":" I16 ",\"perspective\":{" members "}")
#define ORTHOGRAPHIC(members) GLTF("\"matrix\":" I16 ",\"orthographic\":{" members "}")
#define K "[500,0,330.75,0,510,228,0,0,1]"
#define P "[500,0,330.75,0,0,510,228,0,0,0,1,0]"
#define OPEN3D(extrinsic, intrinsic)                                                                                   \
    "{\"camera\":{\"open3d\":{\"extrinsic\":" extrinsic ",\"intrinsic\":{" intrinsic "}},\"near\":1}}"
#define INTRINSIC SIZE ",\"intrinsic_matrix\":[500,0,0,0,510,0,330.75,228,1]"
#define ROS(members) "{\"camera\":{" POSE ",\"ros\":{" SIZE "," members "},\"near\":1}}"

#define ROWS "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"
#define FRAME(members, rows) "{\"camera\":{\"nerfstudio\":{" members ",\"transform_matrix\":" rows "},\"near\":1}}"

static int read_camera(const char *text, const struct spl_camera_defaults *defaults, struct spl_camera *camera,
                       struct spl_error *err)
{
    static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};
    static const char *const none[] = {"camera", NULL};
    json_t *json = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    if (!json)
        fail_msg("no JSON: %s", text);
    *err = (struct spl_error){0};
    int rc = spl_camera_from_json(json, none, defaults, &limits, camera, err);
    json_decref(json);
    return rc;
}

static void every_form_hits_the_golden_pixel(void **state)
{
    (void)state;
    static const double point[3] = {-0.577054497069, 3.30876147309, -1.46753054758};
    static const struct {
        const char *text;
        double u, v, near, far;
    } rows[] = {
        /* fy = 240 / tan 0.5, the point at 0.1625 and 0.0875 of the depth beside the axis */
        {GLTF("\"type\":\"perspective\",\"matrix\":" NODE ",\"perspective\":{\"yfov\":1,\"znear\":0.5,"
              "\"zfar\":90,\"aspectRatio\":1.3333334}"),
         391.38902114678562, 278.44024215596149, 0.5, 90},
        /* parallel rays: 1.3 beside the axis and 0.7 below it, of 8 x 6; at 0.0125 a pixel; at 80 pixels a unit */
        {GLTF("\"matrix\":" NODE ",\"orthographic\":{\"xmag\":4,\"ymag\":3,\"znear\":0,\"zfar\":9}"), 424, 296, 0, 9},
        {"{\"camera\":{" POSE ",\"units_per_pixel\":0.0125,\"near\":1}," SIZE "}", 424, 296, 1, INFINITY},
        {"{\"camera\":{" POSE ",\"projection\":\"orthographic\",\"fx\":80,\"cx\":321.5,\"near\":1}," SIZE "}", 425.5,
         296, 1, INFINITY},
        {GLTF("\"matrix\":" NODE "," LENS), 391.38902114678562, 278.44024215596149, 0.5, INFINITY},
        {"{\"camera\":{\"gltf\":{\"matrix\":" NODE
         "},\"fx\":500,\"fy\":510,\"cx\":331.25,\"cy\":228.5,\"near\":1}," SIZE "}",
         412.5, 273.125, 1, INFINITY},
        {OPEN3D(EXTRINSIC, INTRINSIC), 412.5, 273.125, 1, INFINITY},
        {ROS("\"k\":" K ",\"d\":[0,0,0,0,0],\"distortion_model\":\"plumb_bob\""), 412.5, 273.125, 1, INFINITY},
        {OPEN3D(EXTRINSIC_ROWS, SIZE ",\"intrinsic_matrix\":[[500,0,330.75],[0,510,228],[0,0,1]]"), 412.5, 273.125, 1,
         INFINITY},
        {ROS("\"k\":[[500,0,330.75],[0,510,228],[0,0,1]]"), 412.5, 273.125, 1, INFINITY},
        {ROS("\"p\":[[500,0,330.75,0],[0,510,228,0],[0,0,1,0]]"), 412.5, 273.125, 1, INFINITY},
        {ROS("\"p\":" P ",\"d\":[]"), 412.5, 273.125, 1, INFINITY},
        {ROS("\"k\":" K ",\"p\":" P), 412.5, 273.125, 1, INFINITY},
        {FRAME("\"w\":640,\"h\":480,\"fl_x\":500,\"fl_y\":510,\"cx\":331.25,\"cy\":228.5,\"k1\":0,\"p2\":0,"
               "\"camera_model\":\"PINHOLE\",\"file_path\":\"a.png\"",
               "[[0.78387787227503695,-0.30826946648440512,0.53898554469575628,2.5],"
               "[0.60698607043454015,0.19761352719368059,-0.76975113132005719,-3.5],"
               "[0.13077993598406572,0.93054759679636629,0.34202014332566873,1.75],[0,0,0,1]]"),
         412.5, 273.125, 1, INFINITY},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_camera camera;
        struct spl_error err;
        double pixel[2], depth;
        if (read_camera(rows[i].text, NULL, &camera, &err))
            fail_msg("%s: %s: %s", rows[i].text, err.field, err.message);
        assert_true(camera.width == 640 && camera.height == 480);
        assert_true(camera.near == rows[i].near && camera.far == rows[i].far);
        assert_true(spl_camera_project(&camera, point, pixel, &depth));
        if (!(fabs(pixel[0] - rows[i].u) < 1e-9 && fabs(pixel[1] - rows[i].v) < 1e-9 && fabs(depth - 8) < 1e-9))
            fail_msg("%s: pixel %.12f %.12f depth %.12f", rows[i].text, pixel[0], pixel[1], depth);
    }
}

/* Where it is not said: of parallel rays the eye, whatever pinholes of the dataset begin at. */
static void near_of_parallel_rays_is_the_eye(void **state)
{
    (void)state;
    static const struct spl_camera_defaults dataset = {.up = {0, 0, 1}, .fov = 60, .near = 0.25, .far = INFINITY};
    static const struct {
        const char *camera;
        double near, near_of_no_dataset;
    } rows[] = {
        {"{" POSE ",\"view_height\":6}", 0, 0},
        {"{" POSE ",\"units_per_pixel\":0.01}", 0, 0},
        {"{" POSE ",\"projection\":\"orthographic\",\"fx\":80}", 0, 0},
        {"{" POSE ",\"view_height\":6,\"near\":0.5}", 0.5, 0.5},
        {"{" POSE ",\"fov\":60}", 0.25, SPL_CAMERA_NEAR_DEFAULT},
        {"{" POSE ",\"projection\":\"equirectangular\"}", 0.25, SPL_CAMERA_NEAR_DEFAULT},
    };
    for (size_t i = 0; i < 2 * sizeof rows / sizeof *rows; i++) {
        struct spl_camera camera;
        struct spl_error err;
        char text[1024];
        snprintf(text, sizeof text, "{\"camera\":%s}", rows[i / 2].camera);
        if (read_camera(text, i % 2 ? NULL : &dataset, &camera, &err))
            fail_msg("%s: %s: %s", text, err.field, err.message);
        const double wanted = i % 2 ? rows[i / 2].near_of_no_dataset : rows[i / 2].near;
        if (camera.near != wanted)
            fail_msg("%s: near %g, not %g", text, camera.near, wanted);
    }
}

/* The same point, 1.3 right and 0.7 below the axis at depth 8, through lenses; and how large images become. */
static void lenses_hit_the_golden_pixel(void **state)
{
    (void)state;
#define COLMAP(model, params)                                                                                          \
    "{\"camera\":{" POSE ",\"model\":\"" model "\",\"params\":[500,510,331.25,228.5," params "]}," SIZE "}"
#define BENT_FRAME(members)                                                                                            \
    FRAME("\"w\":640,\"h\":480,\"fl_x\":500,\"fl_y\":510,\"cx\":331.25,\"cy\":228.5," members,                         \
          "[[0.78387787227503695,-0.30826946648440512,0.53898554469575628,2.5],"                                       \
          "[0.60698607043454015,0.19761352719368059,-0.76975113132005719,-3.5],"                                       \
          "[0.13077993598406572,0.93054759679636629,0.34202014332566873,1.75],[0,0,0,1]]")
#define PROJECTION(rest) "{\"camera\":{" POSE ",\"projection\":" rest "}"
    static const struct {
        const char *text;
        uint32_t width, height;
        double u, v;
    } rows[] = {
        {COLMAP("OPENCV", "-0.3,0.1,0.01,-0.02"), 640, 480, 410.952591125488, 272.635915914307},
        {COLMAP("FULL_OPENCV", "-0.3,0.1,0.01,-0.02,0.05,0.2,-0.1,0.04"), 640, 480, 410.417616041725, 272.342091137532},
        {COLMAP("OPENCV_FISHEYE", "0.1,-0.2,0.3,-0.4"), 640, 480, 411.846525439661, 272.766091664552},
        {ROS("\"k\":" K ",\"distortion_model\":\"plumb_bob\",\"d\":[-0.3,0.1,0.01,-0.02,0.05]"), 640, 480,
         410.952751680155,
         272.636004095870},
        {ROS("\"k\":" K ",\"distortion_model\":\"rational_polynomial\",\"d\":[-0.3,0.1,0.01,-0.02,0.05,0.2,-0.1,0.04]"),
         640, 480,
         410.417616041725, 272.342091137532},
        {ROS("\"k\":" K ",\"distortion_model\":\"equidistant\",\"d\":[0.1,-0.2,0.3,-0.4]"), 640, 480, 411.846525439661,
         272.766091664552},
        {BENT_FRAME("\"k1\":-0.3,\"k2\":0.1,\"p1\":0.01,\"p2\":-0.02,\"k3\":0.05"), 640, 480, 410.952751680155,
         272.636004095870},
        {BENT_FRAME("\"camera_model\":\"OPENCV_FISHEYE\""), 640, 480, 411.595881180571, 272.628430125329},
        {BENT_FRAME("\"camera_model\":\"EQUIRECTANGULAR\""), 640, 480, 336.408686655516, 253.163258412386},
        {PROJECTION("\"equirectangular\"") "," SIZE "}", 640, 480, 336.408686655516, 253.163258412386},
        {PROJECTION("\"fisheye\"") "," SIZE "}", 640, 480, 344.551892762167, 253.220249948859},
        {PROJECTION("\"fisheye\",\"fx\":500,\"fy\":510,\"cx\":331.25,\"cy\":228.5") "," SIZE "}", 640, 480,
         411.595881180571,
         272.628430125329},
        {PROJECTION("\"cube\"") ",\"height\":640}", 3840, 640, 2932, 348},
        {PROJECTION("\"cube\"") ",\"width\":3840}", 3840, 640, 2932, 348},
        {PROJECTION("\"equirectangular\"") ",\"width\":640}", 640, 320, 336.408686655516, 168.775505608257},
        {PROJECTION("\"fisheye\"") ",\"height\":480}", 480, 480, 264.551892762167, 253.220249948859},
        /* 9.2299 degrees to the right and 4.9362 below: rays every half degree, from the left and from above, and the
         * other way */
        {PROJECTION("\"equirectangular\",\"azimuth\":[-30,20,101],\"elevation\":[10,-20,61]") "}", 101, 61,
         78.959772487455,
         30.372443809289},
        {PROJECTION("\"equirectangular\",\"azimuth\":[180,-180,720],\"elevation\":[-20,10,61]") "}", 720, 61,
         342.040227512545,
         30.627556190711},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        static const double point[3] = {-0.577054497069, 3.30876147309, -1.46753054758};
        struct spl_camera camera;
        struct spl_error err;
        double pixel[2], distance;
        if (read_camera(rows[i].text, NULL, &camera, &err))
            fail_msg("%s: %s: %s", rows[i].text, err.field, err.message);
        assert_true(spl_camera_is_bent(&camera));
        assert_true(camera.width == rows[i].width && camera.height == rows[i].height);
        assert_true(spl_camera_project(&camera, point, pixel, &distance));
        if (!(fabs(pixel[0] - rows[i].u) < 1e-8 && fabs(pixel[1] - rows[i].v) < 1e-8 &&
              fabs(distance - sqrt(1.3 * 1.3 + 0.7 * 0.7 + 64)) < 1e-9))
            fail_msg("%s: pixel %.12f %.12f distance %.12f", rows[i].text, pixel[0], pixel[1], distance);
    }
}

/* What is seen all around stands upright, however steeply its middle is looked at; a pose is taken as it is. */
static void what_is_seen_all_around_is_level(void **state)
{
    (void)state;
    static const char *const rows[] = {
        "{\"camera\":{\"eye\":[5,6,7],\"target\":[8,10,-40],\"up\":[0,0,3],\"projection\":\"equirectangular\"}}",
        "{\"camera\":{\"eye\":[5,6,7],\"target\":[8,10,-40],\"up\":[0,0,3],\"projection\":\"cube\"}}",
        "{\"camera\":{\"eye\":[5,6,7],\"target\":[8,10,-40],\"up\":[0,0,3],\"projection\":\"fisheye\"}}"};
    for (int i = 0; i < 3; i++) {
        static const double level[9] = {0.8, -0.6, 0, 0, 0, -1, 0.6, 0.8, 0};
        struct spl_camera camera;
        struct spl_error err;
        assert_int_equal(read_camera(rows[i], NULL, &camera, &err), 0);
        double off = 0;
        for (int k = 0; k < 9; k++)
            off = fmax(off, fabs(camera.rotation[k] - level[k]));
        assert_true(i < 2 ? off < 1e-12 : camera.rotation[8] < -0.9);
    }
}

static void an_aspect_ratio_decides_the_side_that_is_left_out(void **state)
{
    (void)state;
#define ASPECT(aspect, rest)                                                                                           \
    "{\"camera\":{\"gltf\":{\"matrix\":" I16 ",\"perspective\":{\"yfov\":1,\"znear\":1,\"aspectRatio\":" aspect        \
    "}}" rest "}}"
    static const struct {
        const char *text;
        uint32_t width, height; /* 0: refused */
    } rows[] = {
        {ASPECT("1.5", ""), 1080, 720},
        {ASPECT("1.5", ",\"width\":300"), 300, 200},
        {ASPECT("0.5", ",\"height\":300"), 150, 300},
        {ASPECT("1.7777", ",\"width\":1280,\"height\":720"), 1280, 720},
        {ASPECT("1.78", ",\"width\":1280,\"height\":720"), 0, 0},
        {ASPECT("0.75", ",\"width\":1280,\"height\":960"), 0, 0},
        {ASPECT("0.001", ""), 1, 720},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_camera camera;
        struct spl_error err;
        int rc = read_camera(rows[i].text, NULL, &camera, &err);
        if (rc != (rows[i].width ? 0 : SPL_E_INPUT))
            fail_msg("%s: %d %s", rows[i].text, rc, err.message);
        if (!rc && (camera.width != rows[i].width || camera.height != rows[i].height || camera.fx != camera.fy))
            fail_msg("%s: %u x %u", rows[i].text, camera.width, camera.height);
        assert_string_equal(err.field, rc ? "gltf.perspective.aspectRatio" : "");
    }
}

static void faults_carry_the_members_name(void **state)
{
    (void)state;
    static const char *const rows[][2] = {
        {"{\"camera\":{\"gltf\":5}}", "gltf"},
        {GLTF(""), "gltf"},
        {GLTF("\"perspective\":[]"), "gltf.perspective"},
        {GLTF("\"type\":5," LENS), "gltf.type"},
        {GLTF("\"type\":\"panorama\"," LENS), "gltf.type"},
        {GLTF("\"type\":\"orthographic\""), "gltf.orthographic"},
        {ORTHOGRAPHIC("\"xmag\":1,\"ymag\":1,\"znear\":1,\"zfar\":9"), "gltf.orthographic.xmag"}, /* 640 x 480 */
        {ORTHOGRAPHIC("\"xmag\":4,\"ymag\":0,\"znear\":1,\"zfar\":9"), "gltf.orthographic.ymag"},
        {ORTHOGRAPHIC("\"xmag\":-4,\"ymag\":3,\"znear\":1,\"zfar\":9"), "gltf.orthographic.xmag"},
        {ORTHOGRAPHIC("\"xmag\":4,\"ymag\":3,\"zfar\":9"), "gltf.orthographic.znear"},
        {ORTHOGRAPHIC("\"xmag\":4,\"ymag\":3,\"znear\":1"), "gltf.orthographic.zfar"},
        {ORTHOGRAPHIC("\"xmag\":4,\"ymag\":3,\"znear\":1,\"zfar\":9,\"yfov\":1"), "gltf.orthographic.yfov"},
        {ORTHOGRAPHIC("\"xmag\":4,\"ymag\":3,\"znear\":-1,\"zfar\":9"), "gltf.orthographic.znear"},
        {GLTF("\"type\":\"perspective\",\"matrix\":" I16 ",\"orthographic\":{}"), "gltf.type"},
        {GLTF("\"type\":\"orthographic\",\"matrix\":" I16 "," LENS), "gltf.type"},
        {"{\"camera\":{" POSE ",\"view_height\":4,\"fov\":50}," SIZE "}", "fov"},
        {"{\"camera\":{" POSE ",\"projection\":\"orthographic\"}," SIZE "}", "view_height"},
        {"{\"camera\":{" POSE ",\"projection\":\"perspective\",\"view_height\":4}," SIZE "}", "view_height"},
        {"{\"camera\":{" POSE ",\"projection\":\"fisheye\",\"view_height\":4}," SIZE "}", "view_height"},
        {"{\"camera\":{" POSE ",\"projection\":\"panorama\"}," SIZE "}", "projection"},
        {"{\"camera\":{" POSE ",\"projection\":\"fisheye\",\"fov\":361}," SIZE "}", "fov"},
        {"{\"camera\":{" POSE ",\"projection\":\"fisheye\",\"fov\":90,\"fx\":50}," SIZE "}", "fov"},
        {"{\"camera\":{" POSE ",\"projection\":\"fisheye\",\"model\":\"OPENCV\",\"params\":[9,9,9,9,0.1,0,0,0]}," SIZE
         "}",
         "projection"},
        {"{\"camera\":{" POSE ",\"projection\":\"equirectangular\",\"fov\":90}," SIZE "}", "fov"},
        {"{\"camera\":{" POSE ",\"projection\":\"equirectangular\",\"cx\":9}," SIZE "}", "cx"},
        {"{\"camera\":{" POSE ",\"projection\":\"cube\"}," SIZE "}", "width"},
        {"{\"camera\":{" POSE ",\"projection\":\"cube\",\"view_height\":4}," SIZE "}", "view_height"},
        {"{\"camera\":{\"eye\":[0,0,1],\"target\":[0,0,9],\"projection\":\"equirectangular\"}}", "up"},
#define SCAN(azimuth, elevation, rest)                                                                                 \
    "{\"camera\":{" POSE ",\"azimuth\":" azimuth ",\"elevation\":" elevation rest "}}"
        {SCAN("[0,9,10]", "[0,9,10]", ""), "azimuth"},
        {SCAN("[0,9,10]", "[0,9,10]", ",\"projection\":\"fisheye\""), "azimuth"},
        {SCAN("[0,9,10]", "[0,9,10]", ",\"projection\":\"equirectangular\",\"width\":9"), "width"},
        {SCAN("[0,9,2.5]", "[0,9,10]", ",\"projection\":\"equirectangular\""), "azimuth"},
        {SCAN("[-200,200,10]", "[0,9,10]", ",\"projection\":\"equirectangular\""), "azimuth"},
        {SCAN("[0,9,10]", "[0,91,10]", ",\"projection\":\"equirectangular\""), "elevation"},
        {SCAN("[0,9,10]", "[9,9,10]", ",\"projection\":\"equirectangular\""), "elevation"},
        {"{\"camera\":{" POSE ",\"azimuth\":[0,9,10],\"projection\":\"equirectangular\"}}", "elevation"},
        {"{\"camera\":{" POSE ",\"elevation\":[0,9,10],\"projection\":\"equirectangular\"}}", "azimuth"},
        {"{\"camera\":{" POSE ",\"azimuth\":[0,9,10]}}", "azimuth"},
        {"{\"camera\":{" POSE ",\"elevation\":[0,9,10]}}", "elevation"},
        {"{\"camera\":{" POSE ",\"model\":\"OPENCV_FISHEYE\",\"params\":[9,9,9,9]}," SIZE "}", "params"},
        {"{\"camera\":{" POSE ",\"model\":\"SIMPLE_RADIAL\",\"params\":[9,9,9,-1e9]}," SIZE "}", "params"},
        {GLTF("\"type\":\"fisheye\"," LENS), "gltf.type"},
#define ROS_K "\"ros\":{\"k\":[500,0,320,0,510,240,0,0,1],\"width\":640,\"height\":480}"
        {"{\"camera\":{" POSE ",\"projection\":\"fisheye\"," ROS_K "}}", "projection"}, /* k is a pinhole's */
        {"{\"camera\":{" POSE "," ROS_K ",\"projection\":\"orthographic\"}}", "projection"},
        {"{\"camera\":{" POSE ",\"projection\":\"fisheye\",\"gltf\":{\"perspective\":{\"yfov\":1,\"znear\":0.1}}}," SIZE
         "}",
         "projection"},
        {"{\"camera\":{\"projection\":\"orthographic\",\"nerfstudio\":{\"w\":640,\"h\":480,\"fl_x\":500,"
         "\"transform_matrix\":" I16 "}}}",
         "projection"},
        {"{\"camera\":{" POSE ",\"view_height\":4,\"units_per_pixel\":4}," SIZE "}", "units_per_pixel"},
        {"{\"camera\":{" POSE ",\"view_height\":4,\"fx\":4}," SIZE "}", "fx"},
        {"{\"camera\":{" POSE ",\"view_height\":0}," SIZE "}", "view_height"},
        {"{\"camera\":{" POSE ",\"units_per_pixel\":-1}," SIZE "}", "units_per_pixel"},
        {"{\"camera\":{" POSE ",\"projection\":\"orthographic\",\"model\":\"PINHOLE\",\"params\":[9,9,9,9]}," SIZE "}",
         "model"},
        {GLTF("\"translation\":[1,2,3]," LENS), "gltf.translation"},
        {PERSPECTIVE("\"yfov\":1,\"znear\":1,\"xfov\":1"), "gltf.perspective.xfov"},
        {PERSPECTIVE("\"znear\":1"), "gltf.perspective.yfov"},
        {PERSPECTIVE("\"yfov\":\"1\",\"znear\":1"), "gltf.perspective.yfov"},
        {PERSPECTIVE("\"yfov\":0,\"znear\":1"), "gltf.perspective.yfov"},
        {PERSPECTIVE("\"yfov\":60,\"znear\":1"), "gltf.perspective.yfov"}, /* degrees */
        {PERSPECTIVE("\"yfov\":1"), "gltf.perspective.znear"},
        {PERSPECTIVE("\"yfov\":1,\"znear\":0"), "gltf.perspective.znear"},
        {PERSPECTIVE("\"yfov\":1,\"znear\":2,\"zfar\":1"), "gltf.perspective.zfar"},
        {PERSPECTIVE("\"yfov\":1,\"znear\":2,\"zfar\":null"), "gltf.perspective.zfar"},
        {PERSPECTIVE("\"yfov\":1,\"znear\":1,\"aspectRatio\":0"), "gltf.perspective.aspectRatio"},
        {PERSPECTIVE("\"yfov\":1,\"znear\":1,\"aspectRatio\":1e300"), "gltf.perspective.aspectRatio"},
        {GLTF("\"matrix\":[1,2,3]," LENS), "gltf.matrix"},
        {GLTF("\"matrix\":" ROWS "," LENS), "gltf.matrix"},                          /* flat by its standard */
        {GLTF("\"matrix\":[1,0,0,4,0,1,0,5,0,0,1,6,0,0,0,1]," LENS), "gltf.matrix"}, /* row-major */
        {GLTF("\"matrix\":[1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1]," LENS), "gltf.matrix"},
        {GLTF("\"matrix\":[2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1]," LENS), "gltf.matrix"},
        {GLTF("\"matrix\":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1]," LENS), "gltf.matrix"},
        {GLTF("\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,2e12,0,0,1]," LENS), "gltf.matrix"},
        {"{\"camera\":{\"gltf\":{\"matrix\":" I16 "," LENS "},\"matrix\":" I16 ",\"convention\":\"opengl\"}}",
         "matrix"},
        {"{\"camera\":{\"matrix\":" I16 ",\"convention\":\"opengl\",\"gltf\":{\"matrix\":" I16 "," LENS "}}}",
         "gltf.matrix"},
        {"{\"camera\":{\"gltf\":{" LENS "}},\"near\":1}", "gltf.perspective.znear"},
        {"{\"camera\":{\"gltf\":{" LENS "}}}", "eye"},
        {"{\"camera\":{\"gltf\":{\"matrix\":" I16 "}}}", "fov"},
        {"{\"camera\":{\"gltf\":{\"matrix\":" I16 "," LENS "},\"eye\":[1,2,3]}}", "eye"},
        {"{\"gltf\":{},\"camera\":{}}", "gltf"},
        {OPEN3D("[1]", INTRINSIC), "open3d.extrinsic"},
        {OPEN3D("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,2,3,1]]", INTRINSIC), "open3d.extrinsic"}, /* columns as rows */
        {OPEN3D(I16, SIZE ",\"intrinsic_matrix\":[[5,0,0],[0,5,0],[2,2,1]]"), "open3d.intrinsic.intrinsic_matrix"},
        {OPEN3D(I16, SIZE ",\"intrinsic_matrix\":[[5,0,2],[0,5,2]]"), "open3d.intrinsic.intrinsic_matrix"},
        {ROS("\"p\":[[500,0,330.75,0],[0,510,228,0]]"), "ros.p"},
        {OPEN3D("[1,0,0,5,0,1,0,0,0,0,1,0,0,0,0,1]", INTRINSIC), "open3d.extrinsic"},
        {OPEN3D("[1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1]", INTRINSIC), "open3d.extrinsic"},
        {OPEN3D("[1,0,0,0,0,1,0,0,0,0,1,0,0,0,1e13,1]", INTRINSIC), "open3d.extrinsic"},
        {OPEN3D(I16, ""), "open3d.intrinsic.width"},
        {OPEN3D(I16, INTRINSIC ",\"fx\":5"), "open3d.intrinsic.fx"},
        {OPEN3D(I16, "\"width\":9000,\"height\":4,\"intrinsic_matrix\":[5,0,0,0,5,0,2,2,1]"), "open3d.intrinsic.width"},
        {OPEN3D(I16, "\"width\":4,\"height\":0.5,\"intrinsic_matrix\":[5,0,0,0,5,0,2,2,1]"), "open3d.intrinsic.height"},
        {OPEN3D(I16, SIZE ",\"intrinsic_matrix\":[5,0,2,0,5,2,0,0,1]"), "open3d.intrinsic.intrinsic_matrix"},
        {OPEN3D(I16, SIZE ",\"intrinsic_matrix\":[0,0,0,0,5,0,2,2,1]"), "open3d.intrinsic.intrinsic_matrix"},
        {OPEN3D(I16, SIZE ",\"intrinsic_matrix\":[5,5]"), "open3d.intrinsic.intrinsic_matrix"},
        {"{\"camera\":{\"open3d\":{\"extrinsic\":" I16 "}}}", "open3d.intrinsic"},
        {"{\"camera\":{\"open3d\":{\"parameters\":[]}}}", "open3d.parameters"},
        {"{\"width\":640,\"camera\":{\"open3d\":{\"extrinsic\":" I16 ",\"intrinsic\":{" INTRINSIC "}}}}",
         "open3d.intrinsic.width"},
        {"{\"camera\":{\"ros\":[]}}", "ros"},
        {ROS("\"r\":[]"), "ros.r"},
        {ROS("\"d\":[]"), "ros.k"},
        {ROS("\"k\":[500]"), "ros.k"},
        {ROS("\"k\":[500,1,330,0,510,228,0,0,1]"), "ros.k"},
        {ROS("\"k\":[500,0,0,0,510,0,330,228,1]"), "ros.k"}, /* column-major */
        {ROS("\"k\":[0,0,0,0,0,0,0,0,0]"), "ros.k"},
        {ROS("\"k\":[0,0,0,0,0,0,0,0,1]"), "ros.k"},
        {ROS("\"p\":[500,0,330,-40,0,510,228,0,0,0,1,0]"), "ros.p"},
        {ROS("\"p\":[-500,0,330,0,0,510,228,0,0,0,1,0]"), "ros.p"},
        {ROS("\"k\":[499,0,330.75,0,510,228,0,0,1],\"p\":" P), "ros.p"},
        {ROS("\"k\":" K ",\"d\":[0,0,0,0.01]"), "ros.distortion_model"},
        {ROS("\"k\":" K ",\"d\":[0,0,0.01],\"distortion_model\":\"plumb_bob\""), "ros.d"},
        {ROS("\"p\":" P ",\"d\":[0,0,0,0.01],\"distortion_model\":\"plumb_bob\""), "ros.p"},
        {ROS("\"k\":" K ",\"distortion_model\":\"thin_prism\""), "ros.distortion_model"},
        {ROS("\"k\":" K ",\"d\":[\"0\"]"), "ros.d"},
        {ROS("\"k\":" K ",\"d\":0"), "ros.d"},
        {ROS("\"k\":" K ",\"distortion_model\":\"equidistant\""), "ros.d"},
        {ROS("\"k\":" K ",\"distortion_model\":null"), "ros.distortion_model"},
        {"{\"camera\":{" POSE ",\"ros\":{\"k\":" K ",\"width\":0,\"height\":4}}}", "ros.width"},
        {"{\"camera\":{" POSE ",\"ros\":{\"k\":" K ",\"width\":4,\"height\":4.5}}}", "ros.height"},
        {"{\"camera\":{" POSE ",\"ros\":{\"k\":" K ",\"width\":4}}}", "ros.height"},
        {"{\"camera\":{" POSE ",\"fov\":60,\"ros\":{\"k\":" K "," SIZE "}}}", "fov"},
        {"{\"camera\":{" POSE ",\"fx\":60,\"ros\":{\"k\":" K "," SIZE "}}}", "ros.k"},
        {"{\"camera\":{\"ros\":{\"k\":" K "," SIZE "}}}", "eye"},
        {"{\"camera\":{\"nerfstudio\":0}}", "nerfstudio"},
        {FRAME("\"frames\":[]", ROWS), "nerfstudio.frames"},
        {FRAME("\"h\":4,\"fl_x\":5", ROWS), "nerfstudio.w"},
        {FRAME("\"w\":4,\"h\":4.5,\"fl_x\":5", ROWS), "nerfstudio.h"},
        {FRAME("\"w\":4,\"h\":0,\"fl_x\":5", ROWS), "nerfstudio.h"},
        {FRAME("\"w\":4,\"h\":4", ROWS), "nerfstudio.fl_x"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":0", ROWS), "nerfstudio.fl_x"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"fl_y\":-5", ROWS), "nerfstudio.fl_y"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"cx\":\"2\"", ROWS), "nerfstudio.cx"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"k4\":0.1", ROWS), "nerfstudio.k4"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"p2\":null", ROWS), "nerfstudio.p2"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"camera_model\":\"FOV\"", ROWS), "nerfstudio.camera_model"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"p1\":1,\"camera_model\":\"OPENCV_FISHEYE\"", ROWS), "nerfstudio.p1"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5,\"k1\":1,\"camera_model\":\"PINHOLE\"", ROWS), "nerfstudio.k1"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5", "[1,0,0,0,0,1,0,0,0,0,1,0]"), "nerfstudio.transform_matrix"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5", "[[1,0,0],[0,1,0],[0,0,1]]"), "nerfstudio.transform_matrix"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5", "[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"),
         "nerfstudio.transform_matrix"},
        {FRAME("\"w\":4,\"h\":4,\"fl_x\":5", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[4,5,6,1]]"),
         "nerfstudio.transform_matrix"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_camera camera;
        struct spl_error err;
        int rc = read_camera(rows[i][0], NULL, &camera, &err);
        if (rc != SPL_E_INPUT || strcmp(err.field, rows[i][1]) || !err.message[0])
            fail_msg("%s: %d, field '%s' instead of '%s': %s", rows[i][0], rc, err.field, rows[i][1], err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_form_hits_the_golden_pixel),
        cmocka_unit_test(near_of_parallel_rays_is_the_eye),
        cmocka_unit_test(lenses_hit_the_golden_pixel),
        cmocka_unit_test(what_is_seen_all_around_is_level),
        cmocka_unit_test(an_aspect_ratio_decides_the_side_that_is_left_out),
        cmocka_unit_test(faults_carry_the_members_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
