/* A scan, streamed: a batch of columns of pulses is cast and formatted by all threads, each column into its own slot,
 * and written in order by the caller's thread: the files are the same for any number of threads, and memory stays
 * small. */
#include "synth/synth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "synth/format.h"
#include "synth/output.h"

static const uint64_t points_min = 1000, points_max = 10000000000;
enum { batch_pulses = 1 << 18 }; /* about 0.1 s of casting, 20 MB of text */

static const struct spl_scan_format *const formats[] = {&spl_format_ptx, &spl_format_ply, &spl_format_las};
enum { formats_count = sizeof formats / sizeof *formats };

struct column {
    size_t bytes[formats_count], points;
    uint64_t by_return[SPL_SCANNER_RETURNS_MAX];
    double bounds[2][3];
};

struct scan {
    struct spl_scan_file file;
    struct spl_scan_grid grid;
    struct spl_scan_faults faults;
    size_t pass;
    uint64_t first_column;  /* of the batch */
    struct column *columns; /* of the batch */
    bool wanted[formats_count];
    size_t slot_bytes[formats_count]; /* of a column */
    char *slots[formats_count];       /* NULL when not asked for */
    struct spl_output output[formats_count];
};

static void note(struct column *column, const struct spl_return *r)
{
    for (int i = 0; i < 3; i++) {
        column->bounds[0][i] = fmin(column->bounds[0][i], r->scene[i]);
        column->bounds[1][i] = fmax(column->bounds[1][i], r->scene[i]);
    }
    column->by_return[r->number - 1]++;
    column->points++;
}

static void cast_columns(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    static const struct spl_return sky;
    struct scan *s = context;
    for (size_t i = begin; i < end; i++) {
        struct column column = {.bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}};
        for (uint64_t row = 0; row < s->grid.rows; row++) {
            struct spl_return returns[SPL_SCANNER_RETURNS_MAX];
            unsigned count =
                spl_scanner_cast(s->file.scene, &s->grid, &s->faults, s->pass, s->first_column + i, row, returns);
            for (unsigned r = 0; r < count; r++)
                note(&column, &returns[r]);
            for (size_t f = 0; f < formats_count; f++) {
                if (!s->wanted[f])
                    continue;
                char *slot = s->slots[f] + i * s->slot_bytes[f];
                for (unsigned r = 0; r < count; r++)
                    column.bytes[f] += formats[f]->record(slot + column.bytes[f], &s->file, &returns[r]);
                if (!count && formats[f]->structured)
                    column.bytes[f] += formats[f]->record(slot + column.bytes[f], &s->file, &sky);
            }
        }
        s->columns[i] = column;
    }
}

/* Default: PLY, and with it PTX from a tripod and LAS from everything that moves. */
static int choose_formats(const char *list, bool classes, const struct spl_scene *scene, bool wanted[formats_count],
                          struct spl_error *err)
{
    bool structured = scene->scanner.kind == SPL_SCANNER_TERRESTRIAL;
    if (!list)
        list = structured && classes ? "ply" : structured ? "ptx,ply" : "ply,las";
    for (const char *at = list; at;) {
        size_t length = strcspn(at, ","), f = 0;
        while (f < formats_count && (strlen(formats[f]->name) != length || strncmp(at, formats[f]->name, length)))
            f++;
        if (f == formats_count)
            return spl_fail_field(err, SPL_E_USAGE, "format", "no format '%.*s'; there are: ptx, ply, las", (int)length,
                                  at);
        if (formats[f]->structured && !structured)
            return spl_fail_field(err, SPL_E_USAGE, "format",
                                  "%s is scanned on the move, which %s cannot hold; there are: ply, las", scene->name,
                                  formats[f]->name);
        if (formats[f]->structured && classes)
            return spl_fail_field(err, SPL_E_USAGE, "format", "%s has no room for classes; there are: ply, las",
                                  formats[f]->name);
        wanted[f] = true;
        at = at[length] ? at + length + 1 : NULL;
    }
    return 0;
}

static int check_range(const char *field, const char *what, double value, double high, const char *unit,
                       struct spl_error *err)
{
    if (!(value >= 0 && value <= high))
        return spl_fail_field(err, SPL_E_USAGE, field, "a %s of %g%s; it must be 0 to %g", what, value, unit, high);
    return 0;
}

static int check(const struct spl_synth_options *o, struct spl_error *err)
{
    if (o->points < points_min || o->points > points_max)
        return spl_fail_field(err, SPL_E_USAGE, "points", "%llu points; a scan has %llu to %llu",
                              (unsigned long long)o->points, (unsigned long long)points_min,
                              (unsigned long long)points_max);
    if (!o->directory || !o->directory[0])
        return spl_fail_field(err, SPL_E_USAGE, "directory", "no directory to write to");
    int result = check_range("noise", "range noise", isfinite(o->noise) && o->noise < 0 ? 0 : o->noise, 1, " m", err);
    if (!result)
        result = check_range("mixed", "share of mixed pixels", o->mixed, 1, "", err);
    if (!result)
        result = check_range("dropout", "share of dropouts", o->dropout, 0.9, "", err);
    if (!result)
        result = check_range("misregister", "misregistration", o->misregister, 10, " m", err);
    return result;
}

struct report {
    const struct spl_synth_options *options;
    char stage[64];
    uint64_t total, start_ns, last_ns;
};

static void report(struct report *r, uint64_t done, bool last)
{
    uint64_t now = spl_now_ns();
    if (!r->options->progress || (!last && now - r->last_ns < 100 * SPL_NS_PER_MS))
        return;
    r->last_ns = now;
    r->options->progress(r->options->progress_context,
                         &(struct spl_progress){.stage = r->stage,
                                                .unit = "points",
                                                .done = done,
                                                .total = last || done > r->total ? done : r->total,
                                                .rate = (double)done / ((double)(now - r->start_ns + 1) / 1e9)});
}

