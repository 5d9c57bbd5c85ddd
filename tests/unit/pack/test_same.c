/* A dataset depends on what is in the scans alone: not on threads, on memory, on the order of files and of the points
 * in them, nor on how many files they lie in. */
#include <glob.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "clouds.h"
#include "dataset/format.h"
#include "pack/spill.h"
#include "support/folder.h"

enum { floor_points = 50000, wall_points = 30000, ball_points = 20000, wire_points = 4000, bush_points = 6000 };
enum { again = 4000, total = floor_points + wall_points + ball_points + wire_points + bush_points + again };

struct point {
    float x, y, z;
    uint8_t red, green, blue, classification;
    float amplitude;
    double time;
};

static struct point *points;

/* A hall's floor and wall, a ball, a wire, a bush; some places twice, with other colours. */
static void make_points(void)
{
    uint64_t random = 11;
    points = calloc(total, sizeof *points);
    assert_non_null(points);
    for (int i = 0; i < total - again; i++) {
        double u = uniform(&random), v = uniform(&random), w = uniform(&random), noise = 0.002 * (w - 0.5);
        int at = i;
        double x = 12 * u, y = 8 * v, z = noise;
        if ((at -= floor_points) >= 0)
            y = noise, z = 4 * v;
        if ((at -= wall_points) >= 0) {
            double flat = sqrt(1 - (2 * v - 1) * (2 * v - 1)), angle = 2 * M_PI * u, r = 0.7 + noise;
            x = 6 + r * flat * cos(angle), y = 4 + r * flat * sin(angle), z = 1.5 + r * (2 * v - 1);
        }
        if ((at -= ball_points) >= 0)
            x = 12 * u, y = 6 + noise, z = 3 + 0.01 * (x - 6) * (x - 6);
        if ((at -= wire_points) >= 0)
            x = 2 + u, y = 2 + v, z = 0.5 + w;
        points[i] = (struct point){(float)x, (float)y, (float)z, (uint8_t)(200 * u), (uint8_t)(i % 200), 90,
                                   (uint8_t)(i % 5), (float)(w * w), 1e8 + 0.001 * i};
    }
    for (int i = total - again; i < total; i++) {
        points[i] = points[17 * (i - (total - again))];
        points[i].red ^= (uint8_t)(i | 1);
        points[i].time += 1;
    }
}

/* Every `step`-th from `first` on, or backwards from it; `side` 0 both halves, else one by x. */
static void write_scan(const char *path, int first, int step, int side)
{
    static const char head[] =
        "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property uchar classification\nproperty float amplitude\nproperty double time\nend_header\n";
    FILE *f = fopen(path, "wb");
    int count = 0;
    assert_non_null(f);
    for (int i = first; i >= 0 && i < total; i += step)
        count += !side || (points[i].x < 5) == (side < 0);
    fprintf(f, head, count);
    for (int i = first; i >= 0 && i < total; i += step)
        if (!side || (points[i].x < 5) == (side < 0)) {
            const struct point *p = &points[i];
            fwrite(p, 16, 1, f);
            fwrite(&p->amplitude, 4, 1, f);
            fwrite(&p->time, 8, 1, f);
        }
    assert_int_equal(fclose(f), 0);
}

struct file {
    uint8_t *bytes;
    size_t length;
};

static struct file read_file(const char *path)
{
    struct file file = {0};
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    fseek(f, 0, SEEK_END);
    file.length = (size_t)ftell(f);
    rewind(f);
    file.bytes = malloc(file.length);
    assert_int_equal(fread(file.bytes, 1, file.length, f), file.length);
    fclose(f);
    return file;
}

static struct spl_pack_options get_options(const char *const *inputs, size_t count, unsigned threads)
{
    return (struct spl_pack_options){.size = sizeof(struct spl_pack_options),
                                     .inputs = inputs,
                                     .input_count = count,
                                     .threads = threads,
                                     .keep = "none,amplitude,time",
                                     .primitives = SPL_PRIMITIVES_ALL};
}

