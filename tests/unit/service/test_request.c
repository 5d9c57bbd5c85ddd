/* Requests for views: every form of a camera gives the same one, every parameter is refused by name. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <math.h>
#include <string.h>
#include <cmocka.h>

#include "service/request/request.h"
#include "service/request/values.h"

static const struct spl_camera_defaults defaults = {
    .eye = {10, 0, 0}, .target = {0, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01, .far = INFINITY};
static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};

static int query(const char *text, struct spl_view_request *out, struct spl_error *err)
{
    *err = (struct spl_error){0};
    return spl_view_request_from_query(text, strlen(text), &defaults, &limits, out, err);
}

static int json(const char *text, struct spl_view_request *out, struct spl_error *err)
{
    *err = (struct spl_error){0};
    return spl_view_request_from_json(text, strlen(text), &defaults, &limits, out, err);
}

/* Moves points by 100 in EPSG:4326; knows of 9 later, and of nothing else. */
static int move(const struct spl_camera_places *places, uint32_t crs, const char *name, const double in[3],
                double out[3], struct spl_error *err)
{
    (void)places;
    if (crs == 9)
        return spl_fail_field(err, SPL_E_BUSY, "crs", "not yet");
    if (crs != 4326)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "no");
    for (int i = 0; in && i < 3; i++)
        out[i] = in[i] + 100;
    return in && in[0] > 1000 ? spl_fail_field(err, SPL_E_INPUT, name, "%s is too far", name) : 0;
}

static void points_of_other_coordinates_are_moved_into_the_world(void **state)
{
    (void)state;
    const struct spl_camera_places places = {move};
    struct spl_camera_defaults placed = defaults;
    struct spl_view_request r;
    struct spl_error err;
    placed.places = &places;
    const char *moved = "crs=EPSG:4326&eye=1,2,3&target=4,5,6", *half = "crs=OGC:CRS84&target=4,5,6";
    assert_int_equal(spl_view_request_from_query(moved, strlen(moved), &placed, &limits, &r, &err), 0);
    assert_true(r.view.camera.eye[0] == 101 && r.view.camera.eye[1] == 102 && r.view.camera.eye[2] == 103);
    assert_int_equal(spl_view_request_from_query(half, strlen(half), &placed, &limits, &r, &err), 0);
    assert_true(r.view.camera.eye[0] == 10); // the default view's, which is in the world
    const struct {
        const char *text, *field;
        int code;
    } wrong[] = {
        {"crs=EPSG:9", "crs", SPL_E_BUSY},
        {"crs=EPSG:5", "crs", SPL_E_INPUT},
        {"crs=EPSG:4326&eye=1001,0,0", "eye", SPL_E_INPUT},
        {"crs=EPSG:4326&target=1001,0,0", "target", SPL_E_INPUT},
        {"crs=EPSG:4326&crs=EPSG:4326", "crs", SPL_E_INPUT},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        err = (struct spl_error){0};
        assert_int_equal(
            spl_view_request_from_query(wrong[i].text, strlen(wrong[i].text), &placed, &limits, &r, &err),
            wrong[i].code);
        assert_string_equal(err.field, wrong[i].field);
    }
    static const char *const bad[] = {"EPSG:", "EPSG:0", "EPSG:01", "EPSG:1234567", "4326", "EPSG:4326+5", "+proj=utm",
                                      "EPSG:-1", "EPSG:1.5", "OGC:CRS83", "EPSG:4326 ", "a=b"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_value value = {0};
        err = (struct spl_error){0};
        assert_int_equal(spl_value_from_choice(&value, SPL_KIND_CRS, "crs", bad[i], &err), SPL_E_INPUT);
        assert_string_equal(err.field, "crs");
    }
    assert_int_equal(query("crs=EPSG:4326", &r, &err), SPL_E_INPUT); // nobody here knows where the world lies
    assert_string_equal(err.field, "crs");
}

static void nothing_given_is_the_default_view(void **state)
{
    (void)state;
    struct spl_view_request a, b;
    struct spl_error err;
    assert_int_equal(query("", &a, &err), 0);
    assert_int_equal(json("", &b, &err), 0);
    assert_memory_equal(&a.view.camera, &b.view.camera, sizeof a.view.camera);
    assert_int_equal(json("{}", &b, &err), 0);
    assert_memory_equal(&a.view.camera, &b.view.camera, sizeof a.view.camera);
    assert_int_equal(a.view.camera.width, 1280);
    assert_int_equal(a.view.camera.height, 720);
    assert_true(a.view.camera.eye[0] == 10);
    assert_int_equal(a.encode.format, SPL_FORMAT_JPEG);
    assert_int_equal(a.view.method, SPL_METHOD_SPLAT);
}

/* Half the angles' tangents, across and upright. */
static void get_tangents(const struct spl_view_request *r, double tangent[2])
{
    tangent[0] = r->view.camera.width / 2.0 / r->view.camera.fx;
    tangent[1] = r->view.camera.height / 2.0 / r->view.camera.fy;
}

