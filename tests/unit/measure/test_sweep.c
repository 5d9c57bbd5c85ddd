/* What 'splatd bench -o' is made of, without a device: chart, peers, state, references, tolerances, thumbnails. */
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

#include "dataset/dataset.h"
#include "image/load.h"
#include "measure/chart.h"
#include "measure/markup.h"
#include "measure/peers.h"
#include "measure/pictures.h"
#include "measure/reference.h"
#include "measure/report.h"
#include "measure/state.h"
#include "measure/tolerance.h"
#include "support/make_dataset.h"

static char folder[256];

static int make(void **state)
{
    (void)state;
    make_folder(folder);
    return 0;
}

static int clean(void **state)
{
    (void)state;
    char command[300];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return system(command);
}

static const char *write_text(const char *name, const char *text)
{
    static char path[300];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    assert_int_equal(fclose(file), 0);
    return path;
}

static size_t count_of(const char *text, const char *part)
{
    size_t count = 0;
    for (const char *at = text; (at = strstr(at, part)); at += strlen(part))
        count++;
    return count;
}

/* ----------------------------------------------------------------------------------------------------------- chart */

static void test_chart_has_every_point(void **state)
{
    (void)state;
    struct spl_chart_point points[200];
    for (int i = 0; i < 200; i++) {
        points[i] = (struct spl_chart_point){.ms = 1 + i % 7, .psnr = 30 + i % 3, .front = i == 3, .index = i};
        snprintf(points[i].label, sizeof points[i].label, "label %d", i);
    }
    points[10].psnr = INFINITY;               /* stands at the edge */
    points[11].psnr = NAN, points[12].ms = 0; /* cannot be drawn */
    struct spl_chart_curve curves[] = {{.name = "a", .points = points, .count = 150},
                                       {.name = "b", .color = 9, .dash = 9, .points = points + 150, .count = 50}};
    struct spl_chart chart = {.title = "t", .subtitle = "", .curves = curves, .curve_count = 2};
    char *svg, wanted[64];
    size_t length;
    assert_int_equal(spl_chart_write(&chart, &svg, &length, NULL), 0);
    assert_int_equal(strlen(svg), length);
    assert_int_equal(count_of(svg, "<circle"), 198);
    for (int i = 0; i < 200; i++) {
        snprintf(wanted, sizeof wanted, "data-index=\"%d\">", i);
        assert_int_equal(count_of(svg, wanted), i != 11 && i != 12);
    }
    assert_int_equal(count_of(svg, ">label 3<"), 1); /* of the front: set before any other */
    assert_null(strstr(svg, "nan"));
    assert_null(strstr(svg, "inf"));
    free(svg);
}

static void test_chart_without_points(void **state)
{
    (void)state;
    struct spl_chart chart = {.title = "nothing", .subtitle = ""};
    char *svg;
    size_t length;
    assert_int_equal(spl_chart_write(&chart, &svg, &length, NULL), 0);
    assert_non_null(strstr(svg, "</svg>"));
    free(svg);
}

static void test_chart_escapes(void **state)
{
    (void)state;
    struct spl_chart_point point = {.ms = 1, .psnr = 30, .index = -1, .label = "<l>", .detail = "\"&'"};
    struct spl_chart_curve curve = {.name = "</text><script>", .points = &point, .count = 1};
    struct spl_chart chart = {.title = "a<b&c\xff\x01", .subtitle = "\"", .curves = &curve, .curve_count = 1};
    char *svg;
    size_t length;
    assert_int_equal(spl_chart_write(&chart, &svg, &length, NULL), 0);
    assert_null(strstr(svg, "<script"));
    assert_null(strstr(svg, "<l>"));
    assert_non_null(strstr(svg, "a&lt;b&amp;c??"));
    assert_non_null(strstr(svg, "&quot;&amp;&#39;"));
    free(svg);
}

