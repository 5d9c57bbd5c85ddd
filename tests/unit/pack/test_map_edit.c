/* Maps through people's hands, and panoramas that nobody named: a texel that was painted over is that in the dataset,
 * aprons included, and nothing else changes; what a scan brings along is taken, and fails nothing. */
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

#include <splatd/pack.h>

#include "base/memory.h"
#include "dataset/dataset.h"
#include "image/load.h"
#include "pack/maps/edit.h"
#include "support/e57_writer.h"
#include "support/folder.h"

enum { side = 64, columns = 120, rows = 60, width = 256 };

static void put_image(const char *name, const struct spl_image *image)
{
    const struct spl_encode_options how = {.size = sizeof how, .format = SPL_FORMAT_PNG};
    struct spl_encoded png;
    assert_int_equal(spl_image_encode(image, &how, &png, NULL), 0);
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(png.bytes, 1, png.length, file), png.length);
    fclose(file);
    spl_encoded_finish(&png);
}

static void an_edited_texel_reaches_its_repeats(void **state)
{
    struct spl_map_row row = {
        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .side = side, .levels = 1, .range_side = 4, .near = 1};
    struct spl_map_edits edits = {0};
    struct spl_map_export out = {0};
    struct spl_atlas atlas, before;
    struct spl_error err = {0};
    uint32_t *words = calloc(spl_map_words(&row), sizeof *words);
    (void)state;
    assert_int_equal(spl_atlas_init(&atlas, side, NULL), 0);
    assert_int_equal(spl_atlas_init(&before, side, NULL), 0);
    for (size_t t = 0; t < (size_t)atlas.width * atlas.height; t++) /* values that no byte stands for exactly */
        for (int c = 0; c < 4; c++)
            atlas.texels[t][c] = before.texels[t][c] = c < 3 ? 0.2f + 0.0001f * (float)(t % 997) : 1;
    assert_int_equal(spl_map_edit(&edits, &out, 0, &row, words, &atlas, &err), 0); /* nothing asked for */
    assert_int_equal(spl_map_export_init(&out, in_folder("texels"), &err), 0);
    assert_int_equal(spl_map_edit(&edits, &out, 0, &row, words, &atlas, &err), 0);
    assert_int_equal(spl_map_export_commit(&out, &err), 0);
    spl_map_export_finish(&out);
    assert_int_equal(spl_map_edits_init(&edits, in_folder("texels"), &err), 0);
    assert_int_equal(spl_map_edit(&edits, &out, 0, &row, words, &atlas, &err), 0);
    assert_memory_equal(atlas.texels, before.texels, sizeof *atlas.texels * atlas.width * atlas.height);

    /* the band's first column, which its far end repeats */
    struct spl_image picture;
    assert_int_equal(spl_image_load(in_folder("texels/station-1.color.png"), SPL_LAYER_COLOR, &picture, &err), 0);
    for (uint32_t y = 0; y < side; y++)
        memcpy((uint8_t *)picture.pixels + 4 * ((size_t)y * 6 * side + 2 * side), (uint8_t[4]){255, 0, 0, 255}, 4);
    put_image("texels/station-1.color.png", &picture);
    spl_image_finish(&picture);
    assert_int_equal(spl_map_edit(&edits, &out, 0, &row, words, &atlas, &err), 0);
    unsigned red = 0;
    for (uint32_t y = 0; y < atlas.height; y++)
        for (uint32_t x = 0; x < atlas.width; x++) {
            const size_t t = (size_t)y * atlas.width + x;
            double d[3], place[2];
            spl_polar_direction(side, SPL_MAP_APRON, (double[2]){x + 0.5, y + 0.5}, d);
            spl_polar_place(side, SPL_MAP_APRON, d, place);
            bool wanted = (uint32_t)place[0] == 6 * side - 1 + 5 * SPL_MAP_APRON; /* the last one of the atlas */
            red += wanted;
            if (wanted)
                assert_true(atlas.texels[t][0] == 1 && atlas.texels[t][1] == 0);
            else
                assert_memory_equal(atlas.texels[t], before.texels[t], sizeof *atlas.texels);
        }
    assert_true(red > side + 8); /* not the band's own alone */
    spl_map_edits_finish(&edits);
    spl_atlas_finish(&atlas);
    spl_atlas_finish(&before);
    free(words);
}

