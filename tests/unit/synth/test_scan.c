/* Scans on disk: complete, repeatable, true to the surfaces they sampled, and absent when something was wrong. */
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/memory.h"
#include "cloud/cloud.h"
#include "support/folder.h"
#include "support/sanitised.h"
#include "synth/light.h"
#include "synth/scene.h"
#include "synth/synth.h"
#include "geom/vector.h"


static char *read_all(const char *path, size_t *bytes)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    *bytes = (size_t)ftell(file);
    rewind(file);
    char *text = calloc(*bytes + 1, 1);
    assert_int_equal(fread(text, 1, *bytes, file), *bytes);
    fclose(file);
    return text;
}

static struct spl_synth_options options_for(const char *directory, uint64_t points)
{
    return (struct spl_synth_options){
        .scene = "courtyard", .directory = directory, .points = points, .seed = 1, .noise = -1, .threads = 2};
}

static uint64_t scan(struct spl_synth_options o)
{
    struct spl_error err = {0};
    uint64_t points = 0;
    if (spl_synth(&o, &points, &err))
        fail_msg("%s: %s", err.field, err.message);
    return points;
}

static bool same_files(const char *a, const char *b)
{
    size_t bytes[2];
    char *text[2] = {read_all(a, &bytes[0]), read_all(b, &bytes[1])};
    bool same = bytes[0] == bytes[1] && !memcmp(text[0], text[1], bytes[0]);
    free(text[0]);
    free(text[1]);
    return same;
}

static void files_depend_on_the_seed_and_not_on_threads(void **state)
{
    (void)state;
    const char *const names[] = {"one", "three", "again", "other"};
    for (int i = 0; i < 4; i++) {
        struct spl_synth_options o = options_for(in_folder(names[i]), TEST_SIZE(20000, 4000));
        o.threads = i == 1 ? 3 : 1;
        o.seed = i == 3 ? 2 : 1;
        scan(o);
        assert_int_equal(folder_count(o.directory), 2);
    }
    assert_true(same_files(in_folder("one/courtyard.ptx"), in_folder("three/courtyard.ptx")));
    assert_true(same_files(in_folder("one/courtyard.ply"), in_folder("three/courtyard.ply")));
    assert_true(same_files(in_folder("one/courtyard.ptx"), in_folder("again/courtyard.ptx")));
    assert_false(same_files(in_folder("one/courtyard.ptx"), in_folder("other/courtyard.ptx")));
    assert_false(same_files(in_folder("one/courtyard.ply"), in_folder("other/courtyard.ply")));
}

static void counts_come_within_two_percent(void **state)
{
    (void)state;
    const uint64_t wanted[] = {1000, 1234, 5000, 77777, 200001};
    for (size_t i = 0; i < TEST_SIZE(sizeof wanted / sizeof *wanted, 3); i++) {
        struct spl_synth_options o = options_for(in_folder("count"), wanted[i]);
        o.formats = "ply";
        uint64_t points = scan(o);
        assert_true(fabs((double)points - (double)wanted[i]) <= 0.02 * (double)wanted[i]);
        size_t bytes;
        unsigned long long stated = 0;
        char *ply = read_all(in_folder("count/courtyard.ply"), &bytes);
        char *body = strstr(ply, "end_header\n") + strlen("end_header\n");
        assert_int_equal(sscanf(strstr(ply, "element vertex"), "element vertex %llu", &stated), 1);
        assert_int_equal(stated, points);
        assert_int_equal(bytes - (size_t)(body - ply), points * 15);
        free(ply);
    }
    assert_int_equal(folder_count(in_folder("count")), 1); /* written over, and no PTX */
}