static void test_markup(void **state)
{
    (void)state;
    static const struct {
        const char *text, *wanted;
    } cases[] = {
        {"gr\xc3\xbc\xc3\x9f \xe2\x82\xac \xf0\x9f\x98\x80", "gr\xc3\xbc\xc3\x9f \xe2\x82\xac \xf0\x9f\x98\x80"},
        {"\xc0\x80", "??"},           /* overlong */
        {"\xed\xa0\x80", "???"},      /* a surrogate */
        {"\xe2\x82", "??"},           /* cut off */
        {"\xf5\x80\x80\x80", "????"}, /* beyond U+10FFFF */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *out;
        size_t length;
        FILE *file = open_memstream(&out, &length);
        spl_markup_text(file, cases[i].text);
        fclose(file);
        assert_string_equal(out, cases[i].wanted);
        free(out);
    }
    static const char *const base64[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"}; /* RFC 4648 */
    for (size_t i = 0; i < 7; i++) {
        char *out;
        size_t length;
        FILE *file = open_memstream(&out, &length);
        spl_markup_base64(file, "foobar", i);
        fclose(file);
        assert_string_equal(out, base64[i]);
        free(out);
    }
}

/* ----------------------------------------------------------------------------------------------------------- peers */

static void test_peers(void **state)
{
    (void)state;
    struct spl_peers peers;
    struct spl_error err = {0};
    const char *path = write_text("p.csv", "name,ms,psnr\r\n# from their paper\nA, fast,12.5,31\n\nB,40,-3.25 \n");
    assert_int_equal(spl_peers_load(&peers, path, &err), 0);
    assert_int_equal(peers.count, 2);
    assert_string_equal(peers.rows[0].name, "A, fast");
    assert_true(peers.rows[0].ms == 12.5 && peers.rows[0].psnr == 31 && peers.rows[1].psnr == -3.25);
    spl_peers_finish(&peers);
}

static void test_peers_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said, *field;
    } bad[] = {
        {"a,1,2\nb,2\n", "line 2", "ms"},
        {"a\n", "line 1", "psnr"},
        {"a,1,x\n", "line 1: 'x' is no psnr", "psnr"},
        {"a,1,\n", "is no psnr", "psnr"},
        {"a,1,nan\n", "is no psnr", "psnr"},
        {"\n\na,0,30\n", "line 3: '0' is no ms", "ms"},
        {"a,-1,30\n", "is no ms", "ms"},
        {"a,1e999,30\n", "is no ms", "ms"},
        {"a,0x10,30\n", "line 1: '0x10' is no ms", "ms"},
        {",1,30\n", "1 to 63 bytes", "name"},
        {"0123456789012345678901234567890123456789012345678901234567890123,1,30\n", "1 to 63 bytes", "name"},
        {"name,ms,psnr\n", "holds no row", ""},
        {"", "holds no row", ""},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_peers peers;
        struct spl_error err = {0};
        assert_int_equal(spl_peers_load(&peers, write_text("p.csv", bad[i].text), &err), SPL_E_INPUT);
        assert_non_null(strstr(err.message, bad[i].said));
        assert_string_equal(err.field, bad[i].field);
        assert_null(peers.rows);
    }
    struct spl_peers peers;
    assert_int_equal(spl_peers_load(&peers, "/nowhere/p.csv", NULL), SPL_E_NOT_FOUND);
}

/* ----------------------------------------------------------------------------------------------------------- state */

static bool take_value(void *context, const json_t *record)
{
    double **next = context;
    const json_t *value = json_object_get(record, "value");
    if (json_is_number(value))
        *(*next)++ = json_number_value(value);
    return json_is_number(value);
}

static int open_values(const char *path, double plan, bool restart, double *values, struct spl_state **out,
                       size_t *resumed, struct spl_error *err)
{
    json_t *json = json_pack("{s:i, s:f}", "splatd-bench", 1, "size", plan);
    int rc = spl_state_open(path, json, restart, take_value, &values, out, resumed, err);
    json_decref(json);
    return rc;
}

