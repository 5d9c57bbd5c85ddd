/* What the encoders wrote is read back to the bit; what is damaged, too large or of another layer is refused with the
 * file's name. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include <turbojpeg.h>

#include "base/memory.h"
#include "image/load.h"

static char path[] = "/tmp/splatd-load-XXXXXX";

static void put(const void *bytes, size_t length)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, length, file), length);
    fclose(file);
}

static struct spl_encoded put_encoded(const struct spl_image *image, enum spl_format format)
{
    struct spl_encoded encoded;
    struct spl_encode_options options = {.size = sizeof options, .format = format, .quality = 100};
    assert_int_equal(spl_image_encode(image, &options, &encoded, NULL), 0);
    put(encoded.bytes, encoded.length);
    return encoded;
}

static void put_npy(const char *dictionary, int version, const void *data, size_t length)
{
    char bytes[1024] = "\x93NUMPY";
    size_t used = strlen(dictionary), prefix = version > 1 ? 12 : 10;
    bytes[6] = (char)version;
    bytes[8] = (char)used;
    memcpy(bytes + prefix, dictionary, used);
    memcpy(bytes + prefix + used, data, length);
    put(bytes, prefix + used + length);
}

static void assert_refused(enum spl_layer layer, int code, const char *field, const char *says)
{
    struct spl_image image;
    struct spl_error err = {0};
    memset(&image, 0x55, sizeof image);
    assert_int_equal(spl_image_load(path, layer, &image, &err), code);
    assert_string_equal(err.field, field);
    if (!strstr(err.message, path) || !strstr(err.message, says))
        fail_msg("'%s' lacks '%s' or the path", err.message, says);
    static const struct spl_image zero;
    assert_memory_equal(&image, &zero, sizeof image);
}

static void what_is_no_image_is_refused(void **state)
{
    (void)state;
    struct spl_image image;
    struct spl_error err = {0};
    assert_int_equal(spl_image_load("/nowhere/a.png", SPL_LAYER_COLOR, &image, &err), SPL_E_NOT_FOUND);
    char pipe[sizeof path + 5];
    snprintf(pipe, sizeof pipe, "%s.pipe", path);
    assert_int_equal(mkfifo(pipe, 0600), 0);
    alarm(60); /* a pipe that nobody writes to keeps nobody waiting */
    assert_int_equal(spl_image_load(pipe, SPL_LAYER_COLOR, &image, NULL), SPL_E_INPUT);
    alarm(0);
    unlink(pipe);
    assert_non_null(strstr(err.message, "/nowhere/a.png"));
    assert_int_equal(spl_image_load("/tmp", SPL_LAYER_COLOR, &image, NULL), SPL_E_INPUT);
    put("", 0);
    assert_refused(SPL_LAYER_COLOR, SPL_E_INPUT, "", "neither");
    put("GIF89a", 6);
    assert_refused(SPL_LAYER_COLOR, SPL_E_INPUT, "", "neither");
    put("\x89PNG\r\n\x1a\n", 8);
    assert_refused(SPL_LAYER_COLOR, SPL_E_INPUT, "", "PNG");
    assert_refused(SPL_LAYER_NORMAL, SPL_E_UNSUPPORTED, "layer", "normal");
    put("\xff\xd8\xff", 3);
    assert_refused(SPL_LAYER_COLOR, SPL_E_INPUT, "width", "0 x 0");
    assert_refused(SPL_LAYER_DEPTH, SPL_E_UNSUPPORTED, "layer", "depth");
}

