/* A job from plan to collection: the same bytes in whatever order and on however many threads its parts are packed; all
 * points in it once, with the attributes that a pack of all has; and what vanished, changed, is torn, missing or of
 * another plan is named. */
#include <locale.h>
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
#include "clouds.h"
#include "dataset/dataset.h"
#include "pack/job/job.h"
#include "support/folder.h"
#include "support/sanitised.h"

enum { scans = 3, points = 12000, parts = 5 };

/* Pieces of ground along x that overlap here and there, two with intensities that are no whole numbers, one without. */
static void write_scan(int scan)
{
    char name[32];
    uint64_t random = (uint64_t)scan * 77 + 5;
    snprintf(name, sizeof name, "scan-%d.ply", scan);
    FILE *f = fopen(in_folder(name), "wb");
    assert_non_null(f);
    fprintf(f,
            "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\n%s%send_header\n",
            points, scan ? "property double intensity\n" : "", scan == 2 ? "property uchar classification\n" : "");
    for (int i = 0; i < points; i++) {
        double x = 500000 + 14 * scan + 20 * uniform(&random), y = 5400000 + 10 * uniform(&random);
        fprintf(f, "%.5f %.5f %.5f %d %d 90", x, y, 0.2 * sin(x) + 0.002 * uniform(&random), 60 * scan, i % 200);
        if (scan)
            fprintf(f, " %.2f", 100 * scan + i % 50 + 0.25);
        if (scan == 2)
            fprintf(f, " %d", 2 + i % 3);
        fputc('\n', f);
    }
    assert_int_equal(fclose(f), 0);
}

static int setup(void **state)
{
    if (folder_make(state))
        return -1;
    for (int i = 0; i < scans; i++)
        write_scan(i);
    return 0;
}

static char said[2000]; /* warnings, one behind the other */

static void hear(void *context, const char *text)
{
    (void)context;
    snprintf(said + strlen(said), sizeof said - strlen(said), "%s\n", text);
}

static int plan(const char *folder, const struct spl_pack_options *how, uint32_t count, bool *same,
                struct spl_error *err)
{
    static char paths[scans][700], output[700];
    const char *inputs[scans];
    struct spl_job job;
    for (int i = 0; i < scans; i++) {
        char name[32];
        snprintf(name, sizeof name, "scan-%d.ply", scans - 1 - i);
        snprintf(paths[i], sizeof paths[i], "%s", in_folder(name));
        inputs[i] = paths[i];
    }
    snprintf(output, sizeof output, "%s", in_folder(folder));
    struct spl_plan_options options = {.pack = *how, .parts = count, .halo = -1};
    options.pack.size = sizeof options.pack;
    options.pack.inputs = inputs;
    options.pack.input_count = scans;
    options.pack.output = output;
    options.pack.threads = options.pack.threads ? options.pack.threads : 2;
    int rc = spl_job_plan(&options, &job, same, err);
    if (!rc)
        spl_job_finish(&job);
    return rc;
}

static void plan_well(const char *folder, const struct spl_pack_options *how, uint32_t count)
{
    struct spl_error err = {0};
    bool same;
    if (plan(folder, how, count, &same, &err))
        fail_msg("%s", err.message);
}

static int pack(const char *folder, uint32_t part, unsigned threads, enum spl_part_outcome *outcome,
                struct spl_error *err)
{
    struct spl_pack_options options = {.size = sizeof options, .threads = threads, .warn = hear};
    struct spl_job job;
    int rc = spl_job_read(&job, in_folder(folder), err);
    if (rc)
        return rc;
    said[0] = '\0';
    rc = spl_job_pack(&job, part, &options, NULL, outcome, err);
    spl_job_finish(&job);
    return rc;
}

static void pack_well(const char *folder, uint32_t part, unsigned threads, enum spl_part_outcome wanted)
{
    struct spl_error err = {0};
    enum spl_part_outcome outcome;
    if (pack(folder, part, threads, &outcome, &err))
        fail_msg("part %u: %s", part, err.message);
    assert_int_equal(outcome, wanted);
}