static void test_state_resumes(void **state)
{
    (void)state;
    char path[300];
    snprintf(path, sizeof path, "%s/s.jsonl", folder);
    struct spl_state *s;
    struct spl_error err = {0};
    double values[4] = {0};
    size_t resumed;
    assert_int_equal(open_values(path, 1. / 3, false, values, &s, &resumed, &err), 0);
    assert_int_equal(resumed, 0);
    assert_int_equal(spl_state_add(s, json_pack("{s:f}", "value", 0.1), &err), 0);
    assert_int_equal(spl_state_add(s, json_pack("{s:f}", "value", 2. / 3), &err), 0);
    assert_int_equal(spl_state_add(s, NULL, &err), SPL_E_NOMEM);
    spl_state_close(s);

    /* A kill in the middle of a write leaves half a line, which is dropped and written over. */
    FILE *file = fopen(path, "a");
    fputs("{\"value\": 7", file);
    fclose(file);
    memset(&err, 0, sizeof err);
    assert_int_equal(open_values(path, 1. / 3, false, values, &s, &resumed, &err), 0);
    assert_int_equal(resumed, 2);
    assert_true(values[0] == 0.1 && values[1] == 2. / 3 && values[2] == 0);
    assert_int_equal(spl_state_add(s, json_pack("{s:f}", "value", 5.), &err), 0);
    spl_state_close(s);
    assert_int_equal(open_values(path, 1. / 3, false, values, &s, &resumed, &err), 0);
    assert_int_equal(resumed, 3);
    assert_true(values[2] == 5);
    spl_state_close(s);

    /* Another plan is refused by the key that differs; --restart begins anew. */
    assert_int_equal(open_values(path, 2, false, values, &s, &resumed, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "size");
    assert_non_null(strstr(err.message, path));
    memset(&err, 0, sizeof err);
    assert_int_equal(open_values(path, 2, true, values, &s, &resumed, &err), 0);
    assert_int_equal(resumed, 0);
    spl_state_close(s);
}

static void test_state_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said;
    } bad[] = {
        {"nonsense\n", "line 1"},
        {"nonsense", "does not begin with the plan"}, /* and stays */
        {"", "does not begin with the plan"},
        {"[]\n", "line 1"},
        {"{\"splatd-bench\": 1, \"size\": 1.0}\n{\"value\": 1}\nx\n{\"value\": 2}\n", "line 3"},
        {"{\"splatd-bench\": 1, \"size\": 1.0}\n{\"value\": \"1\"}\n", "line 2 does not fit"},
        {"{\"splatd-bench\": 1, \"size\": 1.0, \"more\": 1}\n", "another"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        double values[4];
        size_t resumed;
        struct spl_state *s;
        struct spl_error err = {0};
        assert_true(open_values(write_text("bad.jsonl", bad[i].text), 1, false, values, &s, &resumed, &err) < 0);
        assert_non_null(strstr(err.message, bad[i].said));
        assert_null(s);
    }
}

/* A folder that another made: what lies behind a link there is neither read nor written over, no pipe is waited for. */
static void test_state_follows_nothing(void **state)
{
    (void)state;
    char path[300], text[64] = "";
    double values[4];
    size_t resumed;
    struct spl_state *s;
    snprintf(path, sizeof path, "%s/link.jsonl", folder);
    const char *behind = write_text("behind.txt", "{\"splatd-bench\": 1, \"size\": 1.0}\n{");
    assert_int_equal(symlink("behind.txt", path), 0);
    struct spl_error err = {0};
    assert_int_equal(open_values(path, 1, false, values, &s, &resumed, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, path));
    assert_int_equal(open_values(path, 1, true, values, &s, &resumed, NULL), 0); /* in place of the link */
    spl_state_close(s);
    FILE *file = fopen(behind, "r");
    assert_non_null(fgets(text, sizeof text, file));
    assert_int_equal(fgetc(file), '{');
    fclose(file);
    snprintf(path, sizeof path, "%s/pipe.jsonl", folder);
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_int_equal(open_values(path, 1, false, values, &s, &resumed, NULL), SPL_E_INPUT);
}

/* ------------------------------------------------------------------------------------------------------ references */

