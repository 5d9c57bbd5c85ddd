/* E57 files made here: every type of field, packets of every kind, poses, limits, states, and what must be refused. */
#include "cloud_test.h"

#include <math.h>

#include "cloud/e57/crc32c.h"
#include "cloud/e57/points.h"
#include "support/e57_writer.h"

enum { N = 1000 };

static int64_t raw[10][N];
static double value[10][N];

/* Numbers that fill a range of any width, its ends among them. */
static void fill(int64_t *out, int64_t least, int64_t most)
{
    uint64_t span = (uint64_t)most - (uint64_t)least, x = 88172645463325252ull;
    for (int i = 0; i < N; i++) {
        x ^= x << 13, x ^= x >> 7, x ^= x << 17;
        uint64_t in = span == UINT64_MAX ? x : x % (span + 1);
        out[i] = (int64_t)((uint64_t)least + (i == 0 ? 0 : i == 1 ? span : in));
    }
}

static void load_file(uint8_t *file, size_t length, size_t capacity, struct loaded *l)
{
    write_scratch(file, length);
    free(file);
    load_path(scratch_path(), NULL, capacity, l);
}

/* The file of scans of one kind each, read whole; it must load. */
static void load_scans(const struct e57_scan *scans, size_t count, const char *root, struct loaded *l)
{
    struct e57_writer w;
    size_t length;
    e57_begin(&w);
    for (size_t i = 0; i < count; i++)
        e57_add_scan(&w, &scans[i]);
    uint8_t *file = e57_end(&w, root, &length);
    load_file(file, length, 77, l);
    if (l->code)
        fail_msg("%s", l->err.message);
}

static void refused_scan(const struct e57_scan *scan, const char *root, int code, const char *field, const char *part)
{
    struct e57_writer w;
    struct loaded l;
    size_t length;
    e57_begin(&w);
    e57_add_scan(&w, scan);
    uint8_t *file = e57_end(&w, root, &length);
    load_file(file, length, 77, &l);
    if (l.code != code || strcmp(l.err.field, field) || !strstr(l.err.message, part))
        fail_msg("expected %d [%s] \"%s\", got %d [%s] \"%s\" and %llu points", code, field, part, l.code, l.err.field,
                 l.err.message, (unsigned long long)l.points);
    loaded_finish(&l);
}

static void refused_file(uint8_t *file, size_t length, int code, const char *field, const char *part)
{
    struct loaded l;
    load_file(file, length, 77, &l);
    if (l.code != code || strcmp(l.err.field, field) || !strstr(l.err.message, part))
        fail_msg("expected %d [%s] \"%s\", got %d [%s] \"%s\"", code, field, part, l.code, l.err.field, l.err.message);
    loaded_finish(&l);
}

static struct e57_field doubles(const char *name, int of)
{
    return (struct e57_field){.name = name, .type = E57_DOUBLE, .values = value[of]};
}

static void prepare_doubles(void)
{
    for (int k = 0; k < 10; k++)
        for (int i = 0; i < N; i++)
            value[k][i] = k + 0.25 * i;
}

static void checksums_agree(void **state)
{
    uint8_t bytes[300];
    (void)state;
    assert_int_equal(spl_crc32c("123456789", 9), 0xe3069283);
    assert_int_equal(spl_crc32c_table("123456789", 9), 0xe3069283);
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)(i * i * 7 + 3);
    for (size_t length = 0; length < 256; length++)
        for (size_t at = 0; at < 9; at++)
            assert_int_equal(spl_crc32c(bytes + at, length), spl_crc32c_table(bytes + at, length));
}

/* Widths of 0 to 64 bits in x, y, z; packets take odd numbers of bytes, so that values straddle them. */
static void every_width_of_integers(void **state)
{
    (void)state;
    for (unsigned bits = 0; bits <= 64; bits++) {
        uint64_t span = bits == 0 ? 0 : bits == 64 ? UINT64_MAX : (1ull << bits) - 1;
        int64_t least = bits == 64 ? INT64_MIN : -(int64_t)(span / 3), most = (int64_t)((uint64_t)least + span);
        struct loaded l;
        fill(raw[0], least, most);
        fill(raw[1], -5, 5);
        const struct e57_field fields[] = {
            {"cartesianX", E57_SCALED, least, most, 0.001, 10, raw[0], .step = 1 + bits % 7},
            {"cartesianY", E57_INTEGER, -5, 5, .raw = raw[1], .step = 11},
            {"cartesianZ", E57_SCALED, least, most, 2, -1, raw[0], .step = 50},
        };
        load_scans(&(struct e57_scan){"widths", NULL, fields, 3, N, bits % 2}, 1, NULL, &l);
        assert_int_equal(l.points, N);
        assert_int_equal(l.expected, N);
        assert_string_equal(l.format, "E57");
        assert_false(l.attributes & SPL_CLOUD_STATION);
        for (size_t i = 0; i < KEPT; i++)
            assert_point(&l, i, (double)raw[0][i] * 0.001 + 10, (double)raw[1][i], (double)raw[0][i] * 2 - 1);
        loaded_finish(&l);
    }
}

