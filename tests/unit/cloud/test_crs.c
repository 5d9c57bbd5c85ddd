/* Coordinate systems as headers write them: what is read of WKT and of GeoTIFF keys, and what is no reason to believe
 * either. Real files say what they say; without them the rest is tested. */
#include "cloud_test.h"

#include <math.h>

#include "cloud/crs.h"
#include "geom/unit.h"

#define UTM(code, unit, number)                                                                                        \
    "PROJCS[\"P\",GEOGCS[\"G\",DATUM[\"D\",SPHEROID[\"S\",6378137,298.25]],PRIMEM[\"Greenwich\",0],"                   \
    "UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4269\"]],PROJECTION[\"Transverse_Mercator\"],"           \
    "PARAMETER[\"scale_factor\",0.9996],UNIT[" unit number "]" code "]"
#define HEIGHT(unit, code) "VERT_CS[\"H\",VERT_DATUM[\"V\",2005,AUTHORITY[\"EPSG\",\"5103\"]],UNIT[" unit "]" code "]"

/* "crs | unit | unit of heights", the first "-" where nothing is kept, "wkt" where it is the text. */
static const char *show(const struct spl_cloud_coordinates *crs)
{
    static char text[512];
    char unit[SPL_UNIT_TEXT_MAX], height[SPL_UNIT_TEXT_MAX], *kept = spl_crs_print(crs);
    snprintf(text, sizeof text, "%.100s | %s | %s", !kept ? "-" : crs->wkt && !strcmp(kept, crs->wkt) ? "wkt" : kept,
             crs->angles ? "angles" : spl_unit_print(crs->unit_m, unit), spl_unit_print(crs->height_unit_m, height));
    free(kept);
    return text;
}