static int join_as(const char *folder, const char *name, const struct spl_saved_view *view, struct spl_error *err)
{
    char output[800];
    struct spl_job job;
    int rc = spl_job_read(&job, in_folder(folder), err);
    if (rc)
        return rc;
    snprintf(output, sizeof output, "%s/%s", in_folder(folder), name);
    struct spl_collect_options options = {.size = sizeof options,
                                          .output = output,
                                          .threads = 2,
                                          .default_view = view,
                                          .views = view,
                                          .view_count = view != NULL};
    rc = spl_job_join(&job, &options, err);
    spl_job_finish(&job);
    return rc;
}

static int join(const char *folder, struct spl_error *err)
{
    return join_as(folder, "all.spld", NULL, err);
}

static void check_same(const char *folder, const char *other, const char *name)
{
    char paths[2][800];
    char *bytes[2];
    size_t length[2];
    for (int i = 0; i < 2; i++) {
        snprintf(paths[i], sizeof paths[i], "%s/%s", in_folder(i ? other : folder), name);
        FILE *file = fopen(paths[i], "rb");
        if (!file)
            fail_msg("%s", paths[i]);
        bytes[i] = malloc(8 << 20);
        length[i] = fread(bytes[i], 1, 8 << 20, file);
        assert_int_equal(fclose(file), 0);
    }
    assert_int_equal(length[0], length[1]);
    assert_memory_equal(bytes[0], bytes[1], length[0]);
    free(bytes[0]);
    free(bytes[1]);
}

static const char *part_name(uint32_t part, const char *ending)
{
    static char name[32];
    snprintf(name, sizeof name, "part-%u.%s", part, ending);
    return name;
}

static const char *in_job(const char *folder, const char *name)
{
    char path[100];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return in_folder(path);
}

static void test_order_threads_and_locale_change_nothing(void **state)
{
    (void)state;
    struct spl_error err = {0};
    bool same;
    plan_well("one", &(struct spl_pack_options){.title = "A street"}, parts);
    setlocale(LC_ALL, "de_DE.UTF-8"); /* where there is one */
    plan_well("other", &(struct spl_pack_options){.title = "A street", .threads = 1}, parts);
    check_same("one", "other", "job.json");
    for (uint32_t k = 0; k < parts; k++) {
        pack_well("one", k, 1, SPL_PART_MADE);
        pack_well("other", (k * 3 + 1) % parts, 4, SPL_PART_MADE);
    }
    setlocale(LC_ALL, "C");
    for (uint32_t k = 0; k < parts; k++)
        check_same("one", "other", part_name(k, "spld"));
    if (join("one", &err) || join("other", &err))
        fail_msg("%s", err.message);
    check_same("one", "other", "all.spld");
    /* what is there is left; the same plan again too */
    struct stat before, after;
    assert_int_equal(stat(in_job("one", "part-2.spld"), &before), 0);
    pack_well("one", 2, 2, SPL_PART_WAS_THERE);
    assert_int_equal(plan("one", &(struct spl_pack_options){.title = "A street"}, parts, &same, &err), 0);
    assert_true(same);
    pack_well("one", 2, 2, SPL_PART_WAS_THERE);
    assert_int_equal(stat(in_job("one", "part-2.spld"), &after), 0);
    assert_true(before.st_ino == after.st_ino);
    /* torn by a disk, or another's */
    assert_int_equal(truncate(in_job("one", "part-2.spld"), before.st_size / 2), 0);
    pack_well("one", 2, 2, SPL_PART_MADE);
    assert_non_null(strstr(said, "part-2.spld: it is broken, and packed anew"));
    check_same("one", "other", "part-2.spld");
}