static void floats_of_both_kinds_beside_streams_that_are_not_read(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    value[0][1] = 1e-300;
    value[0][2] = NAN;
    value[0][3] = INFINITY;
    const struct e57_field fields[] = {
        doubles("x:unknown", 5),
        {.name = "x:note", .type = E57_TEXT, .step = 3},
        doubles("cartesianX", 0),
        {.name = "cartesianY", .type = E57_SINGLE, .values = value[1], .step = 7},
        {.name = "x:flag", .type = E57_INTEGER, .most = 1, .raw = raw[9], .step = 1},
        doubles("cartesianZ", 2),
    };
    load_scans(&(struct e57_scan){"floats", NULL, fields, 6, N, E57_OTHER_PACKETS}, 1, NULL, &l);
    assert_int_equal(l.points, N - 2);
    assert_int_equal(l.skipped, 2);
    assert_point(&l, 0, 0, 1, 2);
    assert_point(&l, 1, 1e-300, 1.25, 2.25);
    assert_point(&l, 2, 1, 2, 3);
    loaded_finish(&l);
}

/* One stream lies in the first packet as a whole, another begins only when that one has ended. */
static void streams_that_do_not_keep_step(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    const struct e57_field fields[] = {
        {.name = "cartesianX", .type = E57_DOUBLE, .values = value[0], .step = 8 * N},
        {.name = "cartesianY", .type = E57_DOUBLE, .values = value[1], .step = 8},
        {.name = "cartesianZ", .type = E57_DOUBLE, .values = value[2], .step = 3},
    };
    load_scans(&(struct e57_scan){"unequal", NULL, fields, 3, N, E57_OTHER_PACKETS}, 1, NULL, &l);
    assert_int_equal(l.points, N);
    for (size_t i = 0; i < KEPT; i++)
        assert_point(&l, i, value[0][i], value[1][i], value[2][i]);
    assert_true(l.sum[2] == l.sum[0] + 2 * N);
    loaded_finish(&l);
}

static void states_and_misses(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    for (int i = 0; i < N; i++) {
        raw[0][i] = i % 3;
        value[0][i] = value[1][i] = value[2][i] = i % 2;
    }
    struct e57_field fields[] = {
        doubles("cartesianX", 0),
        doubles("cartesianY", 1),
        doubles("cartesianZ", 2),
        {.name = "cartesianInvalidState", .type = E57_INTEGER, .most = 2, .raw = raw[0]},
        {.name = "columnIndex", .type = E57_INTEGER, .most = 2, .raw = raw[0]},
        {.name = "rowIndex", .type = E57_INTEGER, .most = 2, .raw = raw[0]},
    };
    /* flagged: the flags are believed, also of points at the scanner */
    load_scans(&(struct e57_scan){"flagged", NULL, fields, 6, 999, 0}, 1, NULL, &l);
    assert_int_equal(l.points, 333);
    assert_int_equal(l.skipped, 666);
    assert_true(l.at_most);
    assert_true(l.attributes & SPL_CLOUD_STATION);
    loaded_finish(&l);
    /* no flags, but cells: what lies at the scanner was not hit */
    fields[3] = fields[5];
    load_scans(&(struct e57_scan){"cells", NULL, fields, 5, N, 0}, 1, NULL, &l);
    assert_int_equal(l.points, N / 2);
    assert_true(l.at_most);
    loaded_finish(&l);
    /* neither: a point is a point */
    load_scans(&(struct e57_scan){"points", NULL, fields, 3, N, 0}, 1, NULL, &l);
    assert_int_equal(l.points, N);
    assert_false(l.at_most);
    loaded_finish(&l);
}

static void spherical_coordinates_in_the_pose_of_their_scanner(void **state)
{
    struct loaded l;
    (void)state;
    value[0][0] = value[0][1] = 2, value[0][2] = 0;
    value[1][0] = 0, value[1][1] = M_PI / 2, value[1][2] = 1;
    value[2][0] = 0, value[2][1] = M_PI / 6, value[2][2] = 1;
    const struct e57_field fields[] = {doubles("sphericalRange", 0), doubles("sphericalAzimuth", 1),
                                       doubles("sphericalElevation", 2)};
    /* a quarter about z, not a unit quaternion */
    load_scans(&(struct e57_scan){"sphere", e57_pose(3, 0, 0, 3, 100, 200, 300), fields, 3, 3, 0}, 1, NULL, &l);
    assert_int_equal(l.points, 2); /* range 0 is no point */
    assert_int_equal(l.station_count, 1);
    const double expected[2][3] = {{100, 202, 300}, {100 - 2 * cos(M_PI / 6), 200, 301}};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++)
            assert_float_equal(l.first.position[i][k], expected[i][k], 1e-12);
    assert_float_equal(l.station[0][1], -1, 1e-15);
    assert_float_equal(l.station[0][11], 300, 0);
    loaded_finish(&l);
}

