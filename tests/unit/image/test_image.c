/* Encoded images decode back to what went in: PNG and NPY to the bit, JPEG to the eye. What the formats cannot hold is
 * refused by field, and no allocation that fails is passed over. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include <spng.h>
#include <splatd/image.h>
#include <turbojpeg.h>

#include "base/memory.h"

#define ENCODE(image, ...) encode(image, &SPL_SIZED(spl_encode_options, __VA_ARGS__))

static struct spl_encoded encode(const struct spl_image *image, const struct spl_encode_options *options)
{
    struct spl_error err = {0};
    struct spl_encoded out;
    if (spl_image_encode(image, options, &out, &err))
        fail_msg("%s", err.message);
    assert_non_null(out.media_type);
    return out;
}

/* Decodes to the file's own channels and depth (16 bit in host order). */
static uint8_t *decode_png(const struct spl_encoded *png, struct spng_ihdr *header, char note[128])
{
    assert_string_equal(png->media_type, "image/png");
    spng_ctx *ctx = spng_ctx_new(0);
    spng_set_png_buffer(ctx, png->bytes, png->length);
    assert_int_equal(spng_get_ihdr(ctx, header), 0);
    size_t length;
    assert_int_equal(spng_decoded_image_size(ctx, SPNG_FMT_PNG, &length), 0);
    uint8_t *pixels = malloc(length);
    assert_int_equal(spng_decode_image(ctx, pixels, length, SPNG_FMT_PNG, 0), 0);
    if (note) {
        struct spng_text text;
        uint32_t count = 1;
        note[0] = 0;
        if (!spng_get_text(ctx, &text, &count) && count == 1) {
            assert_string_equal(text.keyword, "Depth-Scale");
            memcpy(note, text.text, text.length);
            note[text.length] = 0;
        }
    }
    spng_ctx_free(ctx);
    return pixels;
}

static uint8_t *decode_jpeg(const struct spl_encoded *jpeg, int *width, int *height, int *sampling)
{
    assert_string_equal(jpeg->media_type, "image/jpeg");
    int colorspace;
    tjhandle handle = tjInitDecompress();
    assert_int_equal(tjDecompressHeader3(handle, jpeg->bytes, jpeg->length, width, height, sampling, &colorspace), 0);
    uint8_t *rgb = malloc((size_t)*width * (size_t)*height * 3);
    assert_int_equal(tjDecompress2(handle, jpeg->bytes, jpeg->length, rgb, *width, 0, *height, TJPF_RGB, 0), 0);
    tjDestroy(handle);
    return rgb;
}

/* A picture whose channels all differ and whose alpha is not constant. */
static struct spl_image make_color(uint32_t width, uint32_t height)
{
    struct spl_image image = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, width, height, malloc((size_t)width * height * 4)};
    uint8_t *p = image.pixels;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++, p += 4) {
            p[0] = (uint8_t)(x * 255 / width);
            p[1] = (uint8_t)(y * 255 / height);
            p[2] = (uint8_t)(255 - p[0]);
            p[3] = (uint8_t)(x + y);
        }
    return image;
}

static void png_color_is_lossless_and_keeps_alpha(void **state)
{
    (void)state;
    struct spl_image image = make_color(67, 31);
    struct spl_encoded png = ENCODE(&image, .format = SPL_FORMAT_PNG);
    struct spng_ihdr header;
    uint8_t *decoded = decode_png(&png, &header, NULL);
    assert_int_equal(header.width, 67);
    assert_int_equal(header.height, 31);
    assert_int_equal(header.color_type, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA);
    assert_memory_equal(decoded, image.pixels, 67 * 31 * 4);
    free(decoded);
    spl_encoded_finish(&png);
    spl_image_finish(&image);
    assert_null(image.pixels);
    assert_int_equal(image.width, 0);
}

