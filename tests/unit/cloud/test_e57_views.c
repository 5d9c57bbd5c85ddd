/* Photographs inside E57 files: which are views, where they look, what is refused, and their bytes. */
#include "cloud_test.h"

#include <math.h>

#include "base/memory.h"
#include "cloud/views.h"
#include "support/e57_writer.h"

#define SIZES                                                                                                          \
    "<imageWidth type=\"Integer\">640</imageWidth><imageHeight type=\"Integer\">320</imageHeight>"                     \
    "<pixelWidth type=\"Float\">0.001</pixelWidth><pixelHeight type=\"Float\">0.002</pixelHeight>"
#define JPEG "<jpegImage type=\"Blob\" fileOffset=\"%llu\" length=\"9\"/>"
#define PINHOLE(more) "<name type=\"String\">%s</name>%s<pinholeRepresentation>" more JPEG "</pinholeRepresentation>"
#define FOCAL                                                                                                          \
    "<focalLength type=\"Float\">0.5</focalLength><principalPointX type=\"Float\">300</principalPointX>"               \
    "<principalPointY type=\"Float\">150</principalPointY>"

static unsigned refused_count;
static char refused_message[sizeof((struct spl_error *)0)->message];

static void take_refusal(void *context, const struct spl_error *why)
{
    (void)context;
    refused_count++;
    snprintf(refused_message, sizeof refused_message, "%s", why->message);
}

static const struct spl_photograph_options handing_out = {.refuse = take_refusal};

static void begin(struct e57_writer *w, unsigned long long *blob)
{
    e57_begin(w);
    static const double at[1] = {1};
    const struct e57_field fields[] = {{.name = "cartesianX", .type = E57_DOUBLE, .values = at},
                                       {.name = "cartesianY", .type = E57_DOUBLE, .values = at},
                                       {.name = "cartesianZ", .type = E57_DOUBLE, .values = at}};
    e57_add_scan(w, &(struct e57_scan){"scan", e57_pose(1, 0, 0, 1, 10, 20, 30), fields, 3, 1, 0});
    *blob = e57_add_blob(w, "JPEG here", 9);
}

static int end(struct e57_writer *w, const struct spl_photograph_options *options, struct spl_view_list *list,
               struct spl_error *err)
{
    size_t length;
    uint8_t *file = e57_end(w, NULL, &length);
    write_scratch(file, length);
    free(file);
    return spl_view_list_load_photographs(list, scratch_path(), options, err);
}

static void assert_sees(const struct spl_camera *camera, double x, double y, double z, double u, double v)
{
    double pixel[2], depth;
    assert_true(spl_camera_project(camera, (double[3]){x, y, z}, pixel, &depth));
    assert_float_equal(pixel[0], u, 1e-9);
    assert_float_equal(pixel[1], v, 1e-9);
}