static void stations_are_the_scans_that_have_a_viewpoint(void **state)
{
    struct loaded l;
    char pose[1024];
    (void)state;
    prepare_doubles();
    const struct e57_field plain[] = {doubles("cartesianX", 0), doubles("cartesianY", 1), doubles("cartesianZ", 2)};
    snprintf(pose, sizeof pose, "%s", e57_pose(0, 0, 1, 0, 1, 2, 3));
    const char *moved = "<pose type=\"Structure\"><translation type=\"Structure\"><x type=\"Float\">4</x>"
                        "<y type=\"Float\">5</y><z type=\"Float\">6</z></translation></pose>";
    const struct e57_scan scans[] = {{"merged", NULL, plain, 3, 2, 0},
                                     {"empty", pose, plain, 3, 0, 0},
                                     {"posed", pose, plain, 3, 3, 0},
                                     {"moved", moved, plain, 3, 4, 0}};
    load_scans(scans, 4, NULL, &l);
    assert_int_equal(l.points, 9);
    assert_int_equal(l.station_count, 3);
    const uint16_t station[9] = {UINT16_MAX, UINT16_MAX, 1, 1, 1, 2, 2, 2, 2};
    for (size_t i = 0; i < 9; i++)
        assert_int_equal(l.first.station[i], station[i]);
    assert_point(&l, 0, 0, 1, 2);
    assert_point(&l, 2, 1 - 0, 2 + 1, 3 - 2); /* half a turn about y */
    assert_point(&l, 6, 4.25, 6.25, 8.25);
    loaded_finish(&l);
}

static void normals_turn_with_their_scan_whatever_their_prefix(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    for (int i = 0; i < 4; i++)
        value[3][i] = 5, value[4][i] = value[5][i] = 0;
    const struct e57_field fields[] = {doubles("cartesianX", 0),  doubles("cartesianY", 1),  doubles("cartesianZ", 2),
                                       doubles("nor:normalX", 3), doubles("nor:normalY", 4), doubles("nor:normalZ", 5)};
    const struct e57_scan scans[] = {{"without", NULL, fields, 3, 2, 0},
                                     {"turned", e57_pose(1, 0, 0, 1, 0, 0, 0), fields, 6, 2, 0}};
    load_scans(scans, 2, NULL, &l);
    assert_true(l.attributes & SPL_CLOUD_NORMAL);
    for (int k = 0; k < 3; k++) {
        assert_float_equal(l.first.normal[0][k], 0, 0);
        assert_float_equal(l.first.normal[2][k], k == 1, 1e-7);
    }
    loaded_finish(&l);
}

static void colours_by_limits_by_type_and_by_sight(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    const char *limits =
        "<colorLimits type=\"Structure\"><colorRedMinimum type=\"Integer\">100</colorRedMinimum>"
        "<colorRedMaximum type=\"Integer\">1100</colorRedMaximum>"
        "<colorGreenMinimum type=\"ScaledInteger\" scale=\"0.5\">0</colorGreenMinimum>"
        "<colorGreenMaximum type=\"ScaledInteger\" scale=\"0.5\">8190</colorGreenMaximum>"
        "<colorBlueMinimum type=\"Integer\"/><colorBlueMaximum type=\"Integer\">4095</colorBlueMaximum>"
        "</colorLimits>";
    for (int i = 0; i < N; i++)
        raw[0][i] = 600, raw[1][i] = 4095, raw[2][i] = 0, raw[3][i] = 51;
    struct e57_field fields[] = {
        doubles("cartesianX", 0),
        doubles("cartesianY", 1),
        doubles("cartesianZ", 2),
        {.name = "colorRed", .type = E57_INTEGER, .most = 65535, .raw = raw[0]},
        {.name = "colorGreen", .type = E57_INTEGER, .most = 65535, .raw = raw[1]},
        {.name = "colorBlue", .type = E57_INTEGER, .most = 65535, .raw = raw[2]},
    };
    load_scans(&(struct e57_scan){"limits", limits, fields, 6, 5, 0}, 1, NULL, &l);
    assert_color(&l, 0, 128, 255, 0);
    loaded_finish(&l);
    /* without limits: a type of more than 8 bits is looked at, and here 12 are used */
    load_scans(&(struct e57_scan){"sight", NULL, fields, 6, 5, 0}, 1, NULL, &l);
    assert_color(&l, 0, 37, 255, 0);
    loaded_finish(&l);
    for (int k = 3; k < 6; k++)
        fields[k].raw = raw[3];
    load_scans(&(struct e57_scan){"dark", NULL, fields, 6, 5, 0}, 1, NULL, &l);
    assert_color(&l, 0, 51, 51, 51);
    loaded_finish(&l);
    /* one of 8 bits is not */
    for (int k = 3; k < 6; k++)
        fields[k].most = 255;
    load_scans(&(struct e57_scan){"type", NULL, fields, 6, 5, 0}, 1, NULL, &l);
    assert_color(&l, 0, 51, 51, 51);
    loaded_finish(&l);
    raw[0][3] = 1200;
    fields[3] = (struct e57_field){.name = "colorRed", .type = E57_INTEGER, .most = 65535, .raw = raw[0]};
    refused_scan(&(struct e57_scan){"beyond", limits, fields, 6, 5, 0}, NULL, SPL_E_INPUT, "red", "point 3 has 1200");
}