/* A sphere of 3 m around one station, grey. */
static void write_scan(const char *name)
{
    FILE *f = fopen(in_folder(name), "w");
    assert_non_null(f);
    fprintf(f, "%d\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", columns, rows);
    for (int i = 0; i < columns * rows; i++) {
        double turn = -2 * M_PI * (i / rows) / columns, rise = M_PI * ((i % rows + 0.5) / rows - 0.5);
        fprintf(f, "%.5f %.5f %.5f 0.5 128 128 128\n", 3 * cos(turn) * cos(rise), 3 * sin(turn) * cos(rise),
                3 * sin(rise));
    }
    assert_int_equal(fclose(f), 0);
}

static void write_panorama(const char *name, const uint8_t color[4])
{
    static uint8_t texels[width / 2][width][4];
    const struct spl_image image = {.layer = SPL_LAYER_COLOR, .width = width, .height = width / 2, .pixels = texels};
    for (size_t t = 0; t < width / 2 * width; t++)
        memcpy(texels[t / width][t % width], color, 4);
    put_image(name, &image);
}

static char warning[512];

static void warn(void *context, const char *text)
{
    (void)context;
    snprintf(warning, sizeof warning, "%s", text);
}

static int pack(const char *output, const struct spl_map_options *maps, struct spl_pack_report *report,
                struct spl_error *err)
{
    const char *input = in_folder("scan.ptx");
    const struct spl_pack_options options = {
        .size = sizeof options, .inputs = &input, .input_count = 1, .output = in_folder(output), .maps = maps,
        .warn = warn};
    *report = (struct spl_pack_report){0};
    *warning = 0;
    return spl_pack(&options, report, err);
}

static void assert_colored(const char *name, const int color[3])
{
    struct spl_dataset *dataset;
    uint32_t count;
    assert_int_equal(spl_dataset_open_whole(in_folder(name), true, &dataset, NULL), 0);
    const struct spl_map_row *row = spl_dataset_get_maps(dataset, &count);
    assert_int_equal(count, 1);
    uint32_t *words = malloc(spl_map_words(row) * sizeof *words);
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, NULL), 0);
    for (uint32_t level = 0; level < row->levels; level++)
        for (int i = 0; i < 100; i++) {
            uint32_t high = row->side >> level;
            double place[2], d[3] = {cos(i), sin(i), i / 20.0 - 2.5};
            float got[3];
            spl_polar_place(high, SPL_MAP_APRON, d, place);
            spl_map_get_color(words + spl_map_level_word(row, level), high, (uint32_t)place[0], (uint32_t)place[1],
                              got);
            for (int c = 0; c < 3; c++)
                assert_true(fabsf(got[c] - (float)color[c]) < 6);
        }
    free(words);
    spl_dataset_close(dataset);
}

/* A panorama is a few texels wide, and yet its ranges are as fine as the scan, here of some dozens a quarter turn. */
static void small_panoramas_have_ranges(void)
{
    struct spl_dataset *dataset = NULL;
    uint32_t count;
    assert_int_equal(spl_dataset_open(in_folder("found.spld"), false, &dataset, NULL), SPL_OK);
    const struct spl_map_row *row = spl_dataset_get_maps(dataset, &count);
    assert_int_equal(count, 1);
    if (row->range_side < 16)
        fail_msg("ranges are %u texels a quarter turn", row->range_side);
    spl_dataset_close(dataset);
}