static void a_pinhole_looks_along_its_negative_z(void **state)
{
    struct e57_writer w;
    struct spl_view_list list;
    struct spl_error err = {0};
    unsigned long long blob;
    char bytes[16];
    FILE *file;
    (void)state;
    begin(&w, &blob);
    e57_add_image(&w, PINHOLE(FOCAL SIZES), "../a b", e57_pose(2, 0, 0, 0, 1, 2, 3), blob);
    e57_add_image(&w, PINHOLE(FOCAL SIZES), "", e57_pose(0, 1, 0, 0, 0, 0, 0), blob);
    e57_add_image(&w, "<visualReferenceRepresentation>" SIZES JPEG "</visualReferenceRepresentation>", blob);
    if (end(&w, NULL, &list, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 2);
    spl_view_list_finish(&list);
    assert_int_equal(spl_view_list_load_photographs(&list, scratch_path(), &handing_out, NULL), 0);
    assert_string_equal(list.views[0].name, "_._a b-1");
    assert_string_equal(list.views[1].name, "image-2");
    const struct spl_camera *camera = &list.views[0].camera;
    assert_int_equal(camera->width, 640);
    assert_int_equal(camera->height, 320);
    assert_sees(camera, 1, 2, 3 - 5, 300, 150);
    assert_sees(camera, 1 + 1, 2, 3 - 5, 300 + 500 / 5.0, 150);
    assert_sees(camera, 1, 2 + 1, 3 - 5, 300, 150 - 250 / 5.0);
    assert_sees(&list.views[1].camera, 0, 0, 5, 300, 150); /* half a turn about x */
    assert_false(list.views[0].inner->is_panorama);
    assert_int_equal(spl_view_open_inner(&list.views[0], &file, &err), 0);
    assert_int_equal(fread(bytes, 1, sizeof bytes, file), 9);
    assert_memory_equal(bytes, "JPEG here", 9);
    fclose(file);
    list.views[0].inner->bytes = 10;
    assert_int_equal(spl_view_open_inner(&list.views[0], &file, &err), SPL_E_INPUT);
    list.views[0].inner->bytes = UINT64_MAX;
    err = (struct spl_error){0};
    assert_int_equal(spl_view_open_inner(&list.views[0], &file, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "do not fit"));
    spl_view_list_finish(&list);
}

static void panoramas_are_cut_into_faces_around_their_pose(void **state)
{
    struct e57_writer w;
    struct spl_view_list list;
    struct spl_error err = {0};
    unsigned long long blob;
    (void)state;
    begin(&w, &blob);
    /* a whole sphere in the pose of its scan: a quarter about z */
    e57_add_image(&w,
                  "<name type=\"String\">s</name><associatedData3DGuid type=\"String\">{scan}</associatedData3DGuid>"
                  "<sphericalRepresentation><imageWidth type=\"Integer\">628</imageWidth><imageHeight "
                  "type=\"Integer\">314</imageHeight><pixelWidth type=\"Float\">0.01</pixelWidth><pixelHeight "
                  "type=\"Float\">0.01</pixelHeight>" JPEG "</sphericalRepresentation>",
                  blob);
    /* a piece of a cylinder of 0.64 radians in front */
    e57_add_image(&w,
                  "<name type=\"String\">c</name>%s<cylindricalRepresentation>" SIZES
                  "<radius type=\"Float\">0.5</radius><principalPointY type=\"Float\">160</principalPointY>" JPEG
                  "</cylindricalRepresentation>",
                  e57_pose(1, 0, 0, 0, 0, 0, 0), blob);
    if (end(&w, &handing_out, &list, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 7);
    assert_string_equal(list.views[0].name, "s-1-front");
    assert_string_equal(list.views[5].name, "s-1-down");
    assert_string_equal(list.views[6].name, "c-2-front");
    assert_int_equal(list.views[0].camera.width, 200);
    assert_sees(&list.views[0].camera, 10, 20 + 7, 30, 100, 100); /* its x is the world's y */
    assert_sees(&list.views[1].camera, 10 - 7, 20, 30, 100, 100); /* left */
    assert_sees(&list.views[0].camera, 10, 20 + 7, 30 + 1, 100, 100 - 100 / 7.0);
    assert_sees(&list.views[4].camera, 10, 20, 30 + 7, 100, 100); /* up */
    const struct spl_inner_photograph *inner = list.views[6].inner;
    assert_true(inner->is_panorama && inner->panorama.cylinder && inner->panorama.down == 250);
    assert_true(inner->panorama.horizon == 160);
    spl_view_list_finish(&list);
}

static void a_large_panorama_is_taken_and_a_larger_one_is_not(void **state)
{
    (void)state;
    for (int larger = 0; larger < 2; larger++) {
        struct e57_writer w;
        struct spl_view_list list;
        struct spl_error err = {0};
        unsigned long long blob;
        begin(&w, &blob);
        e57_add_image(&w,
                      "<name>s</name>%s<sphericalRepresentation><imageWidth>%d</imageWidth><imageHeight>8192"
                      "</imageHeight><pixelWidth>%.17g</pixelWidth><pixelHeight>%.17g</pixelHeight>" JPEG
                      "</sphericalRepresentation>",
                      e57_pose(1, 0, 0, 0, 0, 0, 0), 16384 + larger, M_PI / 8193, M_PI / 8192, blob);
        assert_int_equal(end(&w, &(struct spl_photograph_options){0}, &list, &err), larger ? SPL_E_INPUT : 0);
        assert_int_equal(list.count, larger ? 0 : 6);
        spl_view_list_finish(&list);
    }
}

static void hands_out(const char *format, const char *pose, const char *part)
{
    struct e57_writer w;
    struct spl_view_list list;
    struct spl_error err = {0};
    unsigned long long blob;
    begin(&w, &blob);
    e57_add_image(&w, format, "bad", pose, blob);
    e57_add_image(&w, PINHOLE(FOCAL SIZES), "good", e57_pose(1, 0, 0, 0, 0, 0, 0), blob);
    refused_count = 0;
    if (end(&w, &handing_out, &list, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 1);
    assert_int_equal(refused_count, 1);
    if (!strstr(refused_message, part) || !strstr(refused_message, "image 1 ('bad')"))
        fail_msg("\"%s\" instead of \"%s\"", refused_message, part);
    spl_view_list_finish(&list);
    assert_int_equal(spl_view_list_load_photographs(&list, scratch_path(), NULL, &err), SPL_E_INPUT);
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
static void what_cannot_be_a_photograph_is_refused(void **state)
{
    const char *pose = e57_pose(1, 0, 0, 0, 0, 0, 0);
    char keep[1024];
    (void)state;
    snprintf(keep, sizeof keep, "%s", pose);
    hands_out(PINHOLE(FOCAL SIZES), "", "no pose");
    hands_out(PINHOLE(SIZES), keep, "focalLength: 0");
    hands_out(PINHOLE(FOCAL), keep, "imageWidth: 0");
    snprintf(keep, sizeof keep, "%s", e57_pose(0, 0, 0, 0, 0, 0, 0));
    hands_out(PINHOLE(FOCAL SIZES), keep, "no rotation");
    hands_out("<name type=\"String\">%s</name>%s<sphericalRepresentation>" SIZES JPEG "</sphericalRepresentation>", "",
              "no pose, and names no scan");
    snprintf(keep, sizeof keep, "%s", e57_pose(1, 0, 0, 0, 0, 0, 0));
    hands_out("<name type=\"String\">%s</name>%s<cylindricalRepresentation>" SIZES JPEG "</cylindricalRepresentation>",
              keep, "radius: 0");
    hands_out("<name type=\"String\">%s</name>%s<sphericalRepresentation><imageWidth type=\"Integer\">64</imageWidth>"
              "<imageHeight type=\"Integer\">64</imageHeight><pixelWidth type=\"Float\">0.2</pixelWidth><pixelHeight "
              "type=\"Float\">0.1</pixelHeight>" JPEG "</sphericalRepresentation>",
              keep, "more than once around");
}
#pragma GCC diagnostic pop

static void images_are_listed(void **state)
{
    struct e57_writer w;
    struct spl_view_list list;
    struct spl_cloud *cloud;
    unsigned long long blob;
    (void)state;
    begin(&w, &blob);
    e57_add_image(&w, PINHOLE(FOCAL SIZES), "a\033[2J", e57_pose(1, 0, 0, 0, 0, 0, 0), blob);
    e57_add_image(&w, "<visualReferenceRepresentation>" SIZES JPEG "</visualReferenceRepresentation>", blob);
    assert_int_equal(end(&w, &handing_out, &list, NULL), SPL_E_INPUT); /* a control character is no XML */
    begin(&w, &blob);
    e57_add_image(&w, PINHOLE(FOCAL SIZES), "a\xe2\x80\xae", e57_pose(1, 0, 0, 0, 0, 0, 0), blob);
    e57_add_image(&w, "<visualReferenceRepresentation>" SIZES JPEG "</visualReferenceRepresentation>", blob);
    assert_int_equal(end(&w, &handing_out, &list, NULL), 0);
    spl_view_list_finish(&list);
    assert_int_equal(spl_cloud_open(scratch_path(), NULL, &cloud, NULL), 0);
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    assert_int_equal(info->image_count, 2);
    assert_string_equal(info->images[0].name, "a?");
    assert_string_equal(info->images[0].kind, "pinhole");
    assert_string_equal(info->images[0].coding, "JPEG");
    assert_true(info->images[0].posed && info->images[0].width == 640 && info->images[0].height == 320);
    assert_int_equal(info->images[0].bytes, 9);
    assert_string_equal(info->images[1].kind, "visual reference");
    assert_false(info->images[1].posed);
    spl_cloud_destroy(cloud);
}

static void no_image_and_no_memory(void **state)
{
    struct e57_writer w;
    struct spl_view_list list;
    struct spl_error err = {0};
    unsigned long long blob;
    (void)state;
    begin(&w, &blob);
    assert_int_equal(end(&w, &handing_out, &list, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "holds no view"));
    begin(&w, &blob);
    e57_add_image(&w, PINHOLE(FOCAL SIZES), "a", e57_pose(1, 0, 0, 0, 0, 0, 0), blob);
    assert_int_equal(end(&w, &handing_out, &list, NULL), 0);
    spl_view_list_finish(&list);
    for (long n = 1;; n++) {
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int rc = spl_view_list_load_photographs(&list, scratch_path(), &handing_out, &err);
        spl_memory_fail_after(0);
        spl_view_list_finish(&list);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_in_range(n, 1, 50);
    }
    err = (struct spl_error){0};
    const struct spl_photograph_options elsewhere = {.images = "/tmp"};
    assert_int_equal(spl_view_list_load_photographs(&list, scratch_path(), &elsewhere, &err), SPL_E_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pinhole_looks_along_its_negative_z),
        cmocka_unit_test(panoramas_are_cut_into_faces_around_their_pose),
        cmocka_unit_test(a_large_panorama_is_taken_and_a_larger_one_is_not),
        cmocka_unit_test(what_cannot_be_a_photograph_is_refused),
        cmocka_unit_test(images_are_listed),
        cmocka_unit_test(no_image_and_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