static void png_depth_is_16_bit_with_scale_and_saturation(void **state)
{
    (void)state;
    float depth[] = {NAN, 1.0f, 0.0001f, 65.5349f, 65.5351f, 65.6f, INFINITY, 0.2584f, -1.0f};
    static const uint16_t expected[] = {0, 1000, 1, 65535, 65535, 65535, 65535, 258, 0};
    struct spl_image image = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 3, 3, depth};
    struct spl_encoded png = ENCODE(&image, .format = SPL_FORMAT_PNG);
    struct spng_ihdr header;
    char note[128];
    uint8_t *decoded = decode_png(&png, &header, note);
    assert_int_equal(header.bit_depth, 16);
    assert_int_equal(header.color_type, SPNG_COLOR_TYPE_GRAYSCALE);
    assert_memory_equal(decoded, expected, sizeof expected);
    assert_int_equal(png.saturated, 2);
    assert_string_equal(note, "1000 steps per unit, 0 = nothing, 65535 = that far or farther");
    free(decoded);
    spl_encoded_finish(&png);

    png = ENCODE(&image, .format = SPL_FORMAT_PNG, .unit = "us-ft");
    free(decode_png(&png, &header, note));
    assert_string_equal(note, "1000 steps per us-ft, 0 = nothing, 65535 = that far or farther");
    spl_encoded_finish(&png);

    /* TUM's scale; 13.2 m no longer fits */
    image.layer = SPL_LAYER_RANGE;
    depth[3] = 13.2f;
    png = ENCODE(&image, .format = SPL_FORMAT_PNG, .depth_scale = 5000);
    decoded = decode_png(&png, &header, note);
    assert_int_equal(((uint16_t *)decoded)[1], 5000);
    assert_int_equal(png.saturated, 5 - 1);
    assert_int_equal(strncmp(note, "5000 steps", 10), 0);
    free(decoded);
    spl_encoded_finish(&png);
}

/* The bytes in the file, not what a decoder makes of them: one 16 bit pixel of 0x0102, unfiltered by hand. */
static void png_depth_is_big_endian_in_the_file(void **state)
{
    (void)state;
    float depth = 0.258f;
    struct spl_image image = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 1, 1, &depth};
    struct spl_encoded png = ENCODE(&image, .format = SPL_FORMAT_PNG);
    spng_ctx *ctx = spng_ctx_new(0);
    spng_set_png_buffer(ctx, png.bytes, png.length);
    uint8_t raw[2];
    assert_int_equal(spng_decode_image(ctx, raw, sizeof raw, SPNG_FMT_RAW, 0), 0);
    assert_int_equal(raw[0], 1);
    assert_int_equal(raw[1], 2);
    spng_ctx_free(ctx);
    spl_encoded_finish(&png);
}

static void png_of_the_other_layers(void **state)
{
    (void)state;
    float normals[] = {0, 0, 0, 1, 0, -1, 0, 0.6f, 0.8f, NAN, 0, 1};
    static const uint8_t normal_bytes[] = {0, 0, 0, 255, 128, 0, 128, 204, 230, 0, 0, 0};
    struct spl_image image = {SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 2, 2, normals};
    struct spl_encoded png = ENCODE(&image, .format = SPL_FORMAT_PNG);
    struct spng_ihdr header;
    char note[128];
    uint8_t *decoded = decode_png(&png, &header, note);
    assert_int_equal(header.color_type, SPNG_COLOR_TYPE_TRUECOLOR);
    assert_memory_equal(decoded, normal_bytes, sizeof normal_bytes);
    assert_string_equal(note, "");
    free(decoded);
    spl_encoded_finish(&png);

    uint32_t ids[] = {0x04030201, UINT32_MAX};
    static const uint8_t id_bytes[] = {1, 2, 3, 4, 255, 255, 255, 255};
    struct spl_image id_image = {SPL_LAYER_ID, SPL_PIXEL_U32, 2, 1, ids};
    png = ENCODE(&id_image, .format = SPL_FORMAT_PNG);
    decoded = decode_png(&png, &header, NULL);
    assert_memory_equal(decoded, id_bytes, sizeof id_bytes);
    free(decoded);
    spl_encoded_finish(&png);

    uint32_t shapes[] = {SPL_SHAPE_NONE, SPL_SHAPE_SPLAT, SPL_SHAPE_LINE, SPL_SHAPE_PANEL, SPL_SHAPE_MESH, UINT32_MAX};
    static const uint8_t shape_bytes[] = {0,   0,  0, 86, 180, 233, 240, 228, 66,
                                          213, 94, 0, 0,  158, 115, 255, 255, 255};
    struct spl_image shape_image = {SPL_LAYER_PRIMITIVE, SPL_PIXEL_U32, 3, 2, shapes};
    png = ENCODE(&shape_image, .format = SPL_FORMAT_PNG);
    decoded = decode_png(&png, &header, note);
    assert_int_equal(header.color_type, SPNG_COLOR_TYPE_TRUECOLOR);
    assert_int_equal(header.bit_depth, 8);
    assert_memory_equal(decoded, shape_bytes, sizeof shape_bytes);
    assert_string_equal(note, "");
    free(decoded);
    spl_encoded_finish(&png);

    float coverage[] = {0, 1, 0.5f, 1.5f, -1, NAN};
    static const uint8_t coverage_bytes[] = {0, 255, 128, 255, 0, 0};
    struct spl_image coverage_image = {SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 6, 1, coverage};
    png = ENCODE(&coverage_image, .format = SPL_FORMAT_PNG);
    decoded = decode_png(&png, &header, NULL);
    assert_int_equal(header.bit_depth, 8);
    assert_memory_equal(decoded, coverage_bytes, sizeof coverage_bytes);
    free(decoded);
    spl_encoded_finish(&png);
}

