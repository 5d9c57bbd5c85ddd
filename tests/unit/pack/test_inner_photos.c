/* Photographs inside an E57 file as pixels: a pinhole as it was stored, a panorama's faces by their angles, black and
 * what lies outside transparent, and sizes that contradict the file. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "pack/texture/photo_image.h"
#include "support/e57_writer.h"

enum { width = 256, height = 128 };

static char path[64];

/* Red grows with the column, green with the row; the lowest eighth is black. */
static struct spl_encoded make_png(void)
{
    static uint8_t texels[height][width][4];
    struct spl_image image = {
        .layer = SPL_LAYER_COLOR, .type = SPL_PIXEL_RGBA8, .width = width, .height = height, .pixels = texels};
    const struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG};
    struct spl_encoded out;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            uint8_t color[4] = {(uint8_t)x, (uint8_t)(2 * y), 100, 255};
            memcpy(texels[y][x], y >= height * 7 / 8 ? (uint8_t[4]){1, 2, 3, 255} : color, 4);
        }
    assert_int_equal(spl_image_encode(&image, &options, &out, NULL), 0);
    return out;
}

/* One spherical image of `columns` pixels that goes `turns` around. */
static void load(double turns, unsigned columns, struct spl_view_list *list)
{
    struct e57_writer w;
    struct spl_error err = {0};
    struct spl_encoded png = make_png();
    size_t length;
    e57_begin(&w);
    unsigned long long blob = e57_add_blob(&w, png.bytes, png.length);
    double pixel = 2 * M_PI * turns / width;
    e57_add_image(&w,
                  "<name>p</name>%s<sphericalRepresentation><imageWidth>%u</imageWidth><imageHeight>%u</imageHeight>"
                  "<pixelWidth>%.17g</pixelWidth><pixelHeight>%.17g</pixelHeight><pngImage type=\"Blob\" "
                  "fileOffset=\"%llu\" length=\"%zu\"/></sphericalRepresentation>",
                  e57_pose(1, 0, 0, 0, 0, 0, 0), columns, height, pixel, pixel, blob, png.length);
    uint8_t *file = e57_end(&w, NULL, &length);
    FILE *out = fopen(path, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(file, 1, length, out), length);
    fclose(out);
    free(file);
    spl_encoded_finish(&png);
    const struct spl_photograph_options options = {0};
    if (spl_view_list_load_photographs(list, path, &options, &err))
        fail_msg("%s", err.message);
}

static void faces_have_the_panoramas_colours(void **state)
{
    struct spl_view_list list;
    (void)state;
    load(1, width, &list);
    assert_int_equal(list.count, 6);
    for (size_t v = 0; v < list.count; v++) {
        const struct spl_named_view *view = &list.views[v];
        const struct spl_camera *c = &view->camera;
        struct spl_image_info info;
        struct spl_image image;
        unsigned compared = 0;
        assert_int_equal(spl_photo_image_get_info(view, &info, NULL), 0);
        assert_true(info.width == c->width && info.height == c->height);
        assert_int_equal(spl_photo_image_load(view, &image, NULL), 0);
        assert_true(image.width == c->width && image.height == c->height);
        for (uint32_t y = 0; y < c->height; y += 5)
            for (uint32_t x = 0; x < c->width; x += 5) {
                /* of the camera's axes, which are rows of its rotation, not of the face's */
                double d[3], in[3] = {(x + 0.5 - c->cx) / c->fx, (y + 0.5 - c->cy) / c->fy, 1};
                for (int k = 0; k < 3; k++)
                    d[k] = c->rotation[k] * in[0] + c->rotation[3 + k] * in[1] + c->rotation[6 + k] * in[2];
                double column = width * (0.5 - atan2(d[1], d[0]) / (2 * M_PI)) - 0.5;
                double row = height * (0.5 - atan2(d[2], hypot(d[0], d[1])) / M_PI) - 0.5;
                const uint8_t *texel = (const uint8_t *)image.pixels + 4 * ((size_t)y * c->width + x);
                if (row >= height * 7 / 8) {
                    assert_int_equal(texel[3], 0);
                } else if (row > 0 && row < height * 7 / 8 - 1 && column > 0 && column < width - 1) {
                    assert_int_equal(texel[3], 255);
                    assert_true(fabs(texel[0] - column) < 1 && fabs(texel[1] - 2 * row) < 1 && texel[2] == 100);
                    compared++;
                }
            }
        assert_true(compared > 50 || v == 5);
        spl_image_finish(&image);
    }
    spl_view_list_finish(&list);
}