static struct spl_named_view named_view(char *name, double x)
{
    struct spl_named_view view = {.name = name, .camera = {.near = 0.1, .far = INFINITY}};
    assert_int_equal(spl_camera_set_fov(&view.camera, 60, 8, 6, NULL), 0);
    assert_int_equal(
        spl_camera_look_at(&view.camera, (double[3]){x, 0, 0}, (double[3]){x - 1, 0, 0}, (double[3]){0, 0, 1}, NULL),
        0);
    return view;
}

static void write_png(const char *name, uint32_t width, uint32_t height)
{
    char path[300];
    struct spl_encoded encoded;
    struct spl_image image = {.layer = SPL_LAYER_COLOR, .type = SPL_PIXEL_RGBA8, .width = width, .height = height};
    image.pixels = calloc((size_t)width * height, 4);
    assert_int_equal(spl_image_encode(&image, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &encoded, NULL),
                     0);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_int_equal(fwrite(encoded.bytes, 1, encoded.length, file), encoded.length);
    fclose(file);
    spl_encoded_finish(&encoded);
    spl_image_finish(&image);
}

static void test_references(void **state)
{
    (void)state;
    struct spl_named_view views[] = {named_view("east", 5), named_view("west", 6)};
    struct spl_view_list list = {.views = views, .count = 2};
    struct spl_reference exact = {.kind = SPL_REFERENCE_EXACT, .folder = folder, .views = &list};
    struct spl_reference photographs = {.kind = SPL_REFERENCE_PHOTOGRAPHS, .views = &list};
    struct spl_error err = {0};
    uint64_t hash;

    write_png("east.color.png", 8, 6);
    assert_true(spl_reference_check(&exact, &hash, &err) < 0);
    assert_non_null(strstr(err.message, "west"));
    assert_non_null(strstr(err.message, "west.color.png"));

    memset(&err, 0, sizeof err);
    write_png("west.color.png", 9, 6);
    assert_int_equal(spl_reference_check(&exact, &hash, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "west.color.png"));
    assert_non_null(strstr(err.message, "9x6"));
    assert_non_null(strstr(err.message, "8x6"));

    memset(&err, 0, sizeof err);
    write_png("west.color.png", 8, 6);
    assert_int_equal(spl_reference_check(&exact, &hash, &err), 0);
    assert_true(hash != 0);

    assert_int_equal(spl_reference_check(&photographs, &hash, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "'east' names no photograph"));
    memset(&err, 0, sizeof err);
    char east[300], gone[300];
    snprintf(east, sizeof east, "%s/east.color.png", folder);
    snprintf(gone, sizeof gone, "%s/gone.jpg", folder);
    views[0].photograph = east;
    views[1].photograph = gone;
    assert_true(spl_reference_check(&photographs, &hash, &err) < 0);
    assert_non_null(strstr(err.message, "'west'"));
    assert_non_null(strstr(err.message, gone));
}

static void test_poses(void **state)
{
    (void)state;
    struct spl_dataset_info info = {
        .id = "made", .bounds_min = {-1, -1, -1}, .bounds_max = {1, 1, 1}, .splat_radius = 0.1};
    struct spl_named_view views[] = {named_view("inside", 0), named_view("outside", 9), named_view("bad", -9)};
    struct spl_view_list list = {.views = views, .count = 2};
    struct spl_error err = {0};
    assert_int_equal(spl_reference_check_poses(&list, &info, &err), 0);
    list.count = 3; /* looks away */
    assert_int_equal(spl_reference_check_poses(&list, &info, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "'bad'"));
    memset(&err, 0, sizeof err);
    views[2] = named_view("far", 1e6); /* in view, and nowhere near a pixel */
    assert_int_equal(spl_reference_check_poses(&list, &info, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "'far'"));
}

/* ------------------------------------------------------------------------------------------ tolerances, thumbnails */