/* All points once, with the attributes that a pack of all has, in its steps. */
static void test_the_collection_has_what_a_pack_of_all_has(void **state)
{
    (void)state;
    const char *inputs[scans];
    char paths[scans][700], output[700];
    struct spl_error err = {0};
    struct spl_dataset *all, *whole;
    for (int i = 0; i < scans; i++) {
        char name[32];
        snprintf(name, sizeof name, "scan-%d.ply", i);
        snprintf(paths[i], sizeof paths[i], "%s", in_folder(name));
        inputs[i] = paths[i];
    }
    snprintf(output, sizeof output, "%s", in_folder("whole.spld"));
    struct spl_pack_options options = {
        .size = sizeof options, .inputs = inputs, .input_count = scans, .output = output, .threads = 2};
    assert_int_equal(spl_pack(&options, NULL, NULL), 0);
    if (spl_dataset_open(in_job("one", "all.spld"), true, &all, &err) || spl_dataset_open(output, true, &whole, &err))
        fail_msg("%s", err.message);
    const struct spl_dataset_info *a = spl_dataset_get_info(all), *w = spl_dataset_get_info(whole);
    assert_int_equal(a->points, w->points);
    assert_int_equal(a->leaf_splats, w->leaf_splats);
    assert_memory_equal(a->bounds_min, w->bounds_min, sizeof a->bounds_min);
    assert_memory_equal(a->bounds_max, w->bounds_max, sizeof a->bounds_max);
    assert_int_equal(a->stream_count, w->stream_count);
    uint32_t count;
    const struct spl_stream *of_all = spl_dataset_get_streams(all, &count),
                            *of_whole = spl_dataset_get_streams(whole, &count);
    assert_int_equal(a->stream_count, 4); /* class, uncertainty, intensity, scan */
    for (uint32_t s = 0; s < a->stream_count; s++) {
        assert_string_equal(a->streams[s].name, w->streams[s].name);
        assert_string_equal(a->streams[s].type, w->streams[s].type);
        assert_true(of_all[s].first == of_whole[s].first && of_all[s].steps_a_unit == of_whole[s].steps_a_unit);
        assert_int_equal(a->stream_values[s].count, w->stream_values[s].count);
    }
    const json_t *meta = spl_dataset_get_meta(all);
    assert_string_equal(json_string_value(json_object_get(meta, "title")), "A street");
    assert_int_equal(json_array_size(json_object_get(meta, "tiles")), parts);
    spl_dataset_close(all);
    spl_dataset_close(whole);
}

static void refuse_part(const char *folder, uint32_t part, int rc, const char *field, const char *says)
{
    struct spl_error err = {0};
    enum spl_part_outcome outcome;
    assert_int_equal(pack(folder, part, 1, &outcome, &err), rc);
    if (!strstr(err.message, says) || strcmp(err.field, field) != 0)
        fail_msg("%s: %s", err.field, err.message);
}

static void refuse_join(const char *folder, int rc, const char *says)
{
    struct spl_error err = {0};
    assert_int_equal(join(folder, &err), rc);
    if (!strstr(err.message, says))
        fail_msg("%s", err.message);
}

/* A scan whose middle changes between two parts: its size and ends say nothing, the points that are missing do. */
static void test_a_join_knows_how_many_points_there_are(void **state)
{
    static const char before[] = "\n50003", after[] = "\n50001";
    char bytes[64 << 10];
    (void)state;
    plan_well("middle", &(struct spl_pack_options){0}, 2);
    pack_well("middle", 0, 1, SPL_PART_MADE);
    FILE *f = fopen(in_folder("scan-1.ply"), "r+b");
    assert_true(f && !fseek(f, 200 << 10, SEEK_SET));
    const size_t count = fread(bytes, 1, sizeof bytes - 1, f);
    bytes[count] = '\0';
    assert_non_null(strstr(bytes, before));
    for (char *at = bytes; (at = strstr(at, before)); at++)
        memcpy(at, after, sizeof after - 1);
    assert_int_equal(fseek(f, 200 << 10, SEEK_SET), 0);
    assert_true(fwrite(bytes, 1, count, f) == count && !fclose(f));
    pack_well("middle", 1, 1, SPL_PART_MADE);
    refuse_join("middle", SPL_E_INPUT, "points and the plan 36000: a scan has changed since");
    write_scan(1);
    unlink(in_job("middle", "part-1.spld"));
    pack_well("middle", 1, 1, SPL_PART_MADE);
    struct spl_error err = {0};
    if (join("middle", &err))
        fail_msg("%s", err.message);
}