static void jpeg_of_color_is_close_and_opaque(void **state)
{
    (void)state;
    struct spl_image image = make_color(160, 120);
    for (int quality = 0; quality <= 95; quality += 95) {
        struct spl_encoded jpeg = ENCODE(&image, .format = SPL_FORMAT_JPEG, .quality = quality);
        int width, height, sampling;
        uint8_t *rgb = decode_jpeg(&jpeg, &width, &height, &sampling);
        assert_int_equal(width, 160);
        assert_int_equal(height, 120);
        assert_int_equal(sampling, quality ? TJSAMP_444 : TJSAMP_420);
        double sum = 0;
        for (int i = 0; i < 160 * 120; i++)
            for (int c = 0; c < 3; c++)
                sum += pow(rgb[3 * i + c] - ((uint8_t *)image.pixels)[4 * i + c], 2);
        assert_true(10 * log10(255.0 * 255 / (sum / (160 * 120 * 3))) > 35);
        assert_true(jpeg.near == 0 && jpeg.far == 0);
        free(rgb);
        spl_encoded_finish(&jpeg);
    }
    spl_image_finish(&image);
}

static void jpeg_of_depth_ends_its_map_at_the_robust_range(void **state)
{
    (void)state;
    enum { N = 64 * 64 };
    float depth[N];
    for (int i = 0; i < N; i++)
        depth[i] = 10 + 20.0f * (float)i / N;
    for (int i = 0; i < 64 * 16; i++)
        depth[i] = NAN;  /* the upper quarter shows nothing */
    depth[N - 1] = 1e6f; /* strays at both ends do not stretch the map */
    depth[N - 2] = 1e-3f;
    struct spl_image image = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 64, 64, depth};
    struct spl_encoded jpeg = ENCODE(&image, .format = SPL_FORMAT_JPEG, .quality = 100);
    assert_true(fabsf(jpeg.near - 15.15f) < 0.2f);
    assert_true(fabsf(jpeg.far - 29.85f) < 0.3f);
    int width, height, sampling;
    uint8_t *rgb = decode_jpeg(&jpeg, &width, &height, &sampling);
    const uint8_t *nothing = rgb + 3 * (64 * 4 + 32), *near = rgb + 3 * (64 * 20 + 32), *far = rgb + 3 * (64 * 60 + 32);
    assert_true(nothing[0] + nothing[1] + nothing[2] < 15);
    assert_true(near[0] + near[1] + near[2] > 500);
    assert_true(far[0] + far[1] + far[2] > 120 && far[0] + far[1] + far[2] < 300);
    free(rgb);
    spl_encoded_finish(&jpeg);
}

