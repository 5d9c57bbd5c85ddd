/* What arguments mean as files: folders, lists, files with several names; and scans that break, left out as if they had
 * not been named. */
#include <dirent.h>
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>

#include <splatd/pack.h>

#include "base/memory.h"
#include "dataset/dataset.h"
#include "pack/inputs.h"

static char folder[] = "/tmp/splatd-inputs-XXXXXX";
static char said[8192];

__attribute__((format(printf, 1, 2))) static char *path_of(const char *format, ...)
{
    static char paths[16][4400];
    static int next;
    char *path = paths[next++ % 16], name[4200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(name, sizeof name, format, arguments);
    va_end(arguments);
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static void write_bytes(const char *path, const char *bytes, size_t length)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, length, f), length);
    assert_int_equal(fclose(f), 0);
}

static void write_text(const char *path, const char *text)
{
    write_bytes(path, text, strlen(text));
}

static void listen(void *context, const char *text)
{
    (void)context;
    size_t used = strlen(said);
    snprintf(said + used, sizeof said - used, "%s\n", text);
}

static void listen_left_out(void *context, const struct spl_error *why)
{
    listen(context, why->message);
}

/* Every test begins in an empty folder. */
static int empty_folder(void **state)
{
    char command[128];
    (void)state;
    snprintf(command, sizeof command, "cd / && chmod -R u+rwx %s && rm -rf %s && mkdir %s", folder, folder, folder);
    said[0] = 0;
    return system(command);
}

static int find(struct spl_inputs *inputs, const char *given, bool skip, struct spl_error *err)
{
    const struct spl_inputs_listener listener = {listen, skip ? listen_left_out : NULL, NULL};
    return spl_inputs_find(inputs, &given, 1, &listener, err);
}

/* The names found, "a.ply b.ply", below the folder. */
static const char *names_of(const char *given)
{
    static char text[4096];
    struct spl_inputs inputs;
    struct spl_error err = {0};
    if (find(&inputs, given, false, &err))
        fail_msg("%s", err.message);
    text[0] = 0;
    for (size_t i = 0; i < inputs.count; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%s", i ? " " : "",
                 inputs.paths[i] + (strncmp(inputs.paths[i], folder, strlen(folder)) ? 0 : strlen(folder) + 1));
    spl_inputs_finish(&inputs);
    return text;
}

static void refuse(const char *given, int code, const char *why)
{
    struct spl_inputs inputs;
    struct spl_error err = {0};
    assert_int_equal(find(&inputs, given, false, &err), code);
    if (!strstr(err.message, why))
        fail_msg("'%s' is not in '%s'", why, err.message);
    assert_null(inputs.paths);
}

static void test_folders(void **state)
{
    static const char *const files[] = {"b.las",   "a.LAZ",         "B.ply",      "Z/c.ptx",     "Z/a/x.xyz",
                                        "a/y.pts", "scan.copc.laz", "readme.txt", "b.las.lax",   "tile.prj",
                                        ".b.las",  "noend",         "las",        "a.las/z.e57", "a.las/sum.csv"};
    (void)state;
    mkdir(path_of("Z"), 0700), mkdir(path_of("Z/a"), 0700), mkdir(path_of("a"), 0700), mkdir(path_of("a.las"), 0700);
    mkdir(path_of(".hidden"), 0700);
    write_text(path_of(".hidden/h.ply"), "x");
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        write_text(path_of("%s", files[i]), files[i]);
    assert_int_equal(mkfifo(path_of("pipe.las"), 0600), 0);
    assert_string_equal(names_of(folder), "B.ply Z/a/x.xyz Z/c.ptx a/y.pts a.LAZ a.las/z.e57 b.las scan.copc.laz");
    assert_non_null(strstr(said, ": 8 scans are taken, 9 other files left ("));
    assert_non_null(strstr(said, ".ply, .las, .laz, "));
    said[0] = 0;
    assert_string_equal(names_of(path_of("Z//")), "Z//a/x.xyz Z//c.ptx");
    assert_string_equal(said, "");
    /* named itself, everything is taken */
    assert_string_equal(names_of(path_of("readme.txt")), "readme.txt");
    assert_string_equal(names_of(path_of("pipe.las")), "pipe.las");
    assert_string_equal(names_of("none/such.ply"), "none/such.ply");
}

