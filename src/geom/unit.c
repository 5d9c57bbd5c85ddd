/* The table of units. Pure functions; any thread. */
#include "geom/unit.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"

static const double seven_digits = 1e-7; /* US survey foot and foot are 2e-6 apart, and headers round */
static const double metres_least = 1e-6, metres_most = 1e9;

static const struct {
    const char *name;
    double metres;
} units[] = {{"unknown", 0}, {"m", 1},        {"ft", 0.3048},   {"us-ft", 1200.0 / 3937}, {"km", 1000},
             {"cm", 0.01},   {"mm", 0.001}, {"yd", 0.9144}, {"in", 0.0254},
             {"meter", 1},   {"metre", 1},  {"meters", 1},  {"metres", 1}, /* these are read alone */
             {"foot", 0.3048}, {"feet", 0.3048}};

bool spl_unit_is_same(double metres_a, double metres_b)
{
    return fabs(metres_a / metres_b - 1) <= seven_digits;
}

const char *spl_unit_print(double metres, char text[SPL_UNIT_TEXT_MAX])
{
    size_t i = metres > 0;
    while (metres > 0 && i < sizeof units / sizeof *units && !spl_unit_is_same(metres, units[i].metres))
        i++;
    if (i < sizeof units / sizeof *units)
        snprintf(text, SPL_UNIT_TEXT_MAX, "%s", units[i].name);
    else
        snprintf(text, SPL_UNIT_TEXT_MAX, "%.12g m", metres);
    return text;
}

bool spl_unit_parse(const char *text, double *metres)
{
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (!strcmp(text, units[i].name)) {
            *metres = units[i].metres;
            return true;
        }
    double value = 0;
    const char *end = isdigit((unsigned char)*text) ? spl_decimal_parse(text, &value) : NULL;
    if (!(value >= metres_least && value <= metres_most))
        return false;
    end += *end == ' ';
    if (strcmp(end, "m") != 0)
        return false;
    *metres = value;
    return true;
}
