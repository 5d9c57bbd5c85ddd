/* What the ways of naming a coordinate system have in common: numbers held against units, the text that a dataset
 * keeps, and what users say. Pure but for the file that a user names; any thread. */
#include "cloud/crs.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/source.h"
#include "geom/unit.h"

/* Units that only the numbers say; a number beside which another unit stands is none. */
static void settle(struct spl_cloud_coordinates *crs)
{
    bool angles;
    double unit = spl_crs_get_unit(crs->epsg, &angles);
    if (!angles && unit == 0)
        crs->epsg = 0;
    else if (crs->unit_m == 0 && !crs->angles) {
        crs->unit_m = unit;
        crs->angles = angles;
    } else if (angles != crs->angles || (!angles && !spl_unit_is_same(unit, crs->unit_m)))
        crs->epsg = 0;
    unit = spl_crs_get_unit(crs->height_epsg, &angles);
    if (crs->height_unit_m == 0)
        crs->height_unit_m = unit;
    if (unit == 0 || !spl_unit_is_same(unit, crs->height_unit_m))
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

/* "EPSG:N", behind which `text` then stands. */
static bool take_number(const char **text, uint32_t *number)
{
    uint64_t value;
    const char *digits = *text + 5, *end;
    if (strncasecmp(*text, "EPSG:", 5) != 0 || !(end = spl_integer_parse(digits, digits + strlen(digits), &value)) ||
        value > UINT32_MAX)
        return false;
    *text = end;
    *number = (uint32_t)value;
    return true;
}

static int read_numbers(const char *text, struct spl_cloud_coordinates *crs, struct spl_error *err)
{
    struct spl_cloud_coordinates said = {0};
    const char *at = text;
    bool angles, good = take_number(&at, &said.epsg);
    if (good && *at == '+') {
        at++;
        good = take_number(&at, &said.height_epsg);
    }
    if (!good || *at)
        return spl_fail_field(err, SPL_E_USAGE, "crs",
                              "--crs takes EPSG and a number, such as EPSG:25832, two of them where heights have their "
                              "own, such as EPSG:25832+EPSG:7837, a file that holds WKT, or none, not '%.60s'",
                              text);
    for (int k = 0; k < 2; k++) {
        uint32_t number = k ? said.height_epsg : said.epsg;
        if (number && spl_crs_get_unit(number, &angles) == 0 && (k || !angles))
            return spl_fail_field(err, SPL_E_USAGE, "crs", "--crs %.60s: EPSG:%u is no coordinate system%s", text,
                                  number, k ? " of heights" : "");
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
