/* Columns of a text by their headings: names that every format knows first, then what surveyors and other languages
 * call them, without the unit in brackets behind. Longitudes and latitudes are no coordinates. Pure functions. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "cloud/fields.h"
#include "cloud/text.h"

static bool is(const char *name, size_t length, const char *other)
{
    return strlen(other) == length && !strncasecmp(other, name, length);
}

static bool is_one_of(const char *const *words, size_t count, const char *name, size_t length)
{
    for (size_t i = 0; i < count; i++)
        if (is(name, length, words[i]))
            return true;
    return false;
}

#define IS_ONE_OF(words, name, length) is_one_of(words, sizeof(words) / sizeof *(words), name, length)

/* The next heading. Between blanks "[m]" is the unit of the one before. */
static bool next_name(struct spl_fields *fields, const char **name, size_t *length)
{
    do {
        if (spl_fields_text(fields, length) != SPL_FIELD_OK)
            return false;
        *name = fields->start;
    } while (fields->separator == ' ' && *length > 1 && strchr("[(", **name) && strchr("])", (*name)[*length - 1]));
    return true;
}

/* "X [m]", "R(0-255)" and "Nr." without what is behind. */
static size_t without_unit(const char *name, size_t length)
{
    size_t bare = 0;
    while (bare < length && name[bare] != '[' && name[bare] != '(')
        bare++;
    while (bare > 1 && strchr(" \t.", name[bare - 1]))
        bare--;
    return bare ? bare : length;
}

/* Only where no column has the name itself. Letters beyond ASCII are in UTF-8 and Latin-1, and in both cases, since
 * strncasecmp() makes none of them small. */
static int column_from_synonym(const char *name, size_t length, bool letters)
{
    static const struct {
        const char *name;
        int column;
    } synonyms[] = {{"easting", SPL_COLUMN_X},
                    {"northing", SPL_COLUMN_Y},
                    {"east", SPL_COLUMN_X},
                    {"north", SPL_COLUMN_Y},
                    {"up", SPL_COLUMN_Z},
                    {"height", SPL_COLUMN_Z},
                    {"elevation", SPL_COLUMN_Z},
                    {"elev", SPL_COLUMN_Z},
                    {"h", SPL_COLUMN_Z},
                    {"rechtswert", SPL_COLUMN_X},
                    {"hochwert", SPL_COLUMN_Y},
                    {"ostwert", SPL_COLUMN_X},
                    {"nordwert", SPL_COLUMN_Y},
                    {"ost", SPL_COLUMN_X},
                    {"nord", SPL_COLUMN_Y},
                    {"hoehe", SPL_COLUMN_Z},
                    {"h\xc3\xb6he", SPL_COLUMN_Z},
                    {"h\xc3\x96he", SPL_COLUMN_Z},
                    {"h\xf6he", SPL_COLUMN_Z},
                    {"h\xd6he", SPL_COLUMN_Z},
                    {"x_", SPL_COLUMN_X},
                    {"y_", SPL_COLUMN_Y},
                    {"z_", SPL_COLUMN_Z},
                    {"x-coordinate", SPL_COLUMN_X},
                    {"y-coordinate", SPL_COLUMN_Y},
                    {"z-coordinate", SPL_COLUMN_Z},
                    {"x_coord", SPL_COLUMN_X},
                    {"y_coord", SPL_COLUMN_Y},
                    {"z_coord", SPL_COLUMN_Z},
                    {"coord_x", SPL_COLUMN_X},
                    {"coord_y", SPL_COLUMN_Y},
                    {"coord_z", SPL_COLUMN_Z},
                    {"rot", SPL_COLUMN_RED},
                    {"gr\xc3\xbcn", SPL_COLUMN_GREEN},
                    {"gr\xc3\x9cn", SPL_COLUMN_GREEN},
                    {"gr\xfcn", SPL_COLUMN_GREEN},
                    {"gr\xdcn", SPL_COLUMN_GREEN},
                    {"gruen", SPL_COLUMN_GREEN},
                    {"blau", SPL_COLUMN_BLUE},
                    {"rouge", SPL_COLUMN_RED},
                    {"vert", SPL_COLUMN_GREEN},
                    {"bleu", SPL_COLUMN_BLUE},
                    {"intensit\xc3\xa4t", SPL_COLUMN_INTENSITY},
                    {"intensit\xc3\x84t", SPL_COLUMN_INTENSITY},
                    {"intensit\xe4t", SPL_COLUMN_INTENSITY},
                    {"intensit\xc4t", SPL_COLUMN_INTENSITY},
                    {"intensitaet", SPL_COLUMN_INTENSITY},
                    {"intensit\xc3\xa9", SPL_COLUMN_INTENSITY},
                    {"intensit\xc3\x89", SPL_COLUMN_INTENSITY},
                    {"intensit\xe9", SPL_COLUMN_INTENSITY},
                    {"intensit\xc9", SPL_COLUMN_INTENSITY},
                    {"reflectivity", SPL_COLUMN_INTENSITY},
                    {"klasse", SPL_COLUMN_CLASS},
                    {"classe", SPL_COLUMN_CLASS}};
    if (letters && is(name, length, "e"))
        return SPL_COLUMN_X;
    if (letters && is(name, length, "n"))
        return SPL_COLUMN_Y;
    for (size_t i = 0; i < sizeof synonyms / sizeof *synonyms; i++)
        if (is(name, length, synonyms[i].name))
            return synonyms[i].column;
    return SPL_COLUMN_SKIP;
}