static void scans_of_different_limits_agree(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    for (int i = 0; i < N; i++) {
        raw[0][i] = i;
        raw[1][i] = 255;
        value[3][i] = i / 1000.0;
    }
    const char *to_one = "<intensityLimits><intensityMinimum type=\"Float\"/>"
                         "<intensityMaximum type=\"Float\">1</intensityMaximum></intensityLimits>";
    const struct e57_field integers[] = {doubles("cartesianX", 0),
                                         doubles("cartesianY", 1),
                                         doubles("cartesianZ", 2),
                                         {.name = "intensity", .type = E57_INTEGER, .most = 1000, .raw = raw[0]}},
                           floats[] = {doubles("cartesianX", 0), doubles("cartesianY", 1), doubles("cartesianZ", 2),
                                       doubles("intensity", 3)},
                           colors[] = {doubles("cartesianX", 0),
                                       doubles("cartesianY", 1),
                                       doubles("cartesianZ", 2),
                                       {.name = "colorRed", .type = E57_INTEGER, .most = 255, .raw = raw[1]},
                                       {.name = "colorGreen", .type = E57_INTEGER, .most = 255, .raw = raw[1]},
                                       {.name = "colorBlue", .type = E57_INTEGER, .most = 255, .raw = raw[1]}};
    const struct e57_scan scans[] = {{"integers", NULL, integers, 4, N, 0}, {"floats", to_one, floats, 4, N, 0}};
    struct spl_cloud *cloud;
    struct spl_point_batch batch;
    uint8_t shade[2];
    load_scans(scans, 2, NULL, &l);
    loaded_finish(&l);
    assert_int_equal(spl_cloud_open(scratch_path(), NULL, &cloud, NULL), 0);
    assert_int_equal(spl_point_batch_init(&batch, 2 * N, NULL), 0);
    assert_int_equal(spl_cloud_read(cloud, &batch, NULL), 1);
    assert_int_equal(batch.count, 2 * N);
    shade[0] = batch.color[500][0], shade[1] = batch.color[N + 500][0];
    assert_in_range(shade[0], 120, 135);
    assert_int_equal(shade[0], shade[1]);
    spl_cloud_destroy(cloud);
    spl_point_batch_finish(&batch);
    /* with colours in one, the other is grey by its limits */
    const struct e57_scan mixed[] = {{"colours", NULL, colors, 6, 2, 0}, {"floats", to_one, floats, 4, 2, 0}};
    load_scans(mixed, 2, NULL, &l);
    assert_color(&l, 0, 255, 255, 255);
    assert_color(&l, 3, 0, 0, 0);
    loaded_finish(&l);
}

static void classes_of_an_extension(void **state)
{
    struct loaded l;
    (void)state;
    prepare_doubles();
    for (int i = 0; i < N; i++)
        raw[0][i] = i % 7;
    const struct e57_field fields[] = {
        doubles("cartesianX", 0),
        doubles("cartesianY", 1),
        doubles("cartesianZ", 2),
        {.name = "las:classification", .type = E57_INTEGER, .most = 65535, .raw = raw[0]}};
    load_scans(&(struct e57_scan){"classes", NULL, fields, 4, N, 0}, 1, NULL, &l);
    assert_true(l.attributes & SPL_CLOUD_CLASS);
    for (size_t i = 0; i < KEPT; i++)
        assert_int_equal(l.first.classification[i], i % 7);
    loaded_finish(&l);
}

