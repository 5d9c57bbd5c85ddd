/* Canonical forms: what means the same has one key, what changes a byte has another; If-None-Match. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <math.h>
#include <string.h>
#include <cmocka.h>

#include "service/view/key.h"

enum { renderer = 9 };
static const struct spl_dataset_info plain = {.version = 7}, textured = {.version = 7, .atoms = 16, .maps = 4};

static int stay(const struct spl_camera_places *places, uint32_t crs, const char *name, const double in[3],
                double out[3], struct spl_error *err)
{
    (void)places;
    (void)crs;
    (void)name;
    (void)err;
    if (in)
        memcpy(out, in, 3 * sizeof *out);
    return 0;
}

static struct spl_key key_of(const struct spl_dataset_info *dataset, const char *query)
{
    static const struct spl_camera_places places = {stay};
    static const struct spl_camera_defaults defaults = {.eye = {10, 0, 0},
                                                        .target = {0, 0, 0},
                                                        .up = {0, 0, 1},
                                                        .fov = 60,
                                                        .near = 0.01,
                                                        .far = INFINITY,
                                                        .places = &places};
    static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};
    struct spl_view_request request;
    struct spl_error err = {0};
    bool json = query[0] == '{';
    bool pick = query[0] == '@', body = pick && query[1] == '{';
    int rc = body   ? spl_pick_request_from_json(query + 1, strlen(query) - 1, &defaults, &limits, &request, &err)
             : pick ? spl_pick_request_from_query(query + 1, strlen(query) - 1, &defaults, &limits, &request, &err)
             : json ? spl_view_request_from_json(query, strlen(query), &defaults, &limits, &request, &err)
                    : spl_view_request_from_query(query, strlen(query), &defaults, &limits, &request, &err);
    if (rc)
        fail_msg("%s: %s", query, err.message);
    return spl_key_make(&request, dataset, renderer);
}

static void what_means_the_same_has_one_key(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {
        {"", "{}"},
        {"", "method=splat&lod=1.0&layer=color&format=jpg&quality=90&margin=1&transparent=false&width=1280&height=720"},
        {"", "eye=10,0,-0&target=0,0,0&up=0,0,2&fov=60&near=0.01&background=%23000000"},
        {"", "v=0123456789abcdef"},
        {"", "chroma=420"},
        {"", "maps=on"},
        {"width=320", "width=320&height=180"},
        {"height=180", "{\"width\":320,\"height\":180}"},
        {"width=1280", ""},
        {"background=white", "background=%23FFFFFF"},
        {"wait=0", "wait=1"},
        {"format=png&background=transparent", "format=png&background=00000000"},
        {"quality=95", "quality=95&chroma=444"},
        {"format=png", "format=png&chroma=444"},
        {"layers=depth,color", "{\"layers\":[\"color\",\"depth\"],\"container\":\"multipart\"}"},
        {"layers=depth,normal", "layers=normal,depth&background=ff0000&quality=3"},
        {"layers=color,depth", "layers=depth,color&depth_scale=1000&quality=90"},
        {"", "depth_scale=5000"},
        {"method=fill", "method=fill&threshold=0.38&margin=1&pyramid=0&kernel=0&visibility=adaptive"},
        {"layer=depth", "layer=depth&background=ff0000&quality=50&format=png"},
        {"layer=depth&format=npy", "layer=depth&format=npy&depth_scale=5000"},
        {"format=png", "format=png&quality=10"},
        {"transparent=true&background=102030", "background=10203000"},
        {"fx=100&width=64&height=64",
         "{\"camera\":{\"fx\":100,\"fy\":100,\"cx\":32,\"cy\":32},\"width\":64,\"height\":64}"},
        {"eye=5,0,0", "crs=EPSG:4326&eye=5,0,0"},
        {"", "soft_opacity=0.7&soft_cover=0.5&soft_model=base&soft_blend=2&of=first"}, /* nothing is soft */
        {"", "{\"soft\":[],\"soft_opacity\":0.7}"},
        {"", "color_by=rgb&ramp=turbo&range=0..1"},
        {"", "shade=auto"},
        {"layer=depth", "layer=depth&shade=edl&color_by=height"},
        {"color_by=plane:0,0,0,0,0,1", "{\"color_by\":\"plane:0,0,-0,0,0,1.0\"}"},
        {"layer=id&soft=u>0.5", "{\"soft\":\"u>0.5\",\"of\":\"solid\",\"layer\":\"id\"}"},
        {"soft=class:3-5,9", "soft=class:3..5&soft=class:9"},
        {"soft=u>0.5+or+class:3", "{\"soft\":[\"0.50<u\",\"class:3\"],\"soft_opacity\":0.3}"},
        {"@x=3&y=4&soft=u>q0.9", "@{\"x\":3,\"y\":4,\"soft\":\"u>q.9\"}"},
        {"@x=3&y=4&fx=50&width=64&height=48", "@{\"x\":3,\"y\":4,\"camera\":{\"fx\":50,\"width\":64,\"height\":48}}"},
        {"eye=5,0,0&target=0,0,0&fx=50",
         "{\"camera\":{\"matrix\":[0,0,-1,5,1,0,0,0,0,-1,0,0,0,0,0,1],\"convention\":\"opencv\",\"fx\":50}}"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        struct spl_key a = key_of(&textured, pairs[i][0]), b = key_of(&textured, pairs[i][1]);
        if (!spl_key_equal(&a, &b))
            fail_msg("'%s' and '%s' differ", pairs[i][0], pairs[i][1]);
    }
}

