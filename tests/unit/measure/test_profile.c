/* Profiles: what is saved is loaded again, every broken field is refused by its name, and so are profiles of another
 * dataset version or another device. The Pareto front and the fit of the time model by hand-made cases. */
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "measure/profile.h"
#include "support/make_dataset.h"

static const struct spl_dataset_info dataset = {.id = "hall", .version = 0x0123456789abcdefu};
static const struct spl_device_info device = {.backend = "vulkan", .name = "a GPU", .driver = "driver 1"};

static void make(struct spl_profile *profile)
{
    struct spl_error err = {0};
    assert_int_equal(spl_profile_init(profile, &dataset, &device, 2, &err), 0);
    profile->views = 8;
    profile->width = 1280;
    profile->height = 720;
    profile->points[0] = (struct spl_profile_point){.setting = {SPL_METHOD_SPLAT, 1, 1, 2},
                                                    .ms = 80.5,
                                                    .ms_q90 = 99,
                                                    .fixed_ms = 20,
                                                    .ms_per_mpx = 65.6,
                                                    .splats = NAN,
                                                    .psnr = 34.25,
                                                    .psnr_sd = 1.5,
                                                    .psnr_q05 = 32,
                                                    .ssim = 0.97,
                                                    .depth_rmse = 0.01,
                                                    .depth_beyond = 0.001,
                                                    .holes = 0,
                                                    .see_through = 1,
                                                    .halo = NAN,
                                                    .normal_mean = 2};
    profile->points[1] = (struct spl_profile_point){.setting = {SPL_METHOD_POINTS, 2.5, 0.5, 8},
                                                    .ms = 0.75,
                                                    .ms_q90 = 0.75,
                                                    .fixed_ms = 0,
                                                    .ms_per_mpx = 0.8,
                                                    .splats = 9,
                                                    .psnr = INFINITY,
                                                    .psnr_sd = NAN,
                                                    .psnr_q05 = INFINITY,
                                                    .ssim = NAN,
                                                    .depth_rmse = NAN,
                                                    .depth_beyond = NAN,
                                                    .holes = NAN,
                                                    .see_through = NAN,
                                                    .halo = NAN,
                                                    .normal_mean = NAN};
    spl_profile_mark_front(profile);
}