static void fields_that_are_kept(void **state)
{
    struct spl_keep keep;
    struct spl_cloud *cloud;
    struct spl_point_batch batch;
    struct loaded l;
    (void)state;
    prepare_doubles();
    for (int i = 0; i < N; i++)
        raw[0][i] = i % 2, raw[1][i] = i;
    const struct e57_field fields[] = {doubles("cartesianX", 0),
                                       doubles("cartesianY", 1),
                                       doubles("cartesianZ", 2),
                                       doubles("intensity", 3),
                                       {.name = "isIntensityInvalid", .type = E57_INTEGER, .most = 1, .raw = raw[0]},
                                       {.name = "returnIndex", .type = E57_INTEGER, .most = 1, .raw = raw[0]},
                                       {.name = "rowIndex", .type = E57_INTEGER, .most = 999, .raw = raw[1]},
                                       doubles("a:amplitude", 4),
                                       doubles("timeStamp", 5)};
    const struct e57_scan scans[] = {{"all", NULL, fields, 9, 4, 0}, {"none", NULL, fields, 3, 4, 0}};
    load_scans(scans, 2, NULL, &l);
    loaded_finish(&l);
    assert_int_equal(spl_keep_parse(&keep, "amplitude,rowindex,timeStamp", NULL), 0);
    assert_int_equal(spl_cloud_open(scratch_path(), &(struct spl_cloud_options){.keep = &keep}, &cloud, NULL), 0);
    assert_int_equal(spl_point_batch_init(&batch, 8, NULL), 0);
    assert_int_equal(spl_cloud_read(cloud, &batch, NULL), 1);
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    assert_int_equal(info->scalars, 1u << SPL_SCALAR_INTENSITY | 1u << SPL_SCALAR_RETURN | 7u << SPL_SCALAR_KEPT);
    assert_non_null(strstr(info->fields, "a:amplitude"));
    for (size_t i = 0; i < 8; i++) {
        const double expected[5] = {i % 2 ? NAN : value[3][i], (double)(i % 2) + 1, value[4][i], (double)i,
                                    value[5][i]};
        const int scalar[5] = {SPL_SCALAR_INTENSITY, SPL_SCALAR_RETURN, SPL_SCALAR_KEPT, SPL_SCALAR_KEPT + 1,
                               SPL_SCALAR_KEPT + 2};
        for (int k = 0; k < 5; k++) {
            double got = batch.scalar[scalar[k]][i], wanted = i < 4 ? expected[k] : NAN;
            if (got != wanted && !(isnan(got) && isnan(wanted)))
                fail_msg("point %zu, %d: %g instead of %g", i, k, got, wanted);
        }
    }
    spl_point_batch_finish(&batch);
    spl_cloud_destroy(cloud);
}

/* From any place to any later one, over streams that do not keep step. */
static void points_are_skipped_to(void **state)
{
    struct e57_writer w;
    struct spl_source source;
    struct spl_e57_pages pages;
    struct spl_e57_document document;
    struct spl_e57_points points;
    size_t length;
    double got[5];
    (void)state;
    prepare_doubles();
    fill(raw[1], -1000, 4000);
    const struct e57_field fields[] = {
        {.name = "cartesianX", .type = E57_DOUBLE, .values = value[0], .step = 8 * N},
        {.name = "cartesianY", .type = E57_INTEGER, .least = -1000, .most = 4000, .raw = raw[1], .step = 5},
        {.name = "cartesianZ", .type = E57_SINGLE, .values = value[2], .step = 33},
    };
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"skipped", NULL, fields, 3, N, E57_OTHER_PACKETS});
    uint8_t *file = e57_end(&w, NULL, &length);
    write_scratch(file, length);
    free(file);
    assert_int_equal(spl_source_open(&source, scratch_path(), NULL), 0);
    assert_int_equal(spl_e57_pages_init(&pages, &source, NULL), 0);
    assert_int_equal(spl_e57_document_read(&document, &pages, NULL), 0);
    assert_int_equal(spl_e57_points_init(&points, &pages, &document, NULL), 0);
    for (uint64_t step = 1; step < 400; step += 13) {
        assert_int_equal(spl_e57_points_begin(&points, document.scans, NULL), 0);
        for (uint64_t to = 0; to + 5 <= N; to += 5 + step) {
            assert_int_equal(spl_e57_points_skip(&points, to, NULL), 0);
            for (unsigned k = 0; k < 3; k++) {
                assert_int_equal(spl_e57_points_read(&points, SPL_E57_X + k, got, 5, NULL), 0);
                for (size_t i = 0; i < 5; i++)
                    assert_true(got[i] == (k == 1 ? (double)raw[1][to + i] : value[k][to + i]));
            }
            spl_e57_points_take(&points, 5);
        }
    }
    spl_e57_points_finish(&points);
    spl_e57_document_finish(&document);
    spl_e57_pages_finish(&pages);
    spl_source_close(&source);
}

/* Large scans: grey comes from samples all over them, and the first points are read all the same. */
static void grey_of_large_scans(void **state)
{
    enum { MANY = 90000 };
    int64_t *ramp = malloc(MANY * sizeof *ramp);
    struct loaded l;
    (void)state;
    for (int i = 0; i < MANY; i++)
        ramp[i] = i;
    const struct e57_field fields[] = {
        {.name = "cartesianX", .type = E57_INTEGER, .most = MANY, .raw = ramp, .step = 900},
        {.name = "cartesianY", .type = E57_INTEGER, .most = MANY, .raw = ramp, .step = 20000},
        {.name = "cartesianZ", .type = E57_INTEGER, .most = MANY, .raw = ramp, .step = 900},
        {.name = "intensity", .type = E57_INTEGER, .most = MANY, .raw = ramp, .step = 1200},
    };
    const struct e57_scan scans[] = {{"a", NULL, fields, 4, MANY, 0}, {"b", NULL, fields, 4, 30, 0}};
    load_scans(scans, 2, NULL, &l);
    assert_int_equal(l.points, MANY + 30);
    assert_point(&l, 7, 7, 7, 7);
    assert_true(l.sum[0] == MANY / 2 * (MANY - 1.0) + 29 * 15);
    loaded_finish(&l);
    struct spl_cloud *cloud;
    assert_int_equal(spl_cloud_open(scratch_path(), NULL, &cloud, NULL), 0);
    const struct spl_cloud_colors *colors = &spl_cloud_get_info(cloud)->colors;
    assert_int_equal(colors->from, SPL_COLORS_INTENSITY);
    assert_true(fabs(colors->black - 0.01 * MANY) < 0.03 * MANY && fabs(colors->white - 0.99 * MANY) < 0.03 * MANY);
    spl_cloud_destroy(cloud);
    free(ramp);
}