static void test_inputs_that_vanish_or_change_are_named(void **state)
{
    (void)state;
    plan_well("changed", &(struct spl_pack_options){0}, 2);
    const char *scan = in_folder("scan-1.ply"), *away = in_folder("away");
    assert_int_equal(rename(scan, away), 0);
    refuse_part("changed", 0, SPL_E_IO, "path", "scan-1.ply: cannot be opened: No such file");
    refuse_part("changed", 0, SPL_E_IO, "path", "bring it back, or make the plan anew without it");
    assert_int_equal(rename(in_folder("away"), in_folder("scan-1.ply")), 0);
    FILE *file = fopen(in_folder("scan-1.ply"), "r+b");
    char last[2];
    assert_int_equal(fseek(file, -2, SEEK_END), 0);
    assert_int_equal(fread(last, 1, 2, file), 2);
    assert_int_equal(fseek(file, -2, SEEK_END), 0);
    fputc(last[0] == '7' ? '8' : '7', file);
    fclose(file);
    refuse_part("changed", 1, SPL_E_INPUT, "ends", "scan-1.ply: its first or last 64 KiB are others");
    file = fopen(in_folder("scan-1.ply"), "ab");
    fputc('\n', file);
    fclose(file);
    refuse_part("changed", 1, SPL_E_INPUT, "bytes", "when the plan was made: bring that file back");
    /* a part that does not read it is packed all the same */
    write_scan(1);
    plan_well("changed", &(struct spl_pack_options){0}, 8);
    assert_int_equal(rename(in_folder("scan-2.ply"), in_folder("away")), 0);
    pack_well("changed", 0, 2, SPL_PART_MADE);
    assert_int_equal(rename(in_folder("away"), in_folder("scan-2.ply")), 0);
    refuse_part("changed", 8, SPL_E_USAGE, "part", "has parts 0 to 7, and none of number 8");
}

static void test_joining_names_what_is_missing_or_foreign(void **state)
{
    (void)state;
    struct spl_error err = {0};
    bool same;
    plan_well("joined", &(struct spl_pack_options){0}, 8);
    refuse_join("joined", SPL_E_NOT_FOUND, "8 of 8 parts are missing: 0-7; make each with \"splatd pack --part K");
    pack_well("joined", 1, 2, SPL_PART_MADE);
    pack_well("joined", 3, 2, SPL_PART_MADE);
    pack_well("joined", 7, 2, SPL_PART_MADE);
    refuse_join("joined", SPL_E_NOT_FOUND, "5 of 8 parts are missing: 0, 2, 4-6;");
    /* another plan in the same folder: its parts are packed anew, and until then refused */
    assert_int_equal(plan("joined", &(struct spl_pack_options){.neighbours = 10}, 2, &same, &err), 0);
    assert_false(same);
    refuse_join("joined", SPL_E_INPUT, "part-1.spld: it is a part of another plan (");
    pack_well("joined", 1, 2, SPL_PART_MADE);
    assert_non_null(strstr(said, "part-1.spld: it is a part of an older plan, and packed anew"));
    refuse_join("joined", SPL_E_NOT_FOUND, "1 of 2 parts are missing: 0;");
    /* a part under another's name, and what is none */
    assert_int_equal(link(in_job("joined", "part-1.spld"), in_job("joined", "part-0.spld")), 0);
    refuse_part("joined", 0, SPL_E_INPUT, "part", "part-0.spld: it is part 1 of this job under another name");
    refuse_join("joined", SPL_E_INPUT, "part-0.spld: it is part 1 of this job under another name");
    unlink(in_job("joined", "part-0.spld"));
    assert_int_equal(link(in_folder("whole.spld"), in_job("joined", "part-0.spld")), 0);
    refuse_part("joined", 0, SPL_E_INPUT, "part", "part-0.spld: it is no part of a job, but a dataset of its own");
    refuse_join("joined", SPL_E_INPUT, "part-0.spld: it is no part of a job");
    unlink(in_job("joined", "part-0.spld"));
    pack_well("joined", 0, 2, SPL_PART_MADE);
    if (join("joined", &err))
        fail_msg("%s", err.message);
}

