/* Numbers that no sound file has, wherever a reader takes one: no number at all, the least and largest that integers
 * hold, sizes beyond any memory. Each is refused with the file, the field and the value; or the point that has it is
 * counted as none, and nothing of the others changes. */
#include "las_bytes.h"

#include <math.h>
#include <sys/stat.h>

#include "cloud/path.h"
#include "cloud/views.h"
#include "support/folder.h"

#define LEAST "-9223372036854775808"
#define MOST "9223372036854775807"
#define PAST "18446744073709551616" /* of 64 bits */
#define HALF "4611686018427387905"  /* 2^62 + 1: times four it is four */

static int remove_both(void **state)
{
    remove_scratch(NULL);
    return folder_remove(state);
}

static const char *put_file(const char *name, const char *text)
{
    folder_put_text(name, text);
    return in_folder(name);
}

static void check_said(size_t row, const struct spl_error *err, const char *file, const char *field, const char *value)
{
    if (strcmp(err->field, field) || !strstr(err->message, file) || !strstr(err->message, value))
        fail_msg("%zu: wanted %s [%s] %s, got [%s] \"%s\"", row, file, field, value, err->field, err->message);
}

#define PLY(elements) "ply\nformat ascii 1.0\n" elements "end_header\n"
#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define STATION "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"

static void scans(void **state)
{
    static const struct {
        const char *text, *field, *value;
    } rows[] = {
        {PLY("element vertex " HALF "\n" XYZ) "1 2 3\n", "vertex", HALF},
        {PLY("element vertex " MOST "\n" XYZ) "1 2 3\n", "vertex", MOST},
        {PLY("element vertex 18446744073709551615\n" XYZ) "1 2 3\n", "vertex", "18446744073709551615"},
        {PLY("element vertex " PAST "\n" XYZ) "1 2 3\n", "element", PAST},
        {PLY("element vertex " LEAST "\n" XYZ) "1 2 3\n", "element", LEAST},
        {PLY("element vertex nan\n" XYZ) "1 2 3\n", "element", "nan"},
        {PLY("element face " HALF "\nproperty list uchar int i\nelement vertex 1\n" XYZ) "1 2 3\n", "face", HALF},
        {PLY("element vertex 1\n" XYZ "property list uchar int i\n") "1 2 3 nan\n", "i", "nan"},
        {PLY("element vertex 1\n" XYZ "property list uchar int i\n") "1 2 3 -1\n", "i", "-1"},
        {PLY("element vertex 1\n" XYZ "property list uchar int i\n") "1 2 3 1.5 1 1\n", "i", "1.5"},
        {PLY("element vertex 1\n" XYZ "property list uchar int i\n") "1 2 3 " LEAST "\n", "i", LEAST},
        {HALF "\n1 2 3\n", "count", HALF},
        {"18446744073709551615\n1 2 3\n", "count", "18446744073709551615"},
        {"1 2 3\nnought 2 3\n", "x", "nought"},
        {"4294967296\n4294967296\n" STATION, "columns", "4.29497e+09"},
        {HALF "\n4\n" STATION "1 2 3\n", "columns", "4.61169e+18"},
        {"4294967295\n4294967295\n" STATION "1 2 3\n", "columns, rows", "4294967295 x 4294967295"},
        {"1\n1\n0 0 nan\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3\n", "scanner position", "nan"},
        {"1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 nan 0 0\n0 0 1 0\n0 0 0 1\n1 2 3\n", "matrix", "nan"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct loaded l;
        write_scratch(rows[i].text, strlen(rows[i].text));
        load_path(scratch_path(), NULL, 7, &l);
        if (l.code != SPL_E_INPUT)
            fail_msg("%zu: %d and %llu points", i, l.code, (unsigned long long)l.points);
        check_said(i, &l.err, scratch_path(), rows[i].field, rows[i].value);
        loaded_finish(&l);
    }
}

static void las_headers(void **state)
{
    static const struct {
        unsigned at, bytes;
        uint64_t value;
        const char *field, *said;
    } rows[] = {
        {247, 8, UINT64_MAX, "number of point records", "18446744073709551615"},
        {247, 8, UINT64_C(1) << 62, "number of point records", "4611686018427387904"},
        {247, 8, UINT64_C(1) << 63, "number of point records", "9223372036854775808"},
        {96, 4, UINT32_MAX, "offset to point data", "4294967295"},
        {94, 2, UINT16_MAX, "header size", "65535"},
        {105, 2, 0, "point data record length", "0 bytes"},
        {131, 8, UINT64_C(0x7ff8000000000000), "x scale", "nan"},
        {171, 8, UINT64_C(0xfff0000000000000), "z offset", "-inf"},
        {155, 8, UINT64_C(0x7ff0000000000000), "x offset", "inf"},
    };
    static struct bytes b;
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct loaded l;
        const struct las las = las_default(4, 6, 0, 3);
        las_build(&b, &las);
        las_set(&b, rows[i].at, rows[i].value, rows[i].bytes);
        load_bytes(&b, NULL, 2, &l);
        assert_int_equal(l.code, SPL_E_INPUT);
        check_said(i, &l.err, scratch_path(), rows[i].field, rows[i].said);
        loaded_finish(&l);
    }
}