static struct file pack(struct spl_pack_options options)
{
    struct spl_error err = {0};
    struct spl_pack_report report = {0};
    options.output = in_folder("same.spld");
    if (spl_pack(&options, &report, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.duplicates, again);
    assert_true(report.panels > 0 && report.meshes > 0 && report.pieces > 0);
    return read_file(options.output);
}

static void assert_same(const char *what, struct file one, struct file other)
{
    if (one.length != other.length || memcmp(one.bytes, other.bytes, one.length))
        fail_msg("%s: another dataset", what);
}

static const struct spl_section *find_section(struct file file, uint32_t type, uint32_t index, uint32_t *count)
{
    const struct spl_file_header *header = (const void *)file.bytes;
    const struct spl_section *table = (const void *)(file.bytes + header->table_offset);
    *count = header->section_count;
    for (uint32_t s = 0; s < header->section_count; s++)
        if (table[s].type == type && table[s].index == index)
            return &table[s];
    return NULL;
}

/* The sections of `one` but META, which names the files, are those of `other`. */
static void assert_same_content(const char *what, struct file one, struct file other)
{
    uint32_t count, others;
    const struct spl_section *all = find_section(one, SPL_SECTION_META, 0, &count);
    assert_non_null(all);
    all = (const void *)(one.bytes + ((const struct spl_file_header *)one.bytes)->table_offset);
    for (uint32_t s = 0; s < count; s++) {
        const struct spl_section *same = find_section(other, all[s].type, all[s].index, &others);
        assert_non_null(same);
        assert_int_equal(count, others);
        if (all[s].type != SPL_SECTION_META &&
            (same->bytes != all[s].bytes ||
             memcmp(one.bytes + all[s].offset, other.bytes + same->offset, same->bytes)))
            fail_msg("%s: section %.4s %u differs", what, (const char *)&all[s].type, all[s].index);
    }
}

static struct file whole;
static char scan[300];

static int setup(void **state)
{
    int rc = folder_make(state);
    const char *path = scan;
    snprintf(scan, sizeof scan, "%s", in_folder("scan.ply"));
    make_points();
    write_scan(scan, 0, 1, 0);
    whole = pack(get_options(&path, 1, 1));
    return rc;
}

static int teardown(void **state)
{
    free(whole.bytes);
    free(points);
    return folder_remove(state);
}

static void of_any_number_of_threads(void **state)
{
    const char *path = scan;
    (void)state;
    struct file other = pack(get_options(&path, 1, 3));
    assert_same("threads", whole, other);
    free(other.bytes);
}

/* Within which arrays fit, and where all of them lie in files. */
static void of_any_memory(void **state)
{
    const char *path = scan;
    static const struct {
        uint64_t memory;
        size_t forced;
        unsigned threads;
    } rows[] = {{1 << 30, 0, 2}, {SPL_PACK_MEMORY_MIN, 4096, 1}, {1 << 30, 65536, 2}};
    (void)state;
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        struct spl_pack_options options = get_options(&path, 1, rows[row].threads);
        options.memory_bytes = rows[row].memory;
        spl_spill_force(rows[row].forced);
        struct file other = pack(options);
        spl_spill_force(0);
        assert_same("memory", whole, other);
        free(other.bytes);
    }
}

static void of_any_memory_without_surfaces(void **state)
{
    const char *path = scan;
    struct spl_error err = {0};
    struct file file[2];
    (void)state;
    for (int forced = 0; forced < 2; forced++) {
        struct spl_pack_options options = get_options(&path, 1, 2);
        options.primitives = SPL_PRIMITIVES_OFF;
        options.points_only = true;
        options.memory_bytes = forced ? SPL_PACK_MEMORY_MIN : 0;
        options.output = in_folder("same.spld");
        spl_spill_force(forced ? 4096 : 0);
        if (spl_pack(&options, NULL, &err))
            fail_msg("%s", err.message);
        file[forced] = read_file(options.output);
    }
    spl_spill_force(0);
    assert_same("memory, points only", file[0], file[1]);
    free(file[0].bytes);
    free(file[1].bytes);
}