static void test_tolerance(void **state)
{
    (void)state;
    enum { COUNT = 300 };
    struct make_splat splats[COUNT];
    for (int i = 0; i < COUNT; i++)
        splats[i] =
            (struct make_splat){.position = {0.01 * i, 0, 0}, .normal = {0, 0, 1}, .radius = i < 150 ? 0.5f : 2};
    struct spl_dataset *dataset = make_dataset(splats, COUNT);
    struct spl_tolerance *tolerance;
    assert_int_equal(spl_tolerance_create(dataset, &tolerance, NULL), 0);
    uint32_t ids[6] = {0, 149, 150, 299, UINT32_MAX, COUNT};
    float depths[6] = {1, 1, 1, 1, NAN, 1}, out[6];
    struct spl_image id = {.layer = SPL_LAYER_ID, .type = SPL_PIXEL_U32, .width = 3, .height = 2, .pixels = ids};
    struct spl_image depth = {
        .layer = SPL_LAYER_DEPTH, .type = SPL_PIXEL_F32, .width = 3, .height = 2, .pixels = depths};
    struct spl_view view;
    spl_view_init(&view);
    view.camera = named_view("v", 0).camera;
    view.lod = 0;
    spl_tolerance_fill(tolerance, &view, &id, &depth, 1, out);
    const double wanted[4] = {0.5, 0.5, 2, 2};
    for (int i = 0; i < 4; i++)
        assert_true(fabs(out[i] / wanted[i] - 1) < 0.06); /* the container's radius error */
    assert_true(out[4] == out[5] && fabs(out[4] - spl_dataset_get_info(dataset)->splat_radius) < 1e-6);

    /* Far away only a quarter of the splats is drawn, at twice the radius. */
    for (int i = 0; i < 4; i++)
        depths[i] = 1e6f;
    float far[6];
    view.lod = 1;
    spl_tolerance_fill(tolerance, &view, &id, &depth, 2, far);
    for (int i = 0; i < 4; i++)
        assert_true(fabs(far[i] / out[i] - 2) < 1e-6);
    spl_tolerance_destroy(tolerance);
    spl_dataset_close(dataset);
}