static void the_field_of_view_follows_the_shape(void **state)
{
    (void)state;
    struct spl_camera_defaults fitted = defaults;
    struct spl_view_request r;
    struct spl_error err = {0};
    double t[2], wide = tan(40 * M_PI / 180), high = tan(20 * M_PI / 180);
    fitted.fit[0] = 80;
    fitted.fit[1] = 40;
    static const char *const sizes[] = {"width=1600&height=900", "width=390&height=844", "width=500&height=500",
                                        "width=2000&height=200"};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        assert_int_equal(spl_view_request_from_query(sizes[i], strlen(sizes[i]), &fitted, &limits, &r, &err), 0);
        get_tangents(&r, t);
        assert_true(t[0] > wide - 1e-9 && t[1] > high - 1e-9); // all is there
        assert_true(fabs(t[0] - wide) < 1e-9 || fabs(t[1] - high) < 1e-9); // and no more
    }
    const char *given = "width=390&height=844&fov=50";
    assert_int_equal(spl_view_request_from_query(given, strlen(given), &fitted, &limits, &r, &err), 0);
    get_tangents(&r, t);
    assert_true(fabs(t[1] - tan(25 * M_PI / 180)) < 1e-9);
    assert_int_equal(query("width=390&height=844", &r, &err), 0); // a dataset of before
    get_tangents(&r, t);
    assert_true(fabs(t[1] - tan(30 * M_PI / 180)) < 1e-9);
}

struct door {
    struct spl_camera_names names;
    const char *settings; /* of the view */
};

static int find_door(const struct spl_camera_names *names, const char *name, struct spl_camera_defaults *out,
                     struct spl_error *err)
{
    if (strcmp(name, "door"))
        return spl_fail_field(err, SPL_E_INPUT, "view", "no");
    snprintf(out->settings, sizeof out->settings, "%s", ((const struct door *)(const void *)names)->settings);
    out->eye[0] = 7;
    out->fov = out->fit[0] = out->fit[1] = 70;
    return 0;
}