/* Wherever a pack is: the error names the folder and what to do, and nothing is left there. */
static void a_full_disk_is_told_in_every_stage(void **state)
{
    char few[300], left[300];
    const char *path = few;
    struct spl_pack_options options = get_options(&path, 1, 2);
    glob_t found;
    long n = 0;
    int rc = SPL_E_IO;
    (void)state;
    snprintf(few, sizeof few, "%s", in_folder("few.ply"));
    snprintf(left, sizeof left, "%s", in_folder("{,.}none*"));
    write_scan(few, 0, 20, 0);
    options.output = in_folder("none.spld");
    options.memory_bytes = SPL_PACK_MEMORY_MIN;
    spl_spill_force(1024);
    while (rc) {
        struct spl_error err = {0};
        spl_spill_fail_after(++n);
        rc = spl_pack(&options, NULL, &err);
        if (rc && (rc != SPL_E_IO || err.code != rc || strcmp(err.field, "memory") ||
                   !strstr(err.message, test_folder) || !strstr(err.message, "make room there")))
            fail_msg("array %ld: %d, %s: %s", n, rc, err.field, err.message);
        if (rc && glob(left, GLOB_BRACE, NULL, &found) != GLOB_NOMATCH)
            fail_msg("array %ld: %s is left", n, found.gl_pathv[0]);
    }
    spl_spill_fail_after(0);
    spl_spill_force(0);
    assert_true(n > 40);
    assert_int_equal(unlink(options.output), 0);
    assert_int_equal(unlink(few), 0);
}

static char warned[2000];

static void keep_warning(void *context, const char *text)
{
    (void)context;
    strncat(warned, text, sizeof warned - strlen(warned) - 1);
}

static void stop_reading(void *context, const struct spl_progress *progress)
{
    if (!strncmp(progress->stage, "reading", 7))
        spl_cancel_set(context);
}

/* How a pack of twice so many points ends that stops before it reads them: a hole. `cells`: in two rows of a grid, in
 * which some may be none. What it warns of is in `warned`. */
static int pack_hollow(uint64_t half, bool cells, uint64_t memory, const char *output, struct spl_error *err)
{
    static const char *const heads[] = {
        "ply\nformat binary_little_endian 1.0\nelement vertex %llu\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n",
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS %llu\nWIDTH %llu\nHEIGHT 2\n"
        "VIEWPOINT 0 0 0 1 0 0 0\nDATA binary\n"};
    char path[300], head[400];
    const char *input = path;
    struct spl_cancel cancel = {0};
    struct spl_pack_options options = get_options(&input, 1, 1);
    snprintf(path, sizeof path, "%s", in_folder(cells ? "hollow.pcd" : "hollow.ply"));
    int length = snprintf(head, sizeof head, heads[cells], (unsigned long long)(2 * half), (unsigned long long)half);
    folder_put_text(cells ? "hollow.pcd" : "hollow.ply", head);
    if (truncate(path, length + 24 * (off_t)half))
        skip(); /* no such large file here */
    options.keep = NULL;
    options.output = output;
    options.cancel = options.progress_context = &cancel;
    options.memory_bytes = memory;
    options.warn = keep_warning;
    options.progress = stop_reading;
    warned[0] = 0;
    int rc = spl_pack(&options, NULL, err);
    assert_int_equal(unlink(path), 0);
    return rc;
}

/* What is said of a pack beyond its memory. */
static void warn_of(const char *output)
{
    struct spl_error err = {0};
    assert_int_equal(pack_hollow(500000, false, SPL_PACK_MEMORY_MIN, output, &err), SPL_E_CANCELLED);
}

/* A million points: 88 bytes each less what is in memory, and 16 of the dataset. */
static void what_the_disk_needs_is_said(void **state)
{
    char *in_memory = spl_spill_find_memory_folder(in_folder("none.spld"));
    (void)state;
    warn_of(in_folder("none.spld"));
    if (!strstr(warned, "take up to 0.1 GB while") || !strstr(warned, "0.1 GB of it lie on disk") ||
        !strstr(warned, "which takes up to 0.0 GB itself"))
        fail_msg("%s", warned);
    assert_int_equal(!strstr(warned, "tmpfs"), !in_memory);
    free(in_memory);
}

static void a_disk_in_memory_is_said(void **state)
{
    char output[100], *folder = spl_spill_find_memory_folder("/dev/shm/none.spld");
    (void)state;
    if (!folder)
        skip(); /* none here */
    assert_string_equal(folder, "/dev/shm/");
    free(folder);
    snprintf(output, sizeof output, "/dev/shm/splatd-test-%ld.spld", (long)getpid());
    warn_of(output);
    if (!strstr(warned, "'/dev/shm/' lies in memory") || !strstr(warned, "-o"))
        fail_msg("%s", warned);
}

