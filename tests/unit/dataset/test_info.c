/* splatd info as scripts meet it: output, exit codes, messages. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>

#include "dataset/dataset.h"
#include "image/load.h"
#include "support/make_dataset.h"
#include "support/make_textures.h"

static char folder[256];

/* Runs `splatd info ARGUMENTS` in the folder, stdout and stderr into `output`; returns the exit code. */
static int run(const char *arguments, char *output, size_t size)
{
    char command[1024];
    snprintf(command, sizeof command, "cd '%s' && '%s' info %s", folder, getenv("SPLATD_BINARY"), arguments);
    FILE *pipe = popen(command, "r");
    size_t used = fread(output, 1, size - 1, pipe);
    output[used] = 0;
    return WEXITSTATUS(pclose(pipe));
}

static void flip_page_byte(const char *name)
{
    char path[300];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r+b");
    fseek(file, 65536, SEEK_SET);
    int byte = fgetc(file);
    fseek(file, 65536, SEEK_SET);
    fputc(byte ^ 1, file);
    fclose(file);
}

static void make(const char *name, size_t count, int levels)
{
    char path[300];
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {0.5 * (double)(i % 100), 0.5 * (double)(i / 100), 0},
                                        .normal = {0, 0, 1},
                                        .radius = 0.5f,
                                        .color = {(uint8_t)i, 10, 10},
                                        .linear = i % 10 == 3,
                                        .clip = {i % 8 == 1, 0, 0},
                                        .clip_offset = 0.4f};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    make_dataset_file(path, splats, count, levels);
    free(splats);
}

static double number(const json_t *json, const char *key)
{
    assert_true(json_is_number(json_object_get(json, key)));
    return json_number_value(json_object_get(json, key));
}

static void test_json(void **state)
{
    (void)state;
    static const char *const attributes[] = {"position", "radius",      "normal", "color",
                                             "class",    "uncertainty", "linear", "clip",
                                             "lines",    "chunk"};
    char output[8192];
    assert_int_equal(run("--json two.spld", output, sizeof output), 0);
    json_t *json = json_loads(output, 0, NULL);
    assert_string_equal(json_string_value(json_object_get(json, "id")), "two");
    assert_true(number(json, "linear") == 400);
    assert_true(number(json, "clip_lines") == 500);
    const json_t *discs = json_object_get(json_object_get(json, "kinds"), "discs");
    const json_t *lines = json_object_get(json_object_get(json, "kinds"), "lines");
    assert_true(number(discs, "splats") == 4500 && number(discs, "chunks") == number(json, "chunks"));
    assert_true(number(discs, "bytes") > 4500 && number(lines, "pieces") == 0 && number(lines, "bytes") == 0);
    assert_true(json_is_true(json_object_get(json_object_get(json, "attributes"), "surface")));
    const json_t *streams = json_object_get(json, "streams");
    assert_int_equal(json_array_size(streams), 2);
    assert_string_equal(json_string_value(json_object_get(json_array_get(streams, 1), "type")), "half-octaves");
    assert_string_equal(json_string_value(json_object_get(json, "unit")), "us-ft");
    assert_string_equal(json_string_value(json_object_get(json, "crs")), "EPSG:2263");
    assert_string_equal(spl_unit_word(&(struct spl_dataset_info){.unit = "us-ft"}), "us-ft");
    assert_string_equal(spl_unit_word(&(struct spl_dataset_info){.unit = "unknown"}), "unit");
    assert_string_equal(spl_unit_word(&(struct spl_dataset_info){0}), "unit");
    assert_true(json_object_size(json_object_get(json, "widths")) == 6);
    assert_true(number(json, "points") == 4000 && number(json, "splats") == 4500 && number(json, "levels") == 2);
    const json_t *max = json_object_get(json_object_get(json, "bounds"), "max");
    assert_true(json_number_value(json_array_get(max, 0)) == 49.5 && json_number_value(json_array_get(max, 2)) == 0);
    const json_t *bytes = json_object_get(json, "bytes_per_splat"), *levels = json_object_get(json, "by_level"), *level;
    double kept = number(json_object_get(json, "bytes_per_point"), "total");
    assert_float_equal(kept, number(bytes, "total") * 4500 / 4000, 1e-9);
    double sum = 0, splats = 0;
    for (size_t i = 0; i < sizeof attributes / sizeof *attributes; i++)
        sum += number(bytes, attributes[i]);
    assert_true(sum > 1 && sum < number(bytes, "total") + 1e-9 && sum > number(bytes, "total") - 1e-9);
    size_t i;
    json_array_foreach(levels, i, level)
        splats += number(level, "splats");
    assert_true(splats == 4500);
    assert_true(number(json, "file_bytes") > number(json, "page_bytes"));
    assert_int_equal(strlen(json_string_value(json_object_get(json, "version"))), 16);
    const char *name;
    json_t *histogram;
    json_object_foreach(json_object_get(json, "widths"), name, histogram)
    {
        double share = 0;
        const char *width;
        json_t *value;
        json_object_foreach(histogram, width, value)
            share += json_number_value(value);
        assert_true(share > 0.999999 && share < 1.000001);
    }
    json_decref(json);
}