static void test_round_trip(void **state)
{
    (void)state;
    char folder[256], path[300];
    struct spl_profile profile, again;
    struct spl_error err = {0};
    struct stat status;
    make_folder(folder);
    snprintf(path, sizeof path, "%s/hall.profile.json", folder);
    make(&profile);
    for (int i = 0; i < 2; i++) // the second time over an older file
        assert_int_equal(spl_profile_save(path, &profile, &err), 0);
    assert_int_equal(spl_profile_load(path, &dataset, &device, &again, &err), 0);
    assert_string_equal(again.splatd, SPLATD_VERSION);
    assert_string_equal(again.dataset_id, "hall");
    assert_string_equal(again.device, "a GPU");
    assert_string_equal(again.driver, "driver 1");
    assert_true(again.dataset_version == dataset.version && again.views == 8 && again.width == 1280 &&
                again.height == 720 && again.count == 2 && !again.software);
    struct spl_profile_point *p = again.points;
    assert_true(p[0].setting.method == SPL_METHOD_SPLAT && p[0].ms == 80.5 && p[0].psnr_q05 == 32 && isnan(p[0].halo));
    assert_true(p[0].setting.atoms == 2 && p[1].setting.atoms == 8);
    assert_true(p[0].see_through == 1 && p[0].ms_per_mpx == 65.6 && isnan(p[0].splats));
    assert_true(p[1].setting.method == SPL_METHOD_POINTS && p[1].setting.lod == 2.5 && p[1].setting.supersample == 0.5);
    assert_true(p[1].psnr == SPL_PROFILE_PSNR_MAX && isnan(p[1].psnr_sd) && p[1].front && !p[0].front);
    spl_profile_finish(&again);

    struct spl_dataset_info newer = dataset;
    newer.version++;
    assert_int_equal(spl_profile_load(path, &newer, &device, &again, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "version");
    assert_non_null(strstr(err.message, "splatd bench"));
    assert_null(again.points);
    struct spl_device_info others[3] = {device, device, device};
    snprintf(others[0].backend, sizeof others[0].backend, "egl");
    snprintf(others[1].name, sizeof others[1].name, "another GPU");
    snprintf(others[2].driver, sizeof others[2].driver, "driver 2");
    for (int i = 0; i < 3; i++) {
        err = (struct spl_error){0};
        assert_int_equal(spl_profile_load(path, &dataset, &others[i], &again, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "device");
    }
    assert_int_equal(spl_profile_load(path, NULL, NULL, &again, NULL), 0);
    spl_profile_finish(&again);

    assert_int_equal(stat(path, &status), 0); // nothing else was left in the folder
    assert_int_equal(unlink(path), 0);
    assert_int_equal(spl_profile_load(path, &dataset, &device, &again, NULL), SPL_E_NOT_FOUND);
    assert_int_equal(spl_profile_save("/nowhere/at/all.profile.json", &profile, NULL), SPL_E_IO);
    assert_int_equal(rmdir(folder), 0);
    spl_profile_finish(&profile);
}

static void test_what_cannot_be_loaded_is_not_saved(void **state)
{
    (void)state;
    struct spl_profile profile;
    struct spl_error err = {0};
    make(&profile);
    profile.points[0].ms = NAN;
    assert_int_equal(spl_profile_save("/tmp/splatd-never", &profile, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "ms");
    profile.points[0].ms = 1;
    profile.points[1].setting = profile.points[0].setting;
    err = (struct spl_error){0};
    assert_int_equal(spl_profile_save("/tmp/splatd-never", &profile, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "points");
    profile.count = 0;
    assert_int_equal(spl_profile_save("/tmp/splatd-never", &profile, NULL), SPL_E_USAGE);
    assert_true(access("/tmp/splatd-never", F_OK) != 0);
    profile.count = 2;
    spl_profile_finish(&profile);
}

#define POINT                                                                                                          \
    "{\"method\": \"splat\", \"lod\": 1, \"supersample\": 1, \"ms\": 80, \"ms_q90\": 90, \"fixed_ms\": 10, "           \
    "\"ms_per_mpx\": 70, \"psnr\": 33, \"future\": {}}"
#define OTHER                                                                                                          \
    "{\"method\": \"points\", \"lod\": 1, \"supersample\": 1, \"ms\": 80, \"ms_q90\": 90, \"fixed_ms\": 10, "          \
    "\"ms_per_mpx\": 70}"
#define TEXTURED                                                                                                       \
    "{\"method\": \"splat\", \"lod\": 1, \"supersample\": 1, \"atoms\": 2, \"ms\": 8, \"ms_q90\": 9, \"fixed_ms\": "   \
    "1, "                                                                                                              \
    "\"ms_per_mpx\": 7}"
#define FEWER_OF_POINTS                                                                                                \
    "{\"method\": \"points\", \"lod\": 1, \"supersample\": 1, \"atoms\": 2, \"ms\": 8, \"ms_q90\": 9, \"fixed_ms\": "  \
    "1, "                                                                                                              \
    "\"ms_per_mpx\": 7}"
#define MAPPED(maps, atoms)                                                                                            \
    "{\"method\": \"splat\", \"lod\": 1, \"supersample\": 1, \"atoms\": " atoms ", \"maps\": \"" maps                  \
    "\", \"ms\": 8, "                                                                                                  \
    "\"ms_q90\": 9, \"fixed_ms\": 1, \"ms_per_mpx\": 7}"
#define SOFT(terms, opacity) "\"soft\": {\"terms\": \"" terms "\", \"opacity\": " opacity ", \"blend\": 0.5}"
#define SOFTENED(model)                                                                                                \
    "{\"method\": \"splat\", \"lod\": 1, \"supersample\": 1, \"soft_model\": \"" model "\", \"ms\": 95, "              \
    "\"ms_q90\": 99, \"soft_ms\": 20, \"fixed_ms\": 1, \"ms_per_mpx\": 7, \"psnr\": 20}"
#define GOOD                                                                                                           \
    "{\"format\": \"splatd-profile\", \"format_version\": 1, \"splatd\": \"0.1.0\", \"dataset\": {\"id\": \"hall\", "  \
    "\"version\": \"0123456789abcdef\"}, \"device\": {\"backend\": \"egl\", \"name\": \"n\", \"driver\": \"d\", "      \
    "\"software\": true}, \"reference\": \"exact\", \"views\": 8, \"width\": 1280, \"height\": 720, \"more\": [], "    \
    "\"points\": [" POINT ", " OTHER "]}"

/* GOOD with the first `find` replaced must be refused with `field`. */
static void refuse(const char *find, const char *replace, const char *field)
{
    char text[4096];
    const char *at = strstr(GOOD, find);
    assert_non_null(at);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at - GOOD), GOOD, replace, at + strlen(find));
    struct spl_profile profile;
    struct spl_error err = {0};
    int rc = spl_profile_parse(text, strlen(text), "file", &profile, &err);
    if (rc != SPL_E_INPUT || strcmp(err.field, field) || strncmp(err.message, "file: ", 6))
        fail_msg("'%s' for '%s': code %d, field '%s', message '%s'", replace, find, rc, err.field, err.message);
    assert_null(profile.points);
}

static void test_every_broken_field_is_named(void **state)
{
    (void)state;
    struct spl_profile profile;
    assert_int_equal(spl_profile_parse(GOOD, strlen(GOOD), "file", &profile, NULL), 0);
    assert_true(profile.count == 2 && isnan(profile.points[0].holes) && isnan(profile.points[1].psnr));
    assert_true(profile.points[0].front && !profile.points[1].front && profile.software);
    assert_true(profile.points[0].setting.atoms == 8); // from before textures: all
    spl_profile_finish(&profile);

    static const struct {
        const char *find, *replace, *field;
    } cases[] = {
        {"{", "", ""},                                      // no JSON at all
        {"\"views\": 8", "\"views\": 8, \"views\": 9", ""}, // twice
        {"80", "1e999", ""},                                // more than a double holds
        {"\"format\": \"splatd-profile\"", "\"format\": \"other\"", "format"},
        {"\"format\": \"splatd-profile\", ", "", "format"},
        {"\"format_version\": 1", "\"format_version\": 3", "format_version"},
        {"\"format_version\": 1", "\"format_version\": 0", "format_version"},
        {"\"format_version\": 1", "\"format_version\": \"1\"", "format_version"},
        {"\"0.1.0\"", "7", "splatd"},
        {"\"0.1.0\"", "\"0123456789012345678901234567890123456789\"", "splatd"},
        {"\"id\": \"hall\"", "\"id\": null", "id"},
        {"\"dataset\": {", "\"dataset\": 3, \"x\": {", "id"},
        {"0123456789abcdef", "0123456789abcde", "version"},
        {"0123456789abcdef", "0123456789abcdefa", "version"},
        {"0123456789abcdef", "0123456789ABCDEF", "version"},
        {"0123456789abcdef", "0x23456789abcdef", "version"},
        {"0123456789abcdef", "-123456789abcdef", "version"},
        {"\"backend\": \"egl\"", "\"backend\": \"a backend of a long name\"", "backend"},
        {"\"name\": \"n\"", "\"name\": []", "name"},
        {"\"driver\": \"d\", ", "", "driver"},
        {"\"software\": true", "\"software\": 1", "software"},
        {"\"exact\"", "\"as measured by somebody else\"", "reference"},
        {"\"views\": 8", "\"views\": 0", "views"},
        {"\"views\": 8", "\"views\": 8.5", "views"},
        {"\"width\": 1280", "\"width\": -1", "width"},
        {"\"height\": 720", "\"height\": 99999999999", "height"},
        {"[" POINT ", " OTHER "]", "[]", "points"},
        {"[" POINT ", " OTHER "]", "{}", "points"},
        {POINT, "3", "points"},
        {OTHER, POINT, "points"}, // the same setting twice
        {"\"method\": \"splat\"", "\"method\": \"magic\"", "method"},
        {"\"lod\": 1", "\"lod\": -1", "lod"},
        {"\"lod\": 1", "\"lod\": 65", "lod"},
        {"\"lod\": 1", "\"lod\": \"1\"", "lod"},
        {"\"supersample\": 1", "\"supersample\": 3", "supersample"},
        {"\"future\": {}", "\"atoms\": 9", "atoms"},
        {"\"future\": {}", "\"atoms\": -1", "atoms"},
        {"\"future\": {}", "\"atoms\": 2.5", "atoms"},
        {"\"future\": {}", "\"atoms\": null", "atoms"},
        {"\"future\": {}", "\"maps\": \"both\"", "maps"},
        {"\"future\": {}", "\"maps\": true", "maps"},
        {"\"future\": {}", "\"maps\": \"\"", "maps"},
        {OTHER, TEXTURED ", " TEXTURED, "points"},
        {OTHER, OTHER ", " FEWER_OF_POINTS, "points"}, // which draw no textures
        {OTHER, MAPPED("on", "8") ", " MAPPED("on", "2"), "points"}, // maps in place of textures
        {"\"ms\": 80", "\"ms\": 0", "ms"},
        {"\"ms\": 80", "\"ms\": -80", "ms"},
        {"\"ms\": 80", "\"ms\": null", "ms"},
        {"\"ms\": 80, ", "", "ms"},
        {"\"ms\": 80", "\"ms\": 1e300", "ms"},
        {"\"ms_q90\": 90", "\"ms_q90\": 79", "ms_q90"},
        {"\"fixed_ms\": 10", "\"fixed_ms\": -1", "fixed_ms"},
        {"\"fixed_ms\": 10, \"ms_per_mpx\": 70", "\"fixed_ms\": 0, \"ms_per_mpx\": 0", "fixed_ms"},
        {"\"ms_per_mpx\": 70", "\"ms_per_mpx\": true", "ms_per_mpx"},
        {"\"psnr\": 33", "\"psnr\": 101", "psnr"},
        {"\"psnr\": 33", "\"psnr\": \"NaN\"", "psnr"},
        {"\"future\": {}", "\"psnr_sd\": -1", "psnr_sd"},
        {"\"future\": {}", "\"psnr_q05\": -101", "psnr_q05"},
        {"\"future\": {}", "\"ssim\": 1.5", "ssim"},
        {"\"future\": {}", "\"splats\": -1", "splats"},
        {"\"future\": {}", "\"depth_rmse\": -1", "depth_rmse"},
        {"\"future\": {}", "\"depth_beyond\": 2", "depth_beyond"},
        {"\"future\": {}", "\"holes\": 1.01", "holes"},
        {"\"future\": {}", "\"see_through\": -0.1", "see_through"},
        {"\"future\": {}", "\"halo\": 2", "halo"},
        {"\"future\": {}", "\"normal_mean\": 181", "normal_mean"},
        {"\"future\": {}", "\"soft_ms\": 81", "soft_ms"}, // more than the frame
        {"\"future\": {}", "\"soft_ms\": -1", "soft_ms"},
        {"\"future\": {}", "\"soft_model\": \"express\"", "soft_model"}, // of what?
        {"\"future\": {}", "\"soft_model\": 1", "soft_model"},
        {"\"more\": []", "\"soft\": []", "soft"},
        {"\"more\": []", SOFT("class:3-", "0.3"), "soft"},
        {"\"more\": []", SOFT("class:3-5", "1.5"), "soft"},
        {"\"more\": []", SOFT("class:3-5", "null"), "soft"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        refuse(cases[i].find, cases[i].replace, cases[i].field);
}

/* With maps, without, and where there are none: other settings, which are written as they are read. */
static void test_maps(void **state)
{
    (void)state;
    static const char plain[] = "{\"format\": \"splatd-profile\"";
    char text[4096];
    struct spl_profile profile;
    snprintf(text, sizeof text, "%.*s%s, %s, %s]}", (int)(strstr(GOOD, OTHER) - GOOD), GOOD, MAPPED("on", "8"),
             MAPPED("off", "8"), MAPPED("off", "2"));
    assert_int_equal(strncmp(text, plain, sizeof plain - 1), 0);
    assert_int_equal(spl_profile_parse(text, strlen(text), "file", &profile, NULL), 0);
    assert_true(profile.count == 4 && profile.points[0].setting.maps == SPL_SETTING_NO_MAPS);
    assert_true(profile.points[1].setting.maps == SPL_SETTING_MAPS_ON);
    assert_true(profile.points[3].setting.maps == SPL_SETTING_MAPS_OFF && profile.points[3].setting.atoms == 2);
    json_t *json = spl_profile_to_json(&profile);
    static const char *const names[] = {NULL, "on", "off", "off"};
    for (size_t i = 0; i < 4; i++) {
        const json_t *maps = json_object_get(json_array_get(json_object_get(json, "points"), i), "maps");
        assert_int_equal(!maps, !names[i]);
        if (maps)
            assert_string_equal(json_string_value(maps), names[i]);
    }
    json_decref(json);
    struct spl_view view;
    spl_view_init(&view);
    assert_int_equal(view.maps, SPL_MAPS_ON);
    spl_setting_apply(&profile.points[3].setting, &view);
    assert_true(view.maps == SPL_MAPS_OFF && view.disc.atoms == 2);
    spl_setting_apply(&profile.points[0].setting, &view); /* says nothing of them */
    assert_int_equal(view.maps, SPL_MAPS_OFF);
    spl_setting_apply(&profile.points[1].setting, &view);
    assert_int_equal(view.maps, SPL_MAPS_ON);
    spl_profile_finish(&profile);
}

/* Points with something soft are settings of their own, on a front of their own, and are written as they are read. */
static void test_soft(void **state)
{
    (void)state;
    char text[4096], folder[256], path[300];
    const char *more = strstr(GOOD, "\"more\": []"), *other = strstr(GOOD, OTHER);
    snprintf(text, sizeof text, "%.*s%s%.*s%s, %s]}", (int)(more - GOOD), GOOD, SOFT("class:3-5", "0.3"),
             (int)(other - more - strlen("\"more\": []")), more + strlen("\"more\": []"), SOFTENED("express"),
             SOFTENED("base"));
    struct spl_profile profile, again;
    assert_int_equal(spl_profile_parse(text, strlen(text), "file", &profile, NULL), 0);
    make_folder(folder);
    snprintf(path, sizeof path, "%s/x.profile.json", folder);
    assert_int_equal(spl_profile_save(path, &profile, NULL), 0);
    assert_int_equal(spl_profile_load(path, NULL, NULL, &again, NULL), 0);
    struct spl_profile *both[] = {&profile, &again};
    for (int i = 0; i < 2; i++) {
        const struct spl_profile_point *p = both[i]->points;
        assert_true(both[i]->count == 3 && both[i]->soft.what.count == 1 && both[i]->soft.blend == 0.5 &&
                    both[i]->soft.cover == 1); /* which the text does not say */
        assert_string_equal(both[i]->soft.what.terms[0].name, "class");
        assert_true(!p[0].setting.soft && isnan(p[0].soft_ms) && p[1].soft_ms == 20);
        assert_string_equal(spl_setting_soft_name(p[1].setting.soft), "express");
        assert_string_equal(spl_setting_soft_name(p[2].setting.soft), "base");
        assert_true(p[0].front && p[1].front && p[2].front); /* slower and less like its reference than the first */
    }
    struct spl_view view;
    spl_view_init(&view);
    spl_setting_apply_soft(&profile.points[2].setting, &profile.soft, &view);
    assert_true(view.soft.what.count == 1 && view.soft.model == SPL_SOFT_MODEL_BASE && view.soft.opacity == 0.3);
    spl_setting_apply_soft(&profile.points[0].setting, &profile.soft, &view);
    assert_int_equal(view.soft.what.count, 0);
    spl_profile_finish(&profile);
    spl_profile_finish(&again);
    unlink(path);
    rmdir(folder);
}

static void test_files_that_are_no_profiles(void **state)
{
    (void)state;
    char folder[256], path[300];
    struct spl_profile profile;
    make_folder(folder);
    assert_int_equal(spl_profile_load(folder, NULL, NULL, &profile, NULL), SPL_E_INPUT); // a directory
    snprintf(path, sizeof path, "%s/large", folder);
    int fd = open(path, O_CREAT | O_WRONLY, 0600);
    assert_int_equal(ftruncate(fd, 2 << 20), 0);
    close(fd);
    assert_int_equal(spl_profile_load(path, NULL, NULL, &profile, NULL), SPL_E_INPUT);
    assert_int_equal(truncate(path, 0), 0);
    assert_int_equal(spl_profile_load(path, NULL, NULL, &profile, NULL), SPL_E_INPUT);
    unlink(path);
    rmdir(folder);
}

static void test_where_a_profile_lies(void **state)
{
    (void)state;
    static const char *const cases[][2] = {{"a/hall.spld", "a/hall.profile.json"},
                                           {"hall", "hall.profile.json"},
                                           {".spld", ".spld.profile.json"},
                                           {"x.spld.spld", "x.spld.profile.json"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *path = spl_profile_path(cases[i][0], NULL);
        assert_string_equal(path, cases[i][1]);
        free(path);
    }
}

static void test_front(void **state)
{
    (void)state;
    const double cost[] = {1, 2, 2, 3, 3, 4, 5, NAN, 0.5, INFINITY};
    const double error[] = {9, 5, 5, 4, 6, 4, 1, 0, NAN, 0};
    static const bool wanted[] = {true, true, true, true, false, false, true, false, false, true};
    bool front[10];
    spl_front_mark(cost, error, 10, front);
    for (int i = 0; i < 10; i++)
        assert_int_equal(front[i], wanted[i]);
    spl_front_mark(NULL, NULL, 0, NULL);
}

static void test_time_fit(void **state)
{
    (void)state;
    double fixed, slope;
    spl_profile_fit_time((double[]){0.25, 1, 4}, (double[]){12.5, 20, 50}, 3, &fixed, &slope);
    assert_true(fabs(fixed - 10) < 1e-9);
    assert_true(fabs(slope - 10) < 1e-9);
    spl_profile_fit_time((double[]){2}, (double[]){40}, 1, &fixed, &slope);
    assert_true(fabs(fixed - 10) < 1e-9);
    assert_true(fabs(slope - 15) < 1e-9);
    spl_profile_fit_time((double[]){1, 4}, (double[]){10, 9}, 2, &fixed, &slope); // larger and faster: noise
    assert_true(slope == 0 && fixed > 9 && fixed < 10);
    spl_profile_fit_time((double[]){1, 4}, (double[]){10, 50}, 2, &fixed, &slope); // steeper than proportional
    assert_true(fixed == 0 && slope > 10 && slope < 12.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_what_cannot_be_loaded_is_not_saved),
        cmocka_unit_test(test_every_broken_field_is_named),
        cmocka_unit_test(test_maps),
        cmocka_unit_test(test_soft),
        cmocka_unit_test(test_files_that_are_no_profiles),
        cmocka_unit_test(test_where_a_profile_lies),
        cmocka_unit_test(test_front),
        cmocka_unit_test(test_time_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
