/* Units in headings: behind a name in brackets, as its last word, or, between blanks, as a word of their own. What is
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
    return close < length;
}

/* "easting_ft", "Height m": a word of a length alone, since others mean other things there. */
static double find_last_word(const char *name, size_t length)
{
    static const char *const words[] = {"m", "mm", "cm", "ft", "usft", "feet", "meters", "metres"};
    size_t first = length;
    while (first > 0 && !strchr(" _-", name[first - 1]))
        first--;
    for (size_t i = 0; first > 1 && i < sizeof words / sizeof *words; i++)
        if (strlen(words[i]) == length - first && !strncasecmp(words[i], name + first, length - first))
            return spl_text_unit(name + first, length - first);
    return 0;
}

void spl_layout_find_units(const struct spl_layout *layout, const char *line, size_t length, double units[3])
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    unsigned next = 0;
    int column = SPL_COLUMN_SKIP;
    size_t size, inner;
    units[0] = units[1] = units[2] = 0;
    while (spl_fields_text(&fields, &size) == SPL_FIELD_OK) {
        const char *name = fields.start, *inside;
        const bool brackets = find_brackets(name, size, &inside, &inner);
        const bool alone = fields.separator == ' ' && brackets && inside == name + 1 && size > 1;
        if (!alone) {
            if (next == layout->fields)
                return;
            column = layout->column[next++];
        }
        if (column < SPL_COLUMN_X || column > SPL_COLUMN_Z)
            continue;
        double unit = brackets ? spl_text_unit(inside, inner) : find_last_word(name, size);
        if (unit != 0)
            units[column - SPL_COLUMN_X] = unit;
    }
}