static void what_a_scan_brings_along_is_found(void **state)
{
    const struct spl_map_options found = {.size = sizeof found, .find = true};
    struct spl_pack_report report;
    struct spl_error err = {0};
    (void)state;
    write_scan("scan.ptx");
    assert_int_equal(pack("none.spld", NULL, &report, NULL), 0);
    assert_int_equal(pack("nothing-there.spld", &found, &report, NULL), 0);
    assert_int_equal(report.maps.stations, 0);
    folder_assert_same("none.spld", "nothing-there.spld");

    assert_int_equal(mkdir(in_folder("panoramas"), 0777), 0);
    folder_put_text("panoramas/panoramas.json",
                    "{\"panoramas\": [{\"name\": \"a\", \"color\": \"a.png\", \"position\": "
                    "[0, 0, 0], \"quaternion\": [1, 0, 0, 0]}]}");
    assert_int_equal(pack("broken.spld", &found, &report, &err), 0); /* the image is missing */
    assert_int_equal(report.maps.stations, 0);
    assert_non_null(strstr(warning, "panoramas"));
    folder_assert_same("none.spld", "broken.spld");
    write_panorama("panoramas/a.png", (uint8_t[4]){40, 80, 200, 255});
    if (pack("found.spld", &found, &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.stations, 1);
    assert_int_equal(report.maps.pictures, 1);
    assert_colored("found.spld", (const int[3]){40, 80, 200});
    small_panoramas_have_ranges();
}

/* An image whose header is whole and whose pixels are cut off: what is found is warned of, what is named fails. */
static void what_is_found_fails_nothing(void **state)
{
    struct spl_map_options maps = {.size = sizeof maps, .find = true};
    struct spl_pack_report report;
    struct spl_error err = {0};
    struct stat status;
    char list[256];
    (void)state;
    assert_int_equal(stat(in_folder("panoramas/a.png"), &status), 0);
    assert_int_equal(truncate(in_folder("panoramas/a.png"), status.st_size - 40), 0);
    if (pack("cut.spld", &maps, &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.stations, 1); /* of the splats' own colours */
    assert_colored("cut.spld", (const int[3]){128, 128, 128});
    assert_non_null(strstr(warning, "a.png"));
    snprintf(list, sizeof list, "%s", in_folder("panoramas"));
    maps = (struct spl_map_options){.size = sizeof maps, .panoramas = list};
    unlink(in_folder("cut.spld"));
    assert_true(pack("cut.spld", &maps, &report, &err) < 0);
    assert_non_null(strstr(err.message, "a.png"));
    assert_int_equal(access(in_folder("cut.spld"), F_OK), -1);
    write_panorama("panoramas/a.png", (uint8_t[4]){40, 80, 200, 255});
}

/* Panoramas that scans bring along are found for panels as for discs. */
static void primitives_go_with_maps(void **state)
{
    const char *input = in_folder("scan.ptx");
    struct spl_map_options maps = {.size = sizeof maps, .find = true};
    struct spl_pack_options options = {.size = sizeof options, .inputs = &input, .input_count = 1,
                                       .output = in_folder("flat.spld"), .maps = &maps, .warn = warn,
                                       .primitives = SPL_PRIMITIVES_ALL};
    struct spl_pack_report report = {0};
    struct spl_error err = {0};
    (void)state;
    *warning = 0;
    if (spl_pack(&options, &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.stations, 1);
    assert_null(strstr(warning, "left out"));
}

static void count_refused(void *context, const struct spl_error *why)
{
    (void)why;
    ++*(unsigned *)context;
}

/* One panorama at `x`, and `missing` others whose images are not there. */
static void write_list(const char *name, double x, unsigned missing)
{
    char text[4096];
    int length = sprintf(text, "{\"panoramas\": [{\"name\": \"a\", \"color\": \"panoramas/a.png\", \"position\": "
                               "[%g, 0, 0], \"quaternion\": [1, 0, 0, 0]}", x);
    for (unsigned i = 0; i < missing; i++)
        length += sprintf(text + length, ", {\"name\": \"m%u\", \"color\": \"missing-%u.png\", \"position\": "
                                         "[0, 0, 0], \"quaternion\": [1, 0, 0, 0]}", i, i);
    strcat(text, "]}");
    folder_put_text(name, text);
}

/* What decides is whether any picture stands at a station, not how many were refused for something else. */
static void one_good_picture_among_many_bad_ones_will_do(void **state)
{
    unsigned refused = 0;
    struct spl_map_options maps = {.size = sizeof maps, .refused = count_refused, .context = &refused};
    struct spl_pack_report report;
    struct spl_error err = {0};
    char list[256];
    (void)state;
    write_list("many.json", 0, 7);
    snprintf(list, sizeof list, "%s", in_folder("many.json"));
    maps.panoramas = list;
    if (pack("many.spld", &maps, &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(refused, 7);
    assert_int_equal(report.maps.refused, 7);
    assert_int_equal(report.maps.pictures, 8); /* a panorama, and those that are missing */
    assert_colored("many.spld", (const int[3]){40, 80, 200});
}

static void named_panoramas_that_fit_no_station_are_refused(void **state)
{
    unsigned refused = 0;
    struct spl_map_options maps = {.size = sizeof maps, .refused = count_refused, .context = &refused};
    struct spl_pack_report report;
    char list[256];
    (void)state;
    for (unsigned missing = 0; missing < 3; missing += 2)
        for (int lax = 0; lax < 2; lax++) {
            struct spl_error err = {0};
            if (missing && !lax)
                continue; /* the missing image ends it before */
            write_list("off.json", 40, missing);
            snprintf(list, sizeof list, "%s", in_folder("off.json"));
            maps.panoramas = list;
            maps.refused = lax ? count_refused : NULL;
            assert_int_equal(pack("off.spld", &maps, &report, &err), SPL_E_INPUT);
            assert_string_equal(err.field, "panoramas");
            assert_non_null(strstr(err.message, "off.json"));
            if (!strstr(err.message, missing ? "none of its 3 pictures" : "none of its 1 picture "))
                fail_msg("%s", err.message);
            assert_int_equal(access(in_folder("off.spld"), F_OK), -1);
        }
}

static void edits_survive_packing(void **state)
{
    struct spl_map_options maps = {.size = sizeof maps, .find = true, .export_to = in_folder("exported")};
    struct spl_pack_report report;
    struct spl_error err = {0};
    struct spl_image picture;
    char exported[256];
    (void)state;
    snprintf(exported, sizeof exported, "%s", maps.export_to);
    maps.export_to = exported;
    if (pack("exported.spld", &maps, &report, &err))
        fail_msg("%s", err.message);
    folder_assert_same("exported.spld", "found.spld");
    assert_int_equal(pack("again.spld", &maps, &report, &err), SPL_E_USAGE); /* the folder is not empty now */
    assert_string_equal(err.field, "export-maps");
    assert_int_equal(access(in_folder("again.spld"), F_OK), -1);

    err = (struct spl_error){0};
    maps.export_to = NULL;
    maps.edits = exported;
    if (pack("unchanged.spld", &maps, &report, &err))
        fail_msg("%s", err.message);
    folder_assert_same("unchanged.spld", "found.spld");
    assert_int_equal(spl_image_load(in_folder("exported/station-1.color.png"), SPL_LAYER_COLOR, &picture, NULL), 0);
    for (size_t t = 0; t < (size_t)picture.width * picture.height; t++)
        memcpy((uint8_t *)picture.pixels + 4 * t, (uint8_t[4]){20, 160, 60, 255}, 4);
    put_image("exported/station-1.color.png", &picture);
    spl_image_finish(&picture);
    assert_int_equal(pack("edited.spld", &maps, &report, NULL), 0);
    assert_colored("edited.spld", (const int[3]){20, 160, 60});
    assert_int_equal(report.maps.edits, 1);
    assert_int_equal(report.maps.edited, 1);
    assert_null(strstr(warning, "not taken"));

    folder_put_text("exported/maps.json", "{\"maps\": [{\"name\": \"station-7\", \"color\": \"station-1.color.png\", "
                                   "\"side\": 64, \"position\": [0, 0, 0]}]}");
    assert_int_equal(pack("edited.spld", &maps, &report, NULL), 0); /* nobody's */
    assert_colored("edited.spld", (const int[3]){40, 80, 200});
    assert_int_equal(report.maps.edits, 1);
    assert_int_equal(report.maps.edited, 0);
    assert_non_null(strstr(warning, "1 of its 1 maps are of no station"));

    folder_put_text("exported/maps.json", "{");
    err = (struct spl_error){0};
    assert_int_equal(pack("again.spld", &maps, &report, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "maps");
    assert_int_equal(access(in_folder("again.spld"), F_OK), -1);

    /* a map that does not fit is refused, also where nobody named the panoramas */
    folder_put_text("exported/maps.json", "{\"maps\": [{\"name\": \"station-1\", \"color\": \"station-1.color.png\", "
                                          "\"side\": 128, \"position\": [0, 0, 0]}]}");
    err = (struct spl_error){0};
    assert_int_equal(pack("again.spld", &maps, &report, &err), SPL_E_INPUT);
    assert_int_equal(access(in_folder("again.spld"), F_OK), -1);

    /* without maps there is nothing to export, and no folder */
    maps = (struct spl_map_options){.size = sizeof maps, .find = true, .export_to = in_folder("never"), .edits = NULL};
    snprintf(exported, sizeof exported, "%s", maps.export_to);
    maps.export_to = exported;
    unlink(in_folder("panoramas/panoramas.json"));
    err = (struct spl_error){0};
    assert_int_equal(pack("again.spld", &maps, &report, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "bring no panoramas along"));
    assert_int_equal(access(exported, F_OK), -1);
}

/* What lies where: red grows with the world's x, green with its y, blue with its z. */
static void color_of(const double d[3], uint8_t color[4])
{
    for (int c = 0; c < 3; c++)
        color[c] = (uint8_t)lround(128 + 100 * d[c]);
    color[3] = 255;
}

/* A panorama as it sees that, turned by a quarter around z: its middle looks along the world's y. */
static struct spl_encoded make_turned_panorama(void)
{
    static uint8_t texels[width / 2][width][4];
    const struct spl_image image = {.layer = SPL_LAYER_COLOR, .width = width, .height = width / 2, .pixels = texels};
    const struct spl_encode_options how = {.size = sizeof how, .format = SPL_FORMAT_PNG};
    struct spl_encoded png;
    for (int y = 0; y < width / 2; y++)
        for (int x = 0; x < width; x++) {
            double turn = M_PI * (1 - 2 * (x + 0.5) / width) + M_PI / 2, rise = M_PI * (0.5 - (y + 0.5) * 2 / width);
            color_of((double[3]){cos(rise) * cos(turn), cos(rise) * sin(turn), sin(rise)}, texels[y][x]);
        }
    assert_int_equal(spl_image_encode(&image, &how, &png, NULL), 0);
    return png;
}

/* The same sphere as E57, with the panorama among its images. */
static void write_e57(const char *name, const struct spl_encoded *png)
{
    static double values[3][columns * rows];
    static const char *const axes[3] = {"cartesianX", "cartesianY", "cartesianZ"};
    struct e57_field fields[3];
    struct e57_writer w;
    size_t length;
    for (int i = 0; i < columns * rows; i++) {
        double turn = -2 * M_PI * (i / rows) / columns, rise = M_PI * ((i % rows + 0.5) / rows - 0.5);
        values[0][i] = 3 * cos(turn) * cos(rise);
        values[1][i] = 3 * sin(turn) * cos(rise);
        values[2][i] = 3 * sin(rise);
    }
    for (int k = 0; k < 3; k++)
        fields[k] = (struct e57_field){.name = axes[k], .type = E57_DOUBLE, .values = values[k], .step = 8000};
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"scan", e57_pose(1, 0, 0, 0, 0, 0, 0), fields, 3, columns * rows, 0});
    unsigned long long blob = e57_add_blob(&w, png->bytes, png->length);
    e57_add_image(&w,
                  "<name>p</name>%s<sphericalRepresentation><imageWidth>%d</imageWidth><imageHeight>%d</imageHeight>"
                  "<pixelWidth>%.17g</pixelWidth><pixelHeight>%.17g</pixelHeight><pngImage type=\"Blob\" "
                  "fileOffset=\"%llu\" length=\"%zu\"/></sphericalRepresentation>",
                  e57_pose(1, 0, 0, 1, 0, 0, 0), width, width / 2, 2 * M_PI / width, 2 * M_PI / width, blob,
                  png->length);
    uint8_t *file = e57_end(&w, NULL, &length);
    FILE *out = fopen(in_folder(name), "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(file, 1, length, out), length);
    fclose(out);
    free(file);
}

static void assert_oriented(const char *name)
{
    struct spl_dataset *dataset;
    uint32_t count;
    assert_int_equal(spl_dataset_open_whole(in_folder(name), true, &dataset, NULL), 0);
    const struct spl_map_row *row = spl_dataset_get_maps(dataset, &count);
    assert_int_equal(count, 1);
    uint32_t *words = malloc(spl_map_words(row) * sizeof *words);
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, NULL), 0);
    for (int i = 0; i < 300; i++) {
        double place[2], z = 1.98 * (i / 299.0) - 0.99, flat = sqrt(1 - z * z);
        const double d[3] = {flat * cos(i), flat * sin(i), z};
        double local[3] = {0};
        uint8_t wanted[4];
        float got[3];
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                local[a] += row->rotation[3 * b + a] * d[b];
        spl_polar_place(row->side, SPL_MAP_APRON, local, place);
        spl_map_get_color(words + spl_map_level_word(row, 0), row->side, (uint32_t)place[0], (uint32_t)place[1], got);
        color_of(d, wanted);
        for (int c = 0; c < 3; c++)
            assert_true(fabsf(got[c] - wanted[c]) < 10);
    }
    free(words);
    spl_dataset_close(dataset);
}

static void panoramas_lie_where_they_look(void **state)
{
    struct spl_encoded png = make_turned_panorama();
    struct spl_map_options maps = {.size = sizeof maps};
    struct spl_pack_report report;
    struct spl_error err = {0};
    char list[256];
    (void)state;
    write_e57("scan.e57", &png);
    FILE *file = fopen(in_folder("turned.png"), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(png.bytes, 1, png.length, file), png.length);
    fclose(file);
    spl_encoded_finish(&png);
    folder_put_text("turned.json", "{\"panoramas\": [{\"name\": \"a\", \"color\": \"turned.png\", \"position\": "
                            "[0, 0, 0], \"rotation\": [0, -1, 0, 1, 0, 0, 0, 0, 1]}]}");
    snprintf(list, sizeof list, "%s", in_folder("turned.json"));
    maps.panoramas = list;
    if (pack("turned.spld", &maps, &report, &err))
        fail_msg("%s", err.message);
    assert_oriented("turned.spld");

    const char *input = in_folder("scan.e57");
    maps = (struct spl_map_options){.size = sizeof maps, .find = true};
    const struct spl_pack_options options = {
        .size = sizeof options, .inputs = &input, .input_count = 1, .output = in_folder("e57.spld"), .maps = &maps};
    report = (struct spl_pack_report){0};
    if (spl_pack(&options, &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.pictures, 1);
    assert_oriented("e57.spld");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_edited_texel_reaches_its_repeats),
        cmocka_unit_test(what_a_scan_brings_along_is_found),
        cmocka_unit_test(what_is_found_fails_nothing),
        cmocka_unit_test(primitives_go_with_maps),
        cmocka_unit_test(one_good_picture_among_many_bad_ones_will_do),
        cmocka_unit_test(named_panoramas_that_fit_no_station_are_refused),
        cmocka_unit_test(edits_survive_packing),
        cmocka_unit_test(panoramas_lie_where_they_look),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