static void test_folders_without_a_scan(void **state)
{
    (void)state;
    refuse(folder, SPL_E_NOT_FOUND, "no scan lies in this folder or below (0 other files)");
    write_text(path_of("points.txt"), "1 2 3\n");
    mkdir(path_of("deep"), 0700);
    write_text(path_of("deep/points.csv"), "1 2 3\n");
    refuse(folder, SPL_E_NOT_FOUND, "(2 other files); those that end in .ply, ");
}

/* Links are followed; one file or folder is taken once, and it is said. */
static void test_links_and_files_with_several_names(void **state)
{
    (void)state;
    mkdir(path_of("in"), 0700), mkdir(path_of("in/far"), 0700), mkdir(path_of("out"), 0700);
    write_text(path_of("out/o.las"), "o");
    write_text(path_of("in/a.las"), "a");
    assert_int_equal(link(path_of("in/a.las"), path_of("in/hard.las")), 0);
    assert_int_equal(symlink("a.las", path_of("in/soft.las")), 0);
    assert_int_equal(symlink(".", path_of("in/loop")), 0);
    assert_int_equal(symlink("..", path_of("in/far/up")), 0);
    assert_int_equal(symlink("../out", path_of("in/out")), 0);
    assert_int_equal(symlink("gone.las", path_of("in/gone.las")), 0);
    assert_int_equal(symlink("self", path_of("in/self")), 0);
    assert_string_equal(names_of(path_of("in")), "in/a.las in/gone.las in/out/o.las");
    assert_non_null(strstr(said, "taken once, though named more than once: "));
    assert_non_null(strstr(said, "/in/far/up, "));
    assert_non_null(strstr(said, "/in/hard.las, "));
    assert_non_null(strstr(said, "/in/loop and 1 more"));
    const char *two[] = {path_of("out/o.las"), path_of("out"), path_of("in/../out/o.las")};
    struct spl_inputs inputs;
    assert_int_equal(spl_inputs_find(&inputs, two, 3, &(struct spl_inputs_listener){0}, NULL), SPL_OK);
    assert_int_equal(inputs.count, 1);
    spl_inputs_finish(&inputs);
}

/* Links that fan out would be followed 2^30 times. */
static void test_many_ways_into_a_folder(void **state)
{
    (void)state;
    for (int i = 0; i < 30; i++) {
        char next[16];
        mkdir(path_of("d%d", i), 0700);
        snprintf(next, sizeof next, "../d%d", i + 1);
        assert_int_equal(symlink(next, path_of("d%d/a", i)), 0);
        assert_int_equal(symlink(next, path_of("d%d/b", i)), 0);
    }
    mkdir(path_of("d30"), 0700);
    write_text(path_of("d30/x.ply"), "x");
    char wanted[128] = "d0/";
    for (int i = 0; i < 30; i++)
        strcat(wanted, "a/");
    assert_string_equal(names_of(path_of("d0")), strcat(wanted, "x.ply"));
}

static void test_large_and_deep_folders(void **state)
{
    struct spl_inputs inputs;
    (void)state;
    for (int i = 1499; i >= 0; i--)
        write_text(path_of("t%d.laz", i), "x");
    assert_int_equal(find(&inputs, folder, false, NULL), SPL_OK);
    assert_int_equal(inputs.count, 1500);
    for (size_t i = 1; i < inputs.count; i++)
        assert_true(strcmp(inputs.paths[i - 1], inputs.paths[i]) < 0);
    spl_inputs_finish(&inputs);
    empty_folder(NULL);
    char deep[512] = "d";
    for (int i = 0; i < 66; i++, strcat(deep, "/d"))
        mkdir(path_of("%s", deep), 0700);
    refuse(folder, SPL_E_LIMIT, "folders lie deeper than 64 in each other");
}