static void test_table(void **state)
{
    (void)state;
    char output[8192];
    assert_int_equal(run("two.spld one.spld", output, sizeof output), 0);
    assert_non_null(strstr(output, "splats        4,500: 4,000 points and 500 for coarser levels (12.5 %)"));
    assert_non_null(strstr(output, "one  version "));
    assert_non_null(strstr(output, "linear        400 points on wires, poles and cables (10.00 %)"));
    assert_non_null(strstr(output, "clip lines    500 splats (11.11 %)"));
    assert_non_null(strstr(output, "surface       normals and radii"));
    assert_non_null(strstr(output, "attributes    color, class, uncertainty (derived from the points)\n"));
    assert_non_null(strstr(output, "unit          us-ft"));
    assert_non_null(strstr(output, "crs           EPSG:2263"));
}

/* A scan's name comes into META and from there onto terminals. */
static void test_texts_of_files_are_shown_not_carried_out(void **state)
{
    (void)state;
    char output[8192];
    assert_int_equal(
        run("one.spld >/dev/null; for i in $(seq 300); do echo $i $((i * 7 % 13)) $((i % 5)); done >\"$(printf "
            "'Z\\303\\274rich\\033[2J\\n\\302\\233x.xyz')\" && \"$SPLATD_BINARY\" pack *.xyz -o odd.spld 2>&1 && "
            "\"$SPLATD_BINARY\" info odd.spld && rm odd.spld *.xyz",
            output, sizeof output),
        0);
    assert_non_null(strstr(output, "reading Z\303\274rich?[2J??x.xyz: "));
    assert_non_null(strstr(output, "  source        Z\303\274rich?[2J??x.xyz\n"));
    assert_null(strchr(output, '\033'));
    assert_null(strstr(output, "\302\233"));
    assert_int_equal(run("\"$(printf 'none\\033[2J\\nforged.spld')\" 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "none?[2J?forged.spld"));
    assert_int_equal(
        run(">/dev/null 2>&1; seq 300 | sed 's/.*/& & 1/' >a.xyz; \"$SPLATD_BINARY\" pack a.xyz -o gone/a.spld 2>&1; "
            "rm a.xyz",
            output, sizeof output),
        0);
    assert_non_null(strstr(output, "cannot create gone/a.spld: there is no folder 'gone/'"));
}

static void test_exit_codes(void **state)
{
    (void)state;
    char output[8192];
    assert_int_equal(run("2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "at least one dataset: splatd info hall.spld"));
    assert_int_equal(run("--jsno one.spld 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "'splatd info --help' shows how"));
    assert_int_equal(run("--help", output, sizeof output), 0);
    assert_non_null(strstr(output, "splatd info courtyard.spld"));
    assert_int_equal(run("missing.spld one.spld 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "missing.spld: there is no such file"));
    assert_non_null(strstr(output, "one  version ")); /* the others are still told of */
    assert_int_equal(run("one.spld >/dev/full 2>/dev/null", output, sizeof output), 1);

    make("hurt.spld", 100, 1);
    flip_page_byte("hurt.spld");
    assert_int_equal(run("--json hurt.spld 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "section PAGE 0 fails its checksum"));
    assert_null(strchr(output, '{'));
    assert_int_equal(run("--no-verify hurt.spld", output, sizeof output), 0);
}

static void test_textures(void **state)
{
    (void)state;
    char output[8192], path[300];
    struct spl_dataset *from;
    struct spl_dictionary dictionary = make_dictionary(10, 8, 1);
    snprintf(path, sizeof path, "%s/two.spld", folder);
    assert_int_equal(spl_dataset_open(path, true, &from, NULL), SPL_OK);
    snprintf(path, sizeof path, "%s/textured.spld", folder);
    make_textured_file(from, &dictionary, 3, 1, path);
    spl_dataset_close(from);
    spl_dictionary_finish(&dictionary);
    assert_int_equal(run("--json textured.spld", output, sizeof output), 0);
    json_t *json = json_loads(output, 0, NULL), *textures = json_object_get(json, "textures"), *count;
    const json_t *bytes = json_object_get(json, "bytes_per_splat"),
                 *counts = json_object_get(textures, "splats_by_atoms");
    assert_true(number(textures, "atoms") == 10 && number(textures, "size") == 8);
    assert_true(number(bytes, "texture") > 0 && number(bytes, "dictionary") > 16 / 4500.0 &&
                number(bytes, "dictionary") < 10 * 192 / 4500.0);
    double splats = 0;
    size_t i;
    json_array_foreach(counts, i, count)
        splats += json_number_value(count);
    assert_true(splats == 4500 && json_array_size(counts) == 9 && json_number_value(json_array_get(counts, 3)) > 100);
    json_decref(json);
    assert_int_equal(run("--dictionary atoms.png textured.spld", output, sizeof output), 0);
    assert_non_null(strstr(output, "textures of 8 x 8 from 10 atoms"));
    snprintf(path, sizeof path, "%s/atoms.png", folder);
    struct spl_image picture;
    assert_int_equal(spl_image_load(path, SPL_LAYER_COLOR, &picture, NULL), SPL_OK);
    assert_true(picture.width == 4 * 9 + 1 && picture.height == 3 * 9 + 1);
    const uint8_t *pixels = picture.pixels;
    int least = 255, most = 0;
    for (uint32_t y = 1; y < 9; y++)
        for (uint32_t x = 1; x < 9; x++) {
            int red = pixels[4 * (y * picture.width + x)];
            least = red < least ? red : least;
            most = red > most ? red : most;
        }
    assert_true(pixels[0] == 0 && least < 100 && most > 150);
    spl_image_finish(&picture);
    assert_int_equal(run("--dictionary atoms.png one.spld 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "one has no textures"));
    assert_int_equal(run("--dictionary atoms.png one.spld two.spld 2>&1", output, sizeof output), 2);
    assert_int_equal(run("--dictionary nowhere/atoms.png textured.spld 2>/dev/null", output, sizeof output), 1);
}

static int prepare(void **state)
{
    (void)state;
    make_folder(folder);
    make("one.spld", 1, 1);
    make("two.spld", 4000, 2);
    return 0;
}

static int clean(void **state)
{
    (void)state;
    static const char *const names[] = {"one.spld", "two.spld", "hurt.spld", "textured.spld", "atoms.png"};
    for (size_t i = 0; i < 5; i++) {
        char path[300];
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    return rmdir(folder);
}

/* Five splats, three panels for 40 points and two meshes for 25. */
static void make_primitives(const char *name)
{
    char path[300];
    struct make_splat splats[5];
    struct spl_panel panels[3] = {{.column = 1}, {.column = 2}, {.column = 3}};
    struct spl_relief reliefs[2] = {{.level = 1, .height = {0.01f, 0.02f}}, {.level = 1}};
    for (int i = 0; i < 5; i++)
        splats[i] = (struct make_splat){.position = {i, 0, 0}, .normal = {0, 0, 1}, .radius = 0.5f};
    for (int i = 0; i < 3; i++)
        panels[i].cells[4] = 7;
    struct make_panels made[2] = {{.plane = {.normal = {0, 0, 1}, .cell = 0.1f, .error_mean = 0.003f,
                                             .error_most = 0.009f, .points = 40},
                                   .panels = panels,
                                   .count = 3},
                                  {.plane = {.normal = {0, 0, 1}, .cell = 0.1f, .error_mean = 0.004f,
                                             .error_most = 0.02f, .points = 25},
                                   .panels = panels,
                                   .reliefs = reliefs,
                                   .count = 2}};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    make_dataset_file_panels(path, splats, 5, made, 2, 1);
}

static void test_panels_and_meshes(void **state)
{
    (void)state;
    char output[8192];
    make_primitives("shapes.spld");
    assert_int_equal(run("--json shapes.spld", output, sizeof output), 0);
    json_t *json = json_loads(output, 0, NULL);
    const json_t *all = json_object_get(json, "primitives"), *kinds = json_object_get(json, "kinds");
    const json_t *panels = json_object_get(all, "panels"), *meshes = json_object_get(all, "meshes");
    const json_t *level = json_array_get(json_object_get(json, "by_level"), 0);
    assert_true(number(json, "leaf_splats") == 70 && number(json, "splats") == 5);
    assert_true(number(panels, "count") == 3 && number(panels, "points") == 40);
    assert_true(number(meshes, "count") == 2 && number(meshes, "points") == 25);
    assert_float_equal(number(panels, "error_mean"), 0.003, 1e-7);
    assert_float_equal(number(panels, "error_most"), 0.009, 1e-7);
    assert_float_equal(number(meshes, "error_mean"), 0.004, 1e-7);
    assert_float_equal(number(meshes, "error_most"), 0.02, 1e-7);
    assert_true(number(meshes, "bytes") == 60 + 4 * 2 * (2 + 3 + 1 + 1)); /* of one mask and one colour each */
    assert_true(number(json_object_get(kinds, "meshes"), "bytes") == number(meshes, "bytes"));
    assert_true(number(json_object_get(kinds, "meshes"), "meshes") == 2);
    assert_true(number(level, "panels") == 3 && number(level, "meshes") == 2);
    assert_float_equal(number(json_object_get(json, "bytes_per_splat"), "meshes"), number(meshes, "bytes") / 70, 1e-9);
    assert_float_equal(number(json_object_get(json, "bytes_per_point"), "meshes"), number(meshes, "bytes") / 70, 1e-9);
    json_decref(json);
    assert_int_equal(run("shapes.spld", output, sizeof output), 0);
    assert_non_null(strstr(output, "  panels        3 for 40 points (57.14 %)"));
    assert_non_null(
        strstr(output, "  meshes        2 for 25 points (35.71 %), 0.1 kB; points off them 0.004 us-ft, 0.02"));
    assert_non_null(strstr(output, "panels      meshes"));
    assert_non_null(strstr(output, "bytes a point"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_json),
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_texts_of_files_are_shown_not_carried_out),
        cmocka_unit_test(test_exit_codes),
        cmocka_unit_test(test_textures),
        cmocka_unit_test(test_panels_and_meshes),
    };
    return cmocka_run_group_tests(tests, prepare, clean);
}
