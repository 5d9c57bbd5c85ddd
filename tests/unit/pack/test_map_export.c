/* Exported maps: each texel lies where the layout says, what is taken back is what was edited, nothing of others is
 * written over, and nothing stays of an export that was not finished. */
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

#include "base/memory.h"
#include "geom/polar.h"
#include "image/load.h"
#include "pack/maps/export.h"

enum { side = 64, range_side = 32 };

static char parent[] = "/tmp/splatd-map-export-XXXXXX", folder[64];

static struct spl_map_row make_row(void)
{
    return (struct spl_map_row){.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1},
                                .position = {10, 20, 30},
                                .side = side,
                                .levels = 1,
                                .range_side = range_side,
                                .near = 0.5f};
}

static const char *in(const char *name)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

/* Every texel another colour than its neighbours. */
static struct spl_image make_picture(void)
{
    struct spl_image picture;
    assert_int_equal(spl_map_picture_init(&picture, side, NULL), 0);
    uint8_t(*texels)[4] = picture.pixels;
    for (uint32_t t = 0; t < 6 * side * side; t++)
        memcpy(texels[t], (uint8_t[4]){(uint8_t)t, (uint8_t)(t >> 8), (uint8_t)(7 * t), 255}, 4);
    return picture;
}

/* Code 1000 in the top cap, no return at elevation 0, the aprons' codes nowhere in sight. */
static uint32_t *make_words(const struct spl_map_row *row)
{
    uint32_t *words = calloc(spl_map_words(row), sizeof *words);
    uint32_t across = spl_polar_width(range_side, SPL_MAP_RANGE_APRON);
    uint32_t down = spl_polar_height(range_side, SPL_MAP_RANGE_APRON);
    for (uint32_t y = 0; y < down; y++)
        for (uint32_t x = 0; x < across; x++) {
            bool apron = y < 1 || y > range_side || x < 1 || x == range_side + 1 || x == range_side + 2 ||
                         x == 2 * range_side + 3 || x == 2 * range_side + 4 || x == across - 1;
            double d[3];
            spl_polar_direction(range_side, SPL_MAP_RANGE_APRON, (double[2]){x + 0.5, y + 0.5}, d);
            spl_map_set_code(words, y * across + x, apron ? 7 : d[2] > 0.9 ? 1000 : fabs(d[2]) < 0.1 ? 65535 : 0);
        }
    return words;
}

static void export_one(const struct spl_map_row *row, const struct spl_image *picture)
{
    struct spl_map_export out;
    struct spl_error err = {0};
    uint32_t *words = make_words(row);
    if (spl_map_export_init(&out, folder, &err) || spl_map_export_add(&out, row, picture, words, &err) ||
        spl_map_export_commit(&out, &err))
        fail_msg("%s", err.message);
    spl_map_export_finish(&out);
    free(words);
}

static void what_is_exported_comes_back(void **state)
{
    const struct spl_map_row row = make_row();
    struct spl_image picture = make_picture(), back = make_picture();
    struct spl_map_edits edits;
    struct spl_image codes;
    (void)state;
    export_one(&row, &picture);
    memset(back.pixels, 9, (size_t)6 * side * side * 4);
    assert_int_equal(spl_map_edits_init(&edits, folder, NULL), 0);
    assert_int_equal(spl_map_edits_apply(&edits, 1, &row, &back, NULL), 0); /* no such map: nothing happens */
    assert_int_equal(*(uint8_t *)back.pixels, 9);
    assert_int_equal(spl_map_edits_apply(&edits, 0, &row, &back, NULL), 0);
    for (uint32_t t = 0; t < 6 * side * side; t++)
        assert_memory_equal((uint8_t *)back.pixels + 4 * t, (uint8_t *)picture.pixels + 4 * t, 3);
    spl_map_edits_finish(&edits);

    /* ranges without aprons: the middle of the top cap, and the band's equator */
    assert_int_equal(spl_image_load(in("station-1.range.png"), SPL_LAYER_DEPTH, &codes, NULL), 0);
    assert_true(codes.width == 6 * range_side && codes.height == range_side);
    const float *values = codes.pixels;
    assert_true(values[range_side / 2 * 6 * range_side + range_side * 3 / 2] == 1000);
    for (uint32_t x = 2 * range_side; x < 6 * range_side; x++)
        assert_true(isnan(values[range_side / 2 * 6 * range_side + x])); /* 65535 */
    for (uint32_t t = 0; t < 6 * range_side * range_side; t++)
        assert_true(!(values[t] == 7));
    spl_image_finish(&codes);
    spl_image_finish(&picture);
    spl_image_finish(&back);
}