/* Two places and nothing between, in so many parts that some have nothing. */
static void test_parts_without_points_leave_a_mark(void **state)
{
    (void)state;
    enum { many = 6 };
    struct spl_error err = {0};
    struct spl_job job;
    bool same;
    unsigned empty = 0;
    folder_put_text("few.xyz", "0 0 0\n0 0 0\n5 0 0\n");
    const char *input = in_folder("few.xyz");
    char output[700];
    snprintf(output, sizeof output, "%s", in_folder("few"));
    struct spl_plan_options options = {
        .pack = {.size = sizeof options.pack, .inputs = &input, .input_count = 1, .output = output, .threads = 1},
        .parts = many,
        .halo = 0};
    if (spl_job_plan(&options, &job, &same, &err))
        fail_msg("%s", err.message);
    spl_job_finish(&job);
    for (uint32_t k = 0; k < many; k++) {
        enum spl_part_outcome outcome;
        if (pack("few", k, 1, &outcome, &err))
            fail_msg("part %u: %s", k, err.message);
        empty += outcome == SPL_PART_EMPTY;
        assert_int_equal(outcome == SPL_PART_EMPTY, !access(in_job("few", part_name(k, "empty")), F_OK));
        assert_int_equal(outcome == SPL_PART_MADE, !access(in_job("few", part_name(k, "spld")), F_OK));
        pack_well("few", k, 1, SPL_PART_WAS_THERE);
    }
    assert_int_equal(empty, many - 2);
    if (join("few", &err))
        fail_msg("%s", err.message);
    /* a part of an older plan beside the mark, whose process was killed before it had removed it */
    uint32_t marked = 0;
    while (access(in_job("few", part_name(marked, "empty")), F_OK))
        marked++;
    assert_int_equal(link(in_job("joined", "part-1.spld"), in_job("few", part_name(marked, "spld"))), 0);
    refuse_join("few", SPL_E_INPUT, "it is a part of another plan");
    pack_well("few", marked, 1, SPL_PART_WAS_THERE);
    if (join("few", &err))
        fail_msg("%s", err.message);
}

/* Ground round a scanner at (40 k, 2, 1.5); numbers in a file are the scanner's own. */
static void write_station(int k)
{
    char name[32];
    uint64_t random = (uint64_t)k + 3;
    snprintf(name, sizeof name, "station-%d.ptx", k);
    FILE *f = fopen(in_folder(name), "wb");
    assert_non_null(f);
    fprintf(f, "60\n60\n%d 2 1.5\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%d 2 1.5 1\n", 40 * k, 40 * k);
    for (int i = 0; i < 60 * 60; i++)
        fprintf(f, "%.4f %.4f -1.5 0.5 %d 90 9\n", 24 * uniform(&random) - 12, 8 * uniform(&random) - 4, i % 250);
    assert_int_equal(fclose(f), 0);
}

static void check_stations(const char *path, uint64_t least)
{
    struct spl_dataset *dataset;
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), 0);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_int_equal(info->station_count, scans);
    for (int k = 0; k < scans; k++)
        assert_true(info->stations[k][3] == 40 * k && info->stations[k][11] == 1.5);
    int stream = spl_dataset_find_stream(dataset, "scan");
    assert_true(stream >= 0);
    const struct spl_stream_values *values = spl_dataset_info_get_values(info, (uint32_t)stream);
    assert_true(values->kind_count >= 1 && values->kind_count <= scans);
    for (uint32_t i = 0; i < values->kind_count; i++) {
        assert_true(values->kinds[i].value < scans);
        assert_true(values->kinds[i].count >= least);
    }
    assert_true(least < 2 || values->kind_count == scans);
    spl_dataset_close(dataset);
}

