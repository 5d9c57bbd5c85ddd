/* What the ways of naming a coordinate system have in common: numbers held against units, the text that a dataset
 * keeps, and what users say. Pure but for the file that a user names; any thread. */
#include "cloud/crs.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/source.h"
#include "geom/unit.h"

/* Units that only the numbers say; a number beside which another unit stands is none. */
static void settle(struct spl_cloud_coordinates *crs)
{
    bool angles;
    double unit = spl_crs_get_unit(crs->epsg, &angles);
    if ((!angles && unit == 0) || spl_crs_get_kind(crs->epsg) == SPL_CRS_HEIGHTS)
        crs->epsg = 0;
    else if (crs->unit_m == 0 && !crs->angles) {
        crs->unit_m = unit;
        crs->angles = angles;
    } else if (angles != crs->angles || (!angles && !spl_unit_is_same(unit, crs->unit_m))) {
        char own[SPL_UNIT_TEXT_MAX], beside[SPL_UNIT_TEXT_MAX];
        if (!crs->wkt)
            snprintf(crs->lost, sizeof crs->lost,
                     "its coordinate system EPSG:%u is in %s, but the unit beside that is %s: the number is left out",
                     crs->epsg, angles ? "degrees" : spl_unit_print(unit, own),
                     crs->angles ? "degrees" : spl_unit_print(crs->unit_m, beside));
        crs->epsg = 0;
    }
    unit = spl_crs_get_unit(crs->height_epsg, &angles);
    if (crs->height_unit_m == 0)
        crs->height_unit_m = unit;
    if (unit == 0 || !spl_unit_is_same(unit, crs->height_unit_m) ||
        spl_crs_get_kind(crs->height_epsg) != SPL_CRS_HEIGHTS)
        crs->height_epsg = 0;
}

void spl_crs_replace(struct spl_cloud_coordinates *crs, const struct spl_cloud_coordinates *said)
{
    struct spl_cloud_coordinates old = *crs;
    *crs = *said;
    memcpy(crs->step, old.step, sizeof crs->step);
    memcpy(crs->first, old.first, sizeof crs->first);
    crs->floats = old.floats;
    settle(crs);
    free(old.wkt);
}

/* GDAL, too, makes such a system of a citation that is all there is. GeoTIFF keys may say how it is projected; but
 * files are about half and half in whether false eastings are in the unit or in metres, and nothing tells which: wrong
 * by 900 km of a state plane. */
void spl_crs_keep_name(struct spl_cloud_coordinates *crs)
{
    static const struct {
        double metres;
        const char *name;
    } units[] = {{1, "metre"}, {0.3048, "foot"}, {1200.0 / 3937, "US survey foot"}};
    const char *unit = "unit";
    char doubled[2 * sizeof crs->name], *out = doubled;
    if (crs->epsg || crs->wkt || crs->angles || !crs->name[0] || !strcasecmp(crs->name, "unnamed") ||
        !strcasecmp(crs->name, "unknown"))
        return;
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        unit = spl_unit_is_same(crs->unit_m, units[i].metres) ? units[i].name : unit;
    for (const char *c = crs->name; *c; c++) {
        if (*c == '"')
            *out++ = '"';
        *out++ = *c;
    }
    *out = 0;
    int length = crs->unit_m > 0
                     ? asprintf(&crs->wkt, "LOCAL_CS[\"%s\",UNIT[\"%s\",%.17g]]", doubled, unit, crs->unit_m)
                     : asprintf(&crs->wkt, "LOCAL_CS[\"%s\"]", doubled);
    if (length < 0)
        crs->wkt = NULL; /* as if it had none */
    if (!crs->lost[0])
        snprintf(
            crs->lost, sizeof crs->lost,
            "of its coordinate system the name is kept (%s), but not how it is projected: it has no number of EPSG",
            crs->name);
}

char *spl_crs_print(const struct spl_cloud_coordinates *crs)
{
    char *text = NULL;
    int length = 0;
    if (crs->epsg && crs->height_epsg)
        length = asprintf(&text, "EPSG:%u+EPSG:%u", crs->epsg, crs->height_epsg);
    else if (crs->epsg)
        length = asprintf(&text, "EPSG:%u", crs->epsg);
    else if (crs->wkt)
        text = strdup(crs->wkt);
    return length < 0 ? NULL : text;
}

