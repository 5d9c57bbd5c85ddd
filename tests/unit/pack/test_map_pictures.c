/* Pictures of maps: which ones scans bring along, and what is refused of them by their headers. */
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

#include <splatd/image.h>

#include "base/memory.h"
#include "pack/maps/pictures.h"
#include "pack/texture/photo_image.h"
#include "support/e57_writer.h"
#include "support/folder.h"

enum { width = 64, height = 32 };

static struct spl_encoded make_png(uint32_t w, uint32_t h)
{
    static uint8_t texels[height * width][4];
    struct spl_image image = {.layer = SPL_LAYER_COLOR, .width = w, .height = h, .pixels = texels};
    const struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG};
    struct spl_encoded out;
    memset(texels, 200, sizeof texels);
    assert_int_equal(spl_image_encode(&image, &options, &out, NULL), 0);
    return out;
}

static void put_png(const char *name, uint32_t w, uint32_t h)
{
    struct spl_encoded png = make_png(w, h);
    folder_put(name, png.bytes, png.length);
    spl_encoded_finish(&png);
}

/* 16 bits a channel, as converters of cameras write them. */
static void put_deep_png(const char *name)
{
    static float values[height * width];
    struct spl_image image = {
        .layer = SPL_LAYER_DEPTH, .type = SPL_PIXEL_F32, .width = width, .height = height, .pixels = values};
    const struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG};
    struct spl_encoded png;
    assert_int_equal(spl_image_encode(&image, &options, &png, NULL), 0);
    folder_put(name, png.bytes, png.length);
    spl_encoded_finish(&png);
}

static void put_list(const char *name, const char *const *images, size_t count)
{
    char json[2048] = "{\"panoramas\": [";
    for (size_t i = 0; i < count; i++)
        sprintf(json + strlen(json), "%s{\"name\": \"p%zu\", \"color\": \"%s\", \"position\": [%zu, 0, 0], "
                                     "\"quaternion\": [1, 0, 0, 0]}", i ? "," : "", i, images[i], i);
    strcat(json, "]}");
    folder_put(name, json, strlen(json));
}

/* One scan; with an image of an E57 file's own kinds where `image` says one. */
static void put_e57(const char *name, bool posed)
{
    struct e57_writer w;
    static const double one[1] = {1};
    const struct e57_field fields[] = {{.name = "cartesianX", .type = E57_DOUBLE, .values = one},
                                       {.name = "cartesianY", .type = E57_DOUBLE, .values = one},
                                       {.name = "cartesianZ", .type = E57_DOUBLE, .values = one}};
    struct spl_encoded png = make_png(width, height);
    size_t length;
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"scan", e57_pose(1, 0, 0, 0, 10, 20, 30), fields, 3, 1, 0});
    unsigned long long blob = e57_add_blob(&w, png.bytes, png.length);
    e57_add_image(&w,
                  "<name>p</name>%s<%s><imageWidth>64</imageWidth><imageHeight>32</imageHeight>"
                  "<pixelWidth>0.09817477</pixelWidth><pixelHeight>0.09817477</pixelHeight><pngImage type=\"Blob\" "
                  "fileOffset=\"%llu\" length=\"%zu\"/></%s>",
                  e57_pose(1, 0, 0, 0, 0, 0, 0), posed ? "sphericalRepresentation" : "visualReferenceRepresentation",
                  blob, png.length, posed ? "sphericalRepresentation" : "visualReferenceRepresentation");
    uint8_t *file = e57_end(&w, NULL, &length);
    folder_put(name, file, length);
    free(file);
    spl_encoded_finish(&png);
}