/* By the formulas that maps.json says. */
static void direction_of(double x, double y, double d[3])
{
    int chart = x < side ? 0 : x < 2 * side ? 1 : 2;
    if (chart == 2) {
        double turn = 2 * M_PI * (1 - (x - 2 * side) / (4 * side)), rise = (0.5 - y / side) * M_PI / 2;
        d[0] = cos(rise) * cos(turn);
        d[1] = cos(rise) * sin(turn);
        d[2] = sin(rise);
        return;
    }
    double u = (x - chart * side) / side - 0.5, v = chart ? y / side - 0.5 : 0.5 - y / side, r = hypot(u, v);
    d[0] = u / r * sin(M_PI * r / 2);
    d[1] = v / r * sin(M_PI * r / 2);
    d[2] = (chart ? 1 : -1) * cos(M_PI * r / 2);
}

static void texels_look_as_they_did_from_the_station(void **state)
{
    (void)state;
    for (uint32_t y = 0; y < side; y += 7)
        for (uint32_t x = 0; x < 6 * side; x += 5) {
            uint32_t there[2];
            double a[3], b[3], right[3], down[3], turned = 0;
            spl_map_picture_texel(side, SPL_MAP_APRON, x, y, there);
            direction_of(x + 0.5, y + 0.5, a);
            spl_polar_direction(side, SPL_MAP_APRON, (double[2]){there[0] + 0.5, there[1] + 0.5}, b);
            direction_of(x + 0.51, y + 0.5, right);
            direction_of(x + 0.5, y + 0.51, down);
            for (int k = 0; k < 3; k++) { /* to the right, down and ahead are right-handed: letters can be read */
                int i = (k + 1) % 3, j = (k + 2) % 3;
                turned += a[k] * ((right[i] - a[i]) * (down[j] - a[j]) - (right[j] - a[j]) * (down[i] - a[i]));
                assert_true(fabs(a[k] - b[k]) < 1e-12);
            }
            assert_true(turned > 0);
            assert_true(x < 2 * side || down[2] < a[2]); /* the band stands upright */
        }
}