static void test_lists(void **state)
{
    (void)state;
    mkdir(path_of("lists"), 0700), mkdir(path_of("tiles"), 0700);
    write_text(path_of("tiles/1.las"), "1"), write_text(path_of("tiles/2.las"), "2");
    write_text(path_of("lists/a b.ply"), "x"), write_text(path_of("lists/#c.ply"), "x");
    write_text(path_of("lists/@d.ply"), "x");
    char text[1024];
    snprintf(text, sizeof text,
             "\xef\xbb\xbf# tiles of the north\r\n\r\n  a b.ply \t\r\n \t\n./#c.ply\n   # more\n../tiles\n%s\n./@d.ply",
             path_of("tiles/2.las"));
    write_text(path_of("lists/all.txt"), text);
    assert_string_equal(names_of(path_of("lists/all.txt")), "lists/all.txt"); /* no @, a scan */
    char at[300];
    snprintf(at, sizeof at, "@%s", path_of("lists/all.txt"));
    assert_string_equal(names_of(at),
                        "lists/a b.ply lists/./#c.ply lists/../tiles/1.las lists/../tiles/2.las lists/./@d.ply");
    assert_non_null(strstr(said, "more than once: "));
    /* relative to the list's folder where it has none */
    assert_int_equal(chdir(path_of("lists")), 0);
    assert_string_equal(names_of("./@d.ply"), "./@d.ply");
    write_text("short.txt", "a b.ply\n");
    assert_string_equal(names_of("@short.txt"), "a b.ply");
    assert_int_equal(chdir("/"), 0);
}

static void test_bad_lists(void **state)
{
    char at[300], *list = path_of("list");
    (void)state;
    snprintf(at, sizeof at, "@%s", list);
    write_text(path_of("a.ply"), "x");
    write_text(list, "a.ply\n# c\n\nb.ply\n");
    refuse(at, SPL_E_INPUT, "list: line 4: ");
    refuse(at, SPL_E_INPUT, "/b.ply: there is no such file");
    write_text(list, "a.ply\n@other\n");
    refuse(at, SPL_E_INPUT, "line 2: a list names no other list; write ./@NAME");
    write_bytes(list, "a.ply\nb\0c\n", 10);
    refuse(at, SPL_E_INPUT, "line 2: a byte 0 is in no path");
    write_text(list, "# nothing\n\n");
    refuse(at, SPL_E_INPUT, "list: this list names no scan");
    write_text(list, "");
    refuse(at, SPL_E_INPUT, "is empty");
    char *line = malloc(10 << 20);
    memset(line, 'a', 10 << 20);
    line[5000] = '\n';
    write_bytes(list, line, 5001);
    refuse(at, SPL_E_INPUT, "line 1: 5000 bytes are no path");
    memset(line, '\n', 6);
    line[5000] = 'a';
    write_bytes(list, line, 10 << 20);
    refuse(at, SPL_E_INPUT, "line 7: no line ending within 1048576 bytes");
    free(line);
    refuse("@", SPL_E_USAGE, "takes the name of a list");
    refuse("@none", SPL_E_NOT_FOUND, "a scan called @none is named ./@none");
    snprintf(at, sizeof at, "@%s", folder);
    refuse(at, SPL_E_INPUT, "is not a regular file");
    assert_int_equal(mkfifo(path_of("pipe"), 0600), 0);
    snprintf(at, sizeof at, "@%s", path_of("pipe"));
    refuse(at, SPL_E_INPUT, "is not a regular file");
}

static void test_no_permission(void **state)
{
    struct spl_inputs inputs;
    struct spl_error err = {0};
    (void)state;
    if (geteuid() == 0)
        skip();
    mkdir(path_of("closed"), 0);
    write_text(path_of("a.ply"), "x");
    assert_int_equal(find(&inputs, folder, false, &err), SPL_E_IO);
    assert_non_null(strstr(err.message, "/closed: this folder cannot be opened: Permission denied"));
    assert_int_equal(find(&inputs, folder, true, NULL), SPL_OK);
    assert_int_equal(inputs.count, 1);
    assert_non_null(strstr(said, "/closed: this folder cannot be opened"));
    spl_inputs_finish(&inputs);
}