#define METADATA(text) "<coordinateMetadata type=\"String\"><![CDATA[" text "]]></coordinateMetadata>"
#define UTM(unit, epsg)                                                                                                \
    "PROJCS[\"UTM 32\",GEOGCS[\"ETRS89\",DATUM[\"ETRS89\",SPHEROID[\"GRS 1980\",6378137,298.257222101]],PRIMEM["       \
    "\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"]," unit epsg "]"

/* Metres by definition: a system in other units is not that of the coordinates. */
static void coordinates_are_in_metres(void **state)
{
    static const struct {
        const char *root, *name;
        uint32_t epsg;
        const char *lost; /* NULL: nothing, or that of a name alone */
    } rows[] = {
        {NULL, "", 0},
        {METADATA(" "), "", 0},
        {METADATA(UTM("UNIT[\"metre\",1]", ",AUTHORITY[\"EPSG\",\"25832\"]")), "UTM 32", 25832},
        {METADATA(UTM("UNIT[\"foot\",0.3048]", "")), "", 0, "its coordinate system (UTM 32) is in ft, and E57"},
        {METADATA("GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
                  "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]"),
         "", 0, "its coordinate system (WGS 84) is in degrees, and E57"},
        {METADATA("\nurn:ogc:def:crs:EPSG::25832 "), "", 25832},
        {METADATA("EPSG:25833\n"), "", 25833},
        {METADATA("EPSG:2994"), "", 0, "its coordinate system (EPSG:2994) is in ft, and E57 always in metres: it is"},
        {METADATA("EPSG:foo"), "EPSG:foo", 0},
        {METADATA("our own grid"), "our own grid", 0}};
    (void)state;
    prepare_doubles();
    const struct e57_field fields[] = {doubles("cartesianX", 0), doubles("cartesianY", 1), doubles("cartesianZ", 2)};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_cloud *cloud;
        struct loaded l;
        load_scans(&(struct e57_scan){"crs", NULL, fields, 3, 2, 0}, 1, rows[i].root, &l);
        loaded_finish(&l);
        assert_int_equal(spl_cloud_open(scratch_path(), NULL, &cloud, NULL), 0);
        const struct spl_cloud_coordinates *crs = &spl_cloud_get_info(cloud)->coordinates;
        assert_string_equal(crs->name, rows[i].name);
        assert_int_equal(crs->epsg, rows[i].epsg);
        assert_true(crs->unit_m == 1 && !crs->angles);
        assert_true((crs->wkt && !crs->epsg) == (rows[i].name[0] && !crs->epsg)); /* a name alone is kept */
        assert_true(rows[i].lost ? crs->lost == strstr(crs->lost, rows[i].lost)
                                 : !crs->lost[0] == !(rows[i].name[0] && !crs->epsg));
        spl_cloud_destroy(cloud);
    }
}

static void a_prototype_may_be_nested_and_repeat_itself(void **state)
{
    static const char xml[] =
        "<e57Root><data3D><vectorChild><name>%s</name><points type=\"CompressedVector\" fileOffset=\"0\" "
        "recordCount=\"0\"><prototype type=\"Structure\"><a type=\"Structure\"><cartesianX type=\"Float\"/></a>"
        "</prototype></points></vectorChild></data3D></e57Root>";
    struct loaded l;
    size_t length;
    (void)state;
    uint8_t *file = e57_make(xml, sizeof xml - 1, sizeof xml - 1, &length);
    load_file(file, length, 10, &l);
    assert_int_equal(l.code, 0);
    assert_int_equal(l.points, 0);
    loaded_finish(&l);
}

static uint8_t *a_file(size_t *length)
{
    struct e57_writer w;
    prepare_doubles();
    const struct e57_field fields[] = {doubles("cartesianX", 0), doubles("cartesianY", 1), doubles("cartesianZ", 2)};
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"whole", NULL, fields, 3, N, 0});
    return e57_end(&w, NULL, length);
}

static void set(uint8_t *file, size_t at, uint64_t number, int bytes)
{
    for (int i = 0; i < bytes; i++)
        file[at + (size_t)i] = (uint8_t)(number >> 8 * i);
}