static void put_png(const char *name, uint32_t width, uint32_t height, const uint8_t color[4])
{
    struct spl_image image = {.layer = SPL_LAYER_COLOR, .width = width, .height = height};
    const struct spl_encode_options how = {.size = sizeof how, .format = SPL_FORMAT_PNG};
    struct spl_encoded png;
    image.pixels = malloc((size_t)width * height * 4);
    for (uint32_t t = 0; t < width * height; t++)
        memcpy((uint8_t *)image.pixels + 4 * t, t == width ? (uint8_t[4]){0} : color, 4);
    assert_int_equal(spl_image_encode(&image, &how, &png, NULL), 0);
    FILE *file = fopen(in(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(png.bytes, 1, png.length, file), png.length);
    fclose(file);
    spl_encoded_finish(&png);
    free(image.pixels);
}

/* 16 bit grey. */
static void put_deep_png(const char *name, uint32_t width, uint32_t height)
{
    struct spl_image image = {.layer = SPL_LAYER_DEPTH, .type = SPL_PIXEL_F32, .width = width, .height = height};
    const struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG};
    struct spl_encoded png;
    image.pixels = calloc((size_t)width * height, sizeof(float));
    assert_int_equal(spl_image_encode(&image, &options, &png, NULL), 0);
    FILE *file = fopen(in(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(png.bytes, 1, png.length, file), png.length);
    fclose(file);
    spl_encoded_finish(&png);
    free(image.pixels);
}

static void refused(const struct spl_map_row *row, const char *field, const char *part)
{
    struct spl_image picture = make_picture();
    struct spl_map_edits edits;
    struct spl_error err = {0};
    int rc = spl_map_edits_init(&edits, folder, &err);
    if (!rc) {
        rc = spl_map_edits_apply(&edits, 0, row, &picture, &err);
        spl_map_edits_finish(&edits);
    }
    if (!rc || strcmp(err.field, field) || !strstr(err.message, part))
        fail_msg("[%s] \"%s\" instead of [%s] \"%s\"", err.field, err.message, field, part);
    assert_null(edits.list);
    spl_image_finish(&picture);
}

static void put_text(const char *name, const char *text)
{
    FILE *file = fopen(in(name), "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void edits_that_do_not_fit_are_refused(void **state)
{
    struct spl_map_row row = make_row();
    struct spl_image picture = make_picture();
    struct spl_map_edits edits;
    (void)state;
    export_one(&row, &picture);
    row.position[1] += 0.02;
    refused(&row, "position", "stands elsewhere");
    row = make_row();
    row.rotation[0] = 0.01;
    refused(&row, "position", "stands elsewhere");
    row = make_row();

    /* painted over, but for one texel that was wiped out */
    put_png("station-1.color.png", 6 * side, side, (uint8_t[4]){1, 2, 3, 255});
    assert_int_equal(spl_map_edits_init(&edits, folder, NULL), 0);
    assert_int_equal(spl_map_edits_apply(&edits, 0, &row, &picture, NULL), 0);
    spl_map_edits_finish(&edits);
    const uint8_t *texels = picture.pixels;
    assert_memory_equal(texels, ((uint8_t[3]){1, 2, 3}), 3);
    assert_memory_equal(texels + 4 * 6 * side, ((uint8_t[3]){(uint8_t)(6 * side), 6 * side >> 8, (uint8_t)(42 * side)}),
                        3);
    spl_image_finish(&picture);

    put_png("station-1.color.png", 6 * side, side + 1, (uint8_t[4]){1, 2, 3, 255});
    refused(&row, "color", "384 x 65 pixels");
    put_text("station-1.color.png", "");
    refused(&row, "", "neither PNG nor JPEG");
    unlink(in("station-1.color.png"));
    refused(&row, "", "no such file");
    put_text("maps.json", "{\"maps\": [{\"name\": \"station-1\", \"color\": \"a.png\", \"side\": 1000000000}]}");
    refused(&row, "side", "has a side of");
    put_text("maps.json", "{\"maps\": [{\"name\": \"station-1\", \"color\": \"a.png\", \"side\": 64.5}]}");
    refused(&row, "side", "no side that is a whole number");
    put_text("maps.json", "{\"maps\": [{\"name\": \"station-1\", \"color\": \"deep.png\", \"side\": 64}]}");
    put_deep_png("deep.png", 6 * side, side);
    refused(&row, "color", "16 bits a channel");
    unlink(in("deep.png"));
    put_text("maps.json", "{\"maps\": [{\"name\": 3, \"color\": \"a.png\", \"side\": 64}]}");
    refused(&row, "name", "map 1");
    put_text("maps.json", "{\"maps\": []}");
    refused(&row, "maps", "holds no maps");
    put_text("maps.json", "{");
    refused(&row, "maps", "broken JSON");
    unlink(in("maps.json"));
    refused(&row, "maps", "has no maps.json");
}

static void nothing_is_overwritten_and_nothing_is_left(void **state)
{
    const struct spl_map_row row = make_row();
    struct spl_image picture = make_picture();
    struct spl_map_export out;
    struct spl_error err = {0};
    uint32_t *words = make_words(&row);
    (void)state;
    assert_int_equal(mkdir(folder, 0777), 0);
    put_text(".hidden", "mine");
    assert_int_equal(spl_map_export_init(&out, folder, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "export-maps");
    assert_non_null(strstr(err.message, "name a new folder"));
    spl_map_export_finish(&out);
    assert_int_equal(access(in(".hidden"), F_OK), 0);
    assert_int_equal(spl_map_export_init(&out, in(".hidden"), NULL), SPL_E_USAGE);
    spl_map_export_finish(&out);
    unlink(in(".hidden"));

    /* a folder of the user's stays, its files go */
    assert_int_equal(spl_map_export_init(&out, folder, NULL), 0);
    assert_int_equal(spl_map_export_add(&out, &row, &picture, words, NULL), 0);
    assert_int_equal(access(in("station-1.color.png"), F_OK), 0);
    spl_map_export_finish(&out);
    assert_int_equal(access(in("station-1.color.png"), F_OK), -1);
    assert_int_equal(rmdir(folder), 0);

    for (long n = 1;; n++) { /* whatever is refused */
        int rc;
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        if (!(rc = spl_map_export_init(&out, folder, &err)) &&
            !(rc = spl_map_export_add(&out, &row, &picture, words, &err)))
            rc = spl_map_export_commit(&out, &err);
        spl_memory_fail_after(0);
        spl_map_export_finish(&out);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(access(folder, F_OK), -1);
        assert_in_range(n, 1, 500);
    }
    snprintf(folder, sizeof folder, "%s/no/such", parent);
    assert_true(spl_map_export_init(&out, folder, &err) < 0);
    assert_non_null(strstr(err.message, "cannot be made"));
    spl_map_export_finish(&out);
    spl_image_finish(&picture);
    free(words);
}

static int clean(void **state)
{
    char command[256];
    (void)state;
    snprintf(folder, sizeof folder, "%s/maps", parent);
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(parent) ? 0 : -1;
}

static int remove_folder(void **state)
{
    char command[256];
    (void)state;
    snprintf(command, sizeof command, "rm -r %s", parent);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(what_is_exported_comes_back, clean),
        cmocka_unit_test_setup(texels_look_as_they_did_from_the_station, clean),
        cmocka_unit_test_setup(edits_that_do_not_fit_are_refused, clean),
        cmocka_unit_test_setup(nothing_is_overwritten_and_nothing_is_left, clean),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