static int write_pass_headers(struct scan *s, struct spl_error *err)
{
    char header[SPL_SCAN_HEADER_MAX];
    int result = 0;
    for (size_t f = 0; f < formats_count && !result; f++)
        if (s->wanted[f] && formats[f]->pass_header)
            result = spl_output_write(&s->output[f], header, formats[f]->pass_header(header, &s->file, s->pass), err);
    return result;
}

static int write_column(struct scan *s, uint64_t i, struct spl_error *err)
{
    const struct column *column = &s->columns[i];
    struct spl_scan_file *file = &s->file;
    int result = 0;
    for (size_t f = 0; f < formats_count && !result; f++)
        if (s->wanted[f])
            result = spl_output_write(&s->output[f], s->slots[f] + i * s->slot_bytes[f], column->bytes[f], err);
    for (int k = 0; k < 3; k++) {
        file->bounds[0][k] = fmin(file->bounds[0][k], column->bounds[0][k]);
        file->bounds[1][k] = fmax(file->bounds[1][k], column->bounds[1][k]);
    }
    for (int k = 0; k < SPL_SCANNER_RETURNS_MAX; k++)
        file->by_return[k] += column->by_return[k];
    file->points += column->points;
    return result;
}

/* The files' headers, with what is known by now. */
static int write_headers(struct scan *s, struct spl_error *err)
{
    char header[SPL_SCAN_HEADER_MAX];
    int result = 0;
    for (size_t f = 0; f < formats_count && !result; f++)
        if (s->wanted[f] && formats[f]->header)
            result = spl_output_write_at(&s->output[f], header, formats[f]->header(header, &s->file), 0, err);
    return result;
}

static int scan_passes(struct scan *s, const struct spl_synth_options *options, uint64_t batch, struct report *progress,
                       struct spl_error *err)
{
    int result = write_headers(s, err);
    for (s->pass = 0; s->pass < s->file.scene->station_count && !result; s->pass++) {
        result = write_pass_headers(s, err);
        for (s->first_column = 0; !result && s->first_column < s->grid.columns; s->first_column += batch) {
            uint64_t left = s->grid.columns - s->first_column, count = left < batch ? left : batch;
            spl_parallel_for(options->threads, count, 1, cast_columns, s);
            for (uint64_t i = 0; i < count && !result; i++)
                result = write_column(s, i, err);
            report(progress, s->file.points, false);
        }
    }
    return result ? result : write_headers(s, err);
}

static int take_memory(struct scan *s, uint64_t batch, struct spl_error *err)
{
    s->columns = spl_alloc(batch, sizeof *s->columns, err);
    if (!s->columns)
        return SPL_E_NOMEM;
    for (size_t f = 0; f < formats_count; f++) {
        if (!s->wanted[f])
            continue;
        s->slot_bytes[f] = s->grid.rows * s->file.scene->scanner.returns * formats[f]->record_max;
        s->slots[f] = spl_alloc_raw(batch, s->slot_bytes[f], err);
        if (!s->slots[f])
            return SPL_E_NOMEM;
    }
    return 0;
}

int spl_synth(const struct spl_synth_options *options, uint64_t *points_written, struct spl_error *err)
{
    struct spl_scene *scene = NULL;
    struct scan s = {
        .faults = {.seed = options->seed,
                   .mixed = options->mixed,
                   .dropout = options->dropout,
                   .misregister = options->misregister},
        .file = {.bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}},
    };
    struct report progress = {.options = options};
    for (size_t f = 0; f < formats_count; f++)
        s.output[f].fd = -1;
    int result = check(options, err);
    if (!result)
        result = spl_scene_create_part(options->scene, options->without, options->only, &scene, err);
    if (!result)
        result = choose_formats(options->formats, options->classes, scene, s.wanted, err);
    if (!result)
        result = spl_output_make_directory(options->directory, err);
    for (size_t f = 0; f < formats_count && !result; f++)
        if (s.wanted[f])
            result = spl_output_open(&s.output[f], options->directory, scene->name, formats[f]->name, err);
    if (result)
        goto done;

    s.file.scene = scene;
    s.file.grid = &s.grid;
    s.file.faults = &s.faults;
    s.file.classes = options->classes;
    s.faults.noise = options->noise < 0 ? scene->scanner.noise : options->noise;
    s.grid = spl_scanner_fit(scene, &s.faults, options->points, options->threads);
    uint64_t in_column = s.grid.rows * scene->scanner.returns;
    uint64_t batch = in_column < batch_pulses ? batch_pulses / in_column : 1;
    if (batch > s.grid.columns)
        batch = s.grid.columns;
    result = take_memory(&s, batch, err);
    if (result)
        goto done;
    snprintf(progress.stage, sizeof progress.stage, "scanning %s", scene->name);
    progress.total = s.grid.expected;
    progress.start_ns = spl_now_ns();
    report(&progress, 0, false);
    result = scan_passes(&s, options, batch, &progress, err);
    if (result)
        goto done;
    report(&progress, s.file.points, true);
    for (size_t f = 0; f < formats_count && !result; f++) {
        if (!s.wanted[f])
            continue;
        result = spl_output_commit(&s.output[f], err);
        if (!result && options->file)
            options->file(options->file_context, s.output[f].path);
    }
    if (!result && points_written)
        *points_written = s.file.points;
done:
    free(s.columns);
    for (size_t f = 0; f < formats_count; f++) {
        free(s.slots[f]);
        spl_output_finish(&s.output[f]);
    }
    spl_scene_destroy(scene);
    return result;
}
