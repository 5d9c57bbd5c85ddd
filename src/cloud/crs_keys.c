/* GeoTIFF's keys, in the records of LAS files: entries of 8 bytes behind a head of 8, each a number, where its value
 * lies (0: in the entry itself), how many there are, and the value or its place. Nothing that is odd refuses points: it
 * counts as not said. Pure functions; any thread. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/text.h"
#include "cloud/crs.h"
#include "cloud/little.h"

enum { head_bytes = 8, entry_bytes = 8, user_defined = 32767 };
enum { in_doubles = 34736, in_text = 34737 };
enum {
    key_model = 1024,
    key_citation = 1026,
    key_geographic = 2048,
    key_geographic_citation = 2049,
    key_projected = 3072,
    key_projected_citation = 3073,
    key_unit = 3076,
    key_unit_size = 3077,
    key_height = 4096,
    key_height_unit = 4099
};
enum { model_projected = 1, model_geographic = 2, model_geocentric = 3 };
/* GeoTIFF's first edition had numbers of its own for heights, which are none of EPSG's. */
enum { old_heights_first = 5001, old_heights_last = 5106 };

/* The entry of a key whose value lies at `place`; NULL: there is none. */
static const uint8_t *find(const struct spl_crs_keys *k, uint16_t key, uint16_t place)
{
    size_t count = k->keys_bytes >= head_bytes ? spl_le_get16(k->keys + 6) : 0;
    for (size_t i = 0; i < count && head_bytes + (i + 1) * entry_bytes <= k->keys_bytes; i++) {
        const uint8_t *entry = k->keys + head_bytes + i * entry_bytes;
        if (spl_le_get16(entry) == key && spl_le_get16(entry + 2) == place)
            return entry;
    }
    return NULL;
}

/* 0: not said. */
static uint16_t get_number(const struct spl_crs_keys *k, uint16_t key)
{
    const uint8_t *entry = find(k, key, 0);
    return entry ? spl_le_get16(entry + 6) : 0;
}

static uint32_t get_system(const struct spl_crs_keys *k, uint16_t key)
{
    uint16_t number = get_number(k, key);
    return number < user_defined ? number : 0;
}

static double get_double(const struct spl_crs_keys *k, uint16_t key)
{
    const uint8_t *entry = find(k, key, in_doubles);
    const size_t at = entry ? sizeof(double) * spl_le_get16(entry + 6) : 0;
    return entry && at + sizeof(double) <= k->doubles_bytes ? spl_le_get_double(k->doubles + at) : 0;
}

/* Texts end with '|'. */
static void get_text(const struct spl_crs_keys *k, uint16_t key, char *out, size_t size)
{
    const uint8_t *entry = find(k, key, in_text);
    size_t at = entry ? spl_le_get16(entry + 6) : 0, length = entry ? spl_le_get16(entry + 4) : 0, i = 0;
    char text[256];
    if (!entry || at > k->text_bytes)
        return;
    for (; i < length && at + i < k->text_bytes && i + 1 < sizeof text && k->text[at + i] && k->text[at + i] != '|';
         i++)
        text[i] = (char)k->text[at + i];
    while (i > 0 && text[i - 1] == ' ')
        i--;
    text[i] = 0;
    if (i)
        spl_text_show(text, out, size);
}

static double get_length(const struct spl_crs_keys *k)
{
    uint16_t unit = get_number(k, key_unit);
    double size = unit == user_defined ? get_double(k, key_unit_size) : spl_crs_get_length(unit);
    return size >= 1e-6 && size <= 1e9 ? size : 0;
}

void spl_crs_read_keys(const struct spl_crs_keys *keys, struct spl_cloud_coordinates *crs)
{
    struct spl_cloud_coordinates said = {0};
    uint32_t projected = get_system(keys, key_projected), geographic = get_system(keys, key_geographic);
    uint16_t model = get_number(keys, key_model);
    if (model != model_geographic && model != model_geocentric && !get_number(keys, key_projected) && geographic &&
        !get_number(keys, key_unit))
        model = model_geographic;
    if (model == model_geographic || model == model_geocentric) {
        said.epsg = geographic;
        said.angles = model == model_geographic;
        get_text(keys, key_geographic_citation, said.name, sizeof said.name);
    } else {
        said.epsg = projected;
        get_text(keys, key_citation, said.name, sizeof said.name);
        get_text(keys, key_projected_citation, said.name, sizeof said.name);
    }
    if (!said.angles)
        said.unit_m = get_length(keys);
    said.height_epsg = get_system(keys, key_height);
    if (said.height_epsg >= old_heights_first && said.height_epsg <= old_heights_last)
        said.height_epsg = 0;
    said.height_unit_m = spl_crs_get_length(get_number(keys, key_height_unit));
    if (get_number(keys, key_projected) == user_defined && !said.name[0])
        snprintf(
            said.lost, sizeof said.lost,
            "its GeoTIFF keys define a coordinate system without a number of EPSG and without a name, which is left "
            "out");
    spl_crs_replace(crs, &said);
}