static void what_a_dataset_lacks_is_left_out(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {
        {"", "atoms=0"},
        {"", "{\"atoms\": 5}"},
        {"layers=color,depth", "layers=color,depth&atoms=3"},
        {"", "maps=off"},
        {"layer=depth", "layer=depth&maps=off"},
        {"@x=1&y=1", "@x=1&y=1&maps=off"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        struct spl_key a = key_of(&plain, pairs[i][0]), b = key_of(&plain, pairs[i][1]);
        if (!spl_key_equal(&a, &b))
            fail_msg("'%s' and '%s' differ", pairs[i][0], pairs[i][1]);
    }
}

static void what_changes_a_byte_has_a_key_of_its_own(void **state)
{
    (void)state;
    static const char *const queries[] = {
        "",
        "eye=10,0,1e-9",
        "target=0,0,1",
        "up=0,1,1",
        "fov=61",
        "fx=700",
        "fx=700&fy=701",
        "cx=640.5",
        "cy=361",
        "width=1281",
        "height=721",
        "width=720&height=1280",
        "near=0.02",
        "far=100",
        "method=points",
        "method=fill",
        "method=fill&visibility=constant",
        "method=fill&kernel=9",
        "method=fill&threshold=0.25",
        "method=fill&pyramid=3",
        "kernel=9", /* bare points are drawn by fill where splat is asked for */
        "visibility=none",
        "lod=1.5",
        "lod=0",
        "layer=depth",
        "layer=range",
        "layer=normal",
        "layer=id",
        "layer=coverage",
        "supersample=2",
        "atoms=0",
        "maps=off",
        "layer=depth&maps=off", /* silhouettes, too */
        "@x=640&y=360&maps=off",
        "supersample=0.5",
        "margin=0",
        "margin=1.5",
        "soft=u>0.5",
        "soft=u>=0.5",
        "soft=u>q0.5",
        "soft=v>0.5",
        "soft=u>0.5&soft=class:3",
        "soft=class:3&soft=u>0.5", /* the order of terms may count */
        "soft=u>0.5&soft_opacity=0.7",
        "soft=u>0.5&soft_model=base",
        "shade=headlight",
        "shade=sun:10,20",
        "shade=sun:10,21",
        "color_by=height",
        "color_by=height&ramp=turbo",
        "color_by=height&range=0..1",
        "color_by=u&range=0..1",
        "color_by=u&range=q0..q1",
        "color_by=rgb%2Bu",
        "soft=u>0.5&soft_cover=0.5",
        "soft=u>0.5&soft_blend=1",
        "layer=depth&soft=u>0.5&of=first",
        "layer=depth&soft=u>0.5&of=median",
        "@x=640&y=360&soft=u>0.5&of=first",
        "soft=axis:0,0,0,0,0,1<4",
        "soft=axis:0,0,0,0,0,2<4",
        "layer=depth&soft=u>0.5",
        "@x=640&y=360&soft=u>0.5",
        "background=000001",
        "background=00000000",
        "format=png",
        "format=npy",
        "format=raw",
        "quality=91",
        "layer=depth&depth_scale=5000",
        "layer=depth&format=jpeg",
        "layer=depth&format=jpeg&quality=91",
        "layer=depth&format=raw",
        "chroma=444",
        "layers=color",
        "layers=color,depth",
        "layers=color,normal",
        "layers=color&container=zip",
        "layers=color,depth&format=png",
        "layers=color,depth&format=npy",
        "layers=color,depth&depth_scale=5000",
        "layers=color,depth&quality=91",
        "layers=depth",
        "@x=1&y=1&width=1&height=1",
        "@x=1&y=1&width=1&height=1&crs=EPSG:4326",
        "@x=1&y=1&width=1&height=1&crs=EPSG:4327",
        "@x=640&y=360",
        "@x=640.25&y=360",
        "@x=640&y=360.25",
        "@x=640&y=360&lod=2",
        "@x=640&y=360&method=points",
        "@x=640&y=360&width=1281",
    };
    enum { count = sizeof queries / sizeof *queries };
    struct spl_key keys[count];
    for (size_t i = 0; i < count; i++) {
        keys[i] = key_of(&textured, queries[i]);
        for (size_t j = 0; j < i; j++)
            if (spl_key_equal(&keys[i], &keys[j]))
                fail_msg("'%s' and '%s' share a key", queries[i], queries[j]);
    }
}

/* Lists differ by their directions, lengths apart, and by what they are sent as. */
static void rays_are_part_of_it(void **state)
{
    (void)state;
    const double lists[4][2][3] = {
        {{0, 0, 1}, {1, 0, 1}}, {{0, 0, 3}, {2, 0, 2}}, {{0, 0, 1}, {1, 0, 1.0000001}}, {{1, 0, 1}, {0, 0, 1}}};
    struct spl_view_request request = {.encode.quality = 90};
    struct spl_key keys[4];
    spl_view_init(&request.view);
    for (int i = 0; i < 4; i++) {
        struct spl_rays *rays;
        assert_int_equal(spl_rays_create(lists[i][0], 2, &rays, NULL), 0);
        assert_int_equal(spl_camera_set_rays(&request.view.camera, rays, 100, NULL), 0);
        request.view.rays = rays;
        request.listed = false;
        keys[i] = spl_key_make(&request, &plain, 1);
        request.listed = true;
        const struct spl_key listed = spl_key_make(&request, &plain, 1);
        assert_false(spl_key_equal(&keys[i], &listed));
        assert_true(spl_key_equal(&keys[i], &keys[0]) == (i < 2));
        spl_rays_destroy(rays);
    }
}

static void version_and_renderer_are_part_of_it(void **state)
{
    (void)state;
    struct spl_view_request request = {.encode.quality = 90};
    spl_view_init(&request.view);
    struct spl_dataset_info newer = plain;
    newer.version++;
    struct spl_key key = spl_key_make(&request, &plain, 1), other = spl_key_make(&request, &newer, 1);
    assert_false(spl_key_equal(&key, &other));
    other = spl_key_make(&request, &plain, 2);
    assert_false(spl_key_equal(&key, &other));
    other = spl_key_make(&request, &plain, 1);
    assert_true(spl_key_equal(&key, &other));
    request.view.surrounded = true; /* a map's tile of the same place */
    other = spl_key_make(&request, &plain, 1);
    assert_false(spl_key_equal(&key, &other));

    struct spl_device_info a = {.backend = "vulkan", .name = "one", .driver = "1.0"}, b = a;
    assert_true(spl_renderer_hash(&a) == spl_renderer_hash(&b));
    strcpy(b.driver, "1.1");
    assert_true(spl_renderer_hash(&a) != spl_renderer_hash(&b));
    b = a;
    strcpy(b.name, "two");
    assert_true(spl_renderer_hash(&a) != spl_renderer_hash(&b));
    b = a;
    strcpy(b.backend, "egl");
    assert_true(spl_renderer_hash(&a) != spl_renderer_hash(&b));
}

static void if_none_match_is_read_as_the_standard_says(void **state)
{
    (void)state;
    struct spl_key key = {.words = {0x0123456789abcdef, 1}};
    char etag[SPL_ETAG_BYTES];
    spl_key_etag(&key, etag);
    assert_string_equal(etag, "\"0123456789abcdef0000000000000001\"");
    static const char *const good[] = {
        "*",    " * ",     "%s",      " %s ",          "W/%s", "\"x\", %s", "\"x\",W/\"y\",%s",
        ",,%s", "\"\",%s", "%s, \"x", "\"a,b\"\t,\t%s", "W/\"y\" , %s"};
    static const char *const bad[] = {"",
                                      " ",
                                      "**",
                                      "* x",
                                      "\"",
                                      "\"x\"",
                                      "x",
                                      "x, %s",
                                      "W/",
                                      "w/%s",
                                      "\"%s",
                                      "\"x\" y, %s",
                                      "\"0123456789abcdef000000000000000\"",
                                      "0123456789abcdef0000000000000001"};
    char text[160];
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        const char *hole = strstr(good[i], "%s");
        snprintf(text, sizeof text, "%.*s%s%s", hole ? (int)(hole - good[i]) : (int)strlen(good[i]), good[i],
                 hole ? etag : "", hole ? hole + 2 : "");
        if (!spl_etag_matches(text, etag, false))
            fail_msg("%s does not match", text);
        const bool weak = strstr(good[i], "W/%s");
        if (spl_etag_matches(text, etag, true) == weak)
            fail_msg("%s %s", text, weak ? "is strong" : "does not match though it is strong");
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *hole = strstr(bad[i], "%s");
        snprintf(text, sizeof text, "%.*s%s%s", hole ? (int)(hole - bad[i]) : (int)strlen(bad[i]), bad[i],
                 hole ? etag : "", hole ? hole + 2 : "");
        if (spl_etag_matches(text, etag, false))
            fail_msg("%s matches", text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_means_the_same_has_one_key),
        cmocka_unit_test(what_a_dataset_lacks_is_left_out),
        cmocka_unit_test(what_changes_a_byte_has_a_key_of_its_own),
        cmocka_unit_test(rays_are_part_of_it),
        cmocka_unit_test(version_and_renderer_are_part_of_it),
        cmocka_unit_test(if_none_match_is_read_as_the_standard_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
