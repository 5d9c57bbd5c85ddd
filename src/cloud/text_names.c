/* Columns of a text by their headings: names that every format knows first, then synonyms (synonyms.h), without the
 * unit in brackets behind. Longitudes and latitudes are no coordinates. Pure functions. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "cloud/fields.h"
#include "cloud/synonyms.h"
#include "cloud/text.h"

static bool is_one_of(const char *const *words, size_t count, const char *name, size_t length)
{
    for (size_t i = 0; i < count; i++)
        if (spl_name_is(name, length, words[i]))
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
    size_t bare;
    spl_text_split_unit(name, length, false, &bare);
    return bare;
}

/* The same, and "x_usft" and "Z / m" too. */
static size_t without_words(const char *name, size_t length)
{
    size_t bare;
    spl_text_split_unit(name, length, true, &bare);
    return bare;
}

bool spl_text_names_degrees(const char *line, size_t length)
{
    static const char *const degrees[] = {"lon", "lat", "long", "longitude", "latitude"};
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    const char *name;
    size_t size;
    while (next_name(&fields, &name, &size))
        if (IS_ONE_OF(degrees, name, without_words(name, size)))
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
        length = without_words(name, length);
        found |= spl_name_is(name, length, "e") ? 1 : spl_name_is(name, length, "n") ? 2 : 0;
    }
    return found == 3;
}

static void take_synonyms(struct spl_layout *layout, struct spl_fields fields)
{
    bool letters = has_letters(fields);
    for (enum spl_synonym_pass pass = 0; pass < SPL_SYNONYM_PASSES; pass++) {
        if (pass == SPL_SYNONYM_WORDS)
            layout->letters = spl_layout_has(layout, SPL_COLUMN_X) && spl_layout_has(layout, SPL_COLUMN_Y);
        struct spl_fields again = fields;
        const char *name;
        size_t length;
        for (unsigned i = 0; i < layout->fields && next_name(&again, &name, &length); i++) {
            int column = spl_column_from_synonym(name, without_unit(name, length), letters, pass);
            if (column < 0)
                column = spl_column_from_synonym(name, without_words(name, length), letters, pass);
            if (column > SPL_COLUMN_Z && without_words(name, length) < without_unit(name, length))
                column = SPL_COLUMN_SKIP; /* "r_m" is a range, and no red */
            if (column >= 0 && layout->column[i] < 0 && !spl_layout_has(layout, column))
                layout->column[i] = (int8_t)column;
        }
    }
}

/* In German geodesy Y is the east and X the north. With a point's number called in German, Y X and a height that is
 * what is meant; with a German height alone it may be, and nobody can tell. */
static void look_for_surveyors(struct spl_layout *layout, struct spl_fields fields)
{
    static const char *const numbers[] = {"nr",      "ptnr",        "pktnr",    "pkt",     "punkt",     "pnr",
                                          "punktnr", "punktnummer", "punkt-nr", "pkt-nr",  "punktname", "pkt.nr",
                                          "pkt.-nr", "nummer",      "pkt nr",   "punkt nr"};
    static const char *const heights[] = {"h", "hoehe", "h\xc3\xb6he", "h\xc3\x96he", "h\xf6he", "h\xd6he"};
    const char *name;
    size_t length;
    bool numbered = false;
    for (unsigned i = 0, stage = 0; next_name(&fields, &name, &length); i++) {
        length = without_words(name, length);
        numbered |= !stage && IS_ONE_OF(numbers, name, length);
        bool height = stage == 2 && layout->column[i] == SPL_COLUMN_Z;
        const char *blank = memchr(name, ' ', length);
        bool german = IS_ONE_OF(heights, name, blank ? (size_t)(blank - name) : length);
        int axis = spl_name_is(name, length, "x")   ? SPL_COLUMN_X
                   : spl_name_is(name, length, "y") ? SPL_COLUMN_Y
                                                    : spl_column_from_synonym(name, length, false, SPL_SYNONYM_AXES);
        stage = stage == 1 && axis == SPL_COLUMN_X ? 2 : axis == SPL_COLUMN_Y ? 1 : 0;
        layout->doubtful |= height && german && !numbered;
        if (height && numbered) {
            layout->surveyors = true;
            layout->column[i - 2] = SPL_COLUMN_X;
            layout->column[i - 1] = SPL_COLUMN_Y;
        }
    }
}

/* A colour of one column, where no three are red, green and blue. */
static void find_packed(struct spl_layout *layout, struct spl_fields fields)
{
    const char *name;
    size_t length;
    bool rgb = spl_columns_have3(spl_layout_taken(layout), SPL_COLUMN_RED);
    for (unsigned i = 0; i < layout->fields && !rgb && !layout->packed && next_name(&fields, &name, &length); i++) {
        if (layout->column[i] >= 0 || !spl_text_names_packed(name, without_unit(name, length), &layout->vague))
            continue;
        for (unsigned k = 0; k < layout->fields; k++)
            if (layout->column[k] >= SPL_COLUMN_RED && layout->column[k] <= SPL_COLUMN_BLUE)
                layout->column[k] = SPL_COLUMN_SKIP; /* of three that are not all there */
        layout->column[i] = SPL_COLUMN_RED;
        layout->packed = (uint8_t)(i + 1);
        layout->argb = !strncasecmp(name, "argb", length < 4 ? length : 4);
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
        if (size > 2 && memmem(name, size, "[]", 2)) { /* a list, as long as it may be: COLMAP's TRACK[] */
            layout->exact = false;
            break;
        }
        uint32_t taken = spl_layout_taken(layout);
        int column = spl_keep_find_column(keep, taken, name, size);
        if (column < 0)
            column = spl_keep_find_column(keep, taken, name, without_unit(name, size));
        layout->column[layout->fields++] = (int8_t)column;
    }
    take_synonyms(layout, again);
    look_for_surveyors(layout, again);
    find_packed(layout, again);
    return true;
}

void spl_layout_list_unused(const struct spl_layout *layout, const char *line, size_t length, char *text, size_t size)
{
    static const char more[] = ", …";
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    const char *name;
    size_t used = 0, n;
    for (unsigned i = 0; i < layout->fields && next_name(&fields, &name, &n); i++) {
        if (spl_column_is_used(spl_layout_taken(layout), layout->column[i]) || n == 0)
            continue;
        if (used + n + 2 + sizeof more > size) {
            snprintf(text + used, size - used, "%s", used ? more : "…");
            return;
        }
        used += (size_t)snprintf(text + used, size - used, "%s%.*s", used ? ", " : "", (int)n, name);
    }
}