/* One number of the header, a section or a packet is changed, the checksums made right. */
static void changed(size_t at, uint64_t number, int bytes, int code, const char *field, const char *part)
{
    size_t length;
    uint8_t *file = a_file(&length);
    set(file, at, number, bytes);
    e57_seal(file, length);
    refused_file(file, length, code, field, part);
}

static void what_the_header_must_not_say(void **state)
{
    size_t length;
    uint8_t *file = a_file(&length);
    (void)state;
    refused_file(file, 40, SPL_E_INPUT, "", "header of 48 bytes");
    file = a_file(&length);
    refused_file(file, length - 1, SPL_E_INPUT, "file length", "cut off");
    file = a_file(&length);
    file[length - 1] ^= 1;
    refused_file(file, length, SPL_E_INPUT, "checksum", "CRC-32C");
    file = a_file(&length);
    file[2000] ^= 1;
    refused_file(file, length, SPL_E_INPUT, "checksum", "offset 1024");
    changed(8, 2, 4, SPL_E_UNSUPPORTED, "version", "2.0");
    changed(40, 512, 8, SPL_E_UNSUPPORTED, "page size", "512");
    changed(16, 1000, 8, SPL_E_INPUT, "file length", "1000");
    changed(24, 1021, 8, SPL_E_INPUT, "XML offset", "1021");
    changed(24, 1ull << 60, 8, SPL_E_INPUT, "XML offset", "outside");
    changed(32, 0, 8, SPL_E_INPUT, "XML length", "0 bytes");
    changed(32, UINT64_MAX, 8, SPL_E_INPUT, "XML length", "do not fit");
}

static void what_sections_and_packets_must_not_say(void **state)
{
    (void)state; /* the section lies at 48, its first packet at 80 */
    changed(48, 2, 1, SPL_E_INPUT, "section", "2 is no section of points");
    changed(56, 31, 8, SPL_E_INPUT, "section length", "31 bytes");
    changed(56, 1ull << 62, 8, SPL_E_INPUT, "section length", "the file goes on");
    changed(56, 2000, 8, SPL_E_INPUT, "recordCount", "do not fit");
    changed(64, 48, 8, SPL_E_INPUT, "data offset", "48");
    changed(64, 1023, 8, SPL_E_INPUT, "data offset", "1023");
    changed(80, 3, 1, SPL_E_INPUT, "packet type", "3");
    changed(80, 2, 1, SPL_E_INPUT, "cartesianX", "of its 1000 values"); /* one packet less */
    changed(82, 65535, 2, SPL_E_INPUT, "packet length", "65536");
    changed(82, 1, 2, SPL_E_INPUT, "packet length", "2");
    changed(84, 4, 2, SPL_E_INPUT, "bytestreams", "4");
    changed(86, 60000, 2, SPL_E_INPUT, "bytestreams", "longer");
}

static void refused_xml(const char *xml, const char *field, const char *part)
{
    size_t length;
    uint8_t *file = e57_make(xml, strlen(xml), strlen(xml), &length);
    refused_file(file, length, SPL_E_INPUT, field, part);
}

static void what_the_xml_must_not_say(void **state)
{
#define SCAN(inside) "<e57Root><data3D><vectorChild>" inside "</vectorChild></data3D></e57Root>"
#define POINTS(attributes, fields)                                                                                     \
    SCAN("<points type=\"CompressedVector\" " attributes "><prototype>" fields "</prototype></points>")
#define AT "fileOffset=\"48\" recordCount=\"1\""
    (void)state;
    refused_xml("<e57Root>", "", "line 1");
    refused_xml("<other/>", "e57Root", "other");
    refused_xml("<!DOCTYPE e57Root [<!ENTITY a \"aaaa\">]><e57Root>&a;</e57Root>", "DOCTYPE", "none is taken");
    refused_xml("<!DOCTYPE e57Root SYSTEM \"/etc/passwd\"><e57Root/>", "DOCTYPE", "none is taken");
    refused_xml(SCAN("<points/>"), "points", "CompressedVector");
    enum { token = 3 << 19 };
    char *long_one = calloc(token + 64, 1); /* expat would look at it anew with each block */
    strcpy(long_one, "<e57Root a=\"");
    memset(long_one + strlen(long_one), 'x', token);
    refused_xml(strcat(long_one, "\"/>"), "", "more than 1048576 bytes");
    free(long_one);
    refused_xml(SCAN("<points type=\"CompressedVector\" recordCount=\"1\"/>"), "points", "fileOffset is missing");
    refused_xml(POINTS("fileOffset=\"48\" recordCount=\"-1\"", ""), "recordCount", "-1");
    refused_xml(POINTS("fileOffset=\"48\" recordCount=\"9223372036854775808\"", ""), "recordCount", "64 bits");
    refused_xml(POINTS("fileOffset=\"48\" recordCount=\"1e3\"", ""), "recordCount", "1e3");
    refused_xml(POINTS(AT, ""), "prototype", "neither cartesianX");
    refused_xml(POINTS(AT, "<cartesianX/>"), "cartesianX", "type ''");
    refused_xml(POINTS(AT, "<cartesianX type=\"Blob\"/>"), "cartesianX", "Blob");
    refused_xml(POINTS(AT, "<a type=\"Integer\" minimum=\"2\" maximum=\"1\"/>"), "a", "above maximum");
    refused_xml(POINTS(AT, "<a type=\"Integer\" minimum=\"x\"/>"), "minimum", "'x'");
    refused_xml(POINTS(AT, "<a type=\"ScaledInteger\" scale=\"0\"/>"), "a", "scale 0");
    refused_xml(POINTS(AT, "<a type=\"ScaledInteger\" scale=\"inf\"/>"), "a", "scale inf");
    refused_xml(POINTS(AT, "<a type=\"Float\" precision=\"half\"/>"), "a", "half");
    refused_xml(SCAN("<pose><rotation><w type=\"Float\">0</w></rotation></pose>"), "rotation", "no rotation");
    refused_xml(SCAN("<pose><rotation><w type=\"Float\">one</w></rotation></pose>"), "w", "'one'");
    refused_xml(SCAN("<pose><translation><x type=\"Float\">nan</x></translation></pose>"), "translation", "finite");
    refused_xml(POINTS("fileOffset=\"1022\" recordCount=\"1\"",
                       "<cartesianX type=\"Float\"/><cartesianY type=\"Float\"/><cartesianZ type=\"Float\"/>"),
                "fileOffset", "1022");
    char deep[4096] = "<e57Root>";
    for (int i = 0; i < 40; i++)
        strcat(deep, "<a>");
    refused_xml(deep, "", "deep");
}

