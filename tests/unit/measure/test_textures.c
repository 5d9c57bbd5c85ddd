/* The baselines' blocks and where photographs are looked up, files of textures and what is refused of them, and the
 * comparison of coders on few textures. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/memory.h"
#include "measure/blocks.h"
#include "measure/textures.h"
#include "sparse/texture_file.h"
#include "unit/sparse/plant.h"

static double block_error(void (*code)(const uint8_t[16][3], uint8_t[16][3]), uint8_t in[16][3])
{
    uint8_t out[16][3];
    double sum = 0;
    code((const uint8_t(*)[3])in, out);
    for (int i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            sum += (out[i][c] - in[i][c]) * (out[i][c] - in[i][c]);
    return sum / 48;
}

static void test_blocks(void **state)
{
    uint8_t flat[16][3], two[16][3], ramp[16][3];
    double bc1 = 0, bc7 = 0;
    (void)state;
    for (int i = 0; i < 16; i++) {
        memcpy(flat[i], (uint8_t[]){200, 100, 50}, 3);
        memcpy(two[i], i % 3 ? (uint8_t[]){255, 255, 255} : (uint8_t[]){0, 0, 0}, 3);
        memcpy(ramp[i], (uint8_t[]){(uint8_t)(40 + 10 * i), (uint8_t)(200 - 8 * i), 90}, 3);
    }
    assert_true(block_error(spl_block_bc1, flat) < 4);
    assert_true(block_error(spl_block_bc7, flat) < 0.7);
    assert_true(block_error(spl_block_bc1, two) == 0);
    assert_true(block_error(spl_block_bc7, two) < 0.5);
    assert_true(block_error(spl_block_bc1, ramp) > 20); /* four colours for sixteen */
    assert_true(block_error(spl_block_bc7, ramp) < 1);
    for (uint64_t round = 0; round < 200; round++) {
        uint8_t noise[16][3];
        for (int i = 0; i < 48; i++)
            noise[i / 3][i % 3] = (uint8_t)(100 + spl_random_at(round, (uint64_t)i) % 60);
        bc1 += block_error(spl_block_bc1, noise);
        bc7 += block_error(spl_block_bc7, noise);
    }
    assert_true(bc7 < bc1 && bc1 < 200 * 60 * 60 / 12.0);
}

static char path[64];

static void write_bytes(const void *bytes, size_t length)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, length, file), length);
    fclose(file);
}

static void expect_refused(const void *bytes, size_t length, const char *said)
{
    struct spl_texture_file file;
    struct spl_error err = {0};
    write_bytes(bytes, length);
    assert_int_equal(spl_texture_file_open(path, &file, &err), SPL_E_INPUT);
    if (!strstr(err.message, said) || !strstr(err.message, path))
        fail_msg("%s does not say %s", err.message, said);
}

static void expect_header_refused(uint8_t *bytes, size_t length, const struct spl_texture_file_header *good, size_t at,
                                  uint64_t value, const char *said)
{
    memcpy(bytes, good, sizeof *good);
    memcpy(bytes + at, &value, sizeof value);
    expect_refused(bytes, length, said);
    memcpy(bytes, good, sizeof *good);
}