static void jpeg_of_flat_and_empty_depth(void **state)
{
    (void)state;
    float depth[] = {7, 7, 7, 7};
    struct spl_image image = {SPL_LAYER_RANGE, SPL_PIXEL_F32, 2, 2, depth};
    struct spl_encoded jpeg = ENCODE(&image, .format = SPL_FORMAT_JPEG);
    assert_true(jpeg.near == 7 && jpeg.far == 7);
    spl_encoded_finish(&jpeg);
    for (int i = 0; i < 4; i++)
        depth[i] = NAN;
    jpeg = ENCODE(&image, .format = SPL_FORMAT_JPEG);
    assert_true(jpeg.near == 0 && jpeg.far == 0);
    int width, height, sampling;
    uint8_t *rgb = decode_jpeg(&jpeg, &width, &height, &sampling);
    for (int i = 0; i < 12; i++)
        assert_int_equal(rgb[i], 0);
    free(rgb);
    spl_encoded_finish(&jpeg);
}

static void jpeg_of_the_other_layers(void **state)
{
    (void)state;
    float normals[3 * 256] = {0}, coverage[256];
    uint32_t ids[256], shapes[256];
    for (int i = 0; i < 256; i++) {
        shapes[i] = i < 128 ? SPL_SHAPE_SPLAT : SPL_SHAPE_NONE;
        normals[3 * i + 2] = i < 128 ? 1 : 0;
        ids[i] = i < 128 ? 12345 : UINT32_MAX;
        coverage[i] = i < 128 ? 1 : 0;
    }
    struct spl_image images[] = {{SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 16, 16, normals},
                                 {SPL_LAYER_ID, SPL_PIXEL_U32, 16, 16, ids},
                                 {SPL_LAYER_PRIMITIVE, SPL_PIXEL_U32, 16, 16, shapes},
                                 {SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 16, 16, coverage}};
    for (int i = 0; i < 4; i++) {
        struct spl_encoded jpeg = ENCODE(&images[i], .format = SPL_FORMAT_JPEG, .quality = 100);
        int width, height, sampling;
        uint8_t *rgb = decode_jpeg(&jpeg, &width, &height, &sampling);
        const uint8_t *above = rgb + 3 * 40, *below = rgb + 3 * 230;
        assert_true(above[0] > 40 && above[1] > 40 && above[2] > 40);
        assert_true(below[0] < 8 && below[1] < 8 && below[2] < 8);
        if (images[i].layer == SPL_LAYER_COVERAGE) {
            assert_int_equal(sampling, TJSAMP_GRAY);
            assert_true(jpeg.near == 0 && jpeg.far == 1);
        }
        free(rgb);
        spl_encoded_finish(&jpeg);
    }
}

static void npy_header_is_as_numpy_writes_it(void **state)
{
    (void)state;
    /* by hand from NPY format 1.0: 10 + 118 ('v') bytes, padded with spaces, newline at the end */
    static const char header[129] =
        "\x93NUMPY\x01\x00v\x00{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3, 4), }"
        "                                                       \n";
    struct spl_image image = make_color(3, 2);
    struct spl_encoded npy = ENCODE(&image, .format = SPL_FORMAT_NPY);
    assert_int_equal(npy.length, 128 + 24);
    assert_memory_equal(npy.bytes, header, 128);
    assert_memory_equal(npy.bytes + 128, image.pixels, 24);
    spl_encoded_finish(&npy);
    struct spl_encoded raw = ENCODE(&image, .format = SPL_FORMAT_RAW);
    assert_int_equal(raw.length, 24);
    assert_memory_equal(raw.bytes, image.pixels, 24);
    assert_string_equal(raw.media_type, "application/octet-stream");
    spl_encoded_finish(&raw);
    spl_image_finish(&image);

    float numbers[6] = {1, 2, NAN, 4, 5, 6};
    uint32_t id = 7;
    struct spl_image others[] = {{SPL_LAYER_DEPTH, SPL_PIXEL_F32, 3, 2, numbers},
                                 {SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 2, 1, numbers},
                                 {SPL_LAYER_ID, SPL_PIXEL_U32, 1, 1, &id},
                                 {SPL_LAYER_PRIMITIVE, SPL_PIXEL_U32, 1, 1, &id}};
    static const char *const dictionaries[] = {
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }",
        "{'descr': '<u4', 'fortran_order': False, 'shape': (1, 1), }",
        "{'descr': '<u4', 'fortran_order': False, 'shape': (1, 1), }",
    };
    for (int i = 0; i < 4; i++) {
        npy = ENCODE(&others[i], .format = SPL_FORMAT_NPY);
        size_t header_bytes = 10u + npy.bytes[8] + 256u * npy.bytes[9];
        assert_int_equal(header_bytes % 64, 0);
        assert_memory_equal(npy.bytes + 10, dictionaries[i], strlen(dictionaries[i]));
        assert_int_equal(npy.bytes[header_bytes - 1], '\n');
        assert_memory_equal(npy.bytes + header_bytes, others[i].pixels, npy.length - header_bytes);
        spl_encoded_finish(&npy);
    }
}