static void test_what_is_missing_is_left_out(void **state)
{
    struct spl_inputs inputs;
    struct spl_error err = {0};
    char at[300];
    (void)state;
    snprintf(at, sizeof at, "@%s", path_of("list"));
    mkdir(path_of("none"), 0700);
    write_text(path_of("a.ply"), "x");
    write_text(path_of("list"), "b.ply\na.ply\nnone\n");
    assert_int_equal(find(&inputs, at, true, &err), SPL_OK);
    assert_int_equal(inputs.count, 1);
    assert_int_equal(inputs.left_out_count, 2);
    assert_string_equal(spl_input_name(inputs.left_out[0]), "b.ply");
    assert_string_equal(spl_input_name(inputs.left_out[1]), "none");
    assert_non_null(strstr(said, "list: line 1: "));
    spl_inputs_finish(&inputs);
    write_text(path_of("list"), "b.ply\nnone\n");
    assert_int_equal(find(&inputs, at, true, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "none of the inputs can be used; the first of 2: "));
    /* a list that is none is nobody's to leave out */
    err = (struct spl_error){0};
    write_text(path_of("list"), "@a\na.ply");
    assert_int_equal(find(&inputs, at, true, &err), SPL_E_INPUT);
}

static void test_refused_memory(void **state)
{
    struct spl_inputs inputs;
    char at[300];
    int failures = 0;
    (void)state;
    snprintf(at, sizeof at, "@%s", path_of("list"));
    mkdir(path_of("tiles"), 0700);
    for (int i = 0; i < 100; i++)
        write_text(path_of("tiles/%d.ply", i), "x");
    write_text(path_of("list"), "tiles\ngone.ply\ntiles/1.ply\n");
    for (long n = 1;; n++, failures++) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = find(&inputs, at, true, &err);
        spl_memory_fail_after(0);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_null(inputs.paths);
    }
    assert_true(failures > 4);
    assert_int_equal(inputs.count, 100);
    spl_inputs_finish(&inputs);
}

/* A 10 x 10 grid as ASCII PLY from (x, 0, 0) on; `tail` is the last point's line. */
static char *write_ply(const char *name, double x, const char *properties, const char *value, const char *tail)
{
    char *path = path_of("%s", name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f,
            "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n%s"
            "end_header\n",
            tail ? 101 : 100, properties);
    for (int i = 0; i < 100; i++) {
        fprintf(f, "%.17g %d 0 ", x + i % 10, i / 10);
        fprintf(f, value, i);
        fprintf(f, "\n");
    }
    if (tail)
        fprintf(f, "%s\n", tail);
    assert_int_equal(fclose(f), 0);
    return path;
}

static int pack(const char *const *paths, size_t count, bool skip, const char *output, struct spl_error *err)
{
    struct spl_pack_options options;
    spl_pack_options_init(&options);
    options.inputs = paths;
    options.input_count = count;
    options.output = output;
    options.warn = listen;
    options.left_out = skip ? listen_left_out : NULL;
    options.threads = 1;
    return spl_pack(&options, NULL, err);
}

/* Everything but META's "skipped" is the same in both datasets; returns that, which the caller releases. */
static json_t *compare(const char *with, const char *without)
{
    const char *paths[2] = {with, without};
    struct spl_dataset *sets[2];
    const void *bytes[2];
    json_t *meta[2];
    uint64_t count[2];
    size_t size[2];
    for (int i = 0; i < 2; i++) {
        assert_int_equal(spl_dataset_open(paths[i], true, &sets[i], NULL), SPL_OK);
        meta[i] = json_deep_copy(spl_dataset_get_meta(sets[i]));
        bytes[i] = spl_dataset_get_chunks(sets[i], &count[i]);
    }
    assert_int_equal(count[0], count[1]);
    assert_memory_equal(bytes[0], bytes[1], count[0] * sizeof(struct spl_chunk));
    assert_int_equal(spl_dataset_get_info(sets[0])->pages, spl_dataset_get_info(sets[1])->pages);
    for (uint32_t page = 0; page < spl_dataset_get_info(sets[0])->pages; page++) {
        for (int i = 0; i < 2; i++)
            bytes[i] = spl_dataset_get_page(sets[i], page, &size[i]);
        assert_int_equal(size[0], size[1]);
        assert_memory_equal(bytes[0], bytes[1], size[0]);
    }
    json_t *skipped = json_incref(json_object_get(meta[0], "skipped"));
    json_object_del(meta[0], "skipped");
    assert_true(json_equal(meta[0], meta[1]));
    for (int i = 0; i < 2; i++) {
        spl_dataset_close(sets[i]);
        json_decref(meta[i]);
    }
    return skipped;
}