static void test_file(void **state)
{
    struct plant p = plant_make(8, 5, 3000, 2, 0.5f);
    struct spl_texture_file file;
    struct spl_error err = {0};
    uint8_t bytes[48 + 2 * 192 + 2 * 2 + 3] = {0}, back[192];
    (void)state;
    assert_int_equal(spl_texture_file_open(path, &file, &err), SPL_E_NOT_FOUND);
    expect_refused(bytes, sizeof bytes, "holds no textures");
    expect_refused("SPLTEXT2", 8, "holds no textures");
    struct spl_texture_file_header good = {
        .magic = "SPLTEXT", .size = 8, .count = 2, .splats = 2, .photographs = 2, .names_bytes = 3};
    good.magic[7] = '1'; /* no photographs in those */
    assert_int_equal(sizeof good, 48);
    memcpy(bytes, &good, sizeof good);
    expect_refused(bytes, sizeof bytes, "holds no textures");
    good.magic[7] = '2';
    memcpy(bytes, &good, sizeof good);
    memcpy(bytes + sizeof bytes - 7,
           "\1\0\xff\xff"
           "a",
           6); /* photographs 1 and none; "a" and "" */
    expect_refused(bytes, sizeof bytes - 1, "says 2 textures");
    expect_header_refused(bytes, sizeof bytes, &good, offsetof(struct spl_texture_file_header, count),
                          UINT64_MAX / 192 + 1, "says ");
    expect_header_refused(bytes, sizeof bytes, &good, offsetof(struct spl_texture_file_header, splats),
                          UINT64_MAX / 2 + 2, "says ");
    expect_header_refused(bytes, sizeof bytes, &good, offsetof(struct spl_texture_file_header, names_bytes), 2,
                          "says ");
    struct spl_texture_file_header bad = good;
    bad.size = 33;
    memcpy(bytes, &bad, sizeof bad);
    expect_refused(bytes, sizeof bytes, "not 1..32");
    bad = good;
    bad.splats = 1;
    bad.names_bytes = 5;
    memcpy(bytes, &bad, sizeof bad);
    expect_refused(bytes, sizeof bytes, "on 1 splats");
    bad = good;
    bad.photographs = 1; /* the first splat's is the second */
    memcpy(bytes, &bad, sizeof bad);
    expect_refused(bytes, sizeof bytes, "splat 0 has photograph 1 of 1");
    bad.photographs = 4;
    memcpy(bytes, &bad, sizeof bad);
    expect_refused(bytes, sizeof bytes, "says 4 photographs");
    bad.photographs = 3;
    memcpy(bytes, &bad, sizeof bad);
    bytes[sizeof bytes - 2] = 'b';
    expect_refused(bytes, sizeof bytes, "photograph 1 has no name");
    bytes[sizeof bytes - 2] = 0;
    memcpy(bytes, &good, sizeof good);
    write_bytes(bytes, sizeof bytes);
    err = (struct spl_error){0};
    assert_int_equal(spl_texture_file_open(path, &file, &err), 0);
    assert_string_equal(file.origin.names[0], "a");
    assert_string_equal(file.origin.names[1], "");
    spl_texture_file_close(&file);

    static uint16_t photo[5000];
    photo[4999] = SPL_TEXTURE_NO_PHOTO;
    photo[7] = 2;
    const struct spl_texture_origin origin = {.splats = 5000,
                                              .pixels = 777,
                                              .photographs = 3,
                                              .photo = photo,
                                              .names = (const char *const[]){"north", "", "a b"}};
    assert_int_equal(spl_texture_file_write(path, plant_source(&p), &origin, &err), 0);
    assert_int_equal(spl_texture_file_open(path, &file, &err), 0);
    assert_int_equal(file.source.count, 3000);
    assert_int_equal(file.origin.splats, 5000);
    assert_int_equal(file.origin.pixels, 777);
    assert_int_equal(file.origin.photographs, 3);
    assert_string_equal(file.origin.names[2], "a b");
    assert_memory_equal(file.origin.photo, photo, sizeof photo);
    assert_int_equal(file.source.read(file.source.context, 2999, 1, back, &err), 0);
    assert_memory_equal(back, p.textures + 2999 * 192, 192);
    assert_int_equal(truncate(path, 1000), 0);
    assert_int_equal(file.source.read(file.source.context, 2999, 1, back, &err), SPL_E_INPUT);
    spl_texture_file_close(&file);
    err = (struct spl_error){0};
    assert_int_equal(spl_texture_file_write("/nowhere/at/all", plant_source(&p), &origin, &err), SPL_E_IO);
    plant_finish(&p);
}

static const struct spl_textures_row *find_row(const struct spl_textures_report *report, const char *name)
{
    for (uint32_t i = 0; i < report->rows; i++)
        if (!strcmp(report->row[i].name, name))
            return &report->row[i];
    fail_msg("no row %s", name);
    return NULL;
}

