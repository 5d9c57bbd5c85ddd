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

/* What other languages, surveyors and programs call columns: small letters, without what only parts words. Letters
 * beyond ASCII are in UTF-8 and Latin-1, and in both cases, since nothing makes them small here. */
static int column_from_word(const char *word)
{
    static const struct {
        const char *words; /* with a blank on each side */
        int column;
    } synonyms[] = {
        {" x easting east rechtswert ostwert ost est este \xc3\xb6st \xc3\x96st \xf6st \xd6st oost utme points0 ",
         SPL_COLUMN_X},
        {" y northing north hochwert nordwert nord norte norr noord utmn points1 ", SPL_COLUMN_Y},
        {" z up height elevation elev h hoehe h\xc3\xb6he h\xc3\x96he h\xf6he h\xd6he altitude altitud alt cota quota "
         "h\xc3\xb6jd h\xf6jd hojd hoogte points2 ",
         SPL_COLUMN_Z},
        {" red r rot rouge rosso rojo vermelho rood ", SPL_COLUMN_RED},
        {" green g gr\xc3\xbcn gr\xc3\x9cn gr\xfcn gr\xdcn gruen vert verde groen ", SPL_COLUMN_GREEN},
        {" blue b blau bleu blu azul blauw ", SPL_COLUMN_BLUE},
        {" int intensit\xc3\xa4t intensit\xc3\x84t intensit\xe4t intensit\xc4t intensitaet intensit\xc3\xa9 "
         "intensit\xc3\x89 intensit\xe9 intensit\xc9 intensidad intensidade intensit\xc3\xa0 intensiteit reflectivity ",
         SPL_COLUMN_INTENSITY},
        {" klasse classe clase ", SPL_COLUMN_CLASS},
    };
    char between[48];
    snprintf(between, sizeof between, " %s ", word);
    for (size_t i = 0; i < sizeof synonyms / sizeof *synonyms; i++)
        if (strstr(synonyms[i].words, between))
            return synonyms[i].column;
    return SPL_COLUMN_SKIP;
}

static int column_from_rest(const char *word, bool axes)
{
    return !axes || (word[0] && !word[1] && strchr("xyz", word[0])) ? column_from_word(word) : SPL_COLUMN_SKIP;
}

/* The column that a word means without what says that it is one: "posx", "xcoordinate", "eastingm". `axes`: if it is x,
 * y or z. */
static int column_from_part(const char *word, bool axes)
{
    static const struct {
        const char *text;
        bool before, behind;
    } affixes[] = {{"coordinates", true, true}, {"coordinate", true, true},   {"coord", true, true},
                   {"koordinate", true, true},  {"coordinaat", true, true},   {"co\xc3\xb6rdinaat", true, true},
                   {"position", true, true},    {"pos", true, true},          {"point", true, false},
                   {"wert", false, true},       {"value", false, true},       {"color", true, true},
                   {"colour", true, true},      {"ellipsoidal", true, false}, {"orthometric", true, false},
                   {"m", false, true},          {"ft", false, true}};
    size_t length = strlen(word);
    int column = SPL_COLUMN_SKIP;
    for (size_t i = 0; i < sizeof affixes / sizeof *affixes && column < 0; i++) {
        size_t size = strlen(affixes[i].text);
        char rest[40];
        if (size >= length)
            continue;
        if (affixes[i].before && !memcmp(word, affixes[i].text, size))
            column = column_from_rest(word + size, axes);
        snprintf(rest, sizeof rest, "%.*s", (int)(length - size), word);
        if (column < 0 && affixes[i].behind && !memcmp(word + length - size, affixes[i].text, size))
            column = column_from_rest(rest, axes);
    }
    return column;
}

/* The next word of a heading, of letters and digits; 0 at the end. */
static size_t next_word(const char **p, const char *end)
{
    size_t length = 0;
    while (*p < end && strchr(" \t_-.:,/", **p))
        (*p)++;
    while (*p + length < end && !strchr(" \t_-.:,/", (*p)[length]))
        length++;
    return length;
}

static bool is_height(const char *word, size_t length)
{
    static const char *const heights[] = {"z",       "h",      "hoehe",     "h\xc3\xb6he", "h\xc3\x96he", "h\xf6he",
                                          "h\xd6he", "height", "elevation", "elev",        "altitude",    "alt",
                                          "altitud", "cota",   "quota",     "hoogte",      "h\xc3\xb6jd", "h\xf6jd"};
    return IS_ONE_OF(heights, word, length);
}

