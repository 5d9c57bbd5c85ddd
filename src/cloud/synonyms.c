/* What other languages, surveyors and programs call columns, where no field is called as rows.h has it. In three
 * passes: what surely is an axis before other words, and parts of those last. Pure functions, but of a cloud that
 * opens. */
#include "cloud/synonyms.h"

#include <stdio.h>
#include <string.h>

#include "cloud/text.h"

/* Is the word one of `words`, which are small letters with a blank on each side? */
static bool is_in(const char *words, const char *word, size_t length)
{
    char between[48] = " ";
    size_t n = 1;
    if (length + 3 > sizeof between)
        return false;
    for (size_t i = 0; i < length; i++)
        between[n++] = (char)(word[i] >= 'A' && word[i] <= 'Z' ? word[i] + 32 : word[i]);
    between[n] = ' ';
    return strstr(words, between);
}

/* What other languages, surveyors and programs call columns: small letters, without what only parts words. Letters
 * beyond ASCII are in UTF-8 and Latin-1, and in both cases, since nothing makes them small here. */
static int column_from_word(const char *word)
{
    static const struct {
        const char *words;
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
    for (size_t i = 0; i < sizeof synonyms / sizeof *synonyms; i++)
        if (is_in(synonyms[i].words, word, strlen(word)))
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

/* "Höhe ü. NN", "Altitude NGF", "H m a.s.l.": a height and what it counts from. Other words may make it
 * one of an instrument or a reflector. */
static bool is_height_above(const char *name, size_t length)
{
    static const char called[] = " z h hoehe h\xc3\xb6he h\xc3\x96he h\xf6he h\xd6he height elevation elev "
                                 "altitude alt altitud cota quota hoogte h\xc3\xb6jd h\xf6jd ";
    static const char from[] =
        " \xc3\xbc \xc3\x9c \xfc \xdc ue \xc3\xbc\142er \xfc\142er ueber above over m ft a s l sl "
        "sea level mean msl amsl masl \xc3\xbcm \xfcm \xc3\xbcnn \xfcnn \xc3\xbcnhn \xfcnhn nn nhn "
        "dhhn dhhn12 dhhn92 dhhn2016 ln02 lhn95 ngf ign69 nap rh2000 nn2000 dvr90 navd "
        "navd88 ngvd29 egm96 egm2008 evrf2007 odn ell ellipsoid ellipsoidal "
        "ellipsoidisch ortho orthometric orthometrisch ";
    const char *p = name, *end = name + length;
    unsigned heights = 0, others = 0;
    for (size_t size; (size = next_word(&p, end)); p += size) {
        if (is_in(called, p, size))
            heights++;
        else if (is_in(from, p, size))
            others++;
        else
            return false;
    }
    return heights == 1 && others;
}

int spl_column_from_synonym(const char *name, size_t length, bool letters, enum spl_synonym_pass pass)
{
    char word[40];
    size_t n = 0;
    if (letters && pass == SPL_SYNONYM_WORDS && spl_name_is(name, length, "e"))
        return SPL_COLUMN_X;
    if (letters && pass == SPL_SYNONYM_WORDS && spl_name_is(name, length, "n"))
        return SPL_COLUMN_Y;
    if (pass == SPL_SYNONYM_PARTS && is_height_above(name, length))
        return SPL_COLUMN_Z;
    for (size_t i = 0; i < length && n + 1 < sizeof word; i++)
        if (!strchr(" _-.:", name[i]))
            word[n++] = (char)(name[i] >= 'A' && name[i] <= 'Z' ? name[i] + 32 : name[i]);
    word[n] = 0;
    if (n == 0 || n + 1 == sizeof word)
        return SPL_COLUMN_SKIP;
    if (pass == SPL_SYNONYM_AXES && column_from_rest(word, true) >= 0) /* "X [m]" */
        return column_from_word(word);
    return pass == SPL_SYNONYM_WORDS ? column_from_word(word) : column_from_part(word, pass == SPL_SYNONYM_AXES);
}

/* E and N are east and north only together: one of them alone may be anything. */
static bool has_letters(const struct spl_field_name *fields, unsigned count)
{
    unsigned found = 0;
    for (unsigned i = 0; i < count; i++)
        found |= !strcasecmp(fields[i].name, "e") ? 1 : !strcasecmp(fields[i].name, "n") ? 2 : 0;
    return found == 3;
}

void spl_cloud_take_synonyms(struct spl_cloud *cloud, const struct spl_field_name *fields, unsigned count)
{
    const bool letters = has_letters(fields, count);
    for (enum spl_synonym_pass pass = 0; pass < SPL_SYNONYM_PASSES; pass++)
        for (unsigned i = 0; i < count; i++) {
            static const char prefix[] = "scalar_"; /* as CloudCompare writes what its headings were */
            const bool scalar = !strncasecmp(fields[i].name, prefix, sizeof prefix - 1);
            const char *name = fields[i].name + (scalar ? sizeof prefix - 1 : 0);
            size_t bare;
            if (*fields[i].column >= 0 || spl_text_split_unit(name, strlen(name), true, &bare) != 0)
                continue;
            int column = spl_column_from_synonym(name, strlen(name), letters, pass);
            if (column < 0 || cloud->columns >> column & 1)
                continue;
            *fields[i].column = (int8_t)column;
            cloud->columns |= 1u << column;
        }
}
