/* Units in headings: behind a name in brackets, as its last words, or, between blanks, as a word of their own. What is
 * in brackets may be anything else, and says nothing then. Pure functions. */
#include <string.h>
#include <strings.h>

#include "cloud/text.h"

double spl_text_unit(const char *text, size_t length)
{
    static const struct {
        const char *words; /* with a blank on each side */
        double metres;
    } units[] = {
        {" m meter metre meters metres metern metri metros ", 1},
        {" mm millimeter millimetre ", 0.001},
        {" cm centimeter centimetre ", 0.01},
        {" km ", 1000},
        {" yd yard yards ", 0.9144},
        {" ft foot feet intft ift ftint internationalfoot internationalfeet ", 0.3048},
        {" usft ftus usfoot usfeet ussurveyft ussurveyfoot ussurveyfeet surveyfoot surveyfeet sft ", 1200.0 / 3937},
        {" in inch inches ", 0.0254},
        {" deg degree degrees grad \xc2\xb0 \xb0 ", SPL_TEXT_DEGREES},
    };
    char word[32] = " ";
    size_t n = 1;
    for (size_t i = 0; i < length && n + 2 < sizeof word; i++)
        if (!strchr(" \t_-.", text[i]))
            word[n++] = (char)(text[i] >= 'A' && text[i] <= 'Z' ? text[i] + 32 : text[i]);
    if (n == 1 || n + 2 == sizeof word)
        return 0;
    word[n] = ' ';
    word[n + 1] = 0;
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (strstr(units[i].words, word))
            return units[i].metres;
    return 0;
}

/* Behind '[' or '(' up to its other one; false: there is none. */
static bool find_brackets(const char *name, size_t length, const char **inside, size_t *size)
{
    size_t open = 0;
    while (open < length && name[open] != '[' && name[open] != '(')
        open++;
    size_t close = open;
    while (close < length && name[close] != ']' && name[close] != ')')
        close++;
    *inside = name + open + 1;
    *size = close > open ? close - open - 1 : 0;
    return open < length;
}

/* Without those of `what` at its end. */
static size_t trim(const char *name, size_t length, const char *what)
{
    while (length > 1 && strchr(what, name[length - 1]))
        length--;
    return length;
}

/* "easting_us_ft", "Height m", "Z / m", "X in m": as many words at the end as are a unit. "in" is mostly a word. */
static double find_words(const char *name, size_t length, size_t *bare)
{
    static const char parts[] = " \t_-/";
    for (size_t at = 2; at < length; at++) {
        const double unit = strchr(parts, name[at - 1]) && !strchr(parts, name[at]) &&
                                    !(length - at == 2 && !strncasecmp(name + at, "in", 2))
                                ? spl_text_unit(name + at, length - at)
                                : 0;
        if (unit == 0)
            continue;
        *bare = trim(name, at - 1, parts);
        if (*bare > 3 && strchr(parts, name[*bare - 3]) && !strncasecmp(name + *bare - 2, "in", 2))
            *bare = trim(name, *bare - 2, parts);
        return unit;
    }
    return 0;
}

double spl_text_split_unit(const char *name, size_t length, bool words, size_t *bare)
{
    const char *inside;
    size_t size;
    const bool brackets = find_brackets(name, length, &inside, &size);
    *bare = brackets && inside - name > 1 ? (size_t)(inside - name) - 1 : length;
    double unit = brackets ? spl_text_unit(inside, size) : words ? find_words(name, length, bare) : 0;
    *bare = trim(name, *bare, " \t.");
    return unit;
}

void spl_layout_find_units(const struct spl_layout *layout, const char *line, size_t length, double units[3])
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    unsigned next = 0;
    int column = SPL_COLUMN_SKIP;
    size_t size, bare;
    units[0] = units[1] = units[2] = 0;
    while (spl_fields_text(&fields, &size) == SPL_FIELD_OK) {
        const char *name = fields.start;
        const bool alone = fields.separator == ' ' && size > 1 && strchr("[(", *name) && strchr("])", name[size - 1]);
        if (!alone) {
            if (next == layout->fields)
                return;
            column = layout->column[next++];
        }
        if (column < SPL_COLUMN_X || column > SPL_COLUMN_Z)
            continue;
        double unit = spl_text_split_unit(name, size, true, &bare);
        if (unit != 0)
            units[column - SPL_COLUMN_X] = unit;
    }
}