/* "Höhe ü. NN", "Altitude NGF", "H m a.s.l.": a height and what it counts from. Other words may make it
 * one of an instrument or a reflector. */
static bool is_height_above(const char *name, size_t length)
{
    static const char *const from[] = {"\xc3\xbc",
                                       "\xc3\x9c",
                                       "\xfc",
                                       "\xdc",
                                       "ue",
                                       "\xc3\xbc"
                                       "ber",
                                       "\xfc"
                                       "ber",
                                       "ueber",
                                       "above",
                                       "over",
                                       "m",
                                       "ft",
                                       "a",
                                       "s",
                                       "l",
                                       "sl",
                                       "sea",
                                       "level",
                                       "mean",
                                       "msl",
                                       "amsl",
                                       "masl",
                                       "\xc3\xbcm",
                                       "\xfcm",
                                       "\xc3\xbcnn",
                                       "\xfcnn",
                                       "\xc3\xbcnhn",
                                       "\xfcnhn",
                                       "nn",
                                       "nhn",
                                       "dhhn",
                                       "dhhn12",
                                       "dhhn92",
                                       "dhhn2016",
                                       "ln02",
                                       "lhn95",
                                       "ngf",
                                       "ign69",
                                       "nap",
                                       "rh2000",
                                       "nn2000",
                                       "dvr90",
                                       "navd",
                                       "navd88",
                                       "ngvd29",
                                       "egm96",
                                       "egm2008",
                                       "evrf2007",
                                       "odn",
                                       "ell",
                                       "ellipsoid",
                                       "ellipsoidal",
                                       "ellipsoidisch",
                                       "ortho",
                                       "orthometric",
                                       "orthometrisch"};
    const char *p = name, *end = name + length;
    unsigned heights = 0, others = 0;
    for (size_t size; (size = next_word(&p, end)); p += size) {
        if (is_height(p, size))
            heights++;
        else if (IS_ONE_OF(from, p, size))
            others++;
        else
            return false;
    }
    return heights == 1 && others;
}

/* Only where no column has the name itself: what surely is an axis before other words, and parts of those last. */
enum pass { PASS_AXES, PASS_WORDS, PASS_PARTS, PASSES };

static int column_from_synonym(const char *name, size_t length, bool letters, enum pass pass)
{
    char word[40];
    size_t n = 0;
    if (letters && pass == PASS_WORDS && is(name, length, "e"))
        return SPL_COLUMN_X;
    if (letters && pass == PASS_WORDS && is(name, length, "n"))
        return SPL_COLUMN_Y;
    if (pass == PASS_PARTS && is_height_above(name, length))
        return SPL_COLUMN_Z;
    for (size_t i = 0; i < length && n + 1 < sizeof word; i++)
        if (!strchr(" _-.:", name[i]))
            word[n++] = (char)(name[i] >= 'A' && name[i] <= 'Z' ? name[i] + 32 : name[i]);
    word[n] = 0;
    if (n == 0 || n + 1 == sizeof word)
        return SPL_COLUMN_SKIP;
    if (pass == PASS_AXES && column_from_rest(word, true) >= 0) /* "X [m]" */
        return column_from_word(word);
    return pass == PASS_WORDS ? column_from_word(word) : column_from_part(word, pass == PASS_AXES);
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
        found |= is(name, length, "e") ? 1 : is(name, length, "n") ? 2 : 0;
    }
    return found == 3;
}

static void take_synonyms(struct spl_layout *layout, struct spl_fields fields)
{
    bool letters = has_letters(fields);
    for (int pass = 0; pass < PASSES; pass++) {
        if (pass == PASS_WORDS)
            layout->letters = spl_layout_has(layout, SPL_COLUMN_X) && spl_layout_has(layout, SPL_COLUMN_Y);
        struct spl_fields again = fields;
        const char *name;
        size_t length;
        for (unsigned i = 0; i < layout->fields && next_name(&again, &name, &length); i++) {
            int column = column_from_synonym(name, without_unit(name, length), letters, (enum pass)pass);
            if (column < 0)
                column = column_from_synonym(name, without_words(name, length), letters, (enum pass)pass);
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
        int axis = is(name, length, "x")   ? SPL_COLUMN_X
                   : is(name, length, "y") ? SPL_COLUMN_Y
                                           : column_from_synonym(name, length, false, PASS_AXES);
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
