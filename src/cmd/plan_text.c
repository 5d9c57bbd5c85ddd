/* A plan's numbers in words. Values have three digits, figures all that they were measured with; each figure has the
 * number under which the end of the plan says what it is and where it was measured. No state. */
#include "cmd/plan_text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "cmd/output.h"

static const char *const input_units[SPL_PLAN_INPUTS] = {"points",         "views/s", "headroom",    "of them rendered",
                                                         "of them cached", "copies",  "pixels asked"};

const char *spl_plan_put_number(double value, char text[SPL_PLAN_TEXT_MAX])
{
    char digits[32];
    if (value >= 1e10 || (value > 0 && value < 1e-3)) {
        snprintf(digits, sizeof digits, "%.6e", value);
        char *e = strchr(digits, 'e'), *end = e;
        while (end[-1] == '0')
            end--;
        end -= end[-1] == '.';
        snprintf(text, SPL_PLAN_TEXT_MAX, "%.*se%d", (int)(end - digits), digits, (int)floor(log10(value) + 1e-12));
    } else if (value == floor(value)) {
        spl_cmd_group((uint64_t)value, text);
    } else {
        snprintf(text, SPL_PLAN_TEXT_MAX, "%.6g", value);
    }
    return text;
}

/* Three digits, and what is larger whole. */
static void rounded(double value, char text[SPL_PLAN_TEXT_MAX])
{
    if (value >= 99.95)
        spl_cmd_group((uint64_t)(value + 0.5), text);
    else
        snprintf(text, SPL_PLAN_TEXT_MAX, "%.3g", value);
}

static void scaled(double value, const char *const prefixes[], const char *unit, char text[SPL_PLAN_TEXT_MAX])
{
    char digits[SPL_PLAN_TEXT_MAX];
    int i = 0;
    for (; prefixes[i + 1] && value >= 999.5; i++)
        value /= 1000;
    rounded(value, digits);
    snprintf(text, SPL_PLAN_TEXT_MAX, "%.32s %s%s", digits, prefixes[i], unit);
}

const char *spl_plan_put_value(const struct spl_plan *plan, enum spl_plan_line line, char text[SPL_PLAN_TEXT_MAX])
{
    static const char *const prefixes[] = {"", "k", "M", "G", "T", "P", "E", NULL};
    const struct spl_plan_line_row *row = spl_plan_line_row(line);
    const char *units = spl_plan_device_row(plan->asked.device)->units;
    const double value = plan->lines[line].value;
    char digits[SPL_PLAN_TEXT_MAX], unit[32];
    size_t length;
    switch (row->kind) {
    case SPL_PLAN_BYTES:
        scaled(value, prefixes, value < 999.5 ? "bytes" : "B", text);
        return text;
    case SPL_PLAN_BITS:
        scaled(value, prefixes, "bit/s", text);
        return text;
    case SPL_PLAN_SHARE:
        rounded(value * 100, digits);
        snprintf(text, SPL_PLAN_TEXT_MAX, "%.32s %%", digits);
        return text;
    case SPL_PLAN_NUMBER:
        snprintf(unit, sizeof unit, "%s", row->unit);
        break;
    case SPL_PLAN_DEVICES_USED:
        snprintf(unit, sizeof unit, "%s", units);
        break;
    case SPL_PLAN_DEVICE_HOURS:
        snprintf(unit, sizeof unit, "%.*s hours", (int)strlen(units) - 1, units);
        break;
    }
    rounded(value, digits);
    length = strlen(unit);
    if (!strcmp(digits, "1") && !strchr(unit, '/'))
        unit[length - 1] = '\0';
    snprintf(text, SPL_PLAN_TEXT_MAX, "%.32s %s", digits, unit);
    return text;
}

int spl_plan_footnote(const struct spl_plan *plan, enum spl_plan_figure figure)
{
    int count = 0;
    for (int i = 0; i <= (int)figure; i++)
        count += plan->used[i] && spl_plan_figure_row(i)->where[0];
    return spl_plan_figure_row(figure)->where[0] ? count : 0;
}

static void append(char text[SPL_PLAN_TEXT_MAX], const char *format, ...) __attribute__((format(printf, 2, 3)));

static void append(char text[SPL_PLAN_TEXT_MAX], const char *format, ...)
{
    size_t length = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + length, SPL_PLAN_TEXT_MAX - length, format, arguments);
    va_end(arguments);
}

const char *spl_plan_put_arithmetic(const struct spl_plan *plan, enum spl_plan_line line, char text[SPL_PLAN_TEXT_MAX])
{
    char digits[SPL_PLAN_TEXT_MAX];
    text[0] = '\0';
    for (int i = 0; i < plan->lines[line].count; i++) {
        const struct spl_plan_term term = plan->lines[line].terms[i];
        const struct spl_plan_figure_row *figure;
        int note;
        append(text, "%s", !i ? "" : term.op == '*' ? " × " : term.op == '/' ? " ÷ " : " + ");
        switch (term.from) {
        case SPL_PLAN_FROM_INPUT:
            append(text, "%s %s", spl_plan_put_number(plan->inputs[term.which], digits), input_units[term.which]);
            break;
        case SPL_PLAN_FROM_FIGURE:
            figure = spl_plan_figure_row(term.which);
            note = spl_plan_footnote(plan, term.which);
            append(text, "%s %s", spl_plan_put_number(figure->value, digits), figure->unit);
            if (note)
                append(text, " [%d]", note);
            break;
        case SPL_PLAN_FROM_PIXELS:
            figure = spl_plan_figure_row(term.which);
            append(text, "%s pixels measured", spl_plan_put_number((double)figure->width * figure->height, digits));
            break;
        case SPL_PLAN_FROM_LINE:
            append(text, "%s", spl_plan_put_value(plan, term.which, digits));
            break;
        case SPL_PLAN_FROM_NONE:
        case SPL_PLAN_FROM_DEVICE:
        case SPL_PLAN_FROM_SIZED:
            break;
        }
    }
    return text;
}