static void a_view_by_name_stands_for_what_is_left_out(void **state)
{
    (void)state;
    const struct door plain = {{find_door}, ""};
    struct spl_camera_defaults named = defaults;
    struct spl_view_request r, other;
    struct spl_error err = {0};
    named.names = &plain.names;
    const char *door = "view=door&width=300&height=200",
               *body = "{\"view\": \"door\", \"width\": 300, \"height\": 200}";
    assert_int_equal(spl_view_request_from_query(door, strlen(door), &named, &limits, &r, &err), 0);
    assert_int_equal(spl_view_request_from_json(body, strlen(body), &named, &limits, &other, &err), 0);
    assert_memory_equal(&r.view.camera, &other.view.camera, sizeof r.view.camera);
    assert_true(r.named && r.view.camera.eye[0] == 7 && fabs(100 / r.view.camera.fy - tan(35 * M_PI / 180)) < 1e-9);
    const char *moved = "view=door&eye=1,2,3&fov=50";
    assert_int_equal(spl_view_request_from_query(moved, strlen(moved), &named, &limits, &r, &err), 0);
    assert_true(r.view.camera.eye[0] == 1 && fabs(360 / r.view.camera.fy - tan(25 * M_PI / 180)) < 1e-9);
    const char *list = "{\"view\": \"door\", \"views\": [{}, {\"camera\": {\"eye\": [3, 0, 0]}}]}";
    struct spl_views_request views;
    assert_int_equal(spl_views_request_from_json(list, strlen(list), &named, &limits, &views, &err), 0);
    assert_true(views.views[0].view.camera.eye[0] == 7 && views.views[1].view.camera.eye[0] == 3);
    spl_views_request_finish(&views);
    static const char *const wrong[] = {"view=window",         "view=",     "view=.a", "view=a/b",
                                        "view=door&view=door", "view=a%20b"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        err = (struct spl_error){0};
        assert_int_equal(spl_view_request_from_query(wrong[i], strlen(wrong[i]), &named, &limits, &r, &err),
                         SPL_E_INPUT);
        assert_string_equal(err.field, "view");
    }
    assert_int_equal(query("view=door", &r, &err), SPL_E_INPUT); // nobody here knows any
    assert_int_equal(json("{\"view\": 5}", &r, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "view");
}

/* Printed, as a request has them. */
static void assert_clip(const struct spl_view_request *r, const char *text)
{
    char printed[SPL_TERMS_TEXT_MAX + 1];
    spl_terms_print(&r->view.clip, printed, sizeof printed);
    assert_string_equal(printed, text);
}

static void what_a_view_shows_stands_for_what_is_left_out(void **state)
{
    (void)state;
    struct door door = {
        {find_door},
        "{\"clip\":[\"z<2\",\"x>1\"],\"class\":\"!7\",\"color_by\":\"height\",\"range\":\"0..3\",\"shade\":\"edl\","
        "\"edl_radius\":4,\"soft\":\"z>5\",\"soft_opacity\":0.5,\"background\":\"white\"}"};
    struct spl_camera_defaults named = defaults;
    const struct spl_camera_places places = {move};
    struct spl_view_request r;
    struct spl_error err = {0};
    named.names = &door.names;
    named.places = &places;
    const char *text = "view=door";
    assert_int_equal(spl_view_request_from_query(text, strlen(text), &named, &limits, &r, &err), 0);
    assert_clip(&r, "z<2 and x>1 and !class:7");
    assert_true(r.view.color.by == SPL_COLOR_BY_HEIGHT && r.view.color.has_range && r.view.shade.radius == 4);
    assert_true(r.view.soft.what.count == 1 && r.view.soft.opacity == 0.5 && r.view.background[0] == 255);
    text = "view=door&clip=y<1&color_by=normal&background=black&edl_radius=1";
    assert_int_equal(spl_view_request_from_query(text, strlen(text), &named, &limits, &r, &err), 0);
    assert_clip(&r, "y<1 and !class:7");
    assert_true(r.view.color.by == SPL_COLOR_BY_NORMAL && r.view.shade.radius == 1 && r.view.background[0] == 0);
    assert_false(r.view.color.has_range); /* which is of heights */
    text = "{\"view\": \"door\", \"clip\": [], \"class\": []}";
    assert_int_equal(spl_view_request_from_json(text, strlen(text), &named, &limits, &r, &err), 0);
    assert_int_equal(r.view.clip.count, 0);
    text = "x=1&y=1&view=door";
    assert_int_equal(spl_pick_request_from_query(text, strlen(text), &named, &limits, &r, &err), 0);
    assert_clip(&r, "z<2 and x>1 and !class:7");
    text = "view=door&crs=EPSG:4326&eye=1,2,3"; // of the world they stay
    assert_int_equal(spl_view_request_from_query(text, strlen(text), &named, &limits, &r, &err), 0);
    assert_clip(&r, "z<2 and x>1 and !class:7");
    text = "view=door&crs=EPSG:4326&eye=1,2,3&clip=z<1"; // what the request says is of its own
    assert_int_equal(spl_view_request_from_query(text, strlen(text), &named, &limits, &r, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "clip");
    static const char *const broken[] = {"{", "[]", "{\"width\": 5}", "{\"clip\": 5}", "{\"clip\": \"q\"}"};
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++) {
        door.settings = broken[i];
        err = (struct spl_error){0};
        assert_int_equal(spl_view_request_from_query("view=door", 9, &named, &limits, &r, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "view");
    }
}

static void a_thumbnail_is_small(void **state)
{
    (void)state;
    struct spl_view_request r;
    struct spl_error err = {0};
    assert_int_equal(spl_thumbnail_request_from_query("", 0, &defaults, &limits, &r, &err), 0);
    assert_true(r.view.camera.width == 320 && r.view.camera.height == 180 && r.encode.format == SPL_FORMAT_JPEG);
    assert_true(r.view.camera.eye[0] == 10 && r.view.supersample == 2);
    assert_int_equal(spl_thumbnail_request_from_query("width=640", 9, &defaults, &limits, &r, &err), 0);
    assert_true(r.view.camera.width == 640 && r.view.camera.height == 360);
    const char *cut = "clip=z<2&class=2,6";
    assert_int_equal(spl_thumbnail_request_from_query(cut, strlen(cut), &defaults, &limits, &r, &err), 0);
    assert_clip(&r, "z<2 and class:2 or class:6");
    static const struct {
        const char *text, *field;
    } wrong[] = {{"width=15", "width"}, {"clip=q", "clip"}, {"class=q", "class"}, {"color_by=class", "color_by"},
                 {"width=1281", "width"}, {"width=1.5", "width"}, {"height=90", "height"},
                 {"eye=1,2,3", "eye"},  {"v=5", "v"},            {"shade=1", "shade"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        err = (struct spl_error){0};
        assert_int_equal(
            spl_thumbnail_request_from_query(wrong[i].text, strlen(wrong[i].text), &defaults, &limits, &r, &err),
            SPL_E_INPUT);
        assert_string_equal(err.field, wrong[i].field);
    }
}

static void every_parameter_arrives(void **state)
{
    (void)state;
    struct spl_view_request r;
    struct spl_error err;
    assert_int_equal(
        query("eye=1,-2,3e0&target=0,0,0&up=0,1,0&fx=500&fy=510&cx=300&cy=200.5&width=640&height=480&near=0.5&"
              "far=90&method=points&lod=2&layer=depth&supersample=2&atoms=5&margin=1.5&background=%23102030&"
              "transparent=true&format=npy&quality=77&depth_scale=5000",
              &r, &err),
        0);
    const struct spl_camera *c = &r.view.camera;
    assert_true(c->eye[1] == -2 && c->fx == 500 && c->fy == 510 && c->cx == 300 && c->cy == 200.5);
    assert_true(c->near == 0.5 && c->far == 90 && c->width == 640 && c->height == 480);
    assert_int_equal(r.view.method, SPL_METHOD_POINTS);
    assert_int_equal(r.view.layers, 1 << SPL_LAYER_DEPTH);
    assert_int_equal(r.view.supersample, 2);
    assert_int_equal(r.view.disc.atoms, 5);
    assert_true(r.view.lod == 2 && r.view.disc.margin == 1.5);
    static const uint8_t background[] = {16, 32, 48, 0};
    assert_memory_equal(r.view.background, background, 4);
    assert_int_equal(r.encode.format, SPL_FORMAT_NPY);
    assert_int_equal(r.encode.quality, 77);
    assert_true(r.encode.depth_scale == 5000);
    assert_int_equal(query("layer=depth", &r, &err), 0);
    assert_int_equal(r.encode.format, SPL_FORMAT_PNG);
    assert_int_equal(query("background=transparent&fx=9", &r, &err), 0);
    assert_int_equal(r.view.background[3], 0);
    assert_true(r.view.camera.fy == 9 && r.view.camera.cx == 640);
}

static void ogc_names_mean_the_same(void **state)
{
    (void)state;
    struct spl_view_request a, b;
    struct spl_error err;
    assert_int_equal(query("eye=1,2,3&target=4,5,6&up=0,1,0&fov=50&background=ff8000&transparent=false", &a, &err), 0);
    assert_int_equal(
        query("POC=1,2,3&poi=4,5,6&UP=0,1,0&Fovy=50&BackgroundColor=0xFF8000&TransparentBackground=FALSE", &b, &err),
        0);
    assert_memory_equal(&a, &b, sizeof a);
}

static void flags_are_written_alike_in_queries_and_json(void **state)
{
    (void)state;
    static const char *const words[][2] = {{"false", "0"}, {"true", "1"}};
    struct spl_view_request r;
    struct spl_error err;
    char text[64];
    for (int on = 0; on < 2; on++)
        for (int i = 0; i < 2; i++) {
            snprintf(text, sizeof text, "background=white&transparent=%s&wait=%s", words[on][i], words[on][i]);
            assert_int_equal(query(text, &r, &err), 0);
            assert_true(r.view.background[3] == (on ? 0 : 255) && r.view.partial == !on);
            snprintf(text, sizeof text, "{\"transparent\": %s, \"wait\": %s}", words[on][i], words[on][i]);
            assert_int_equal(json(text, &r, &err), 0);
            assert_true(r.view.background[3] == (on ? 0 : 255) && r.view.partial == !on);
        }
}

static void demands_arrive(void **state)
{
    (void)state;
    struct spl_view_request r;
    struct spl_error err;
    assert_int_equal(query("", &r, &err), 0);
    assert_true(!r.planned && isnan(r.demand.budget_ms) && isnan(r.demand.psnr));
    static const struct {
        const char *text;
        double ms;
    } times[] = {{"50ms", 50}, {"0.05s", 50}, {"50", 50}, {".5", 0.5}, {"600s", 600000}};
    char text[64];
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        snprintf(text, sizeof text, "budget=%s", times[i].text);
        assert_int_equal(query(text, &r, &err), 0);
        assert_true(r.planned && r.demand.budget_ms == times[i].ms && isnan(r.demand.psnr));
        snprintf(text, sizeof text, "{\"budget\": \"%s\"}", times[i].text);
        assert_int_equal(json(text, &r, &err), 0);
        assert_true(r.demand.budget_ms == times[i].ms);
    }
    assert_int_equal(json("{\"budget\": 50, \"psnr\": 38}", &r, &err), 0);
    assert_true(r.demand.budget_ms == 50 && r.demand.psnr == 38);
    assert_int_equal(query("psnr=38&method=points&lod=2&width=64&height=32", &r, &err), 0);
    assert_true(r.planned && r.demand.keep_method && r.demand.keep_lod && !r.demand.keep_supersample);
    assert_true(r.demand.kept.method == SPL_METHOD_POINTS && r.demand.kept.lod == 2);
    assert_false(r.demand.keep_maps);
    assert_true(r.demand.width == 64 && r.demand.height == 32 && r.demand.layer == SPL_LAYER_COLOR);
    assert_int_equal(query("budget=50&maps=off", &r, &err), 0);
    assert_true(r.view.maps == SPL_MAPS_OFF && r.demand.keep_maps && r.demand.kept.maps == SPL_SETTING_MAPS_OFF);
    assert_int_equal(query("budget=50&maps=on", &r, &err), 0);
    assert_true(r.view.maps == SPL_MAPS_ON && r.demand.keep_maps && r.demand.kept.maps == SPL_SETTING_MAPS_ON);
    static const char *const bad[] = {"budget=0",    "budget=0ms",   "budget=-1",   "budget=1m",
                                      "budget=ms",   "budget=1.2.3", "budget=601s", "budget=1e2",
                                      "budget=1 ms", "budget=inf",   "budget="};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(query(bad[i], &r, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "budget");
    }
    static const char *const worse[] = {"psnr=-1", "psnr=100.1", "psnr=nan", "psnr=30&layer=normal"};
    for (size_t i = 0; i < sizeof worse / sizeof *worse; i++) {
        assert_int_equal(query(worse[i], &r, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "psnr");
    }
}

static void assert_same_pose(const struct spl_camera *a, const struct spl_camera *b)
{
    for (int i = 0; i < 3; i++)
        assert_true(fabs(a->eye[i] - b->eye[i]) < 1e-12);
    for (int i = 0; i < 9; i++)
        assert_true(fabs(a->rotation[i] - b->rotation[i]) < 1e-12);
    assert_true(fabs(a->fx - b->fx) < 1e-9 && fabs(a->fy - b->fy) < 1e-9);
    assert_true(fabs(a->cx - b->cx) < 1e-9 && fabs(a->cy - b->cy) < 1e-9);
}

static void camera_forms_agree(void **state)
{
    (void)state;
    /* At (0, -5, 0) looking along +y with z up: x right, y_camera = -z, z_camera = +y. */
    static const char *const forms[] = {
        "{\"camera\":{\"eye\":[0,-5,0],\"target\":[0,0,0],\"up\":[0,0,1],\"fx\":100,\"fy\":110,\"cx\":40,\"cy\":30}}",
        "{\"camera\":{\"matrix\":[1,0,0,0, 0,0,1,-5, 0,-1,0,0, "
        "0,0,0,1],\"convention\":\"opencv\",\"fx\":100,\"fy\":110,"
        "\"cx\":40,\"cy\":30}}",
        "{\"camera\":{\"matrix\":[1,0,0,0, 0,0,-1,-5, 0,1,0,0, "
        "0,0,0,1],\"convention\":\"opengl\",\"fx\":100,\"fy\":110,"
        "\"cx\":40,\"cy\":30}}",
        "{\"camera\":{\"q\":[1,1,0,0],\"t\":[0,0,5],\"model\":\"PINHOLE\",\"params\":[100,110,40,30]}}",
        "{\"camera\":{\"q\":[2,2,0,0],\"t\":[0,0,5],\"model\":\"OPENCV\",\"params\":[100,110,40,30,0,0,0,0]}}",
    };
    struct spl_view_request first, r;
    struct spl_error err;
    assert_int_equal(json(forms[0], &first, &err), 0);
    for (size_t i = 1; i < sizeof forms / sizeof *forms; i++) {
        assert_int_equal(json(forms[i], &r, &err), 0);
        assert_same_pose(&r.view.camera, &first.view.camera);
    }
}

struct refusal {
    const char *text, *field;
};

static void assert_refused(int (*parse)(const char *, struct spl_view_request *, struct spl_error *),
                           const struct refusal *refusals, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct spl_view_request r;
        struct spl_error err;
        if (!parse(refusals[i].text, &r, &err))
            fail_msg("accepted: %s", refusals[i].text);
        if (strcmp(err.field, refusals[i].field))
            fail_msg("%s: field '%s' instead of '%s' (%s)", refusals[i].text, err.field, refusals[i].field,
                     err.message);
        if (!err.message[0] || strchr(err.message, '\n'))
            fail_msg("%s: message '%s'", refusals[i].text, err.message);
    }
}

static void queries_are_refused_by_name(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {"eye=1,2", "eye"},
        {"eye=1,2,3,4", "eye"},
        {"eye=1,2,", "eye"},
        {"eye=", "eye"},
        {"eye", "eye"},
        {"eye=1,2,x", "eye"},
        {"eye=nan,0,0", "eye"},
        {"eye=inf,0,0", "eye"},
        {"eye=0,-Infinity,0", "eye"},
        {"eye=1e999,0,0", "eye"},
        {"eye=0x10,0,0", "eye"},
        {"eye=1%202,0,0", "eye"},
        {"POC=a,b,c", "POC"},
        {"eye=1e13,0,0", "eye"},
        {"target=10,0,0", "target"},
        {"eye=0,0,0", "target"},
        {"up=0,0,0", "up"},
        {"up=1,0,0", "up"},
        {"eye=1,2,3&eye=1,2,3", "eye"},
        {"eye=1,2,3&POC=1,2,3", "POC"},
        {"eye=1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1", "eye"},
        {"fov=0", "fov"},
        {"fov=180", "fov"},
        {"fov=-5", "fov"},
        {"fov=wide", "fov"},
        {"fov=50&fx=100", "fov"},
        {"fy=100", "fx"},
        {"fx=0", "fx"},
        {"fx=-1", "fx"},
        {"fx=10&fy=0", "fy"},
        {"cx=nan", "cx"},
        {"cy=1,2", "cy"},
        {"width=0&height=0", "width"},
        {"width=1000000&height=1000000", "width"},
        {"width=8193", "width"},
        {"height=-1", "height"},
        {"width=10.5", "width"},
        {"height=1e99", "height"},
        {"height=", "height"},
        {"near=0", "near"},
        {"near=-1", "near"},
        {"near=5&far=4", "far"},
        {"far=inf", "far"},
        {"near=x", "near"},
        {"method=magic", "method"},
        {"method=", "method"},
        {"method=Splat", "method"},
        {"layer=smell", "layer"},
        {"lod=-1", "lod"},
        {"lod=65", "lod"},
        {"lod=1;2", "lod"},
        {"supersample=3", "supersample"},
        {"atoms=9", "atoms"},
        {"atoms=-1", "atoms"},
        {"atoms=1e30", "atoms"},
        {"maps=no", "maps"},
        {"supersample=0", "supersample"},
        {"margin=-1", "margin"},
        {"margin=99", "margin"},
        {"soft=", "soft"},
        {"soft=u>0.5&soft=v", "soft"},
        {"soft=u>0.5%20or%20", "soft"},
        {"soft_opacity=1.1", "soft_opacity"},
        {"soft_model=exact", "soft_model"},
        {"soft_blend=-1", "soft_blend"},
        {"shade=glow", "shade"},
        {"shade=edl%2Bnone", "shade"},
        {"edl_radius=0", "edl_radius"},
        {"color_by=", "color_by"},
        {"color_by=rgb%2B", "color_by"},
        {"range=5", "range"},
        {"ramp=jet", "ramp"},
        {"soft_cover=1.1", "soft_cover"},
        {"soft_cover=-0.5", "soft_cover"},
        {"soft_of=1", "soft_of"},
        {"of=second", "of"},
        {"of=", "of"},
        {"of=1", "of"},
        {"visibility=far", "visibility"},
        {"kernel=2", "kernel"},
        {"kernel=130", "kernel"},
        {"kernel=-1", "kernel"},
        {"kernel=nan", "kernel"},
        {"threshold=-0.1", "threshold"},
        {"threshold=1.1", "threshold"},
        {"pyramid=9", "pyramid"},
        {"pyramid=1.5", "pyramid"},
        {"format=gif", "format"},
        {"quality=0", "quality"},
        {"quality=101", "quality"},
        {"quality=90.5", "quality"},
        {"background=rad", "background"},
        {"background=12345", "background"},
        {"background=%231234567", "background"},
        {"BackgroundColor=0xGG0000", "BackgroundColor"},
        {"transparent=maybe", "transparent"}, {"transparent=01", "transparent"}, {"wait=2", "wait"}, {"wait=", "wait"},
        {"depth_scale=0", "depth_scale"},
        {"depth_scale=-1000", "depth_scale"},
        {"depth_scale=1e300", "depth_scale"},
        {"smell=1", "smell"},
        {"=1", ""},
        {"matrix=1", "matrix"},
        {"q=1,0,0,0", "q"},
        {"model=PINHOLE", "model"},
        {"width=%3", "width"},
        {"width=%", "width"},
        {"width=%zz", "width"},
        {"width=%00", "width"},
        {"%zz=1", "a parameter's name"},
        {"width=1%0a2", "width"},
        {"Eye=1,2,3", "Eye"},
    };
    assert_refused(query, refusals, sizeof refusals / sizeof *refusals);
    char text[2000] = "eye=";
    memset(text + 4, '1', 1500);
    text[1504] = '\0';
    const struct refusal longest = {text, "eye"};
    assert_refused(query, &longest, 1);
}

static void bodies_are_refused_by_name(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {"{", "body"},
        {"[]", "body"},
        {"null", "body"},
        {"{}x", "body"},
        {"{\"width\":1,\"width\":2}", "body"},
        {"{\"lod\":NaN}", "body"},
        {"{\"lod\":1e999}", "body"},
        {"{\"width\":99999999999999999999}", "body"},
        {"{\"smell\":1}", "smell"},
        {"{\"eye\":[1,2,3]}", "eye"},
        {"{\"camera\":{\"quality\":3}}", "quality"},
        {"{\"camera\":[]}", "camera"},
        {"{\"camera\":null}", "camera"},
        {"{\"camera\":{\"POC\":[1,2,3]}}", "POC"},
        {"{\"camera\":{\"eye\":\"1,2,3\"}}", "eye"},
        {"{\"camera\":{\"eye\":[1,2]}}", "eye"},
        {"{\"camera\":{\"eye\":[1,2,\"3\"]}}", "eye"},
        {"{\"camera\":{\"eye\":[1,2,null]}}", "eye"},
        {"{\"width\":\"640\"}", "width"},
        {"{\"width\":[640]}", "width"},
        {"{\"width\":true}", "width"},
        {"{\"width\":640,\"camera\":{\"width\":640}}", "width"},
        {"{\"layer\":1}", "layer"},
        {"{\"transparent\":0.5}", "transparent"}, {"{\"wait\":-1}", "wait"}, {"{\"wait\":null}", "wait"},
        {"{\"transparent\":\"true\"}", "transparent"},
        {"{\"background\":[1,2,3]}", "background"},
        {"{\"camera\":{\"matrix\":[1,2,3],\"convention\":\"opencv\"}}", "matrix"},
        {"{\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}}",
         "convention"},
        {"{\"camera\":{\"convention\":\"opengl\"}}", "matrix"},
        {"{\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"convention\":\"directx\"}}", "convention"},
        {"{\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,1,2,3,1],\"convention\":\"opengl\"}}", "matrix"},
        {"{\"camera\":{\"matrix\":[2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"convention\":\"opengl\"}}", "matrix"},
        {"{\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"convention\":\"opengl\",\"eye\":[1,2,3]}}",
         "eye"},
        {"{\"camera\":{\"q\":[1,0,0,0]}}", "t"},
        {"{\"camera\":{\"t\":[0,0,0]}}", "q"},
        {"{\"camera\":{\"q\":[0,0,0,0],\"t\":[0,0,0]}}", "q"},
        {"{\"camera\":{\"q\":[1,0,0],\"t\":[0,0,0]}}", "q"},
        {"{\"camera\":{\"q\":[1,0,0,0],\"t\":[0,0,0],\"up\":[0,0,1]}}", "up"},
        {"{\"camera\":{\"model\":\"PINHOLE\"}}", "params"},
        {"{\"camera\":{\"params\":[1,2,3]}}", "model"},
        {"{\"camera\":{\"model\":\"FISHEYE\",\"params\":[1,2,3]}}", "model"},
        {"{\"camera\":{\"model\":\"PINHOLE\",\"params\":[1,2,3]}}", "params"},
        {"{\"camera\":{\"model\":\"RADIAL\",\"params\":[500,2,3,0.1]}}", "params"},
        {"{\"camera\":{\"model\":\"PINHOLE\",\"params\":[1,2,3,4],\"fx\":3}}", "fx"},
        {"{\"camera\":{\"model\":\"PINHOLE\",\"params\":[1,2,3,4],\"fov\":3}}", "fov"},
        {"{\"camera\":{\"model\":\"PINHOLE\",\"params\":[0,2,3,4]}}", "fx"},
    };
    assert_refused(json, refusals, sizeof refusals / sizeof *refusals);
    struct spl_view_request r;
    struct spl_error err;
    json("{\n  \"width\": 3,\n  oops }", &r, &err);
    assert_non_null(strstr(err.message, "line 3"));
}