static void a_quarter_of_a_panorama_ends_at_its_edges(void **state)
{
    struct spl_view_list list;
    struct spl_image image;
    (void)state;
    load(0.1, width, &list);
    assert_int_equal(list.count, 1);
    assert_int_equal(spl_photo_image_load(&list.views[0], &image, NULL), 0);
    const uint8_t(*texels)[4] = image.pixels;
    size_t middle = (size_t)image.height / 2 * image.width;
    assert_int_equal(texels[middle][3], 0);
    assert_int_equal(texels[middle + image.width - 1][3], 0);
    assert_int_equal(texels[middle + image.width / 2][3], 255);
    assert_in_range(texels[middle + image.width / 2][0], 126, 130);
    spl_image_finish(&image);
    spl_view_list_finish(&list);
}

static void the_size_that_the_file_says_must_be_the_images(void **state)
{
    struct spl_view_list list;
    struct spl_image image;
    struct spl_image_info info;
    struct spl_error err = {0};
    (void)state;
    load(0.5, width - 1, &list);
    assert_int_equal(spl_photo_image_get_info(&list.views[0], &info, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "imageWidth");
    assert_int_equal(spl_photo_image_load(&list.views[0], &image, NULL), SPL_E_INPUT);
    assert_null(image.pixels);
    spl_view_list_finish(&list);
}

static void a_panorama_is_read_once_for_its_faces(void **state)
{
    struct spl_view_list list;
    struct spl_photo_whole whole = {0};
    (void)state;
    load(1, width, &list);
    for (size_t v = 0; v < list.count; v++) {
        struct spl_image image, alone;
        if (v == 1)
            assert_int_equal(truncate(path, 0), 0); /* no face but the first needs the file */
        assert_int_equal(spl_photo_image_load_of(&whole, &list.views[v], &image, NULL), 0);
        assert_int_equal(spl_photo_image_load(&list.views[v], &alone, NULL), v ? SPL_E_INPUT : 0);
        if (!v)
            assert_memory_equal(image.pixels, alone.pixels, (size_t)image.width * image.height * 4);
        spl_image_finish(&image);
        spl_image_finish(&alone);
    }
    /* another section of the same file is another panorama */
    struct spl_image image;
    list.views[0].inner->at++;
    assert_true(spl_photo_image_load_of(&whole, &list.views[0], &image, NULL) < 0);
    spl_photo_whole_finish(&whole);
    spl_view_list_finish(&list);
}

/* White on the left and nothing, which is stored as black, on the right: between them is white, ever thinner. */
static void what_a_panorama_does_not_show_lends_no_colour(void **state)
{
    static uint8_t texels[height][width][4];
    struct spl_image image = {
        .layer = SPL_LAYER_COLOR, .type = SPL_PIXEL_RGBA8, .width = width, .height = height, .pixels = texels};
    const struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG};
    struct spl_inner_photograph inner = {.path = path, .is_panorama = true, .width = width, .height = height};
    struct spl_named_view view = {.photograph = path, .inner = &inner};
    struct spl_encoded png;
    (void)state;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width / 2; x++)
            memset(texels[y][x], 255, 4);
    assert_int_equal(spl_image_encode(&image, &options, &png, NULL), 0);
    FILE *out = fopen(path, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(png.bytes, 1, png.length, out), png.length);
    fclose(out);
    spl_encoded_finish(&png);
    inner.panorama = (struct spl_panorama){.width = width,
                                           .height = height,
                                           .across = width / (2 * M_PI),
                                           .down = height / M_PI,
                                           .horizon = height / 2.0};
    spl_panorama_face(0, inner.panorama.rotation);
    view.camera = (struct spl_camera){.width = 200, .height = 200, .fx = 100, .fy = 100, .cx = 100, .cy = 100};
    assert_int_equal(spl_photo_image_load(&view, &image, NULL), 0);
    unsigned thin = 0;
    for (size_t i = 0; i < 200 * 200; i++) {
        const uint8_t *texel = (const uint8_t *)image.pixels + 4 * i;
        thin += texel[3] > 0 && texel[3] < 255;
        assert_true(!texel[3] || texel[0] == 255);
    }
    assert_true(thin > 200);
    spl_image_finish(&image);
    inner.height++;
    struct spl_error err = {0};
    assert_int_equal(spl_photo_image_load(&view, &image, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "width");
    unlink(path);
    assert_int_equal(spl_photo_image_load(&view, &image, NULL), SPL_E_NOT_FOUND);
}

static int remove_file(void **state)
{
    (void)state;
    unlink(path);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faces_have_the_panoramas_colours),
        cmocka_unit_test(a_quarter_of_a_panorama_ends_at_its_edges),
        cmocka_unit_test(the_size_that_the_file_says_must_be_the_images),
        cmocka_unit_test(a_panorama_is_read_once_for_its_faces),
        cmocka_unit_test(what_a_panorama_does_not_show_lends_no_colour),
    };
    snprintf(path, sizeof path, "/tmp/splatd-test-inner-%ld", (long)getpid());
    return cmocka_run_group_tests(tests, NULL, remove_file);
}
