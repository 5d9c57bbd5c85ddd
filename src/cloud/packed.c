/* What a number means that is a colour. Programs write 0xRRGGBB or 0xAARRGGBB as a whole number, as a negative one
 * where their integers have a sign, as a float whose bits it is, and as a float of that value. Floats whose bits are a
 * colour are below 1e-37 without an alpha and beyond 1e38 with one of 255, so that a whole number between 1 and 2^24
 * is what it says. Pure but for the cloud that opens. */
#include "cloud/packed.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const uint32_t rgb_columns = 7u << SPL_COLUMN_RED;

bool spl_packed_is_name(const char *name, size_t length)
{
    static const char *const names[] = {"rgb", "rgba", "argb", "rgb_packed", "packed_rgb", "rgb_int", "rgbint"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strlen(names[i]) == length && !strncasecmp(names[i], name, length))
            return true;
    return false;
}

bool spl_packed_take(struct spl_cloud *cloud, const char *name, size_t length, unsigned bytes, bool list)
{
    char why[32];
    if (!spl_packed_is_name(name, length) || cloud->columns & rgb_columns ||
        spl_keep_find_column(&cloud->keep, cloud->columns, name, length) >= 0)
        return false;
    if (list || bytes < 4) {
        snprintf(why, sizeof why, "of %u byte%s", bytes, bytes == 1 ? "" : "s");
        spl_cloud_add_unused(cloud, name, length, list ? "a list" : why);
        return false;
    }
    spl_cloud_name_field(cloud, name, length);
    cloud->columns |= rgb_columns;
    return true;
}

void spl_packed_tell_rest(struct spl_cloud *cloud)
{
    char text[80] = "", why[32];
    int lacks = SPL_COLUMN_SKIP;
    size_t used = 0;
    if (!(cloud->columns & rgb_columns))
        return;
    for (int column = SPL_COLUMN_BLUE; column >= SPL_COLUMN_RED; column--)
        lacks = cloud->columns >> column & 1 ? lacks : column;
    for (int column = SPL_COLUMN_RED; column <= SPL_COLUMN_BLUE && lacks >= 0; column++)
        if (cloud->columns >> column & 1)
            used +=
                (size_t)snprintf(text + used, sizeof text - used, "%s%s", used ? ", " : "", spl_column_name(column));
    if (lacks < 0)
        return;
    snprintf(why, sizeof why, "without %s", spl_column_name(lacks));
    spl_cloud_add_unused(cloud, text, used, why);
}

uint32_t spl_packed_from_number(double value)
{
    float single = (float)value;
    uint32_t bits = 0;
    if (value >= INT32_MIN && value <= UINT32_MAX && value == floor(value))
        return (uint32_t)(int64_t)value;
    if (!isnan(value))
        memcpy(&bits, &single, sizeof bits);
    return bits;
}

uint32_t spl_packed_from_bits(uint32_t bits)
{
    float single;
    memcpy(&single, &bits, sizeof single);
    bool number = single >= 1 && single < 1 << 24 && single == floorf(single);
    return number ? (uint32_t)single : bits;
}