static void test_thumbnails(void **state)
{
    (void)state;
    uint8_t pixels[5 * 3 * 4];
    memset(pixels, 255, sizeof pixels);
    struct spl_image image = {
        .layer = SPL_LAYER_COLOR, .type = SPL_PIXEL_RGBA8, .width = 5, .height = 3, .pixels = pixels};
    static const struct {
        uint32_t side, width, height;
    } cases[] = {{640, 5, 3}, {5, 5, 3}, {4, 3, 2}, {2, 2, 1}, {1, 1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_encoded out;
        struct spl_image back;
        char path[300];
        assert_int_equal(spl_thumbnail(&image, cases[i].side, &out, NULL), 0);
        snprintf(path, sizeof path, "%s/t.jpg", folder);
        FILE *file = fopen(path, "w");
        assert_int_equal(fwrite(out.bytes, 1, out.length, file), out.length);
        fclose(file);
        spl_encoded_finish(&out);
        assert_int_equal(spl_image_load(path, SPL_LAYER_COLOR, &back, NULL), 0);
        assert_int_equal(back.width, cases[i].width);
        assert_int_equal(back.height, cases[i].height);
        for (size_t p = 0; p < (size_t)4 * back.width * back.height;
             p++) /* no edge pixel is mixed with what is outside */
            assert_true(((uint8_t *)back.pixels)[p] >= 253);
        spl_image_finish(&back);
    }
}

static void test_page_views(void **state)
{
    (void)state;
    assert_int_equal(spl_sweep_page_views(3), 3);
    assert_int_equal(spl_sweep_page_views(100), SPL_SWEEP_PAGE_VIEWS);
    for (size_t i = 0; i < SPL_SWEEP_PAGE_VIEWS; i++)
        assert_int_equal(spl_sweep_page_view(100, i), 25 * i);
    for (size_t i = 0; i < 3; i++)
        assert_int_equal(spl_sweep_page_view(3, i), i);
}

/* --------------------------------------------------------------------------------------------------------- statistics
 */

static void test_report(void **state)
{
    (void)state;
    struct make_splat splat = {.normal = {0, 0, 1}, .radius = 1};
    struct spl_dataset *dataset = make_dataset(&splat, 1);
    struct spl_named_view views[] = {named_view("a", 5), named_view("b", 6)};
    struct spl_view_list list = {.views = views, .count = 2};
    struct spl_setting settings[] = {{SPL_METHOD_SPLAT, 1, 1, 2}, {SPL_METHOD_POINTS, 2, 2, 8}};
    struct spl_sweep_options options = {
        .dataset = dataset, .views = &list, .settings = settings, .setting_count = 2, .repeats = 3, .folder = folder};
    struct spl_sweep_accuracy accuracy[4] = {{.metrics = {.psnr = 20, .ssim = 0.5, .depth_rmse = 3, .holes = NAN}},
                                             {.metrics = {.psnr = 30, .ssim = 0.7, .depth_rmse = 4, .holes = 0.25}},
                                             {.metrics = {.psnr = INFINITY}},
                                             {.metrics = {.psnr = INFINITY}}};
    struct spl_sweep_time times[24];
    static const double ms[24] = {10, 90, 12, 4, 4, 4, 20, 21, 19, 8, 8, 8, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    for (int i = 0; i < 24; i++)
        times[i] = (struct spl_sweep_time){.ms = ms[i], .shade_ms = ms[i] / 2, .depth_ms = ms[i] / 4};
    double calibrator[] = {22, 20, 24};
    struct spl_sweep sweep = {
        .options = &options, .accuracy = accuracy, .times = times, .calibrator = calibrator, .calibrator_count = 3};
    struct spl_report report;
    assert_int_equal(spl_report_init(&report, &sweep, NULL), 0);
    const struct spl_profile_point *p = report.profile.points;
    assert_true(p[0].ms == 16); /* views: 12 and 20 */
    assert_true(fabs(p[0].ms_q90 - (12 + 0.9 * 8)) < 1e-9);
    assert_true(p[0].psnr == 25);
    assert_true(fabs(p[0].psnr_q05 - 20.5) < 1e-9 && fabs(p[0].psnr_sd - sqrt(50)) < 1e-9);
    assert_true(fabs(p[0].ssim - 0.6) < 1e-9 && fabs(p[0].depth_rmse - sqrt(12.5)) < 1e-9 && p[0].holes == 0.25);
    assert_true(p[1].psnr == SPL_PROFILE_PSNR_MAX && p[1].front && !p[0].front);
    assert_true(report.calibrator.median == 22);
    char *csv, *svg;
    size_t length;
    assert_int_equal(spl_report_to_csv(&report, &csv, &length, NULL), 0);
    assert_int_equal(count_of(csv, "\n"), 3);
    assert_non_null(strstr(csv, "splat,1,1,2,0,16,19.2,12,0,"));
    free(csv);
    json_t *json = spl_report_to_json(&report, NULL);
    const json_t *view =
        json_array_get(json_object_get(json_array_get(json_object_get(json, "points"), 0), "views"), 1);
    assert_string_equal(json_string_value(json_object_get(view, "view")), "b");
    assert_true(json_number_value(json_object_get(json_object_get(view, "ms"), "median")) == 20);
    const json_t *overall = json_object_get(json_array_get(json_object_get(json, "points"), 0), "psnr_overall");
    assert_true(fabs(json_number_value(overall) + 10 * log10((0.01 + 0.001) / 2)) < 1e-9);
    json_decref(json);
    accuracy[0].metrics.psnr = accuracy[1].metrics.psnr = NAN; /* a view without any pixel to compare */
    struct spl_report without;
    assert_int_equal(spl_report_init(&without, &sweep, NULL), 0);
    assert_true(isnan(without.profile.points[0].psnr) && !without.profile.points[0].front);
    spl_report_finish(&without);
    struct spl_peer peer[] = {{"other", 5, 33}, {"third", 6, 31}, {"other", 9, 35}};
    assert_int_equal(spl_report_chart(&report.profile, 1, 22, &(struct spl_peers){peer, 3}, &svg, &length, NULL), 0);
    assert_int_equal(count_of(svg, "<circle"), 5);
    assert_int_equal(count_of(svg, "<polyline"), 4);      /* two settings' curves, two peers */
    assert_int_equal(count_of(svg, "stroke-opacity"), 3); /* fewer atoms are paler: curve, legend, point */
    assert_non_null(strstr(svg, "splat atoms=2"));
    free(svg);
    report.profile.points[0].setting = (struct spl_setting){SPL_METHOD_SPLAT, 4, 1, 8, SPL_SETTING_MAPS_ON};
    assert_int_equal(spl_report_chart(&report.profile, 1, 22, &(struct spl_peers){peer, 3}, &svg, &length, NULL), 0);
    assert_int_equal(count_of(svg, "<polyline"), 4);
    assert_non_null(strstr(svg, ">splat + panorama<"));
    assert_int_equal(count_of(svg, "class=\"curve s4\""), 2); /* after the methods' colours; peers then have the next */
    assert_int_equal(count_of(svg, "class=\"curve s5\""), 2);
    free(svg);
    assert_int_equal(spl_report_to_csv(&report, &csv, &length, NULL), 0);
    assert_non_null(strstr(csv, ",on,solid,\npoints,"));
    free(csv);
    char name[64];
    spl_report_setting_name(&report.profile.points[0].setting, name);
    assert_string_equal(name, "splat lod=4 maps=on");
    spl_report_setting_name(&settings[0], name);
    assert_string_equal(name, "splat lod=1 atoms=2");
    spl_report_setting_name(&settings[1], name);
    assert_string_equal(name, "points lod=2 2×2");
    /* With something soft: a model beside the solid setting, with its own stage's time. */
    struct spl_soft_params soft = {.opacity = 0.3};
    assert_int_equal(spl_soft_parse("class:3-5", &soft, NULL), 0);
    report.profile.points[0].setting = (struct spl_setting){
        .method = SPL_METHOD_POINTS, .lod = 4, .supersample = 1, .atoms = 8, .soft = 1 + SPL_SOFT_MODEL_BASE};
    report.profile.points[0].soft_ms = 7.5;
    report.profile.soft = soft;
    spl_report_setting_name(&report.profile.points[0].setting, name);
    assert_string_equal(name, "points lod=4 soft=base");
    assert_int_equal(spl_report_to_csv(&report, &csv, &length, NULL), 0);
    assert_non_null(strstr(csv, ",maps,soft_model,soft_ms\n"));
    assert_non_null(strstr(csv, ",base,7.5\npoints,"));
    assert_non_null(strstr(csv, ",solid,\n"));
    free(csv);
    assert_int_equal(spl_report_chart(&report.profile, 1, 22, NULL, &svg, &length, NULL), 0);
    assert_non_null(strstr(svg, ">points, base<"));
    assert_int_equal(count_of(svg, "<polyline"), 2);
    free(svg);
    json = spl_report_to_json(&report, NULL);
    assert_string_equal(json_string_value(json_object_get(json_object_get(json, "soft"), "terms")), "class:3..5");
    json_decref(json);
    spl_report_finish(&report);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chart_has_every_point),
        cmocka_unit_test(test_chart_without_points),
        cmocka_unit_test(test_chart_escapes),
        cmocka_unit_test(test_markup),
        cmocka_unit_test(test_peers),
        cmocka_unit_test(test_peers_refusals),
        cmocka_unit_test(test_state_resumes),
        cmocka_unit_test(test_state_refusals),
        cmocka_unit_test(test_state_follows_nothing),
        cmocka_unit_test(test_references),
        cmocka_unit_test(test_poses),
        cmocka_unit_test(test_tolerance),
        cmocka_unit_test(test_thumbnails),
        cmocka_unit_test(test_page_views),
        cmocka_unit_test(test_report),
    };
    return cmocka_run_group_tests(tests, make, clean);
}