/* 16:9, to the nearest pixel, halves up; the camera's own ratio where it has one. Beyond the caps the side that was
 * given is at fault. */
static void a_side_that_is_left_out_follows(void **state)
{
    (void)state;
#define GLTF(aspect, rest) "{\"camera\":{\"gltf\":{\"perspective\":{\"yfov\":1,\"znear\":1" aspect "}}}" rest "}"
    static const struct {
        const char *text;
        uint32_t width, height;
    } sizes[] = {
        {"width=320", 320, 180},
        {"height=180", 320, 180},
        {"width=8", 8, 5},
        {"width=7", 7, 4},
        {"width=1", 1, 1},
        {"height=1", 2, 1},
        {"height=4608", 8192, 4608},
        {"width=320&height=320", 320, 320},
        {"width=320&fx=300&cx=9&cy=9", 320, 180},
        {"{\"width\":640}", 640, 360},
        {"{\"camera\":{\"height\":90}}", 160, 90},
        {GLTF("", ",\"width\":320"), 320, 180},
        {GLTF(",\"aspectRatio\":1.5", ",\"width\":300"), 300, 200},
        {GLTF(",\"aspectRatio\":1.5", ",\"height\":300"), 450, 300},
    };
    struct spl_view_request r;
    struct spl_error err;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const char *text = sizes[i].text;
        if ((*text == '{' ? json : query)(text, &r, &err))
            fail_msg("%s: %s", text, err.message);
        if (r.view.camera.width != sizes[i].width || r.view.camera.height != sizes[i].height)
            fail_msg("%s: %u x %u", text, r.view.camera.width, r.view.camera.height);
    }
    static const struct refusal queries[] = {
        {"width=0", "width"},      {"height=0", "height"},  {"height=4609", "height"},
        {"height=8192", "height"}, {"width=9000", "width"}, {"width=8192&height=0", "height"},
    };
    static const struct refusal bodies[] = {
        {GLTF(",\"aspectRatio\":0.001", ",\"width\":300"), "width"},
        {GLTF(",\"aspectRatio\":1000", ",\"height\":300"), "height"},
        {GLTF(",\"aspectRatio\":1000", ""), "gltf.perspective.aspectRatio"},
    };
    assert_refused(query, queries, sizeof queries / sizeof *queries);
    assert_refused(json, bodies, sizeof bodies / sizeof *bodies);