/* By their numbers, though a part reads the scans of some alone; and the collection looks as a pack of all does. */
static void test_all_parts_know_all_stations(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_job job;
    bool same;
    char output[700], paths[scans][700];
    const char *inputs[scans];
    for (int k = 0; k < scans; k++) {
        char name[32];
        write_station(k);
        snprintf(name, sizeof name, "station-%d.ptx", k);
        snprintf(paths[k], sizeof paths[k], "%s", in_folder(name));
        inputs[k] = paths[k];
    }
    snprintf(output, sizeof output, "%s", in_folder("stations"));
    struct spl_plan_options options = {
        .pack = {.size = sizeof options.pack, .inputs = inputs, .input_count = scans, .output = output, .threads = 1},
        .parts = scans,
        .halo = 0.5};
    if (spl_job_plan(&options, &job, &same, &err))
        fail_msg("%s", err.message);
    assert_int_equal(job.rules.pose_count, scans);
    spl_job_finish(&job);
    for (uint32_t k = 0; k < scans; k++) {
        pack_well("stations", k, 1, SPL_PART_MADE);
        check_stations(in_job("stations", part_name(k, "spld")), 1);
    }
    if (join("stations", &err))
        fail_msg("%s", err.message);
    check_stations(in_job("stations", "all.spld"), 3000);

    /* views are the collection's, which has a name of its own */
    const struct spl_saved_view view = {.name = "door", .eye = {1, 2, 3}, .target = {9, 2, 1}};
    struct spl_dataset *dataset;
    if (join_as("stations", "seen.spld", &view, &err))
        fail_msg("%s", err.message);
    assert_int_equal(spl_dataset_open(in_job("stations", "seen.spld"), true, &dataset, NULL), 0);
    assert_int_equal(spl_dataset_get_info(dataset)->view_count, 1);
    assert_true(spl_dataset_get_info(dataset)->default_eye[1] == 2);
    spl_dataset_close(dataset);
    unlink(in_job("stations", "seen.spld"));
    assert_int_equal(join_as("stations", "job.json", NULL, &err), SPL_E_USAGE);
    assert_int_equal(join_as("stations", "seen", NULL, &err), SPL_E_USAGE);
    assert_int_equal(spl_job_read(&job, in_folder("stations"), NULL), 0);
    spl_job_finish(&job);

    /* pipes that nobody writes to are waited for nowhere */
    unlink(in_folder("station-0.ptx"));
    assert_int_equal(mkfifo(in_folder("station-0.ptx"), 0600), 0);
    unlink(in_job("stations", "part-0.spld"));
    refuse_part("stations", 0, SPL_E_INPUT, "path", "it is not a regular file");
    assert_int_equal(mkfifo(in_job("stations", part_name(0, "empty")), 0600), 0);
    refuse_join("stations", SPL_E_NOT_FOUND, "1 of 3 parts are missing: 0;");
    unlink(in_job("stations", part_name(0, "empty")));
    unlink(in_folder("station-0.ptx"));
    write_station(0);
    pack_well("stations", 0, 1, SPL_PART_MADE);

    /* of two plans, whatever names they have */
    struct spl_collect_options mixed = {.size = sizeof mixed, .threads = 1, .input_count = 2};
    const char *tiles[2];
    char tile[2][800];
    assert_int_equal(link(in_job("joined", "part-0.spld"), in_job("stations", "other.spld")), 0);
    snprintf(tile[0], sizeof tile[0], "%s", in_job("stations", "other.spld"));
    snprintf(tile[1], sizeof tile[1], "%s", in_job("stations", "part-0.spld"));
    for (int i = 0; i < 2; i++)
        tiles[i] = tile[i];
    mixed.inputs = tiles;
    mixed.output = in_job("stations", "mixed.spld");
    err = (struct spl_error){0};
    assert_int_equal(spl_collect(&mixed, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "inputs");
    unlink(tile[0]);
}

static void test_what_cannot_be_split_is_refused(void **state)
{
    (void)state;
    const struct spl_photo_options photos = {.cameras = "c"};
    const struct spl_map_options maps = {.panoramas = "p"}, found = {.find = true};
    const struct spl_saved_view view = {.name = "door", .target = {1, 1, 1}};
    const struct {
        struct spl_pack_options how;
        const char *says;
    } cases[] = {{{.photos = &photos}, "--cameras"},
                 {{.maps = &maps}, "--panoramas"},
                 {{.prune = 10}, "--prune"},
                 {{.max_points = 7}, "--max-points"},
                 {{.default_view = &view}, "--default-view"},
                 {{.views = &view, .view_count = 1}, "--view"},
                 {{.primitives = SPL_PRIMITIVES_ALL, .export_primitives = "a.dxf"}, "--export-primitives"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        bool same;
        assert_int_equal(plan("refused", &cases[i].how, 2, &same, &err), SPL_E_USAGE);
        bool of_join = cases[i].how.default_view || cases[i].how.view_count;
        if (!strstr(err.message, cases[i].says) ||
            !strstr(err.message, of_join ? "--join" : "pack without --plan and --parts, in"))
            fail_msg("%s", err.message);
    }
    struct spl_error err = {0};
    bool same;
    assert_int_equal(plan("refused", &(struct spl_pack_options){.keep = "amplitude"}, 2, &same, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "keep");
    assert_int_equal(plan("refused", &(struct spl_pack_options){0}, 10001, &same, NULL), SPL_E_USAGE);
    /* nor is a name that a dataset could not say, which is known at once */
    const char *unsayable = in_folder("bad\xff.ply");
    assert_int_equal(link(in_folder("scan-0.ply"), unsayable), 0);
    char whole[700];
    snprintf(whole, sizeof whole, "%s", in_folder("unsaid.spld"));
    const struct spl_pack_options bad_name = {
        .size = sizeof bad_name, .inputs = &unsayable, .input_count = 1, .output = whole};
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&bad_name, NULL, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "inputs");
    unlink(unsayable);
    err = (struct spl_error){0};
    const struct spl_pack_options unsaid = {.primitives = SPL_PRIMITIVES_ALL};
    assert_int_equal(plan("refused", &unsaid, 2, &same, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "error");
    /* a tenth of the whole, which no part is as long as */
    const struct spl_pack_options rough = {.primitives = SPL_PRIMITIVES_ALL, .error = 4};
    const struct spl_pack_options bold = {.primitives = SPL_PRIMITIVES_ALL, .error = 5};
    err = (struct spl_error){0};
    assert_int_equal(plan("refused", &bold, 8, &same, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "error");
    plan_well("rough", &rough, 8);
    pack_well("rough", 3, 2, SPL_PART_MADE);
    assert_int_equal(access(in_folder("refused"), F_OK), -1); /* nothing is left of what fails */
    /* nobody asked for those that lie beside a scan */
    assert_int_equal(mkdir(in_folder("panoramas"), 0777), 0);
    folder_put_text("panoramas/panoramas.json", "{}");
    said[0] = '\0';
    plan_well("found", &(struct spl_pack_options){.maps = &found, .warn = hear}, 2);
    assert_non_null(strstr(said, "panoramas: the panoramas that lie there are left"));
    said[0] = '\0';
    plan_well("found", &(struct spl_pack_options){.warn = hear}, 2);
    assert_null(strstr(said, "panoramas"));
}

static void test_nothing_is_left_of_what_fails(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_error err;
    bool same;
    enum spl_part_outcome outcome;
    plan_well("short", &(struct spl_pack_options){0}, 2);
    for (long n = 1;; n += n < 64 ? 1 : TEST_SIZE(7, 61)) {
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int rc = plan("hungry", &(struct spl_pack_options){.threads = 1}, 2, &same, &err);
        spl_memory_fail_after(0);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(access(in_folder("hungry"), F_OK), -1);
    }
    for (long n = 1;; n += n < 64 ? 1 : TEST_SIZE(7, 61)) {
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int rc = pack("short", 0, 1, &outcome, &err);
        spl_memory_fail_after(0);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(folder_count(in_folder("short")), 1);
    }
    assert_int_equal(folder_count(in_folder("short")), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order_threads_and_locale_change_nothing),
        cmocka_unit_test(test_the_collection_has_what_a_pack_of_all_has),
        cmocka_unit_test(test_inputs_that_vanish_or_change_are_named),
        cmocka_unit_test(test_joining_names_what_is_missing_or_foreign),
        cmocka_unit_test(test_parts_without_points_leave_a_mark),
        cmocka_unit_test(test_a_join_knows_how_many_points_there_are),
        cmocka_unit_test(test_all_parts_know_all_stations),
        cmocka_unit_test(test_what_cannot_be_split_is_refused),
        cmocka_unit_test(test_nothing_is_left_of_what_fails),
    };
    return cmocka_run_group_tests(tests, setup, folder_remove);
}