static void broken_npy_is_refused_by_field(void **state)
{
    (void)state;
#define SHAPE(text) "{'descr': '<f4', 'fortran_order': False, 'shape': " text ", }"
    static const struct {
        const char *dictionary;
        enum spl_layer layer;
        int code;
        const char *field, *says;
    } rows[] = {
        {SHAPE("(1, 2)"), SPL_LAYER_NORMAL, SPL_E_INPUT, "shape", "normal"},
        {SHAPE("(1, 2)"), SPL_LAYER_COLOR, SPL_E_INPUT, "descr", "|u1"},
        {SHAPE("(1, 2)"), SPL_LAYER_ID, SPL_E_INPUT, "descr", "'<f4'"},
        {SHAPE("(1, 3)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "8 bytes behind the header, 3 x 1 pixels need 12"},
        {SHAPE("(1, 1)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "need 4"},
        {SHAPE("(0, 2)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "need 0"},
        {SHAPE("(2,)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "(height, width)"},
        {SHAPE("()"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "(height, width)"},
        {SHAPE("(1, 2, 1, 1, 1)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "(height, width)"},
        {SHAPE("(1, -2)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", "(height, width)"},
        {SHAPE("(1, 99999999999999999999999)"), SPL_LAYER_DEPTH, SPL_E_INPUT, "shape",
         "not (1, 99999999999999999999999)"},
        {SHAPE("(4611686018427387905, 4)"), SPL_LAYER_DEPTH, SPL_E_LIMIT, "height", "4 x 4611686018427387905 pixels"},
        {SHAPE("(4, 18446744073709551615)"), SPL_LAYER_DEPTH, SPL_E_LIMIT, "width", "18446744073709551615 x 4 pixels"},
        {SHAPE("(4294967296, 4294967296)"), SPL_LAYER_DEPTH, SPL_E_LIMIT, "height", "limit"},
        {SHAPE("(8192, 16385)"), SPL_LAYER_DEPTH, SPL_E_LIMIT, "width", "16385 x 8192"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }", SPL_LAYER_DEPTH, SPL_E_INPUT, "descr", "'<f8'"},
        {"{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }", SPL_LAYER_DEPTH, SPL_E_INPUT, "fortran_order",
         ""},
        {"{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1, 2), }", SPL_LAYER_DEPTH, SPL_E_INPUT, "descr",
         "'('"},
        {"{'descr': '<f4', 'shape': (1, 2), }", SPL_LAYER_DEPTH, SPL_E_INPUT, "fortran_order", ""},
        {"{'descr': '<f4', 'fortran_order': False}", SPL_LAYER_DEPTH, SPL_E_INPUT, "shape", ""},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), 'shape' : (2, 1), }", SPL_LAYER_DEPTH, SPL_E_INPUT,
         "shape", "twice"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), 'descr': '<f4'}", SPL_LAYER_DEPTH, SPL_E_INPUT,
         "descr", "twice"},
        {"", SPL_LAYER_DEPTH, SPL_E_INPUT, "version", ""},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        put_npy(rows[i].dictionary, 1, (float[2]){1, 2}, 8);
        assert_refused(rows[i].layer, rows[i].code, rows[i].field, rows[i].says);
    }
    put_npy(SHAPE("(1, 2)"), 4, (float[2]){1, 2}, 8);
    assert_refused(SPL_LAYER_DEPTH, SPL_E_INPUT, "version", "");
    put("\x93NUMPY\x01\x00\xff\xff{", 11);
    assert_refused(SPL_LAYER_DEPTH, SPL_E_INPUT, "header", "longer");
    put("\x93NUMPY\x01\x00\xff\x00{", 11);
    assert_refused(SPL_LAYER_DEPTH, SPL_E_INPUT, "header", "cut off");
}

static void npy_comes_back_to_the_bit(void **state)
{
    (void)state;
    uint32_t words[] = {0x3f800000, 0x7fc00000, 0xffffffff, 0, 0x04030201, 0x42280000};
    struct spl_image images[] = {
        {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 3, 2, words}, {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 2, 3, words},
        {SPL_LAYER_RANGE, SPL_PIXEL_F32, 6, 1, words},   {SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 2, 1, words},
        {SPL_LAYER_ID, SPL_PIXEL_U32, 1, 6, words},      {SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 3, 2, words},
        {SPL_LAYER_PRIMITIVE, SPL_PIXEL_U32, 2, 3, words},
    };
    for (int i = 0; i < 7; i++) {
        struct spl_encoded encoded = put_encoded(&images[i], SPL_FORMAT_NPY);
        spl_encoded_finish(&encoded);
        struct spl_image back;
        assert_int_equal(spl_image_load(path, images[i].layer, &back, NULL), 0);
        assert_int_equal(back.layer, images[i].layer);
        assert_int_equal(back.type, images[i].type);
        assert_int_equal(back.width, images[i].width);
        assert_int_equal(back.height, images[i].height);
        assert_memory_equal(back.pixels, words, sizeof words);
        spl_image_finish(&back);
    }
    /* keys in another order, version 2, as other writers have it */
    struct spl_image back;
    put_npy("{'shape':(1,2),'fortran_order':False,'descr':'<f4'}\n", 2, (float[2]){1, 2}, 8);
    assert_int_equal(spl_image_load(path, SPL_LAYER_DEPTH, &back, NULL), 0);
    assert_int_equal(back.width, 2);
    assert_true(((float *)back.pixels)[1] == 2);
    spl_image_finish(&back);
}

static void pictures_come_back(void **state)
{
    (void)state;
    uint8_t pixels[4 * 64];
    for (int i = 0; i < 256; i++)
        pixels[i] = (uint8_t)(i % 4 == 3 ? i * 7 : 100 + i / 16);
    struct spl_image image = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 16, 4, pixels}, back;
    struct spl_encoded encoded = put_encoded(&image, SPL_FORMAT_PNG);
    assert_int_equal(spl_image_load(path, SPL_LAYER_COLOR, &back, NULL), 0);
    assert_true(back.width == 16 && back.height == 4);
    assert_memory_equal(back.pixels, pixels, sizeof pixels);
    spl_image_finish(&back);
    assert_refused(SPL_LAYER_DEPTH, SPL_E_INPUT, "layer", "16 bit grey");
    for (size_t length = 8; length < encoded.length - 20; length += 5) { /* cut short before the last pixel */
        put(encoded.bytes, length);
        assert_refused(SPL_LAYER_COLOR, SPL_E_INPUT, "", "PNG");
    }
    spl_encoded_finish(&encoded);

    encoded = put_encoded(&image, SPL_FORMAT_JPEG);
    assert_int_equal(spl_image_load(path, SPL_LAYER_COLOR, &back, NULL), 0);
    for (int i = 0; i < 256; i++) {
        int got = ((uint8_t *)back.pixels)[i];
        assert_true(i % 4 == 3 ? got == 255 : abs(got - pixels[i]) <= 3);
    }
    spl_image_finish(&back);
    for (size_t length = 3; length < encoded.length; length += 29) {
        put(encoded.bytes, length);
        struct spl_error err = {0};
        assert_int_equal(spl_image_load(path, SPL_LAYER_COLOR, &back, &err), SPL_E_INPUT);
        assert_non_null(strstr(err.message, path));
    }
    spl_encoded_finish(&encoded);
}

static void depth_png_has_steps_and_nothing(void **state)
{
    (void)state;
    float depth[] = {NAN, 1.5f, 12.345f, 70};
    struct spl_image image = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 2, 2, depth}, back;
    struct spl_encoded encoded = put_encoded(&image, SPL_FORMAT_PNG);
    assert_int_equal(spl_image_load(path, SPL_LAYER_RANGE, &back, NULL), 0);
    const float *got = back.pixels;
    assert_true(isnan(got[0]) && got[1] == 1.5f && got[2] == 12.345f && isnan(got[3]));
    assert_int_equal(back.layer, SPL_LAYER_RANGE);
    spl_image_finish(&back);
    spl_encoded_finish(&encoded);
    struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG, .depth_scale = 100};
    assert_int_equal(spl_image_encode(&image, &options, &encoded, NULL), 0);
    put(encoded.bytes, encoded.length);
    spl_encoded_finish(&encoded);
    assert_int_equal(spl_image_load(path, SPL_LAYER_DEPTH, &back, NULL), 0);
    got = back.pixels;
    assert_true(got[1] == 1.5f && fabsf(got[2] - 12.35f) < 1e-5f && got[3] == 70); /* 12.345 rounds to 1235 steps */
    spl_image_finish(&back);
}

/* 4 gigapixels in a few bytes: refused by the header. */
static void a_bomb_is_refused_before_memory_is_taken(void **state)
{
    (void)state;
    uint8_t pixel[4] = {0};
    struct spl_image image = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 1, 1, pixel};
    struct spl_encoded encoded = put_encoded(&image, SPL_FORMAT_JPEG);
    uint8_t *frame = memmem(encoded.bytes, encoded.length, "\xff\xc0", 2);
    assert_non_null(frame);
    memset(frame + 5, 0xf0, 4); /* height and width: 0xf0f0 */
    put(encoded.bytes, encoded.length);
    assert_refused(SPL_LAYER_COLOR, SPL_E_LIMIT, "height", "61680 x 61680");
    spl_encoded_finish(&encoded);
}

static void no_refused_allocation_is_passed_over(void **state)
{
    (void)state;
    float depth[] = {1, 2};
    uint8_t pixels[8] = {0};
    struct spl_image images[] = {{SPL_LAYER_DEPTH, SPL_PIXEL_F32, 2, 1, depth},
                                 {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 2, 1, depth},
                                 {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 2, 1, pixels}};
    static const enum spl_format formats[] = {SPL_FORMAT_NPY, SPL_FORMAT_PNG, SPL_FORMAT_JPEG};
    for (int i = 0; i < 3; i++) {
        struct spl_encoded encoded = put_encoded(&images[i], formats[i]);
        spl_encoded_finish(&encoded);
        struct spl_image back;
        struct spl_error err = {0};
        spl_memory_fail_after(1);
        assert_int_equal(spl_image_load(path, images[i].layer, &back, &err), SPL_E_NOMEM);
        spl_memory_fail_after(0);
        assert_null(back.pixels);
        assert_int_equal(err.code, SPL_E_NOMEM);
        for (int n = 2; n < 6; n++) { /* a note that cannot be read is no reason to read another scale */
            spl_memory_fail_after(n);
            int rc = spl_image_load(path, images[i].layer, &back, NULL);
            spl_memory_fail_after(0);
            assert_true(rc == 0 || rc == SPL_E_NOMEM);
            if (!rc && i < 2)
                assert_true(((float *)back.pixels)[1] == 2);
            spl_image_finish(&back);
        }
    }
}

static int make_file(void **state)
{
    (void)state;
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

static void headers_say_what_a_photograph_is(void **state)
{
    (void)state;
    struct spl_image_info info;
    struct spl_error err = {0};
    static uint8_t pixels[6 * 5 * 4];
    struct spl_image image = {.type = SPL_PIXEL_RGBA8, .width = 6, .height = 5, .pixels = pixels};
    struct spl_encoded encoded = put_encoded(&image, SPL_FORMAT_JPEG);
    assert_int_equal(spl_image_get_info(path, &info, NULL), 0);
    assert_true(info.width == 6 && info.height == 5 && info.bits == 8 && !info.cmyk);
    put(encoded.bytes, 20); /* cut within its header */
    assert_int_equal(spl_image_get_info(path, &info, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, path));
    spl_encoded_finish(&encoded);
    encoded = put_encoded(&image, SPL_FORMAT_PNG);
    assert_int_equal(spl_image_get_info(path, &info, NULL), 0);
    assert_true(info.width == 6 && info.height == 5 && info.bits == 8 && !info.cmyk);
    spl_encoded_finish(&encoded);
    static float depths[30];
    struct spl_image depth = {
        .layer = SPL_LAYER_DEPTH, .type = SPL_PIXEL_F32, .width = 6, .height = 5, .pixels = depths};
    encoded = put_encoded(&depth, SPL_FORMAT_PNG);
    assert_int_equal(spl_image_get_info(path, &info, NULL), 0);
    assert_int_equal(info.bits, 16);
    spl_encoded_finish(&encoded);
    encoded = put_encoded(&depth, SPL_FORMAT_NPY);
    assert_int_equal(spl_image_get_info(path, &info, NULL), SPL_E_UNSUPPORTED);
    spl_encoded_finish(&encoded);
    tjhandle handle = tjInitCompress();
    unsigned char *bytes = NULL;
    unsigned long length = 0;
    assert_int_equal(tjCompress2(handle, pixels, 6, 0, 5, TJPF_CMYK, &bytes, &length, TJSAMP_444, 90, 0), 0);
    put(bytes, length);
    tjFree(bytes);
    tjDestroy(handle);
    assert_int_equal(spl_image_get_info(path, &info, NULL), 0);
    assert_true(info.cmyk && info.width == 6);
    assert_int_equal(spl_image_get_info("/nowhere.png", &info, NULL), SPL_E_NOT_FOUND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_no_image_is_refused),      cmocka_unit_test(broken_npy_is_refused_by_field),
        cmocka_unit_test(npy_comes_back_to_the_bit),        cmocka_unit_test(pictures_come_back),
        cmocka_unit_test(depth_png_has_steps_and_nothing),  cmocka_unit_test(a_bomb_is_refused_before_memory_is_taken),
        cmocka_unit_test(headers_say_what_a_photograph_is), cmocka_unit_test(no_refused_allocation_is_passed_over),
    };
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