static void test_measure(void **state)
{
    struct plant p = plant_make(8, 40, 1200, 2, 1), few = plant_make(4, 1, 2, 1, 1);
    const struct spl_texture_origin origin = {.splats = 2400, .pixels = 100000};
    struct spl_projected_report projected = {.texture = {INFINITY, 45, 40, 37, 36, 35},
                                             .packed = {.views = 2, .colored = {20, 22}, .projected = {{99, 60}}},
                                             .left_out = {.colored = {NAN, NAN}}};
    struct spl_textures_options o = {.source = plant_source(&p),
                                     .origin = &origin,
                                     .projected = &projected,
                                     .epochs = 3,
                                     .runs = SPL_TEXTURES_RUN_ALL,
                                     .memory_bytes = 1 << 28,
                                     .seed = 1};
    static struct spl_textures_report report;
    struct spl_error err = {0};
    char *svg;
    size_t length;
    (void)state;
    if (spl_textures_measure(&o, &report, &err))
        fail_msg("%s", err.message);
    assert_true(report.batches_epochs >= 1 && report.ksvd_epochs >= 1);
    assert_true(report.geometry == 0 && !*report.left_away);
    const struct spl_textures_row *colors = find_row(&report, "colours only");
    assert_true(colors->color == 3 && colors->codes == 0 && colors->psnr < 30 && colors->packed.psnr == 20 &&
                colors->packed.tile == 22);
    assert_true(isnan(colors->left_out.psnr));
    const struct spl_textures_row *whole = find_row(&report, "LOD 0"), *half = find_row(&report, "LOD 1 BC1");
    assert_true(isinf(whole->psnr) && whole->packed.tile == 60 && whole->color == 2);
    assert_true(fabs(whole->shared - 4 * 100000 / 2400.0) < 1e-6);
    assert_true(fabs(half->shared - whole->shared / 24) < 1e-6 && half->psnr == 35);
    /* half of the splats have a texture: 192 bytes and their mips */
    assert_true(fabs(find_row(&report, "a texture for each splat")->codes - 128) < 1e-9);
    const struct spl_textures_row *small = find_row(&report, "paper D8W4"), *large = find_row(&report, "paper D16W8");
    assert_true(small->sample == 0 && large->sample == 0 && large->count > small->count);
    assert_true(fabs(small->codes - small->atoms * 1.5 / 2) < 1e-9 && fabs(large->codes - large->atoms * 3 / 2) < 1e-9);
    double mean = 0, all = 0;
    for (int k = 0; k <= SPL_ATOMS_MAX; k++) {
        all += small->shares[k];
        mean += k * small->shares[k];
    }
    assert_true(fabs(all - 1) < 1e-9 && fabs(mean - small->atoms) < 1e-9);
    const struct spl_textures_row *last = &report.row[report.rows - 1], *first = last - 3;
    assert_true(first->kind == SPL_TEXTURES_OURS && last->psnr > first->psnr && last->codes > first->codes);
    double between = spl_textures_bytes_at(&report, (first[2].psnr + last->psnr) / 2);
    assert_true(between > first->codes && between <= 1.01 * spl_textures_row_bytes(last)); /* 40 atoms bound all */
    assert_true(isnan(spl_textures_bytes_at(&report, 99)));
    assert_int_equal(spl_textures_chart_rate(&report, &svg, &length, &err), 0);
    assert_non_null(strstr(svg, "bytes a splat"));
    assert_non_null(strstr(svg, "paper D12W4"));
    assert_non_null(strstr(svg, "LOD 1 BC7"));
    assert_null(strstr(svg, "milliseconds"));
    free(svg);
    assert_int_equal(spl_textures_chart_training(&report, &svg, &length, &err), 0);
    assert_non_null(strstr(svg, "k-SVD"));
    free(svg);
    o.runs = SPL_TEXTURES_RUN_D16W8 |
             SPL_TEXTURES_RUN_D8W4; /* every third texture is trained on, all of the next ones are coded */
    o.sample = 500;
    assert_int_equal(spl_textures_measure(&o, &report, &err), 0);
    large = find_row(&report, "paper D16W8");
    assert_int_equal(large->sample, 400);
    assert_int_equal(find_row(&report, "paper D8W4")->sample, 400);
    assert_true(large->count <= 400 && large->psnr > colors->psnr + 3);
    assert_true(fabs(large->codes - large->atoms * 3 / 2) < 1e-9); /* of all splats, not of those that were coded */
    o.runs = 0;                                                    /* no codings, and none of photographs */
    o.projected = NULL;
    assert_int_equal(spl_textures_measure(&o, &report, &err), 0);
    assert_int_equal(report.rows, 2);
    assert_int_equal(report.batches_epochs, 0);
    o.source = plant_source(&few); /* smaller than two blocks */
    assert_int_equal(spl_textures_measure(&o, &report, &err), SPL_E_INPUT);
    plant_finish(&p);
    plant_finish(&few);
}