/* All scenes, all faults at once: what is lost is made up for by a finer grid. */
static void every_scene_comes_within_two_percent(void **state)
{
    (void)state;
    for (size_t i = 0; spl_synth_scene_name(i); i++)
        for (int faulty = 0; faulty < 2; faulty++) {
            struct spl_synth_options o = options_for(in_folder("every"), faulty ? 2000 : 4321);
            o.scene = spl_synth_scene_name(i);
            o.formats = "las";
            o.mixed = o.dropout = o.misregister = 0.1 * faulty;
            uint64_t points = scan(o);
            if (fabs((double)points - (double)o.points) > 0.02 * (double)o.points)
                fail_msg("%s: %llu points instead of %llu", o.scene, (unsigned long long)points,
                         (unsigned long long)o.points);
        }
}

static void faulty_scans_do_not_depend_on_threads(void **state)
{
    (void)state;
    static const char *const scenes[] = {"courtyard", "railway", "powerline"};
    const char *const names[] = {"faulty-one", "faulty-three", "faulty-other"};
    for (size_t s = 0; s < TEST_SIZE(3, 1); s++) {
        for (int i = 0; i < 3; i++) {
            struct spl_synth_options o = options_for(in_folder(names[i]), 2000);
            o.scene = scenes[s];
            o.formats = "ply,las";
            o.threads = i == 1 ? 3 : 1;
            o.seed = i == 2 ? 2 : 1;
            o.mixed = 0.5;
            o.dropout = 0.1;
            o.misregister = 0.02;
            scan(o);
        }
        for (int f = 0; f < 2; f++) {
            char paths[3][300];
            for (int i = 0; i < 3; i++)
                snprintf(paths[i], sizeof paths[i], "%s/%s/%s.%s", test_folder, names[i], scenes[s], f ? "ply" : "las");
            assert_true(same_files(paths[0], paths[1]));
            assert_false(same_files(paths[0], paths[2]));
        }
    }
}

/* Reads the PTX with its own poses and casts from each station through each point: how far the surface is from it. */
static void check_truth(const char *directory, uint64_t points, double sigma)
{
    struct spl_scene *scene;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    char path[160];
    size_t ply_bytes;
    snprintf(path, sizeof path, "%s/courtyard.ply", directory);
    char *ply = read_all(path, &ply_bytes), *at = strstr(ply, "end_header\n") + strlen("end_header\n");
    snprintf(path, sizeof path, "%s/courtyard.ptx", directory);
    FILE *ptx = fopen(path, "r");
    assert_non_null(ptx);
    uint64_t returns = 0, empty = 0, off_surface = 0;
    double off_color = 0;
    double squares = 0;
    for (size_t s = 0; s < scene->station_count; s++) {
        unsigned long columns, rows;
        double p[3], axes[9], m[16];
        assert_int_equal(fscanf(ptx, "%lu %lu", &columns, &rows), 2);
        for (int i = 0; i < 3; i++)
            assert_int_equal(fscanf(ptx, "%lf", &p[i]), 1);
        for (int i = 0; i < 9; i++)
            assert_int_equal(fscanf(ptx, "%lf", &axes[i]), 1);
        for (int i = 0; i < 16; i++)
            assert_int_equal(fscanf(ptx, "%lf", &m[i]), 1);
        for (int i = 0; i < 3; i++)
            assert_true(m[12 + i] == p[i] && m[4 * i] == axes[3 * i] && m[4 * i + 3] == 0);
        assert_true(m[15] == 1);
        for (unsigned long cell = 0; cell < columns * rows; cell++) {
            double x[3], intensity, world[3], d[3];
            int rgb[3];
            float stored[3];
            struct spl_hit h;
            assert_int_equal(
                fscanf(ptx, "%lf %lf %lf %lf %d %d %d", &x[0], &x[1], &x[2], &intensity, &rgb[0], &rgb[1], &rgb[2]), 7);
            assert_true(intensity >= 0 && intensity <= 1);
            if (x[0] == 0 && x[1] == 0 && x[2] == 0) {
                assert_true(intensity == 0.5 && !rgb[0] && !rgb[1] && !rgb[2]);
                empty++;
                continue;
            }
            returns++;
            for (int i = 0; i < 3; i++)
                world[i] = x[0] * m[i] + x[1] * m[4 + i] + x[2] * m[8 + i] + m[12 + i];
            memcpy(stored, at, sizeof stored);
            for (int i = 0; i < 3; i++) {
                assert_true(fabs((double)stored[i] - world[i]) < 2e-5);
                assert_int_equal((uint8_t)at[12 + i], rgb[i]);
            }
            at += 15;
            sub3(world, p, d);
            double range = normalise3(d), error = INFINITY;
            if (spl_scene_hit(scene, p, d, &h))
                error = h.t - range;
            /* A ray along an edge may pass on its other side after the rounding to 10 µm. */
            if (fabs(error) > 5 * sigma + 1e-4) {
                off_surface++;
                continue;
            }
            squares += error * error;
            for (int i = 0; i < 3; i++) /* a mean over a patch around: right on average (test_footprint.c) */
                off_color += light_of_level(rgb[i]) - light_of_level(h.color[i]);
        }
    }
    double trailing;
    assert_int_equal(fscanf(ptx, "%lf", &trailing), EOF);
    assert_ptr_equal(at, ply + ply_bytes);
    fclose(ptx);
    assert_int_equal(returns, points);
    assert_true(empty > returns / 4); /* the sky */
    assert_true(off_surface <= returns / 500);
    assert_true(fabs(off_color) <= 0.003 * 3 * (double)returns);
    double deviation = sqrt(squares / (double)returns);
    assert_true(deviation >= 0.97 * sigma && deviation <= 1.03 * sigma + 2e-5);
    free(ply);
    spl_scene_destroy(scene);
}