static void wkt_is_read(void **state)
{
    (void)state;
    static const struct {
        const char *wkt, *said;
    } rows[] = {
        {UTM(",AUTHORITY[\"EPSG\",\"26919\"]", "\"metre\"", ",1,AUTHORITY[\"EPSG\",\"9001\"]"),
         "EPSG:26919 | m | unknown"},
        {UTM("", "\"foot\"", ",0.3048"), "wkt | ft | unknown"},
        {UTM("", "\"Foot_US\"", ",0.3048006096012192"), "wkt | us-ft | unknown"},
        {UTM(",AUTHORITY[\"EPSG\",\"2994\"]", "\"foot\"", ",0.3048"), "EPSG:2994 | ft | unknown"},
        /* a number that stands for another unit is not the system */
        {UTM(",AUTHORITY[\"EPSG\",\"26919\"]", "\"foot\"", ",0.3048"), "wkt | ft | unknown"},
        {UTM(",AUTHORITY[\"ESRI\",\"102100\"]", "\"metre\"", ",1"), "wkt | m | unknown"},
        {UTM(",AUTHORITY[\"EPSG\",\"7\"]", "\"metre\"", ",1"), "wkt | m | unknown"},
        {UTM(",AUTHORITY[\"EPSG\",\"26919.5\"]", "\"metre\"", ",1"), "wkt | m | unknown"},
        {UTM(",AUTHORITY[\"EPSG\",\"1e300\"]", "\"metre\"", ",1"), "wkt | m | unknown"},
        /* a factor that no unit has */
        {UTM("", "\"odd\"", ",0"), "wkt | unknown | unknown"},
        {UTM("", "\"odd\"", ",-1"), "wkt | unknown | unknown"},
        {UTM("", "\"odd\"", ",1e400"), "wkt | unknown | unknown"},
        {UTM("", "\"link\"", ",0.201168"), "wkt | 0.201168 m | unknown"},
        /* a foot that lost its factor */
        {UTM("", "\"US survey foot\"", ",1.0"), "wkt | us-ft | unknown"},
        {UTM("", "\"Foot\"", ",1"), "wkt | ft | unknown"},
        {UTM("", "\"metre\"", ""), "wkt | unknown | unknown"},
        {"COMPD_CS[\"C\"," UTM(",AUTHORITY[\"EPSG\",\"2992\"]", "\"foot\"", ",0.3048") "," HEIGHT(
             "\"US survey foot\",0.304800609601219", ",AUTHORITY[\"EPSG\",\"6360\"]") "]",
         "EPSG:2992+EPSG:6360 | ft | us-ft"},
        {"COMPD_CS[\"C\"," UTM(",AUTHORITY[\"EPSG\",\"25832\"]", "\"metre\"",
                               ",1") "," HEIGHT("\"metre\",1", "") ",AUTHORITY[\"EPSG\",\"5555\"]]",
         "EPSG:25832 | m | m"},
        {"COMPD_CS[\"C\"," UTM("", "\"metre\"", ",1") "," HEIGHT("\"metre\",1", "") ",AUTHORITY[\"EPSG\",\"5555\"]]",
         "EPSG:5555 | m | m"},
        /* heights within the projected system, with a number that is in metres */
        {"PROJCS[\"P\",UNIT[\"US survey foot\",0.3048006096012192],AUTHORITY[\"EPSG\",\"2903\"],"
         "VERTCS[\"V\",UNIT[\"US survey foot\",1.0],AUTHORITY[\"EPSG\",\"5703\"]]]",
         "EPSG:2903 | us-ft | us-ft"},
        /* heights beside it, as Esri writes them */
        {" PROJCS (\"P\", UNIT(\"Meter\",1.0)) , VERTCS(\"V\",UNIT(\"Foot\",0.3048)) \n", "wkt | m | ft"},
        {"VERT_CS[\"V\",UNIT[\"Foot\",0.3048]]", "wkt | unknown | ft"},
        {"GEOGCS[\"WGS 84\",UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4326\"]]",
         "EPSG:4326 | angles | unknown"},
        {"GEOCCS[\"WGS 84\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"4978\"]]", "EPSG:4978 | m | unknown"},
        {"LOCAL_CS[\"site\",UNIT[\"metre\",1]]", "wkt | m | unknown"},
        /* the second edition */
        {"PROJCRS[\"RGF93\",BASEGEOGCRS[\"RGF93\",DATUM[\"D\",ELLIPSOID[\"E\",6378137,298,LENGTHUNIT[\"metre\",1]]],"
         "ID[\"EPSG\",4171]],CONVERSION[\"L\",PARAMETER[\"Easting\",7e5,LENGTHUNIT[\"foot\",0.3048]]],"
         "CS[Cartesian,2,ID[\"EPSG\",4499]],AXIS[\"Easting (X)\",east],AXIS[\"Northing (Y)\",north],"
         "LENGTHUNIT[\"metre\",1,ID[\"EPSG\",9001]],ID[\"EPSG\",2154]]",
         "EPSG:2154 | m | unknown"},
        {"PROJCRS[\"P\",CS[Cartesian,3],AXIS[\"E\",east,ORDER[1],LENGTHUNIT[\"foot\",0.3048]],"
         "AXIS[\"N\",north,LENGTHUNIT[\"foot\",0.3048]],AXIS[\"h\",up,LENGTHUNIT[\"metre\",1]]]",
         "wkt | ft | m"},
        {"COMPOUNDCRS[\"C\",PROJCRS[\"P\",CS[Cartesian,2],LENGTHUNIT[\"metre\",1],ID[\"EPSG\",25832]],"
         "VERTCRS[\"V\",VDATUM[\"D\"],CS[vertical,1],AXIS[\"H\",up],LENGTHUNIT[\"metre\",1],ID[\"EPSG\",7837]]]",
         "EPSG:25832+EPSG:7837 | m | m"},
        {"BOUNDCRS[SOURCECRS[PROJCRS[\"P\",LENGTHUNIT[\"foot\",0.3048]]],TARGETCRS[GEOGCRS[\"WGS 84\","
         "ID[\"EPSG\",4326]]],ABRIDGEDTRANSFORMATION[\"T\"]]",
         "wkt | ft | unknown"},
        {"GEODCRS[\"WGS 84\",CS[Cartesian,3],AXIS[\"(X)\",geocentricX],LENGTHUNIT[\"metre\",1],ID[\"EPSG\",4978]]",
         "EPSG:4978 | m | unknown"},
        {"GEODCRS[\"WGS 84\",CS[ellipsoidal,2],ANGLEUNIT[\"degree\",0.0174],ID[\"EPSG\",4326]]",
         "EPSG:4326 | angles | unknown"},
        {"GEOGCRS[\"WGS 84\",CS[ellipsoidal,3],AXIS[\"lat\",north,ANGLEUNIT[\"degree\",0.0174]],"
         "AXIS[\"lon\",east,ANGLEUNIT[\"degree\",0.0174]],AXIS[\"h\",up,LENGTHUNIT[\"foot\",0.3048]]]",
         "wkt | angles | ft"},
        /* the first of two counts */
        {"PROJCS[\"P\",UNIT[\"metre\",1]],PROJCS[\"Q\",UNIT[\"foot\",0.3048]]", "wkt | m | unknown"},
        {"COMPD_CS[\"C\",PROJCS[\"P\",UNIT[\"metres\",1.0]]], VERT_CS[\"V\", UNIT [ \"metres\", 1 ] ] ]",
         "wkt | m | m"},
        {"PROJCS[\"say \"\"hi\"\"\",GEOGCS[],UNIT[\"metre\",1,]]", NULL},
        {"PROJCS[\"say \"\"hi\"\"\",GEOGCS[],UNIT[\"metre\",1]]", "wkt | m | unknown"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_cloud_coordinates crs = {.step = {1, 2, 3}};
        struct spl_error err = {0};
        int code = spl_crs_read_wkt(rows[i].wkt, strlen(rows[i].wkt), &crs, &err);
        if (code ? rows[i].said != NULL : !rows[i].said || strcmp(show(&crs), rows[i].said) != 0)
            fail_msg("row %zu: %s\n%s", i, code ? err.message : show(&crs), rows[i].wkt);
        assert_true(crs.step[2] == 3);
        spl_crs_finish(&crs);
    }
}

static void odd_wkt_is_refused_where_it_is_odd(void **state)
{
    (void)state;
    static char deep[4096], broad[SPL_CRS_TEXT_MAX + 2];
    for (int i = 0; i < 100; i++)
        strcat(deep, "PROJCS[");
    memset(broad, ' ', sizeof broad);
    static const struct {
        const char *wkt;
        size_t length;
        const char *where, *why;
    } rows[] = {
        {"", 0, "byte 0", "no keyword"},
        {"   ", 3, "byte 3", "no keyword"},
        {"nothing", 7, "byte 7", "no bracket"},
        {"PROJCS", 6, "byte 6", "no bracket"},
        {"PROJCS[\"no end", 14, "byte 7", "not closed"},
        {"PROJCS[\"P\"", 10, "byte 10", "before its brackets"},
        {"PROJCS[\"P\",", 11, "byte 11", "before its brackets"},
        {"PROJCS[", 7, "byte 7", "before its brackets"},
        {"PROJCS[\"P\" \"Q\"]", 15, "byte 11", "neither a comma"},
        {"PROJCS[\"P\",,1]", 14, "byte 11", "neither a text"},
        {"PROJCS[\"P\",--1]", 15, "byte 11", "no number"},
        {"PROJCS[\"P\"],", 12, "byte 12", "no keyword"},
        {"\"PROJCS\"", 8, "byte 0", "no keyword"},
        {"DATUM[\"D\"]", 10, "byte 10", "names no coordinate system"},
        {"PROJCS[\"P\0\",UNIT[\"m\",1]]", 25, "byte 7", "not closed"}, /* ends at the NUL */
        {deep, sizeof deep, "byte 231", "more than 32 deep"},
        {broad, sizeof broad, "", "more than 65536 bytes"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_cloud_coordinates crs = {.epsg = 25832, .unit_m = 1};
        struct spl_error err = {0};
        assert_int_equal(spl_crs_read_wkt(rows[i].wkt, rows[i].length, &crs, &err), SPL_E_INPUT);
        if (!strstr(err.message, rows[i].where) || !strstr(err.message, rows[i].why))
            fail_msg("row %zu: %s", i, err.message);
        assert_string_equal(show(&crs), "EPSG:25832 | m | unknown");
    }
}

struct keys {
    uint16_t entries[16][4]; /* until a key of 0 */
    double doubles[4];
    const char *text;
};

static const char *read_keys(const struct keys *rows, size_t promised, char name[64])
{
    uint8_t bytes[8 + sizeof rows->entries];
    struct spl_cloud_coordinates crs = {0};
    uint16_t head[4] = {1, 1, 0, 0};
    while (rows->entries[head[3]][0])
        head[3]++;
    struct spl_crs_keys keys = {bytes,
                                (const uint8_t *)rows->doubles,
                                (const uint8_t *)rows->text,
                                8 + 8 * (size_t)head[3],
                                sizeof rows->doubles,
                                rows->text ? strlen(rows->text) : 0};
    memcpy(bytes + 8, rows->entries, sizeof rows->entries);
    head[3] = promised ? (uint16_t)promised : head[3];
    memcpy(bytes, head, sizeof head); /* files are little-endian, as these machines */
    spl_crs_read_keys(&keys, &crs);
    snprintf(name, 64, "%s", crs.name);
    const char *said = show(&crs);
    spl_crs_finish(&crs);
    return said;
}

static void keys_are_read(void **state)
{
    (void)state;
    static const struct {
        struct keys keys;
        const char *said, *name;
    } rows[] = {
        {{.entries = {{1024, 0, 1, 1}, {3072, 0, 1, 25832}, {3076, 0, 1, 9001}}}, "EPSG:25832 | m | unknown", ""},
        /* the number says the unit */
        {{.entries = {{3072, 0, 1, 2994}}}, "EPSG:2994 | ft | unknown", ""},
        {{.entries = {{3072, 0, 1, 2276}}}, "EPSG:2276 | us-ft | unknown", ""},
        {{.entries = {{3072, 0, 1, 6580}, {1024, 0, 1, 1}, {4096, 0, 1, 5703}}}, "EPSG:6580+EPSG:5703 | m | m", ""},
        {{.entries = {{3072, 0, 1, 6588}, {4096, 0, 1, 6360}}}, "EPSG:6588+EPSG:6360 | us-ft | us-ft", ""},
        /* a number that contradicts the unit beside it is none */
        {{.entries = {{3072, 0, 1, 25832}, {3076, 0, 1, 9002}}}, "- | ft | unknown", ""},
        {{.entries = {{3072, 0, 1, 25832}, {4096, 0, 1, 5703}, {4099, 0, 1, 9003}}}, "EPSG:25832 | m | us-ft", ""},
        /* heights by the numbers of GeoTIFF's first edition */
        {{.entries = {{3072, 0, 1, 2903}, {3076, 0, 1, 9003}, {4096, 0, 1, 5103}, {4099, 0, 1, 9003}}},
         "EPSG:2903 | us-ft | us-ft", ""},
        {{.entries = {{3072, 0, 1, 32767}, {3076, 0, 1, 9001}, {1026, 34737, 9, 0}}, .text = "site A  |"},
         "- | m | unknown", "site A"}, /* a field of fixed length */
        {{.entries = {{1024, 0, 1, 2}, {2048, 0, 1, 4326}, {2054, 0, 1, 9102}, {2049, 34737, 7, 0}}, .text = "WGS 84|"},
         "EPSG:4326 | angles | unknown", "WGS 84"},
        {{.entries = {{2048, 0, 1, 4326}}}, "EPSG:4326 | angles | unknown", ""},
        {{.entries = {{1024, 0, 1, 2}, {2048, 0, 1, 32767}}}, "- | angles | unknown", ""},
        {{.entries = {{1024, 0, 1, 3}, {2048, 0, 1, 4978}}}, "EPSG:4978 | m | unknown", ""},
        /* a system of its own: that of the base is not taken for it */
        {{.entries = {{1024, 0, 1, 1}, {1026, 34737, 5, 3}, {2048, 0, 1, 4269}, {3072, 0, 1, 32767},
                      {3076, 0, 1, 9002}},
          .text = "ab|site|"},
         "- | ft | unknown", "site"},
        {{.entries = {{3072, 0, 1, 32767}, {3076, 0, 1, 32767}, {3077, 34736, 1, 3}}, .doubles = {0, 0, 0, 0.201168}},
         "- | 0.201168 m | unknown", ""},
        {{.entries = {{3072, 0, 1, 32767}, {3076, 0, 1, 32767}, {3077, 34736, 1, 4}}}, "- | unknown | unknown", ""},
        {{.entries = {{3072, 0, 1, 32767}, {3076, 0, 1, 32767}, {3077, 34736, 1, 0}}, .doubles = {NAN}},
         "- | unknown | unknown", ""},
        {{.entries = {{1026, 34737, 65535, 65535}, {3073, 34737, 65535, 1}, {3076, 0, 1, 9001}}, .text = "xy"},
         "- | m | unknown", "y"},
        {{.entries = {{3076, 0, 1, 65535}, {4096, 0, 1, 32767}, {4099, 0, 1, 9001}}}, "- | unknown | m", ""},
        {{.entries = {{3072, 0, 1, 40000}}}, "- | unknown | unknown", ""},
    };
    char name[64];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *said = read_keys(&rows[i].keys, 0, name);
        if (strcmp(said, rows[i].said) != 0 || strcmp(name, rows[i].name) != 0)
            fail_msg("row %zu: %s, %s", i, said, name);
    }
    assert_string_equal(read_keys(&rows[0].keys, 60000, name), rows[0].said); /* more than there are */
    assert_string_equal(read_keys(&rows[3].keys, 1, name), "EPSG:6580 | m | unknown");
    struct spl_cloud_coordinates crs = {0};
    spl_crs_read_keys(&(struct spl_crs_keys){(const uint8_t *)"\1\0\1\0\0\0\xff", NULL, NULL, 7, 0, 0}, &crs);
    assert_string_equal(show(&crs), "- | unknown | unknown");
}

/* Of a name that stands alone. */
static void names_are_kept(void **state)
{
    (void)state;
    static const struct {
        struct spl_cloud_coordinates crs;
        const char *wkt, *lost;
    } rows[] = {
        {{.name = "site", .unit_m = 1}, "LOCAL_CS[\"site\",UNIT[\"metre\",1]]", "the name is kept (site), but not how"},
        {{.name = "say \"hi\"", .unit_m = 0.3048},
         "LOCAL_CS[\"say \"\"hi\"\"\",UNIT[\"foot\",0.30480000000000002]]",
         "the name is kept (say \"hi\")"},
        {{.name = "links", .unit_m = 0.201168}, "LOCAL_CS[\"links\",UNIT[\"unit\",0.20116800000000001]]", "links"},
        {{.name = "site"}, "LOCAL_CS[\"site\"]", "site"},
        {{.name = "unnamed", .unit_m = 1}, NULL, ""},
        {{.name = "WGS 84", .angles = true}, NULL, ""},
        {{.name = "ETRS89 / UTM 32N", .epsg = 25832, .unit_m = 1}, NULL, ""},
        {{.name = "", .unit_m = 1}, NULL, ""},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_cloud_coordinates crs = rows[i].crs, again = {0};
        struct spl_error err = {0};
        spl_crs_keep_name(&crs);
        if (rows[i].wkt ? !crs.wkt || strcmp(crs.wkt, rows[i].wkt) != 0 : crs.wkt != NULL)
            fail_msg("row %zu: %s", i, crs.wkt);
        assert_true(rows[i].lost[0] ? strstr(crs.lost, rows[i].lost) != NULL : !crs.lost[0]);
        if (crs.wkt) { /* it can be read */
            assert_int_equal(spl_crs_read_wkt(crs.wkt, strlen(crs.wkt), &again, &err), 0);
            assert_true(crs.unit_m == 0 || spl_unit_is_same(again.unit_m, crs.unit_m));
            assert_int_equal(again.name[0], crs.name[0]);
        }
        spl_crs_finish(&again);
        spl_crs_finish(&crs);
    }
}

static void what_users_say(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said, *refused;
    } rows[] = {
        {"EPSG:25832", "EPSG:25832 | m | unknown", NULL},
        {"epsg:2994+EPSG:6360", "EPSG:2994+EPSG:6360 | ft | us-ft", NULL},
        {"EPSG:25832+5783", "EPSG:25832+EPSG:5783 | m | m", NULL},
        {"EPSG:7415", "EPSG:7415 | m | unknown", NULL},
        {"EPSG:4326", "EPSG:4326 | angles | unknown", NULL},
        {"EPSG:0", NULL, "EPSG:0 is no coordinate system"},
        {"EPSG:25832+EPSG:0", NULL, "EPSG:0 is no coordinate system of heights"},
        {"EPSG:25832+25833", NULL, "EPSG:25833 is no coordinate system of heights"},
        {"EPSG:25832+EPSG:4978", NULL, "EPSG:4978 is no coordinate system of heights"},
        {"EPSG:5773", NULL, "EPSG:5773 is one of heights alone: name that of x and y before it"},
        {"EPSG:5783+EPSG:25832", NULL, "EPSG:5783 is one of heights alone"},
        {"EPSG:4978", NULL, "EPSG:4978 counts from the middle of the earth, and z is not up there"},
        {"EPSG:", NULL, "takes EPSG and a number"},
        {"EPSG:25832x", NULL, "takes EPSG and a number"},
        {"EPSG:-25832", NULL, "takes EPSG and a number"},
        {"EPSG:99999999999999999999", NULL, "takes EPSG and a number"},
        {"EPSG:4294967297", NULL, "takes EPSG and a number"},
        {"EPSG:25832+", NULL, "takes EPSG and a number"},
        {"EPSG:12", NULL, "EPSG:12 is no coordinate system"},
        {"EPSG:25832+EPSG:4326", NULL, "EPSG:4326 is no coordinate system of heights"},
        {"/nonexistent/x.prj", NULL, "there is no file"},
        {"25832", NULL, "takes EPSG and a number"},
        {"/tmp", NULL, "no regular file"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_cloud_coordinates crs = {0};
        struct spl_error err = {0};
        int code = spl_crs_read_option(rows[i].text, &crs, &err);
        if (rows[i].said ? code || strcmp(show(&crs), rows[i].said) != 0
                         : !code || (!strstr(err.message, rows[i].refused) && !strstr(err.message, "is not a regular")))
            fail_msg("%s: %s", rows[i].text, code ? err.message : show(&crs));
        spl_crs_finish(&crs);
    }
    struct bytes b = {.length = 0};
    put_text(&b, "PROJCS[\"P\",\n  UNIT[\"foot\",0.3048]]\n");
    FILE *f = fopen(scratch_path(), "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(b.data, 1, b.length, f), b.length);
    assert_int_equal(fclose(f), 0);
    struct spl_cloud_coordinates crs = {0};
    struct spl_error err = {0};
    assert_int_equal(spl_crs_read_option(scratch_path(), &crs, &err), 0);
    assert_string_equal(show(&crs), "wkt | ft | unknown");
    assert_null(strchr(crs.wkt, '\n'));
    spl_crs_finish(&crs);
    assert_int_equal(truncate(scratch_path(), 20), 0);
    assert_int_equal(spl_crs_read_option(scratch_path(), &crs, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "byte 19"));
}

/* From the register, of every kind. */
static void numbers_say_units(void **state)
{
    (void)state;
    static const struct {
        uint32_t epsg;
        double metres; /* -1: angles */
    } rows[] = {{25832, 1}, {28992, 1}, {2154, 1}, {3857, 1}, {2222, 0.3048}, {2223, 0.3048}, {2992, 0.3048},
                {2993, 1}, {2994, 0.3048}, {2991, 1}, {2276, 1200.0 / 3937}, {2278, 1200.0 / 3937},
                {2263, 1200.0 / 3937}, {32617, 1}, {32667, 1200.0 / 3937}, {32058, 1200.0 / 3937}, {4326, -1},
                {4269, -1}, {4978, 1}, {4979, -1}, {7415, 1}, {5703, 1}, {6360, 1200.0 / 3937}, {8228, 0.3048},
                {29371, 1.0000135965}, {2314, 0.3047972654}, {900913, 1}, {32767, 0}, {0, 0}, {1999, 0}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        bool angles;
        double metres = spl_crs_get_unit(rows[i].epsg, &angles);
        if (angles ? rows[i].metres != -1 : fabs(metres - rows[i].metres) > 1e-12)
            fail_msg("EPSG:%u: %g%s", rows[i].epsg, metres, angles ? " angles" : "");
    }
}

static void numbers_are_of_a_kind(void **state)
{
    (void)state;
    static const struct {
        uint32_t epsg;
        enum spl_crs_kind kind;
    } rows[] = {
        {25832, SPL_CRS_PLACES},    {4326, SPL_CRS_PLACES},     {4979, SPL_CRS_PLACES},    {7415, SPL_CRS_PLACES},
        {5555, SPL_CRS_PLACES},     {5698, SPL_CRS_PLACES},     {5514, SPL_CRS_PLACES},    {3857, SPL_CRS_PLACES},
        {5773, SPL_CRS_HEIGHTS},    {3855, SPL_CRS_HEIGHTS},    {5783, SPL_CRS_HEIGHTS},   {7837, SPL_CRS_HEIGHTS},
        {5703, SPL_CRS_HEIGHTS},    {6360, SPL_CRS_HEIGHTS},    {5941, SPL_CRS_HEIGHTS},   {8228, SPL_CRS_HEIGHTS},
        {4978, SPL_CRS_GEOCENTRIC}, {4936, SPL_CRS_GEOCENTRIC}, {4328, SPL_CRS_GEOCENTRIC}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if (spl_crs_get_kind(rows[i].epsg) != rows[i].kind)
            fail_msg("EPSG:%u: %d", rows[i].epsg, spl_crs_get_kind(rows[i].epsg));
}

/* Before the points or behind them, and which of two that contradict each other counts. */
static void files_say_it(void **state)
{
    (void)state;
    static const struct {
        const char *path, *said;
    } rows[] = {
        {"als/autzen_trim.las", "wkt | ft | unknown"},
        {"als/autzen_trim_7.las", "wkt | ft | unknown"},
        {"als/powerline.laz", "- | unknown | unknown"},
        {"copc/lone-star.copc.laz", "wkt | m | unknown"},
        {"trees/pine.las", "- | unknown | unknown"},
        {"formats/las/test_epsg_4326.las", "EPSG:4326 | angles | unknown"},
        {"formats/las/mvk-thin.las", "wkt | us-ft | us-ft"},
        {"formats/las/4_6_crop.las", "EPSG:2903 | us-ft | us-ft"},
        {"formats/las/lots_of_vlr.las", "- | us-ft | unknown"},
        {"formats/las/interesting.las", "wkt | ft | unknown"},
        {"formats/las/1.2-empty-geotiff-vlrs.las", "- | m | m"},
        {"formats/las/test1_4.las", "EPSG:2903 | us-ft | us-ft"},
        {"formats/laz/las_with_several_extra_byte_bloc.laz", "EPSG:2154 | m | unknown"},
        {"interchange/copc/autzen.copc.laz", "EPSG:2992+EPSG:6360 | ft | us-ft"},
        {"interchange/copc/autzen_clip_4326.copc.laz", "EPSG:4326 | angles | unknown"},
        {"interchange/laz/2019_saipan_waveform.laz", "EPSG:8693 | m | us-ft"},
        {"interchange/laz/record-format-7.laz", "EPSG:25832+EPSG:7837 | m | m"},
        {"interchange/laz/32-1-472-150-76.laz", "EPSG:25832+EPSG:5941 | m | m"},
        {"interchange/laz/lazperf-1815.laz", "EPSG:6580+EPSG:5703 | m | m"},
        {"interchange/laz/rlas-las14_prf6.laz", "wkt | m | m"},
        {"interchange/laz/rlas-fwf.laz", "- | unknown | m"},
        {"interchange/gen/compat-pdrf8.laz", "EPSG:2975 | m | unknown"},
    };
    const char *folder = getenv("SPLATD_DATA");
    for (size_t i = 0; folder && i < sizeof rows / sizeof *rows; i++) {
        char path[512];
        struct spl_cloud *cloud;
        struct spl_error err = {0};
        snprintf(path, sizeof path, "%s/%s", folder, rows[i].path);
        if (access(path, R_OK))
            continue;
        if (spl_cloud_open(path, NULL, &cloud, &err))
            fail_msg("%s", err.message);
        const char *said = show(&spl_cloud_get_info(cloud)->coordinates);
        if (strcmp(said, rows[i].said) != 0)
            fail_msg("%s: %s", rows[i].path, said);
        spl_cloud_destroy(cloud);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wkt_is_read),           cmocka_unit_test(odd_wkt_is_refused_where_it_is_odd),
        cmocka_unit_test(keys_are_read),         cmocka_unit_test(names_are_kept),
        cmocka_unit_test(what_users_say),        cmocka_unit_test(numbers_say_units),
        cmocka_unit_test(numbers_are_of_a_kind), cmocka_unit_test(files_say_it),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
