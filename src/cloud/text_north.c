/* Is x the north of a map, and y its east? Nothing may say so, and the image of such a scan is a mirror's. What is told
 * here are places that an east and a north in their order cannot have, or hardly: norths of UTM before its easts,
 * Switzerland's of 1.06 to 1.31 million before 2.47 to 2.85, and easts of Gauss and Krüger with the zone's number in
 * front. Germany's and Poland's zones 5 to 8 are narrow, and norths there are no easts of 6 to 8: of zone 5 they
 * begin at 5.55 million, below which nearly all of its easts lie. Pure functions.
 *
 * Its older places in Switzerland, of six digits both, are as well those of Scotland with the east before the north. */
#include <math.h>

#include "cloud/text.h"

static const char zoned[] = "y seems to have its zone in front (Gauss-Kr\xc3\xbcger)";
static const struct place {
    double x[2], y[2]; /* from, to: the end is none of it */
    bool zone;         /* y behind the zone's number is near the middle of the zone */
    bool aside;        /* and x would not be */
    bool bare;         /* only where no headings say x and y: feet of New York are such ones */
    const char *what;
} places[] = {
    {{1e6, 1e7}, {1e5, 1e6}, false, false, true, "x has seven digits and y six"},
    {{4e6, 9e6}, {1e5, 1e6}, false, false, false, "x has seven digits and y six"},
    {{1.06e6, 1.31e6}, {2.47e6, 2.85e6}, false, false, false, "x is about 1.2 million and y 2.6 million (Swiss LV95)"},
    {{5.2e6, 6.2e6}, {2e6, 5e6}, true, false, false, zoned},
    {{5.55e6, 6.2e6}, {5.33e6, 5.55e6}, false, false, false, zoned},
    {{4.9e6, 6.2e6}, {6.38e6, 6.62e6}, false, false, false, zoned},
    {{4.9e6, 6.2e6}, {7.38e6, 7.62e6}, false, false, false, zoned},
    {{4.9e6, 6.2e6}, {8.38e6, 8.62e6}, false, false, false, zoned},
    {{4e6, 9e6}, {4e6, 1e7}, true, true, false, zoned},
    {{4e6, 9e6}, {1e7, 3.3e7}, true, false, false, zoned},
};
enum { PLACES = sizeof places / sizeof *places };

static bool is_near_middle(double v)
{
    double behind = fmod(v, 1e6);
    return behind >= 2.5e5 && behind < 7.5e5;
}

static bool is_there(const struct place *place, double x, double y)
{
    return x >= place->x[0] && x < place->x[1] && y >= place->y[0] && y < place->y[1] &&
           (!place->zone || is_near_middle(y)) && (!place->aside || !is_near_middle(x));
}

void spl_text_north_add(struct spl_text_north *north, const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field field;
    double at[2] = {NAN, NAN};
    for (unsigned i = 0; i < layout->fields && spl_layout_next(layout, &fields, &field); i++) {
        int column = layout->column[i];
        if (column >= SPL_COLUMN_X && column <= SPL_COLUMN_Y && field.number)
            at[column - SPL_COLUMN_X] = field.value;
    }
    if (!isfinite(at[0]) || !isfinite(at[1]))
        return;
    north->lines++;
    for (unsigned i = 0; i < PLACES; i++)
        north->elsewhere |= (uint32_t)!is_there(&places[i], at[0], at[1]) << i;
}

const char *spl_text_north_tell(const struct spl_text_north *north, bool named)
{
    for (unsigned i = 0; north->lines && i < PLACES; i++)
        if (!(north->elsewhere >> i & 1) && !(named && places[i].bare))
            return places[i].what;
    return NULL;
}
