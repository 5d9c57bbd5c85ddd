/* A plan as people and scripts read it: every line is its value and the sum that made it, then what no sum says, then
 * each figure with where it was measured. Owned by the command's thread. */
#include "cmd/plan_print.h"

#include <string.h>

#include "cmd/options.h"
#include "cmd/plan_text.h"

enum { COLUMN_VALUE = 36, COLUMN_OF = 58, LINE_MAX_COLUMNS = 120 };

static const char *const sections[SPL_PLAN_SECTIONS] = {
    "Scans", "Packing", "Storage", "Rendering", "Network", "Memory", "What drives the cost"};

static const char beyond[] =
    "This size. It is larger than some figures were measured at; sums that have pixels in them "
    "show which grow with it.";

static const char *const unknown[] = {
    "What a GPU hour, a core hour, a TB stored and a TB sent cost: yours to multiply. The order above is that of a "
    "service "
    "whose GPUs cost most.",
    "Whether views spread evenly. A dataset is one daemon's (deploy/haproxy.cfg), a daemon draws on the devices of one "
    "machine, so what all look at has the views a second of one machine, whatever the sum says.",
    "Datasets as one on servers: how long who comes to a new place waits for its parts, each of which is opened with "
    "two requests when a view first needs it.",
    "Packs of more than 100 million points. One dataset of many machines is packed in parts (splatd pack --plan), "
    "beside each other, for 1.1 to 1.25 of the core hours, and becomes a collection.",
    "Many clients whose pages come and go: the two frame times behind that row of devices are of one client, of 100 "
    "million points, pages on a local disk, a quarter of the memory that was wanted.",
    "Other scans: 7.1 to 9.3 bytes a splat were measured, 11.9 with times; LAZ of 5.5 bytes a point, JPEGs of 65 to "
    "324 kB "
    "at 1280x720.",
    "A machine lost, a service in two places, TLS, backups, tours, videos, map tiles: not in these sums.",
};

/* Columns that a text takes: × and ÷ are two bytes each. */
static size_t columns(const char *text)
{
    size_t count = 0;
    for (; *text; text++)
        count += ((unsigned char)*text & 0xc0) != 0x80;
    return count;
}

/* What does not fit behind the value stands below it. */
static void print_line(FILE *out, const struct spl_plan *plan, enum spl_plan_line line)
{
    const struct spl_plan_line_row *row = spl_plan_line_row(line);
    char text[SPL_PLAN_TEXT_MAX], value[SPL_PLAN_TEXT_MAX];
    fprintf(out, "  %-*s%18s", COLUMN_VALUE - 2, row->what, spl_plan_put_value(plan, line, value));
    if (plan->lines[line].count > 1) {
        spl_plan_put_arithmetic(plan, line, value);
        snprintf(text, sizeof text, "= %.*s", SPL_PLAN_TEXT_MAX - 3, value);
        const bool fits = columns(text) <= LINE_MAX_COLUMNS - COLUMN_OF;
        fprintf(out, "%s%s\n", fits ? "  " : "", fits ? text : "");
        if (!fits)
            spl_cmd_print_wrapped(out, 0, 6, text);
    } else {
        fprintf(out, "\n");
    }
    if (row->note)
        fprintf(out, "      %s\n", row->note);
}

void spl_plan_print(FILE *out, const struct spl_plan *plan)
{
    const struct spl_plan_asked *asked = &plan->asked;
    char text[SPL_PLAN_TEXT_MAX];
    int section = -1;
    fprintf(out, "%s points, ", spl_plan_put_number(asked->points, text));
    fprintf(out, "%s views/s of %ux%u, on: %s\n", spl_plan_put_number(asked->views, text), asked->size[0],
            asked->size[1], spl_plan_device_row(asked->device)->what);
    for (int line = 0; line < SPL_PLAN_LINES; line++) {
        if (!plan->lines[line].known)
            continue;
        if ((int)spl_plan_line_row(line)->section != section)
            fprintf(out, "\n%s\n", sections[section = (int)spl_plan_line_row(line)->section]);
        print_line(out, plan, line);
    }
    fprintf(out, "\nWhat this does not know\n");
    if (plan->beyond) {
        fprintf(out, "  -");
        spl_cmd_print_wrapped(out, 3, 5, beyond);
    }
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) {
        fprintf(out, "  -");
        spl_cmd_print_wrapped(out, 3, 5, unknown[i]);
    }
    fprintf(out, "\nWhat it was reckoned with\n");
    for (int i = 0; i < SPL_PLAN_FIGURES; i++) {
        const struct spl_plan_figure_row *row = spl_plan_figure_row(i);
        if (plan->used[i] && row->where[0])
            fprintf(out, "  [%d]%s %s %s: %s\n       %s\n", spl_plan_footnote(plan, i),
                    spl_plan_footnote(plan, i) < 10 ? " " : "", spl_plan_put_number(row->value, text), row->unit,
                    row->what, row->where);
    }
}

static json_t *line_to_json(const struct spl_plan *plan, enum spl_plan_line line)
{
    static const char *const units[] = {
        [SPL_PLAN_BYTES] = "bytes", [SPL_PLAN_BITS] = "bit/s", [SPL_PLAN_SHARE] = "of all"};
    const struct spl_plan_line_row *row = spl_plan_line_row(line);
    const char *device = spl_plan_device_row(plan->asked.device)->units, *unit = row->unit;
    char text[SPL_PLAN_TEXT_MAX];
    if (row->kind == SPL_PLAN_DEVICES_USED || row->kind == SPL_PLAN_DEVICE_HOURS)
        unit = row->kind == SPL_PLAN_DEVICES_USED ? device : "device hours";
    else if (row->kind != SPL_PLAN_NUMBER)
        unit = units[row->kind];
    return json_pack("{s:s, s:s, s:s, s:f, s:s, s:s}", "name", row->name, "section", sections[row->section], "what",
                     row->what, "value", plan->lines[line].value, "unit", unit, "sum",
                     spl_plan_put_arithmetic(plan, line, text));
}

json_t *spl_plan_to_json(const struct spl_plan *plan)
{
    const struct spl_plan_asked *asked = &plan->asked;
    json_t *lines = json_array(), *figures = json_array(), *open = json_array();
    for (int line = 0; line < SPL_PLAN_LINES; line++)
        if (plan->lines[line].known)
            json_array_append_new(lines, line_to_json(plan, line));
    for (int i = 0; i < SPL_PLAN_FIGURES; i++) {
        const struct spl_plan_figure_row *row = spl_plan_figure_row(i);
        if (plan->used[i] && row->where[0])
            json_array_append_new(figures, json_pack("{s:i, s:s, s:f, s:s, s:s, s:s}", "number",
                                                     spl_plan_footnote(plan, i), "name", row->name, "value", row->value,
                                                     "unit", row->unit, "what", row->what, "measured", row->where));
    }
    if (plan->beyond)
        json_array_append_new(open, json_string(beyond));
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        json_array_append_new(open, json_string(unknown[i]));
    return json_pack("{s:{s:f, s:f, s:s, s:[i,i], s:f, s:f, s:f}, s:o, s:o, s:o}", "asked", "points", asked->points,
                     "views_per_second", asked->views, "gpu", spl_plan_device_row(asked->device)->name, "size",
                     (int)asked->size[0], (int)asked->size[1], "cached", asked->cached, "headroom", asked->headroom,
                     "copies", asked->copies, "lines", lines, "figures", figures, "unknown", open);
}