/* A line without coordinates is a point that was not hit: it says nothing of what the columns hold. */
static void lines_of_nans(void **state)
{
    static const char *const lines[] = {"nan nan nan nan nan nan\n", "nan nan nan 0 0 0\n", "1 2 inf -7 0.5 1e9\n",
                                        "1.#QNAN 0 0 nan 1 2\n"};
    (void)state;
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        for (int first = 0; first < 2; first++) {
            struct loaded l;
            char text[256];
            snprintf(text, sizeof text, "%s1 2 3 52 70 64\n%s4 5 6 255 0 1\n%s", first ? lines[i] : "", lines[i],
                     lines[i]);
            load_text(text, NULL, &l);
            assert_int_equal(l.points, 2);
            assert_int_equal(l.skipped, 2 + first);
            if (!(l.attributes & SPL_CLOUD_COLOR))
                fail_msg("%zu: no colours", i);
            assert_color(&l, 0, 52, 70, 64);
            loaded_finish(&l);
        }
}

#define POSE "1 0 0 0 1 2 3"
#define VIEW(camera) "{\"views\": [{\"name\": \"a\", " camera "}]}"
#define LOOK "\"camera\":{\"eye\":[3,-4,2],\"target\":[0,1,1.5],\"fov\":60}"
#define FRAME(w, more)                                                                                                 \
    "{\"fl_x\": 500, \"w\": " w ", \"h\": 480, \"frames\": [{\"file_path\": \"a.png\", " more                          \
    "\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"

static void lists_of_views(void **state)
{
    static const struct {
        const char *json, *cameras, *images; /* a document, or COLMAP's texts */
        const char *file, *field, *value;
    } rows[] = {
        {VIEW("\"width\": " LEAST ", " LOOK), NULL, NULL, "a.json", "width", "-9.22337e+18"},
        {VIEW("\"height\": " MOST ", " LOOK), NULL, NULL, "a.json", "height", "9.22337e+18"},
        {VIEW("\"width\": 1e308, " LOOK), NULL, NULL, "a.json", "width", "1e+308"},
        {FRAME(LEAST, ""), NULL, NULL, "a.json", "w", "-9.22337e+18"},
        {FRAME(HALF, ""), NULL, NULL, "a.json", "w", "4.61169e+18"},
        {NULL, "1 PINHOLE " LEAST " 480 500 510 3 2\n", "1 " POSE " 1 a.jpg\n\n", "cameras.txt", "WIDTH",
         "-9.22337e+18"},
        {NULL, "1 PINHOLE 640 " HALF " 500 510 3 2\n", "1 " POSE " 1 a.jpg\n\n", "cameras.txt", "HEIGHT",
         "4.61169e+18"},
        {NULL, "1 PINHOLE 640 480 500 1e999 3 2\n", "1 " POSE " 1 a.jpg\n\n", "cameras.txt", "PARAMS", "1e999"},
        {NULL, "1 PINHOLE nan 480 500 510 3 2\n", "1 " POSE " 1 a.jpg\n\n", "cameras.txt", "WIDTH", "nan"},
        {NULL, LEAST " PINHOLE 640 480 500 510 3 2\n", "1 " POSE " 1 a.jpg\n\n", "cameras.txt", "CAMERA_ID", LEAST},
        {NULL, PAST " PINHOLE 640 480 500 510 3 2\n", "1 " POSE " 1 a.jpg\n\n", "cameras.txt", "CAMERA_ID", PAST},
        {NULL, "1 PINHOLE 640 480 500 510 3 2\n", "1 " POSE " " PAST " a.jpg\n\n", "images.txt", "CAMERA_ID", PAST},
        {NULL, "1 PINHOLE 640 480 500 510 3 2\n", "1 1 0 0 nan 1 2 3 1 a.jpg\n\n", "images.txt", "QUATERNION", "nan"},
        {NULL, "1 PINHOLE 640 480 500 510 3 2\n", "1 1 0 0 0 1 1e999 3 1 a.jpg\n\n", "images.txt", "TRANSLATION",
         "1e999"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view_list list;
        struct spl_error err = {0};
        const char *path = rows[i].json ? put_file("a.json", rows[i].json) : test_folder;
        if (!rows[i].json) {
            put_file("cameras.txt", rows[i].cameras);
            put_file("images.txt", rows[i].images);
        }
        int rc = spl_view_list_load(&list, path, &err);
        if (rc != SPL_E_INPUT && rc != SPL_E_LIMIT)
            fail_msg("%zu: %d", i, rc);
        check_said(i, &err, rows[i].file, rows[i].field, rows[i].value);
    }
}

static void camera_paths(void **state)
{
    static const struct {
        const char *text, *field, *value;
    } rows[] = {
        {"nan 1 2 3 0 0 0 1\n", "timestamp", "nan"},
        {"1 1 2 3 0 0 0 1e999\n", "qw", "1e999"},
        {"1 1 2 -inf 0 0 0 1\n", "tz", "-inf"},
        {"{\"render_width\": " LEAST ", \"render_height\": 480, \"camera_path\": []}", "width", "-9.22337e+18"},
        {"{\"render_width\": 640, \"render_height\": " MOST ", \"camera_path\": []}", "height", "9.22337e+18"},
        {"{\"fps\": " LEAST ", \"keyframes\": []}", "fps", "-9.22337e+18"},
        {"{\"fps\": 1e308, \"keyframes\": []}", "fps", "1e+308"},
    };
    static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 16 << 20};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct spl_path_options options = {.limits = &limits};
        struct spl_camera_path path = {0};
        struct spl_error err = {0};
        assert_int_equal(spl_camera_path_load(put_file("p.json", rows[i].text), &options, &path, &err), SPL_E_INPUT);
        check_said(i, &err, "p.json", rows[i].field, rows[i].value);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scans),          cmocka_unit_test(las_headers),  cmocka_unit_test(lines_of_nans),
        cmocka_unit_test(lists_of_views), cmocka_unit_test(camera_paths),
    };
    return cmocka_run_group_tests(tests, folder_make, remove_both);
}