static const struct spl_ground a_map = {.placed = true, .across = {1, 0}, .down = {0, -1}};

static void one_pixel_encodes_everywhere(void **state)
{
    (void)state;
    struct spl_image image = make_color(1, 1);
    for (int format = 0; format < SPL_FORMAT_COUNT; format++) {
        struct spl_encoded out = ENCODE(&image, .format = (enum spl_format)format, .ground = a_map);
        assert_true(out.length >= 4);
        spl_encoded_finish(&out);
    }
    spl_image_finish(&image);
}

static void assert_refused(const struct spl_image *image, struct spl_encode_options options, int code,
                           const char *field)
{
    struct spl_error err = {0};
    struct spl_encoded out;
    memset(&out, 0x55, sizeof out);
    assert_int_equal(spl_image_encode(image, &options, &out, &err), code);
    assert_string_equal(err.field, field);
    assert_true(err.message[0]);
    static const struct spl_encoded zero;
    assert_memory_equal(&out, &zero, sizeof out);
}

static void rows_may_lie_apart(void **state)
{
    (void)state;
    enum { width = 5, height = 3, apart = 4 * width + 12 };
    static uint8_t packed[height][4 * width], strided[height][apart];
    memset(strided, 0xee, sizeof strided);
    for (int y = 0; y < height; y++)
        for (int i = 0; i < 4 * width; i++)
            strided[y][i] = packed[y][i] = (uint8_t)(i % 4 == 3 ? 255 : 40 * y + 3 * i);
    struct spl_image image = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, width, height, packed}, other = image;
    other.pixels = strided;
    other.row_bytes = apart;
    for (int format = 0; format < SPL_FORMAT_COUNT; format++) {
        if (!spl_format_is_built((enum spl_format)format))
            continue;
        struct spl_encoded one = ENCODE(&image, .format = (enum spl_format)format, .ground = a_map);
        struct spl_encoded two = ENCODE(&other, .format = (enum spl_format)format, .ground = a_map);
        assert_int_equal(one.length, two.length);
        assert_memory_equal(one.bytes, two.bytes, one.length);
        spl_encoded_finish(&one);
        spl_encoded_finish(&two);
    }
    static const size_t refused[] = {4 * width - 4, SIZE_MAX / 4 + 1, SIZE_MAX};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        struct spl_encoded out;
        other.row_bytes = refused[i];
        assert_int_equal(spl_image_encode(&other, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &out, NULL),
                         SPL_E_USAGE);
    }
}

static void bad_requests_are_refused_by_field(void **state)
{
    (void)state;
    struct spl_image image = make_color(2, 2), wide = make_color(65536, 1), high = make_color(1, 65536);
    assert_refused(&wide, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_JPEG), SPL_E_LIMIT, "width");
    assert_refused(&high, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_JPEG), SPL_E_LIMIT, "height");
    struct spl_encoded png = ENCODE(&wide, .format = SPL_FORMAT_PNG);
    spl_encoded_finish(&png);
    assert_refused(&image, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_JPEG, .quality = 101), SPL_E_USAGE,
                   "quality");
    assert_refused(&image, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_JPEG, .quality = -1), SPL_E_USAGE,
                   "quality");
    assert_refused(&image, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG, .depth_scale = NAN), SPL_E_USAGE,
                   "depth_scale");
    assert_refused(&image, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG, .depth_scale = -5), SPL_E_USAGE,
                   "depth_scale");
    assert_refused(&image, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_COUNT), SPL_E_UNSUPPORTED, "format");
    assert_refused(&image, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_TIFF),
                   spl_format_is_built(SPL_FORMAT_TIFF) ? SPL_E_INPUT : SPL_E_UNSUPPORTED, "format");
    struct spl_image mistyped = image, empty = image;
    mistyped.type = SPL_PIXEL_F32;
    assert_refused(&mistyped, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_RAW), SPL_E_UNSUPPORTED, "layer");
    empty.height = 0;
    assert_refused(&empty, SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_RAW), SPL_E_USAGE, "");
    spl_image_finish(&image);
    spl_image_finish(&wide);
    spl_image_finish(&high);
    spl_image_finish(NULL);
    spl_encoded_finish(NULL);
}