static void points_lie_on_the_surfaces(void **state)
{
    (void)state;
    struct spl_synth_options o = options_for(in_folder("exact/deeper"), TEST_SIZE(60000, 10000));
    o.noise = 0;
    check_truth(o.directory, scan(o), 0);
    o.noise = 0.01;
    check_truth(o.directory, scan(o), 0.01);
    o.noise = -1;
    check_truth(o.directory, scan(o), 0.0015);
}

/* All points of a file; the caller frees *batch with spl_point_batch_finish(). */
static void read_cloud(const char *path, uint64_t points, struct spl_point_batch *batch, struct spl_cloud **cloud)
{
    struct spl_error err = {0};
    if (spl_cloud_open(path, NULL, cloud, &err) || spl_point_batch_init(batch, points + 1, &err))
        fail_msg("%s", err.message);
    assert_int_equal(spl_cloud_read(*cloud, batch, &err), 1);
    assert_int_equal(batch->count, points);
    struct spl_point_batch rest;
    assert_int_equal(spl_point_batch_init(&rest, 16, &err), 0);
    assert_int_equal(spl_cloud_read(*cloud, &rest, &err), 0);
    spl_point_batch_finish(&rest);
}

static void our_readers_find_the_same_points_and_the_stations(void **state)
{
    (void)state;
    struct spl_synth_options o = options_for(in_folder("readers"), 10000);
    uint64_t points = scan(o);
    struct spl_point_batch ptx, ply;
    struct spl_cloud *ptx_cloud, *ply_cloud;
    struct spl_scene *scene;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    read_cloud(in_folder("readers/courtyard.ptx"), points, &ptx, &ptx_cloud);
    read_cloud(in_folder("readers/courtyard.ply"), points, &ply, &ply_cloud);
    const struct spl_cloud_info *info = spl_cloud_get_info(ptx_cloud);
    assert_int_equal(info->attributes & (SPL_CLOUD_COLOR | SPL_CLOUD_STATION), SPL_CLOUD_COLOR | SPL_CLOUD_STATION);
    assert_int_equal(info->station_count, scene->station_count);
    for (size_t s = 0; s < scene->station_count; s++)
        for (int i = 0; i < 3; i++) {
            assert_true(fabs(info->stations[s][4 * i + 3] - scene->stations[s].position[i]) < 1e-9);
            for (int j = 0; j < 3; j++)
                assert_true(fabs(info->stations[s][4 * i + j] - scene->stations[s].rotation[3 * i + j]) < 1e-12);
        }
    for (size_t i = 0; i < points; i++) {
        assert_memory_equal(ptx.color[i], ply.color[i], 3);
        for (int a = 0; a < 3; a++)
            assert_true(fabs(ptx.position[i][a] - ply.position[i][a]) < 2e-5);
        assert_true(ptx.station[i] < scene->station_count && (!i || ptx.station[i] >= ptx.station[i - 1]));
    }
    spl_scene_destroy(scene);
    spl_cloud_destroy(ptx_cloud);
    spl_cloud_destroy(ply_cloud);
    spl_point_batch_finish(&ptx);
    spl_point_batch_finish(&ply);
}