#undef GLTF
}

static void matrices_are_taken_as_rows(void **state)
{
    (void)state;
#define FLAT "1,0,0,0.5, 0,0,-1,-5, 0,1,0,2, 0,0,0,1"
#define ROW3 "[1,0,0,0.5],[0,0,-1,-5],[0,1,0,2]"
#define MATRIX(m) "{\"camera\":{\"matrix\":[" m "],\"convention\":\"opengl\",\"fov\":50}}"
    struct spl_view_request flat, rows;
    struct spl_error err;
    assert_int_equal(json(MATRIX(FLAT), &flat, &err), 0);
    static const char *const same[] = {MATRIX(ROW3 ",[0,0,0,1]"), MATRIX(ROW3)};
    for (size_t i = 0; i < sizeof same / sizeof *same; i++) {
        if (json(same[i], &rows, &err))
            fail_msg("%s: %s", same[i], err.message);
        assert_memory_equal(&flat.view.camera, &rows.view.camera, sizeof flat.view.camera);
    }
    static const struct refusal bodies[] = {
        {MATRIX("1,0,0,0.5, 0,0,-1,-5, 0,1,0,2"), "matrix"},
        {MATRIX(ROW3 ",[0,0,0]"), "matrix"},
        {MATRIX(ROW3 ",0"), "matrix"},
        {MATRIX(ROW3 ",[0,0,0,1],[0,0,0,1]"), "matrix"},
        {MATRIX(ROW3 ",[1,2,3,1]"), "matrix"},
        {MATRIX("[1,0,0,0.5],[0,0,-1,-5],[0,1,0,\"2\"]"), "matrix"},
        {MATRIX("[[1]],[0,0,-1,-5],[0,1,0,2]"), "matrix"},
        {MATRIX("[" FLAT "]"), "matrix"},
        {MATRIX(""), "matrix"},
    };
    assert_refused(json, bodies, sizeof bodies / sizeof *bodies);
}