/* Lets the first, second, third … allocation fail until an encode gets through. */
static void every_failed_allocation_is_reported(void **state)
{
    (void)state;
    float depth[64];
    for (int i = 0; i < 64; i++)
        depth[i] = (float)i;
    struct spl_image color = make_color(8, 8), distance = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 8, 8, depth};
    for (int format = 0; format < SPL_FORMAT_COUNT; format++)
        for (int layer = 0; layer < 2 && spl_format_is_built((enum spl_format)format); layer++) {
            int rc = SPL_E_NOMEM;
            long attempt = 1;
            for (; rc && attempt < 1000; attempt++) {
                struct spl_error err = {0};
                struct spl_encoded out;
                spl_memory_fail_after(attempt);
                rc = spl_image_encode(layer ? &distance : &color, &SPL_SIZED(spl_encode_options,
                                      .format = (enum spl_format)format, .ground = a_map),
                                      &out, &err);
                spl_memory_fail_after(0);
                assert_int_equal(rc, err.code);
                if (rc && rc != SPL_E_NOMEM)
                    fail_msg("format %d, layer %d, allocation %ld: %s", format, layer, attempt, err.message);
                assert_true(!rc == !!out.bytes);
                spl_encoded_finish(&out);
            }
            assert_int_equal(rc, SPL_OK);
            assert_true(attempt > 2 ||
                        format == SPL_FORMAT_WEBP); // colour goes in as it lies; libwebp allocates by itself
        }
    spl_image_finish(&color);
}

static void names_round_trip(void **state)
{
    (void)state;
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        assert_int_equal(spl_layer_from_name(spl_layer_name((enum spl_layer)i)), i);
    for (int i = 0; i < SPL_FORMAT_COUNT; i++)
        assert_int_equal(spl_format_from_name(spl_format_name((enum spl_format)i)), i);
    assert_int_equal(spl_layer_from_name("color"), SPL_LAYER_COLOR);
    assert_int_equal(spl_format_from_name("jpg"), SPL_FORMAT_JPEG);
    assert_int_equal(spl_format_from_name("tif"), SPL_FORMAT_TIFF);
    assert_int_equal(spl_layer_from_name("Color"), -1);
    assert_int_equal(spl_layer_from_name(""), -1);
    assert_int_equal(spl_format_from_name("gif"), -1);
    assert_int_equal(spl_layer_from_name(NULL), -1);
    assert_int_equal(spl_format_from_name(NULL), -1);
    assert_int_equal(spl_pixel_bytes(SPL_PIXEL_RGBA8), 4);
    assert_int_equal(spl_pixel_bytes(SPL_PIXEL_F32X3), 12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_color_is_lossless_and_keeps_alpha),
        cmocka_unit_test(png_depth_is_16_bit_with_scale_and_saturation),
        cmocka_unit_test(png_depth_is_big_endian_in_the_file),
        cmocka_unit_test(png_of_the_other_layers),
        cmocka_unit_test(jpeg_of_color_is_close_and_opaque),
        cmocka_unit_test(jpeg_of_depth_ends_its_map_at_the_robust_range),
        cmocka_unit_test(jpeg_of_flat_and_empty_depth),
        cmocka_unit_test(jpeg_of_the_other_layers),
        cmocka_unit_test(npy_header_is_as_numpy_writes_it),
        cmocka_unit_test(one_pixel_encodes_everywhere),
        cmocka_unit_test(rows_may_lie_apart),
        cmocka_unit_test(bad_requests_are_refused_by_field),
        cmocka_unit_test(every_failed_allocation_is_reported),
        cmocka_unit_test(names_round_trip),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