static double double_at(const char *bytes)
{
    double value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

/* In UTM coordinates, where floats have steps of half a metre: LAS within its half step of the doubles in the PLY, its
 * bounds and counts as the points are. */
static void las_and_ply_hold_far_coordinates(void **state)
{
    (void)state;
    struct spl_synth_options o = options_for(in_folder("far"), 8000);
    o.scene = "powerline";
    uint64_t points = scan(o);
    assert_int_equal(folder_count(o.directory), 2);
    struct spl_point_batch las, ply;
    struct spl_cloud *las_cloud, *ply_cloud;
    read_cloud(in_folder("far/powerline.las"), points, &las, &las_cloud);
    read_cloud(in_folder("far/powerline.ply"), points, &ply, &ply_cloud);
    assert_string_equal(spl_cloud_get_info(las_cloud)->format, "LAS");
    const struct spl_cloud_coordinates *own = &spl_cloud_get_info(las_cloud)->coordinates; /* the scene's, in metres */
    assert_true(own->unit_m == 1 && !own->epsg && !strcmp(own->name, "splatd synth"));
    double low[3], high[3];
    for (size_t i = 0; i < points; i++) {
        assert_memory_equal(las.color[i], ply.color[i], 3);
        for (int a = 0; a < 3; a++) {
            double p = las.position[i][a], steps = p / 0.0001;
            assert_true(fabs(p - ply.position[i][a]) <= 0.00005 + 2e-9);
            assert_true(fabs(steps - nearbyint(steps)) < 1e-4);
            low[a] = i ? fmin(low[a], p) : p;
            high[a] = i ? fmax(high[a], p) : p;
        }
    }
    assert_true(low[0] > 690700 && high[0] < 691300 && low[1] > 5335900 && high[1] < 5336100);
    size_t bytes;
    uint64_t by_return = 0;
    char *file = read_all(in_folder("far/powerline.las"), &bytes);
    uint32_t at;
    memcpy(&at, file + 96, sizeof at);
    assert_int_equal(bytes, at + 36 * points);
    for (int a = 0; a < 3; a++) {
        assert_true(double_at(file + 179 + 16 * a) == high[a]);
        assert_true(double_at(file + 187 + 16 * a) == low[a]);
    }
    for (int r = 0; r < 15; r++) {
        uint64_t count;
        memcpy(&count, file + 255 + 8 * r, sizeof count);
        assert_true(r < 2 ? count > 0 : r < 3 || !count);
        by_return += count;
    }
    assert_int_equal(by_return, points);
    for (size_t i = 0; i < points; i++) {
        const uint8_t *record = (const uint8_t *)file + at + 36 * i;
        int number = record[14] & 15, of = record[14] >> 4;
        assert_true(number >= 1 && number <= of && of <= 3);
        assert_in_range(record[20], 1, 2); /* flight lines */
    }
    free(file);
    spl_cloud_destroy(las_cloud);
    spl_cloud_destroy(ply_cloud);
    spl_point_batch_finish(&las);
    spl_point_batch_finish(&ply);
}

/* A misregistered PTX: the pose is off by what was asked, and with it the points, which are still where they were for
 * the scanner. */
static void poses_in_a_ptx_are_off_by_what_was_asked(void **state)
{
    (void)state;
    struct spl_synth_options o = options_for(in_folder("pose"), 5000);
    o.noise = 0;
    o.misregister = 0.04;
    uint64_t points = scan(o);
    struct spl_scene *scene;
    struct spl_point_batch batch;
    struct spl_cloud *cloud;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    read_cloud(in_folder("pose/courtyard.ptx"), points, &batch, &cloud);
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    size_t on_surface = 0;
    for (size_t i = 0; i < points; i++) {
        const double *station = scene->stations[batch.station[i]].position;
        double off[3], ray[3], place[3];
        for (int a = 0; a < 3; a++) {
            off[a] = info->stations[batch.station[i]][4 * a + 3] - station[a];
            place[a] = batch.position[i][a] - off[a];
        }
        assert_true(fabs(sqrt(dot3(off, off)) - 0.04) < 2e-6);
        sub3(place, station, ray);
        struct spl_hit h;
        on_surface += spl_scene_hit(scene, station, ray, &h) && fabs(h.t - 1) < 1e-4;
    }
    assert_true(on_surface > points * 99 / 100);
    spl_scene_destroy(scene);
    spl_cloud_destroy(cloud);
    spl_point_batch_finish(&batch);
}

/* Each point's is that of the object that lies there; without the option files are as they were. */
static void classes_are_written(void **state)
{
    (void)state;
    static const char *const scenes[] = {"courtyard", "powerline"};
    for (size_t s = 0; s < 2; s++) {
        struct spl_synth_options o = options_for(in_folder("classes"), 3000);
        o.scene = scenes[s];
        o.formats = "ply,las";
        o.classes = true;
        o.dropout = 0.123456789;
        o.misregister = 1e-9;
        o.seed = UINT64_MAX;
        const uint64_t points = scan(o);
        for (int las = 0; las < 2; las++) {
            char path[96];
            snprintf(path, sizeof path, "classes/%s.%s", scenes[s], las ? "las" : "ply");
            struct spl_point_batch batch;
            struct spl_cloud *cloud;
            size_t seen[256] = {0};
            read_cloud(in_folder(path), points, &batch, &cloud);
            for (size_t i = 0; i < points; i++)
                seen[batch.classification[i]]++;
            assert_int_equal(seen[0], 0);
            assert_true(seen[2] > points / 20 && seen[5] > points / 100 && (s || seen[6] > points / 5));
            spl_cloud_destroy(cloud);
            spl_point_batch_finish(&batch);
        }
        o.only = "class:5";
        o.formats = NULL;
        o.directory = in_folder("crown");
        scan(o);
        assert_int_equal(folder_count(o.directory), s ? 3 : 1); /* no PTX */
    }
}

static void refused(struct spl_synth_options o, int code, const char *field, const char *word)
{
    struct spl_error err = {0};
    uint64_t points = 7;
    assert_int_equal(spl_synth(&o, &points, &err), code);
    assert_string_equal(err.field, field);
    if (!strstr(err.message, word))
        fail_msg("'%s' does not say '%s'", err.message, word);
    assert_int_equal(points, 7);
    assert_int_equal(folder_count(o.directory ? o.directory : "/nonexistent"), 0);
}

static void bad_arguments_are_named_and_leave_nothing(void **state)
{
    (void)state;
    const struct spl_synth_options good = options_for(in_folder("refused"), 1000);
    char directory[128];
    snprintf(directory, sizeof directory, "%s", good.directory);
    struct spl_synth_options o = good;
    o.directory = directory;
#define REFUSED(member, value, code, field, word)                                                                      \
    do {                                                                                                               \
        struct spl_synth_options bad = o;                                                                              \
        bad.member = value;                                                                                            \
        refused(bad, code, field, word);                                                                               \
    } while (0)
    REFUSED(scene, "nowhere", SPL_E_USAGE, "scene", "courtyard");
    REFUSED(scene, "", SPL_E_USAGE, "scene", "courtyard");
    REFUSED(points, 0, SPL_E_USAGE, "points", "1000");
    REFUSED(points, 999, SPL_E_USAGE, "points", "999");
    REFUSED(points, 1000000000000, SPL_E_USAGE, "points", "10000000000");
    REFUSED(noise, NAN, SPL_E_USAGE, "noise", "0 to 1");
    REFUSED(noise, 1.01, SPL_E_USAGE, "noise", "1.01");
    REFUSED(noise, -INFINITY, SPL_E_USAGE, "noise", "inf");
    REFUSED(formats, "", SPL_E_USAGE, "format", "ptx, ply");
    REFUSED(formats, "ptx,", SPL_E_USAGE, "format", "ptx, ply");
    REFUSED(formats, "ply,laz", SPL_E_USAGE, "format", "'laz'");
    REFUSED(formats, "pl", SPL_E_USAGE, "format", "'pl'");
    REFUSED(mixed, 1.01, SPL_E_USAGE, "mixed", "1.01");
    REFUSED(mixed, NAN, SPL_E_USAGE, "mixed", "0 to 1");
    REFUSED(dropout, 0.95, SPL_E_USAGE, "dropout", "0 to 0.9");
    REFUSED(dropout, -0.1, SPL_E_USAGE, "dropout", "-0.1");
    REFUSED(misregister, 11, SPL_E_USAGE, "misregister", "11 m");
    REFUSED(misregister, NAN, SPL_E_USAGE, "misregister", "0 to 10");
    REFUSED(without, "unicorn", SPL_E_USAGE, "without", "leaves");
    REFUSED(only, "class:99", SPL_E_USAGE, "only", "class:99");
    o.classes = true;
    REFUSED(formats, "ply,ptx", SPL_E_USAGE, "format", "no room for classes");
    o.classes = false;
    REFUSED(directory, "", SPL_E_USAGE, "directory", "directory");
    REFUSED(directory, NULL, SPL_E_USAGE, "directory", "directory");
    REFUSED(directory, "/proc/no/where", SPL_E_IO, "", "/proc/no");
    REFUSED(directory, "/dev/null", SPL_E_USAGE, "", "/dev/null");
    REFUSED(directory, "/dev/null/below", SPL_E_USAGE, "", "/dev/null");
    o.scene = "railway";
    REFUSED(formats, "ptx", SPL_E_USAGE, "format", "railway is scanned on the move");
    o.scene = "density";
    REFUSED(formats, "ply,ptx", SPL_E_USAGE, "format", "ply, las");
#undef REFUSED
    assert_int_not_equal(access(directory, F_OK), 0);
}

static void a_full_disk_keeps_the_old_files(void **state)
{
    (void)state;
    char directory[128], before[2][160];
    snprintf(directory, sizeof directory, "%s", in_folder("full"));
    struct spl_synth_options o = options_for(directory, 2000);
    scan(o);
    for (int i = 0; i < 2; i++) {
        snprintf(before[i], sizeof before[i], "%s/%s", directory, i ? "before" : "courtyard.ply");
    }
    assert_int_equal(link(before[0], before[1]), 0);
    struct rlimit kept, small = {.rlim_cur = 100000};
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &kept), 0);
    small.rlim_max = kept.rlim_max;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    struct spl_error err = {0};
    o.points = 50000;
    int result = spl_synth(&o, NULL, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &kept), 0);
    assert_int_equal(result, SPL_E_IO);
    assert_non_null(strstr(err.message, "courtyard."));
    assert_int_equal(folder_count(directory), 3); /* both old files and the link, nothing partial */
    assert_true(same_files(before[0], before[1]));
}