static void colours_have_names(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint8_t rgba[4];
    } colours[] = {
        {"background=white", {255, 255, 255, 255}},
        {"background=RebeccaPurple", {102, 51, 153, 255}},
        {"background=aliceblue", {240, 248, 255, 255}},
        {"background=yellowgreen", {154, 205, 50, 255}},
        {"background=Transparent", {0, 0, 0, 0}},
        {"BackgroundColor=tan", {210, 180, 140, 255}},
        {"background=decade", {0xde, 0xca, 0xde, 255}}, /* digits, no name */
        {"{\"background\":\"grey\"}", {128, 128, 128, 255}},
    };
    struct spl_view_request r;
    struct spl_error err;
    for (size_t i = 0; i < sizeof colours / sizeof *colours; i++) {
        const char *text = colours[i].text;
        if ((*text == '{' ? json : query)(text, &r, &err))
            fail_msg("%s: %s", text, err.message);
        assert_memory_equal(r.view.background, colours[i].rgba, 4);
    }
    static const struct refusal refusals[] = {{"background=", "background"},
                                              {"background=whit", "background"},
                                              {"background=whites", "background"},
                                              {"background=%23white", "background"},
                                              {"background=0xwhite", "background"}};
    assert_refused(query, refusals, sizeof refusals / sizeof *refusals);
}

