/* table.json: one row a condition, its value and a method, one member a figure. What counts as a change stands in
 * `kinds`: more than other processors and drivers of the same kind do by rounding (a few pixels of 19,200), less than
 * what one would see. A row that has become better fails as one that has become worse: the table says what users read,
 * so it is written anew by whoever made the change, who looks at it. Owned by one thread. */
#include "table.h"

#include <jansson.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "conditions.h"

static const struct {
    const char *name;
    bool more_is_better;
    double absolute, relative; /* tolerance: the sum of both */
} kinds[FIGURE_COUNT] = {
    [FIGURE_PSNR] = {"psnr", true, 0.25, 0},
    [FIGURE_SSIM] = {"ssim", true, 0.006, 0},
    [FIGURE_HOLES] = {"holes", false, 0.001, 0.04},
    [FIGURE_SEE_THROUGH] = {"see_through", false, 0.001, 0.04},
    [FIGURE_HALO] = {"halo", false, 0.001, 0.04},
    [FIGURE_DEPTH_BEYOND] = {"depth_beyond", false, 0.002, 0.04},
    [FIGURE_DEPTH_MEDIAN] = {"depth_median", false, 1e-5, 0.08},
    [FIGURE_NORMAL_MEDIAN] = {"normal_median", false, 0.2, 0.05},
    [FIGURE_FLICKER] = {"flicker", false, 0.2, 0.04},
};
static const double psnr_of_equals = 99; /* JSON knows no infinity */

struct table {
    char path[512];
    json_t *rows;
    bool seen[1024];
};

static void must(bool good, const char *path, const char *what)
{
    if (good)
        return;
    fprintf(stderr, "%s: %s\n", path, what);
    exit(1);
}

struct table *table_open(const char *path)
{
    struct table *table = calloc(1, sizeof *table);
    must(table, path, "out of memory");
    snprintf(table->path, sizeof table->path, "%s", path);
    FILE *file = fopen(path, "rb");
    if (!file) {
        table->rows = json_array();
        must(table->rows, path, "out of memory");
        return table;
    }
    json_error_t error;
    json_t *root = json_loadf(file, JSON_REJECT_DUPLICATES, &error);
    fclose(file);
    must(root, path, error.text);
    table->rows = json_incref(json_object_get(root, "rows"));
    json_decref(root);
    must(json_is_array(table->rows) && json_array_size(table->rows) <= sizeof table->seen, path,
         "holds no list 'rows'");
    return table;
}

void table_close(struct table *table)
{
    if (!table)
        return;
    json_decref(table->rows);
    free(table);
}

static bool says(const json_t *row, const char *key, const char *text)
{
    const char *value = json_string_value(json_object_get(row, key));
    return value && !strcmp(value, text);
}

static size_t find(const struct table *table, const struct row *wanted)
{
    size_t i;
    json_t *row;
    json_array_foreach(table->rows, i, row) if (says(row, "condition", wanted->condition) &&
                                                says(row, "value", wanted->value) &&
                                                says(row, "method", wanted->method)) return i;
    return SIZE_MAX;
}

static double number(const json_t *row, int figure)
{
    const json_t *value = json_object_get(row, kinds[figure].name);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static double bounded(double figure)
{
    return figure > psnr_of_equals ? psnr_of_equals : figure;
}

void table_judge(struct table *table, struct report *report, const struct row *row, const char *backend)
{
    struct place place = {row->condition, row->value, row->method, backend};
    size_t at = find(table, row);
    char message[200];
    if (at == SIZE_MAX) {
        report_broken(report, "as-in-the-table", &place, "table.json has no such row; `conditions --update` adds it");
        return;
    }
    table->seen[at] = true;
    const json_t *old = json_array_get(table->rows, at);
    for (int f = 0; f < FIGURE_COUNT; f++) {
        double was = number(old, f), is = bounded(row->figures[f]);
        double tolerance = kinds[f].absolute + kinds[f].relative * fabs(was);
        place.layer = kinds[f].name;
        if ((isnan(was) && isnan(is)) || fabs(is - was) <= tolerance) {
            report->passed++;
            continue;
        }
        bool better = !isnan(is) && !isnan(was) && (is > was) == kinds[f].more_is_better;
        snprintf(message, sizeof message, "%.5g on %s, table.json has %.5g +- %.2g: %s", is, backend, was,
                 isnan(was) ? 0 : tolerance,
                 isnan(is) || isnan(was) ? "OTHER pixels than before. Look at the picture, then `conditions --update`"
                 : better ? "BETTER. Run `conditions --update`, look at the table and its pictures, commit it"
                          : "WORSE. Mend it, or say why and `conditions --update`");
        report_broken(report, "as-in-the-table", &place, message);
    }
}

void table_put(struct table *table, const struct row *row)
{
    size_t at = find(table, row);
    json_t *object =
        json_pack("{s:s, s:s, s:s}", "condition", row->condition, "value", row->value, "method", row->method);
    must(object, table->path, "out of memory");
    if (row->whole)
        must(!json_object_set_new(object, "whole", json_true()), table->path, "out of memory");
    for (int f = 0; f < FIGURE_COUNT; f++) {
        double figure = bounded(row->figures[f]);
        json_t *value = isfinite(figure) ? json_real(figure) : json_null();
        must(!json_object_set_new(object, kinds[f].name, value), table->path, "out of memory");
    }
    if (at == SIZE_MAX) {
        must(!json_array_append_new(table->rows, object), table->path, "out of memory");
        at = json_array_size(table->rows) - 1;
        must(at < sizeof table->seen, table->path, "too many rows");
    } else {
        must(!json_array_set_new(table->rows, at, object), table->path, "out of memory");
    }
    table->seen[at] = true;
}

void table_find_stale(struct table *table, struct report *report, const struct conditions *wanted, bool whole)
{
    size_t i;
    json_t *row;
    json_array_foreach(table->rows, i, row)
    {
        const char *condition = json_string_value(json_object_get(row, "condition"));
        if (table->seen[i] || !conditions_wants(wanted, condition) ||
            (!whole && json_is_true(json_object_get(row, "whole"))))
            continue;
        struct place place = {condition,
                              json_string_value(json_object_get(row, "value")),
                              json_string_value(json_object_get(row, "method")), NULL};
        report_broken(report, "as-in-the-table", &place, "nobody measures this row of table.json any more");
    }
}

void table_save(struct table *table, bool whole)
{
    char temporary[sizeof table->path + 4];
    snprintf(temporary, sizeof temporary, "%s.new", table->path);
    FILE *file = fopen(temporary, "wb");
    must(file, temporary, "cannot be written");
    const char *comma = "";
    size_t i;
    json_t *row;
    fprintf(file, "{\"rows\": [");
    json_array_foreach(table->rows, i, row)
    {
        if (whole && !table->seen[i])
            continue;
        char *text = json_dumps(row, JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(5));
        must(text, table->path, "out of memory");
        fprintf(file, "%s\n%s", comma, text);
        free(text);
        comma = ",";
    }
    fprintf(file, "\n]}\n");
    bool broken = ferror(file);
    must(!fclose(file) && !broken && !rename(temporary, table->path), table->path, "cannot be written");
}