static void scans_bring_panoramas_along(void **state)
{
    struct spl_map_sources found;
    struct spl_view_list list;
    (void)state;
    assert_int_equal(mkdir(in_folder("scan"), 0777), 0);
    folder_put("scan/a.ply", "ply", 3);
    folder_put("scan/b.ply", "ply", 3);
    put_e57("scan/with.e57", true);
    put_e57("scan/without.e57", false);
    const char *scans[] = {in_folder("scan/a.ply"), in_folder("scan/b.ply"), in_folder("scan/with.e57"),
                           in_folder("scan/without.e57")};
    assert_int_equal(spl_map_sources_find(scans, 4, &found, NULL), 0);
    assert_int_equal(found.count, 1);
    assert_string_equal(found.paths[0], scans[2]);
    spl_map_sources_finish(&found);
    assert_int_equal(spl_map_sources_find(scans, 2, &found, NULL), 0);
    assert_int_equal(found.count, 0);
    spl_map_sources_finish(&found);

    assert_int_equal(mkdir(in_folder("scan/panoramas"), 0777), 0);
    folder_put("scan/panoramas/else.json", "{}", 2);
    assert_int_equal(spl_map_sources_find(scans, 2, &found, NULL), 0);
    assert_int_equal(found.count, 0);
    spl_map_sources_finish(&found);
    put_list("scan/panoramas/panoramas.json", (const char *const[]){"s.png"}, 1);
    put_png("scan/panoramas/s.png", width, height);
    const char *again[] = {in_folder("scan/a.ply"), in_folder("scan/b.ply"), in_folder("scan/with.e57")};
    assert_int_equal(spl_map_sources_find(again, 3, &found, NULL), 0);
    assert_int_equal(found.count, 2);
    assert_string_equal(found.paths[0], in_folder("scan/panoramas"));

    /* both, in one list */
    const struct spl_map_picture_options both = {.paths = (const char *const *)found.paths, .count = 2};
    struct spl_error err = {0};
    if (spl_map_pictures_load(&both, &list, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 12);
    assert_int_equal(list.views[5].panorama, 1);
    assert_int_equal(list.views[6].panorama, 2);
    struct spl_image image;
    assert_int_equal(spl_photo_image_load(&list.views[0], &image, NULL), 0);
    spl_image_finish(&image);
    spl_view_list_finish(&list);
    spl_map_sources_finish(&found);

    /* a name alone lies in the folder where one is */
    char *old = getcwd(NULL, 0);
    assert_int_equal(chdir(in_folder("scan")), 0);
    assert_int_equal(spl_map_sources_find((const char *const[]){"a.ply"}, 1, &found, NULL), 0);
    assert_int_equal(found.count, 1);
    assert_string_equal(found.paths[0], "panoramas");
    spl_map_sources_finish(&found);
    assert_int_equal(chdir(old), 0);
    free(old);

    for (long n = 1;; n++) {
        spl_memory_fail_after(n);
        int rc = spl_map_sources_find(again, 2, &found, &err);
        spl_memory_fail_after(0);
        spl_map_sources_finish(&found);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_in_range(n, 1, 100);
    }
}

static unsigned refused_count;
static struct spl_error refused_last;

static void refuse(void *context, const struct spl_error *why)
{
    (void)context;
    refused_count++;
    refused_last = *why;
}

static void headers_are_checked_before_packing(void **state)
{
    static const struct {
        const char *image;
        int code;
        const char *part;
    } cases[] = {
        {"empty.png", SPL_E_INPUT, "neither PNG nor JPEG"},
        {"none.png", SPL_E_NOT_FOUND, "no such file"},
        {"deep.png", SPL_E_UNSUPPORTED, "16 bit"},
        {"square.png", SPL_E_INPUT, "equirectangular"},
        {"cut.png", SPL_E_INPUT, "cut.png"},
    };
    struct spl_encoded png = make_png(width, height);
    (void)state;
    folder_put("empty.png", "", 0);
    folder_put("cut.png", png.bytes, 20);
    put_deep_png("deep.png");
    put_png("square.png", 32, 32);
    put_png("good.png", width, height);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_view_list list;
        struct spl_error err = {0};
        const char *path = in_folder("panoramas.json");
        struct spl_map_picture_options options = {.paths = &path, .count = 1};
        put_list("panoramas.json", (const char *const[]){"good.png", cases[i].image, "good.png"}, 3);
        assert_int_equal(spl_map_pictures_load(&options, &list, &err), cases[i].code);
        assert_null(list.views);
        if (!strstr(err.message, cases[i].part) || !strstr(err.message, cases[i].image))
            fail_msg("\"%s\" lacks \"%s\"", err.message, cases[i].part);
        options.refuse = refuse;
        refused_count = 0;
        assert_int_equal(spl_map_pictures_load(&options, &list, NULL), 0);
        assert_int_equal(refused_count, 1);
        assert_non_null(strstr(refused_last.message, cases[i].part));
        assert_int_equal(list.count, 12);
        assert_string_equal(list.views[0].name, "p0-front");
        assert_string_equal(list.views[6].name, "p2-front");
        spl_view_list_finish(&list);
        folder_put("other.json", "{}", 2);
        options.paths = (const char *const[]){in_folder("other.json"), path};
        options.count = 2;
        assert_int_equal(spl_map_pictures_load(&options, &list, NULL), 0);
        assert_int_equal(refused_count, 3);
        assert_int_equal(list.count, 12);
        spl_view_list_finish(&list);
        options.paths++;
        options.count--;
        put_list("panoramas.json", &cases[i].image, 1);
        assert_true(spl_map_pictures_load(&options, &list, &err) < 0);
    }
    spl_encoded_finish(&png);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scans_bring_panoramas_along),
        cmocka_unit_test(headers_are_checked_before_packing),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