static void refusals_say_what_to_write(void **state)
{
    (void)state;
    static const char *const rows[][2] = {
        {"eye=1, 2,3", "by commas, without blanks"},
        {"eye=(1,2,3)", "by commas"},
        {"eye=0,0,5&target=0,0,0", "up=0,1,0"},
        {"eye=0,5,0&target=0,0,0&up=0,1,0", "up=0,0,1"},
        {"background=#fff", "a CSS name such as white, RRGGBB"},
        {"background=", "'#' is written %23 in a URL, or left out"},
        {"zoom=3", "/v1/openapi.json"},
        {"eye=1,0,0&target=0,0,0&fov=0", "above 0, up to 179 degrees, not 0"},
        {"budget=0", "above 0, up to 600000"},
        {"height=8192", "the width that follows from height is 14564; at most 8192"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view_request r;
        struct spl_error err;
        assert_int_equal(query(rows[i][0], &r, &err), SPL_E_INPUT);
        if (!strstr(err.message, rows[i][1]))
            fail_msg("%s: '%s' does not say '%s'", rows[i][0], err.message, rows[i][1]);
    }
}

static void refusals_of_bodies_say_what_to_write(void **state)
{
    (void)state;
    static const char *const rows[][2] = {
        {"{\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}}",
         "'convention' is needed where 'matrix' is given: opengl or opencv"},
        {"{\"camera\":{\"matrix\":[[1,0,0,0]],\"convention\":\"opengl\"}}",
         "3 or 4 rows of 4; it is an array of 1 rows"},
        {"{\"wait\":2}", "wait must be true, false, 1 or 0, not another number"},
        {"{\"transparent\":\"true\"}", "transparent must be true, false, 1 or 0, not text"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view_request r;
        struct spl_error err;
        assert_int_equal(json(rows[i][0], &r, &err), SPL_E_INPUT);
        if (!strstr(err.message, rows[i][1]))
            fail_msg("%s: '%s' does not say '%s'", rows[i][0], err.message, rows[i][1]);
    }
}

static void percent_decoding_is_exact(void **state)
{
    (void)state;
    char out[8];
    struct spl_error err = {0};
    assert_int_equal(spl_percent_decode("%41%2fb+", 8, out, sizeof out, "id", &err), 0);
    assert_string_equal(out, "A/b+");
    assert_int_equal(spl_percent_decode("1234567", 7, out, sizeof out, "id", &err), 0);
    assert_int_equal(spl_percent_decode("12345678", 8, out, sizeof out, "id", &err), SPL_E_INPUT);
    for (const char *const *bad = (const char *const[]){"%", "%4", "%4g", "%g4", "a%", "\x7f", "%1f", NULL}; *bad;
         bad++)
        assert_int_equal(spl_percent_decode(*bad, strlen(*bad), out, sizeof out, "id", NULL), SPL_E_INPUT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_of_other_coordinates_are_moved_into_the_world),
        cmocka_unit_test(nothing_given_is_the_default_view),
        cmocka_unit_test(the_field_of_view_follows_the_shape),
        cmocka_unit_test(a_view_by_name_stands_for_what_is_left_out),
        cmocka_unit_test(what_a_view_shows_stands_for_what_is_left_out),
        cmocka_unit_test(a_thumbnail_is_small),
        cmocka_unit_test(every_parameter_arrives),
        cmocka_unit_test(ogc_names_mean_the_same),
        cmocka_unit_test(camera_forms_agree),
        cmocka_unit_test(queries_are_refused_by_name),
        cmocka_unit_test(bodies_are_refused_by_name),
        cmocka_unit_test(percent_decoding_is_exact),
        cmocka_unit_test(flags_are_written_alike_in_queries_and_json),
        cmocka_unit_test(demands_arrive),
        cmocka_unit_test(a_side_that_is_left_out_follows),
        cmocka_unit_test(matrices_are_taken_as_rows),
        cmocka_unit_test(colours_have_names),                cmocka_unit_test(refusals_say_what_to_write),
        cmocka_unit_test(refusals_of_bodies_say_what_to_write),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