void spl_crs_finish(struct spl_cloud_coordinates *crs)
{
    free(crs->wkt);
    *crs = (struct spl_cloud_coordinates){0};
}

/* "EPSG:N", of heights "N" too, behind which `text` then stands. */
static bool take_number(const char **text, bool bare, uint32_t *number)
{
    uint64_t value;
    bool named = strncasecmp(*text, "EPSG:", 5) == 0;
    const char *digits = named ? *text + 5 : *text, *end;
    if (!(named || bare) || !(end = spl_integer_parse(digits, digits + strlen(digits), &value)) || value > UINT32_MAX)
        return false;
    *text = end;
    *number = (uint32_t)value;
    return true;
}

/* What is wrong with a number where a system of places (`k` = 0) or of heights stands; NULL: nothing. */
static const char *find_fault(uint32_t number, int k)
{
    bool angles;
    if (spl_crs_get_unit(number, &angles) == 0 && (k || !angles))
        return k ? "is no coordinate system of heights" : "is no coordinate system";
    enum spl_crs_kind kind = spl_crs_get_kind(number);
    if (k)
        return kind == SPL_CRS_HEIGHTS ? NULL : "is no coordinate system of heights";
    return kind == SPL_CRS_HEIGHTS ? "is one of heights alone: name that of x and y before it, such as "
                                     "EPSG:25832+EPSG:7837"
           : kind == SPL_CRS_GEOCENTRIC
               ? "counts from the middle of the earth, and z is not up there: project the scans first, such as with "
                 "\"pdal translate IN OUT.las reprojection --filters.reprojection.out_srs=EPSG:…\""
               : NULL;
}

static int read_numbers(const char *text, struct spl_cloud_coordinates *crs, struct spl_error *err)
{
    struct spl_cloud_coordinates said = {0};
    const char *at = text, *fault;
    bool good = take_number(&at, false, &said.epsg), both = good && *at == '+';
    if (both) {
        at++;
        good = take_number(&at, true, &said.height_epsg);
    }
    if (!good || *at)
        return spl_fail_field(err, SPL_E_USAGE, "crs",
                              "--crs takes EPSG and a number, such as EPSG:25832, two of them where heights have their "
                              "own, such as EPSG:25832+EPSG:7837, a file that holds WKT, or none, not '%.60s'",
                              text);
    for (int k = 0; k <= both; k++) {
        uint32_t number = k ? said.height_epsg : said.epsg;
        if ((fault = find_fault(number, k)))
            return spl_fail_field(err, SPL_E_USAGE, "crs", "--crs %.60s: EPSG:%u %s", text, number, fault);
    }
    spl_crs_replace(crs, &said);
    return SPL_OK;
}

int spl_crs_read_option(const char *text, struct spl_cloud_coordinates *crs, struct spl_error *err)
{
    struct spl_source source = {.fd = -1};
    struct spl_error why = {0};
    const uint8_t *bytes;
    size_t available = 0;
    if (strncasecmp(text, "EPSG:", 5) == 0)
        return read_numbers(text, crs, err);
    int rc = spl_source_open(&source, text, &why);
    if (!rc)
        rc = spl_source_peek(&source, SPL_CRS_TEXT_MAX + 1, &bytes, &available, &why);
    if (!rc)
        rc = spl_crs_read_wkt((const char *)bytes, available, crs, &why);
    spl_source_close(&source);
    if (!rc)
        return SPL_OK;
    if (rc == SPL_E_INPUT)
        return spl_fail_field(err, rc, "crs", "--crs %.120s: %s", text, why.message);
    return rc == SPL_E_NOT_FOUND
               ? spl_fail_field(err, SPL_E_USAGE, "crs",
                                "--crs takes EPSG and a number, such as EPSG:25832, a file that holds WKT, or none; "
                                "there is no file %.120s",
                                text)
               : spl_fail_field(err, rc, "crs", "--crs: %s", why.message);
}