/* A pyramid whose texel (x, y) is grey 10 x + y, alpha as given. */
static struct spl_pyramid ramp(uint32_t width, uint32_t height, uint8_t alpha)
{
    struct spl_image image = {.type = SPL_PIXEL_RGBA8, .width = width, .height = height};
    struct spl_pyramid pyramid;
    uint8_t(*to)[4] = image.pixels = malloc((size_t)width * height * 4);
    assert_non_null(to);
    for (uint32_t i = 0; i < width * height; i++) {
        uint8_t grey = (uint8_t)(10 * (i % width) + i / width);
        memcpy(to[i], (uint8_t[]){grey, grey, grey, alpha}, 4);
    }
    assert_int_equal(spl_pyramid_init(&pyramid, &image, NULL), 0);
    return pyramid;
}

static void invert(const uint8_t in[16][3], uint8_t out[16][3])
{
    for (int i = 0; i < 48; i++)
        out[i / 3][i % 3] = (uint8_t)(255 - in[i / 3][i % 3]);
}

/* Every texel of every level is its own block's, whatever the sides; alpha stays. */
static void test_blocks_of_pyramids(void **state)
{
    struct spl_pyramid from = ramp(9, 6, 77), out;
    (void)state;
    assert_int_equal(spl_blocks_code(&from, invert, 2, &out, NULL), 0);
    assert_int_equal(out.levels, from.levels);
    for (uint32_t l = 0; l < from.levels; l++)
        for (uint32_t i = 0; i < 4 * from.width[l] * from.height[l]; i++)
            assert_int_equal(out.texels[l][i], i % 4 < 3 ? 255 - from.texels[l][i] : 77);
    spl_pyramid_finish(&out);
    for (int n = 1;; n++) {
        spl_memory_fail_after(n);
        int rc = spl_blocks_code(&from, invert, 1, &out, NULL);
        spl_memory_fail_after(0);
        assert_true(rc == 0 || (rc == SPL_E_NOMEM && !out.texels[0]));
        if (!rc)
            break;
    }
    spl_pyramid_finish(&out);
    spl_pyramid_finish(&from);
}

static void test_look(void **state)
{
    struct spl_camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                                .fx = 10,
                                .fy = 10,
                                .cx = 4,
                                .cy = 4,
                                .width = 8,
                                .height = 8,
                                .near = 0.1};
    struct spl_named_view photograph = {.camera = camera};
    struct spl_pyramid pyramid = ramp(8, 8, 255);
    float rgb[3];
    (void)state;
    /* through its own eye a photograph shows itself, at any depth */
    assert_true(spl_projected_look(&camera, (double[]){2.5, 5.5}, 3, &photograph, &pyramid, 1, rgb));
    assert_true(fabsf(rgb[0] - 25) < 1e-3f);
    assert_true(spl_projected_look(&camera, (double[]){2.5, 5.5}, 300, &photograph, &pyramid, 1, rgb));
    assert_true(fabsf(rgb[2] - 25) < 1e-3f);
    /* level 1 has the means of 2 x 2: 10 * 2.5 + 4.5 there, and bilinear a quarter of the way to its neighbour */
    assert_true(spl_projected_look(&camera, (double[]){3, 5}, 3, &photograph, &pyramid, 2, rgb));
    assert_true(fabsf(rgb[0] - 29.5f) < 0.6f);
    /* an eye one unit to the right sees what lies 5 deep two pixels further left */
    photograph.camera.eye[0] = 1;
    assert_true(spl_projected_look(&camera, (double[]){6.5, 1.5}, 5, &photograph, &pyramid, 1, rgb));
    assert_true(fabsf(rgb[0] - 41) < 1e-3f);
    assert_false(spl_projected_look(&camera, (double[]){1.5, 1.5}, 5, &photograph, &pyramid, 1, rgb)); /* outside */
    photograph.camera.eye[0] = 0;
    photograph.camera.eye[2] = 4; /* what lies 3 deep is behind it */
    assert_false(spl_projected_look(&camera, (double[]){4, 4}, 3, &photograph, &pyramid, 1, rgb));
    /* from three times the distance a pixel spans three of the photograph's */
    photograph.camera.eye[2] = 6;
    assert_true(spl_projected_look(&camera, (double[]){4, 4}, 9, &photograph, &pyramid, 1, rgb));
    assert_true(fabsf(rgb[0] - 38.5f) < 1);
    spl_pyramid_finish(&pyramid);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks),  cmocka_unit_test(test_file),
        cmocka_unit_test(test_measure), cmocka_unit_test(test_blocks_of_pyramids),
        cmocka_unit_test(test_look),
    };
    snprintf(path, sizeof path, "/tmp/spl-textures-%ld", (long)getpid());
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
