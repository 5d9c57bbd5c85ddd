/* WKT and GeoTIFF keys of any bytes: a text by its first byte or keys, and what must hold of what is read. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "cloud/crs.h"
#include "geom/unit.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require_sound(struct spl_cloud_coordinates *crs)
{
    double back;
    char text[SPL_UNIT_TEXT_MAX];
    if (!(crs->unit_m >= 0 && crs->unit_m <= 1e9) || !(crs->height_unit_m >= 0 && crs->height_unit_m <= 1e9) ||
        !spl_unit_parse(spl_unit_print(crs->unit_m, text), &back) || (crs->angles && crs->unit_m > 0) ||
        !memchr(crs->name, 0, sizeof crs->name))
        abort();
    free(spl_crs_print(crs));
    spl_crs_finish(crs);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct spl_cloud_coordinates crs = {0}, again = {0};
    struct spl_error err = {0};
    int code = spl_crs_read_wkt((const char *)data, size, &crs, &err);
    if (code ? err.code != code || !err.message[0] || crs.wkt : err.code || !crs.wkt)
        abort();
    /* what is kept reads as what was read */
    if (!code && (spl_crs_read_wkt(crs.wkt, strlen(crs.wkt), &again, NULL) || again.epsg != crs.epsg ||
                  again.unit_m != crs.unit_m || strcmp(again.wkt, crs.wkt) != 0))
        abort();
    require_sound(&crs);
    require_sound(&again);
    size_t part = size / 3;
    spl_crs_read_keys(&(struct spl_crs_keys){data, data + part, data + 2 * part, part, part, size - 2 * part}, &crs);
    require_sound(&crs);
    return 0;
}