static int files_like(const char *part)
{
    int count = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));)
        count += strstr(e->d_name, part) != NULL;
    closedir(d);
    return count;
}

/* One cannot be opened, one breaks when stations, normals, colours and classes of it are there already, one in its
 * first batch behind others. */
static void test_the_broken_are_as_never_named(void **state)
{
    static const char normals[] =
        "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty "
        "uchar green\nproperty uchar blue\nproperty uchar classification\n";
    struct spl_error err = {0};
    (void)state;
    write_text(path_of("bad.las"), "LASF, and no more");
    char *normal = write_ply("normal.ply", 0.5, normals, "0 0 1 200 100 %d 5", "1 2 what");
    FILE *f = fopen(path_of("ptx.ptx"), "wb");
    fprintf(f, "10\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    for (int i = 0; i < 9; i++)
        fprintf(f, "%d 1 1 0.5\n", i + 1);
    fprintf(f, "1e13 1 1 0.5\n");
    fclose(f);
    char *far = write_ply("far.ply", 20, "property uchar intensity\n", "%d", "1e13 0 0 1");
    const char *all[] = {path_of("bad.las"), normal, write_ply("a.ply", 0, "property uchar intensity\n", "%d", NULL),
                         path_of("ptx.ptx"), far,    write_ply("b.ply", 10, "property uchar intensity\n", "%d", NULL),
                         path_of("gone.ply")},
               *good[] = {all[2], all[5]};
    assert_int_equal(pack(all, 7, true, path_of("all.spld"), &err), SPL_OK);
    assert_non_null(strstr(said, "bad.las: offset 17: "));
    assert_non_null(strstr(said, "normal.ply: line 115: "));
    assert_non_null(strstr(said, "far.ply: point 100 has x = 1e+13"));
    assert_non_null(strstr(said, "ptx.ptx: "));
    assert_non_null(strstr(said, "gone.ply: there is no such file"));
    assert_int_equal(pack(good, 2, false, path_of("good.spld"), &err), SPL_OK);
    json_t *skipped = compare(path_of("all.spld"), path_of("good.spld"));
    json_t *wanted = json_pack("[s,s,s,s,s]", "bad.las", "gone.ply", "far.ply", "normal.ply", "ptx.ptx");
    assert_true(json_equal(skipped, wanted));
    json_decref(skipped);
    json_decref(wanted);
    /* without being asked to, nothing is left out, and nothing is left behind */
    assert_int_equal(pack(all + 4, 2, false, path_of("none.spld"), &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "far.ply: point 100 has x = 1e+13"));
    assert_int_equal(files_like("none.spld"), 0);
    for (size_t first = 3; first < 5; first++) {
        const char *broken[] = {all[0], all[first]};
        err = (struct spl_error){0};
        assert_int_equal(pack(broken, 2, true, path_of("none.spld"), &err), SPL_E_INPUT);
        assert_non_null(strstr(err.message, "none of the inputs can be used; the first of 2: "));
        assert_int_equal(files_like("none.spld"), 0);
    }
}

/* The range of grey is common to scans of like ranges: one that breaks has no share in it, whenever it breaks. */
static void test_the_broken_have_no_share_in_grey(void **state)
{
    const char *const intensity = "property ushort intensity\n";
    struct spl_error err = {0};
    (void)state;
    const char *all[] = {write_ply("a.ply", 0, intensity, "%d", NULL),
                         write_ply("wide.ply", 20, intensity, "5%02d", "1e13 0 0 1"),
                         write_ply("b.ply", 10, intensity, "%d", NULL)},
               *good[] = {all[0], all[2]};
    assert_int_equal(pack(all, 3, true, path_of("all.spld"), &err), SPL_OK);
    assert_int_equal(pack(good, 2, false, path_of("good.spld"), &err), SPL_OK);
    json_decref(compare(path_of("all.spld"), path_of("good.spld")));
}

/* META has room for some of many names, whatever they are: here each byte takes six in JSON. */
static void test_many_scans(void **state)
{
    enum { many = 2300 };
    struct spl_error err = {0};
    struct spl_dataset *dataset;
    char name[256];
    const char *path = folder;
    (void)state;
    memset(name, '\1', 240);
    for (int i = 0; i < many; i++) {
        snprintf(name + 240, sizeof name - 240, "%04d.xyz", i);
        char text[64];
        snprintf(text, sizeof text, "%d 0 %d\n%d 1 0\n", i, i % 7, i);
        write_text(path_of("%s", name), i < 1150 ? "broken" : text);
    }
    assert_int_equal(pack(&path, 1, true, path_of("all.spld"), &err), SPL_OK);
    assert_int_equal(spl_dataset_open(path_of("all.spld"), true, &dataset, &err), SPL_OK);
    const json_t *meta = spl_dataset_get_meta(dataset), *colors = json_object_get(meta, "color");
    assert_int_equal(json_array_size(json_object_get(meta, "sources")), 1001);
    assert_string_equal(json_string_value(json_array_get(json_object_get(meta, "sources"), 1000)), "and 150 more");
    assert_string_equal(json_string_value(json_array_get(json_object_get(meta, "skipped"), 1000)), "and 150 more");
    assert_int_equal(json_array_size(colors), 1001);
    assert_int_equal(json_integer_value(json_object_get(json_array_get(colors, 1000), "points")), 300);
    spl_dataset_close(dataset);
}

/* Runs `splatd pack ARGUMENTS` in the folder; returns the exit code, what was said in `output`. */
static int run(const char *arguments, char *output, size_t size)
{
    char command[1024];
    snprintf(command, sizeof command, "cd '%s' && '%s' pack %s 2>&1", folder, getenv("SPLATD_BINARY"), arguments);
    FILE *pipe = popen(command, "r");
    size_t used = fread(output, 1, size - 1, pipe);
    output[used] = 0;
    return WEXITSTATUS(pclose(pipe));
}

static void test_the_command(void **state)
{
    char output[16384];
    (void)state;
    mkdir(path_of("tiles"), 0700);
    write_ply("tiles/a.ply", 0, "", "", NULL), write_ply("tiles/b.las", 10, "", "", NULL);
    write_text(path_of("tiles/read.me"), "x");
    assert_int_equal(run("tiles -o all.spld", output, sizeof output), 0);
    assert_non_null(strstr(output, "tiles: 2 scans are taken, 1 other files left (read.me)"));
    assert_non_null(strstr(output, "warning: names end like another format than the file's: b.las holds PLY"));
    assert_non_null(strstr(output, "200 points in"));
    /* what was drawn of scans beside them is none; it may be drawn again */
    const char *draw = "tiles --primitives all --export-primitives tiles/drawn.ply -o all.spld";
    for (int again = 0; again < 2; again++) {
        assert_int_equal(run(draw, output, sizeof output), 0);
        assert_non_null(strstr(output, "200 points in"));
        assert_non_null(strstr(output, "\ntiles/drawn.ply: "));
        assert_non_null(strstr(output, " planes as "));
        assert_int_equal(!again, !strstr(output, "--export-primitives\" drew them: tiles/drawn.ply"));
    }
    assert_int_equal(run("tiles/drawn.ply -o none.spld", output, sizeof output), 2);
    assert_non_null(strstr(output, "tiles/drawn.ply: is a drawing that \"splatd pack --export-primitives\" wrote"));
    write_text(path_of("tiles/0\033[2J.ply"), "ply\nnonsense\n");
    assert_int_equal(run("tiles -o all.spld", output, sizeof output), 2);
    assert_non_null(strstr(output, "0?[2J.ply: line 2: ")); /* a message on its way to a terminal */
    static const char *const early[] = {"gone.ply", "tiles --unit furlong", "tiles --crs nosuch",
                                        "tiles/a.ply gone.ply"};
    for (size_t i = 0; i < sizeof early / sizeof *early; i++) { /* before any work */
        char command[100];
        snprintf(command, sizeof command, "%s -o none.spld", early[i]);
        assert_int_equal(run(command, output, sizeof output), 2);
        assert_null(strstr(output, "looking at"));
        assert_non_null(strstr(output, i == 1   ? "--unit takes"
                                       : i == 2 ? "--crs takes"
                                                : "gone.ply: there is no such"));
    }
    assert_int_equal(run("tiles gone.ply --skip-broken -o all.spld", output, sizeof output), 0);
    assert_non_null(strstr(output, "splatd: left out: "));
    const char *end = strstr(output, "2 scans were left out:\n");
    assert_non_null(end);
    assert_non_null(strstr(end, "  gone.ply: there is no such file\n"));
    assert_non_null(strstr(end, "0?[2J.ply: line 2: "));
    assert_null(strchr(output, '\033'));
    assert_int_equal(run("gone.ply none.ply --skip-broken -o none.spld", output, sizeof output), 2);
    assert_non_null(strstr(output, "none of the inputs can be used; the first of 2: gone.ply: there is no such file"));
    assert_null(strstr(output, "were left out:"));
    assert_int_equal(files_like("none.spld"), 0);
    /* over a scan of the folder, whatever it is called */
    assert_int_equal(rename(path_of("tiles/b.las"), path_of("b.spld")), 0);
    assert_int_equal(symlink("../b.spld", path_of("tiles/b.ply")), 0);
    assert_int_equal(run("tiles/a.ply tiles/b.ply -o b.spld", output, sizeof output), 2);
    assert_non_null(strstr(output, "b.spld is an input too"));
}

static int end(void **state)
{
    (void)state;
    char command[64];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

/* Columns that are named where no scan is a text are refused, by the scans' names; beside a text they are its. */
static void test_columns_without_a_text(void **state)
{
    (void)state;
    write_text(path_of("a.ply"), "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                                 "property float z\nproperty float heat\nend_header\n1 2 3 9\n4 5 6 8\n");
    write_text(path_of("b.pcd"), "FIELDS x y z\nWIDTH 2\nDATA ascii\n1 2 4\n4 5 7\n");
    write_text(path_of("c.csv"), "1;2;5;9\n4;5;8;8\n");
    const char *inputs[] = {path_of("a.ply"), path_of("b.pcd"), path_of("c.csv")};
    static const struct {
        size_t first, count;
        const char *said; /* NULL: packed */
    } cases[] = {{0, 1, "--columns names the columns of texts (XYZ, PTS, CSV and such); a.ply is PLY: leave it out"},
                 {1, 1, "b.pcd is PCD: leave it out"},
                 {0, 2, "a.ply, b.pcd are none: leave it out"},
                 {0, 3, NULL},
                 {2, 1, NULL}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_pack_options options = {.size = sizeof options,
                                           .inputs = inputs + cases[i].first,
                                           .input_count = cases[i].count,
                                           .output = path_of("out.spld"),
                                           .threads = 1,
                                           .columns = "x,y,z,class"};
        struct spl_error err = {0};
        int rc = spl_pack(&options, NULL, &err);
        if (rc != (cases[i].said ? SPL_E_USAGE : SPL_OK) ||
            (cases[i].said && (strcmp(err.field, "columns") || !strstr(err.message, cases[i].said))))
            fail_msg("%zu: %d: %s: %s", i, rc, err.field, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_folders, empty_folder),
        cmocka_unit_test_setup(test_folders_without_a_scan, empty_folder),
        cmocka_unit_test_setup(test_links_and_files_with_several_names, empty_folder),
        cmocka_unit_test_setup(test_many_ways_into_a_folder, empty_folder),
        cmocka_unit_test_setup(test_large_and_deep_folders, empty_folder),
        cmocka_unit_test_setup(test_lists, empty_folder),
        cmocka_unit_test_setup(test_bad_lists, empty_folder),
        cmocka_unit_test_setup(test_no_permission, empty_folder),
        cmocka_unit_test_setup(test_what_is_missing_is_left_out, empty_folder),
        cmocka_unit_test_setup(test_refused_memory, empty_folder),
        cmocka_unit_test_setup(test_the_broken_are_as_never_named, empty_folder),
        cmocka_unit_test_setup(test_the_broken_have_no_share_in_grey, empty_folder),
        cmocka_unit_test_setup(test_many_scans, empty_folder),
        cmocka_unit_test_setup(test_columns_without_a_text, empty_folder),
        cmocka_unit_test_setup(test_the_command, empty_folder),
    };
    if (!mkdtemp(folder))
        return 1;
    return cmocka_run_group_tests(tests, NULL, end);
}