static void refused_memory_leaves_nothing(void **state)
{
    (void)state;
    struct spl_synth_options o = options_for(in_folder("memory"), 1000);
    for (long n = 1;; n++) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int result = spl_synth(&o, NULL, &err);
        spl_memory_fail_after(0);
        if (!result)
            break;
        assert_int_equal(result, SPL_E_NOMEM);
        assert_int_equal(folder_count(o.directory), 0);
    }
    assert_int_equal(folder_count(o.directory), 2);
}

static void note_progress(void *context, const struct spl_progress *progress)
{
    struct spl_progress *last = context;
    assert_true(progress->done >= last->done);
    assert_true(progress->done <= progress->total);
    *last = *progress;
}

static void progress_ends_at_the_number_of_points(void **state)
{
    (void)state;
    struct spl_progress last = {0};
    struct spl_synth_options o = options_for(in_folder("progress"), 1000);
    o.progress = note_progress;
    o.progress_context = &last;
    uint64_t points = scan(o);
    assert_int_equal(last.done, points);
    assert_int_equal(last.total, points);
}

/* Runs `splatd synth ARGUMENTS`; the exit code, and what came on stdout and stderr together. */
static int run(const char *arguments, char *output, size_t bytes)
{
    char command[512];
    snprintf(command, sizeof command, "(%s synth %s) 2>&1", getenv("SPLATD_BINARY"), arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t got = fread(output, 1, bytes - 1, pipe);
    output[got] = 0;
    int status = pclose(pipe);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static void the_command_line_names_what_is_wrong(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *says;
    } bad[] = {
        {"", "one SCENE"},
        {"courtyard courtyard -o x", "one SCENE"},
        {"courtyard", "-o DIR"},
        {"nowhere -o x", "courtyard"},
        {"courtyard -o x --points 5.5", "--points"},
        {"courtyard -o x --points 5k", "--points"},
        {"courtyard -o x --points -5", "--points"},
        {"courtyard -o x --points 1e12", "points"},
        {"courtyard -o x --seed 1.5", "--seed"},
        {"courtyard -o x --noise nan", "--noise"},
        {"courtyard -o x --noise -1", "--noise"},
        {"courtyard -o x --mixed 2", "--mixed"},
        {"courtyard -o x --dropout 1", "--dropout"},
        {"courtyard -o x --misregister -1", "--misregister"},
        {"courtyard --print-views --size 0x5", "--size"},
        {"nowhere --print-views", "courtyard"},
        {"courtyard -o x --threads 0", "--threads"},
        {"courtyard -o x --format e57", "e57"},
        {"courtyard --output", "--help"},
    };
    char output[16384], arguments[256], expected[256];
    if (!getenv("SPLATD_BINARY"))
        skip();
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        int code = run(bad[i].arguments, output, sizeof output);
        if (code != 2 || !strstr(output, bad[i].says))
            fail_msg("'%s' exits with %d and says: %s", bad[i].arguments, code, output);
    }
    assert_int_equal(run("--list", output, sizeof output), 0);
    assert_non_null(strstr(output, "courtyard "));
    assert_int_equal(run("--help", output, sizeof output), 0);
    assert_non_null(strstr(output, "splatd synth courtyard"));
    snprintf(arguments, sizeof arguments, "courtyard -n 1e3 --format ply -o %s 2>/dev/null", in_folder("command"));
    snprintf(expected, sizeof expected, "%s\n", in_folder("command/courtyard.ply"));
    assert_int_equal(run(arguments, output, sizeof output), 0);
    assert_string_equal(output, expected);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(files_depend_on_the_seed_and_not_on_threads),
        cmocka_unit_test(counts_come_within_two_percent),
        cmocka_unit_test(every_scene_comes_within_two_percent),
        cmocka_unit_test(faulty_scans_do_not_depend_on_threads),
        cmocka_unit_test(las_and_ply_hold_far_coordinates),
        cmocka_unit_test(poses_in_a_ptx_are_off_by_what_was_asked),
        cmocka_unit_test(points_lie_on_the_surfaces),
        cmocka_unit_test(our_readers_find_the_same_points_and_the_stations),
        cmocka_unit_test(classes_are_written),
        cmocka_unit_test(bad_arguments_are_named_and_leave_nothing),
        cmocka_unit_test(a_full_disk_keeps_the_old_files),
        cmocka_unit_test(refused_memory_leaves_nothing),
        cmocka_unit_test(progress_ends_at_the_number_of_points),
        cmocka_unit_test(the_command_line_names_what_is_wrong),
    };
    only_threads_under_tsan();
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