bool spl_text_names_degrees(const char *line, size_t length)
{
    static const char *const degrees[] = {"lon", "lat", "long", "longitude", "latitude"};
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    const char *name;
    size_t size;
    while (next_name(&fields, &name, &size))
        if (IS_ONE_OF(degrees, name, without_unit(name, size)))
            return true;
    return false;
}

/* E and N are east and north only together: one of them alone may be anything. */
static bool has_letters(struct spl_fields fields)
{
    const char *name;
    size_t length;
    unsigned found = 0;
    while (next_name(&fields, &name, &length)) {
        length = without_unit(name, length);
        found |= is(name, length, "e") ? 1 : is(name, length, "n") ? 2 : 0;
    }
    return found == 3;
}

static void take_synonyms(struct spl_layout *layout, struct spl_fields fields)
{
    bool letters = has_letters(fields);
    const char *name;
    size_t length;
    for (unsigned i = 0; i < layout->fields && next_name(&fields, &name, &length); i++) {
        int column = column_from_synonym(name, without_unit(name, length), letters);
        if (column >= 0 && layout->column[i] < 0 && !spl_layout_has(layout, column))
            layout->column[i] = (int8_t)column;
    }
}

/* In German geodesy Y is the east and X the north. With a point's number, Y X and a height called by its German name
 * that is what is meant; without the number it may be, and nobody can tell. */
static void look_for_surveyors(struct spl_layout *layout, struct spl_fields fields)
{
    static const char *const numbers[] = {"nr",        "ptnr",    "pktnr",       "pkt",      "punkt",
                                          "pnr",       "punktnr", "punktnummer", "punkt-nr", "pkt-nr",
                                          "punktname", "pkt.nr",  "pkt.-nr"};
    static const char *const heights[] = {"h", "hoehe", "h\xc3\xb6he", "h\xc3\x96he", "h\xf6he", "h\xd6he"};
    const char *name;
    size_t length;
    bool numbered = false;
    for (unsigned i = 0, stage = 0; next_name(&fields, &name, &length); i++) {
        length = without_unit(name, length);
        numbered |= !stage && IS_ONE_OF(numbers, name, length);
        bool height = stage == 2 && IS_ONE_OF(heights, name, length) && layout->column[i] == SPL_COLUMN_Z;
        bool either = stage == 2 && numbered && is(name, length, "z"); /* a German number, no German height */
        stage = stage == 1 && is(name, length, "x") ? 2 : is(name, length, "y") ? 1 : 0;
        layout->doubtful |= either || (height && !numbered);
        if (height && numbered) {
            layout->surveyors = true;
            layout->column[i - 2] = SPL_COLUMN_X;
            layout->column[i - 1] = SPL_COLUMN_Y;
        }
    }
}

bool spl_layout_from_names(struct spl_layout *layout, const struct spl_keep *keep, const char *line, size_t length)
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length)), again = fields;
    const char *name;
    size_t size;
    *layout = (struct spl_layout){.exact = true};
    while (next_name(&fields, &name, &size)) {
        if (layout->fields == SPL_TEXT_FIELDS)
            return false;
        uint32_t taken = spl_layout_taken(layout);
        int column = spl_keep_find_column(keep, taken, name, size);
        if (column < 0)
            column = spl_keep_find_column(keep, taken, name, without_unit(name, size));
        layout->column[layout->fields++] = (int8_t)column;
    }
    take_synonyms(layout, again);
    look_for_surveyors(layout, again);
    return true;
}

/* Of colours and normals that lack a component none is used. */
static bool is_used(const struct spl_layout *layout, unsigned i)
{
    int column = layout->column[i];
    uint32_t taken = spl_layout_taken(layout);
    if (column >= SPL_COLUMN_RED && column < SPL_COLUMN_NX)
        return spl_columns_have3(taken, SPL_COLUMN_RED);
    if (column >= SPL_COLUMN_NX && column < SPL_COLUMN_CLASS)
        return spl_columns_have3(taken, SPL_COLUMN_NX);
    return column >= 0;
}

void spl_layout_list_unused(const struct spl_layout *layout, const char *line, size_t length, char *text, size_t size)
{
    static const char more[] = ", …";
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    const char *name;
    size_t used = 0, n;
    for (unsigned i = 0; i < layout->fields && next_name(&fields, &name, &n); i++) {
        if (is_used(layout, i) || n == 0)
            continue;
        if (used + n + 2 + sizeof more > size) {
            snprintf(text + used, size - used, "%s", used ? more : "…");
            return;
        }
        used += (size_t)snprintf(text + used, size - used, "%s%.*s", used ? ", " : "", (int)n, name);
    }
}