static void a_count_without_bits_is_bounded(void **state)
{
    (void)state;
    raw[0][0] = 7;
    const struct e57_field fields[] = {
        {.name = "cartesianX", .type = E57_INTEGER, .least = 7, .most = 7, .raw = raw[0]},
        {.name = "cartesianY", .type = E57_INTEGER, .least = 7, .most = 7, .raw = raw[0]},
        {.name = "cartesianZ", .type = E57_INTEGER, .least = 7, .most = 7, .raw = raw[0]}};
    struct loaded l;
    load_scans(&(struct e57_scan){"one", NULL, fields, 3, 1, 0}, 1, NULL, &l);
    assert_point(&l, 0, 7, 7, 7);
    loaded_finish(&l);
    struct e57_field empty[3];
    for (int k = 0; k < 3; k++) {
        empty[k] = fields[k];
        empty[k].raw = NULL; /* there are no bits to take from it */
    }
    refused_scan(&(struct e57_scan){"many", NULL, empty, 3, 1 << 20, 0}, NULL, SPL_E_INPUT, "recordCount", "0 bits");
}

/* Each scan's count fits its packets, but they are the same ones. */
static void scans_that_share_their_packets_are_bounded(void **state)
{
    struct e57_writer w;
    struct loaded l;
    size_t length;
    (void)state;
    prepare_doubles();
    const struct e57_field fields[] = {doubles("cartesianX", 0), doubles("cartesianY", 1), doubles("cartesianZ", 2)};
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"once", NULL, fields, 3, N, 0});
    char *one = w.scans, *many = NULL;
    for (int i = 0; i < 6; i++) {
        char *more;
        assert_true(asprintf(&more, "%s%s", many ? many : "", one) > 0);
        free(many);
        many = more;
    }
    free(one);
    w.scans = many;
    uint8_t *file = e57_end(&w, NULL, &length);
    load_file(file, length, 77, &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    assert_string_equal(l.err.field, "recordCount");
    loaded_finish(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(checksums_agree),
        cmocka_unit_test(every_width_of_integers),
        cmocka_unit_test(floats_of_both_kinds_beside_streams_that_are_not_read),
        cmocka_unit_test(streams_that_do_not_keep_step),
        cmocka_unit_test(states_and_misses),
        cmocka_unit_test(spherical_coordinates_in_the_pose_of_their_scanner),
        cmocka_unit_test(stations_are_the_scans_that_have_a_viewpoint),
        cmocka_unit_test(normals_turn_with_their_scan_whatever_their_prefix),
        cmocka_unit_test(colours_by_limits_by_type_and_by_sight),
        cmocka_unit_test(scans_of_different_limits_agree),
        cmocka_unit_test(classes_of_an_extension),
        cmocka_unit_test(fields_that_are_kept),
        cmocka_unit_test(points_are_skipped_to),
        cmocka_unit_test(grey_of_large_scans),
        cmocka_unit_test(coordinates_are_in_metres),
        cmocka_unit_test(a_prototype_may_be_nested_and_repeat_itself),
        cmocka_unit_test(what_the_header_must_not_say),
        cmocka_unit_test(what_sections_and_packets_must_not_say),
        cmocka_unit_test(what_the_xml_must_not_say),
        cmocka_unit_test(scans_that_share_their_packets_are_bounded),
        cmocka_unit_test(a_count_without_bits_is_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