static void too_little_memory_is_refused(void **state)
{
    const char *path = scan;
    struct spl_error err = {0};
    struct spl_pack_options options = get_options(&path, 1, 1);
    (void)state;
    options.output = in_folder("none.spld");
    options.memory_bytes = SPL_PACK_MEMORY_MIN - 1;
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "memory");
}

/* Before they are read; but not cells of a grid of which some may have seen nothing. */
static void too_many_points_are_refused_at_once(void **state)
{
    char output[300];
    struct spl_error err = {0};
    (void)state;
    snprintf(output, sizeof output, "%s", in_folder("none.spld"));
    assert_int_equal(pack_hollow(UINT64_C(1) << 31, false, 0, output, &err), SPL_E_LIMIT);
    assert_non_null(strstr(err.message, "more than 4294967294 points"));
    err = (struct spl_error){0};
    assert_int_equal(pack_hollow(UINT64_C(1) << 31, true, 0, output, &err), SPL_E_CANCELLED);
}

/* Of the disk's room the same, unless half of the cells have none either. */
static void a_disk_that_has_no_room_is_refused_at_once(void **state)
{
    char output[300];
    struct statvfs status;
    struct spl_error err = {0};
    (void)state;
    snprintf(output, sizeof output, "%s", in_folder("none.spld"));
    assert_int_equal(statvfs(test_folder, &status), 0);
    double points_in_room = (double)status.f_bavail * (double)status.f_frsize / 116;
    if (points_in_room > 2e9)
        skip(); /* so many are no scan */
    uint64_t half = (uint64_t)(0.625 * points_in_room);
    assert_int_equal(pack_hollow(half, false, SPL_PACK_MEMORY_MIN, output, &err), SPL_E_IO);
    assert_non_null(strstr(err.message, "GB are free"));
    err = (struct spl_error){0};
    assert_int_equal(pack_hollow(half, true, SPL_PACK_MEMORY_MIN, output, &err), SPL_E_CANCELLED);
    assert_non_null(strstr(warned, "GB are free"));
    err = (struct spl_error){0};
    assert_int_equal(pack_hollow(2 * half, true, SPL_PACK_MEMORY_MIN, output, &err), SPL_E_IO);
}

/* A name is in META, so that the points that lie the other way round lie in a file of the same one. */
static void of_any_order_of_points(void **state)
{
    const char *path = scan;
    (void)state;
    write_scan(scan, total - 1, -1, 0);
    struct file other = pack(get_options(&path, 1, 2));
    write_scan(scan, 0, 1, 0);
    assert_same("order of points", whole, other);
    free(other.bytes);
}

static void of_tiles_in_any_order(void **state)
{
    char east[300], west[300];
    (void)state;
    snprintf(east, sizeof east, "%s", in_folder("b-tile.ply"));
    snprintf(west, sizeof west, "%s", in_folder("a-tile.ply"));
    write_scan(east, 0, 1, 1);
    write_scan(west, total - 1, -1, -1);
    struct file one = pack(get_options((const char *const[]){west, east}, 2, 2));
    struct file other = pack(get_options((const char *const[]){east, west}, 2, 2));
    assert_same("order of files", one, other);
    assert_same_content("tiles", whole, one);
    free(one.bytes);
    free(other.bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(of_any_number_of_threads),
                                       cmocka_unit_test(of_any_memory),
                                       cmocka_unit_test(of_any_memory_without_surfaces),
                                       cmocka_unit_test(a_full_disk_is_told_in_every_stage),
                                       cmocka_unit_test(what_the_disk_needs_is_said),
                                       cmocka_unit_test(a_disk_in_memory_is_said),
                                       cmocka_unit_test(too_little_memory_is_refused),
                                       cmocka_unit_test(too_many_points_are_refused_at_once),
                                       cmocka_unit_test(a_disk_that_has_no_room_is_refused_at_once),
                                       cmocka_unit_test(of_any_order_of_points),
                                       cmocka_unit_test(of_tiles_in_any_order)};
    return cmocka_run_group_tests_name("a dataset depends on its scans alone", tests, setup, teardown);
}
