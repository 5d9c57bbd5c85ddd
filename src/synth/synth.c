/* A scan, streamed: a batch of grid columns is cast and formatted by all threads, each column into its own slot, and
 * written in order by the caller's thread: the files are the same for any number of threads, and memory stays small. */
#include <splatd/synth.h>

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "synth/output.h"
#include "synth/scanner.h"

static const uint64_t points_min = 1000, points_max = 10000000000;
enum { batch_cells = 1 << 18 }; /* about 0.1 s of casting, 20 MB of text */

struct column {
    size_t ptx_bytes, ply_bytes, points;
};

struct scan {
    const struct spl_scene *scene;
    struct spl_scan_grid grid;
    double sigma;
    uint64_t seed;
    size_t station;
    uint64_t first_column;  /* of the batch */
    struct column *columns; /* of the batch */
    char *ptx, *ply;        /* a slot a column; NULL when not asked for */
};

static void cast_columns(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct scan *s = context;
    for (size_t i = begin; i < end; i++) {
        char *ptx = s->ptx ? s->ptx + i * s->grid.rows * SPL_PTX_CELL_MAX : NULL;
        char *ply = s->ply ? s->ply + i * s->grid.rows * SPL_PLY_POINT_BYTES : NULL;
        struct column column = {0};
        for (uint64_t row = 0; row < s->grid.rows; row++) {
            struct spl_return r =
                spl_scanner_cast(s->scene, &s->grid, s->station, s->first_column + i, row, s->sigma, s->seed);
            if (ptx)
                column.ptx_bytes += spl_ptx_cell(ptx + column.ptx_bytes, &r);
            if (ply && r.hit)
                column.ply_bytes += spl_ply_point(ply + column.ply_bytes, &r);
            column.points += r.hit;
        }
        s->columns[i] = column;
    }
}

static int make_directories(const char *path, struct spl_error *err)
{
    char *part = strdup(path);
    if (!part)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    int result = 0;
    for (char *at = part + 1; !result; at++) {
        if (*at && *at != '/')
            continue;
        char kept = *at;
        *at = 0;
        struct stat st;
        if (mkdir(part, 0777) && errno != EEXIST)
            result = spl_fail_errno(err, errno, "the directory %s cannot be made", part);
        else if (!stat(part, &st) && !S_ISDIR(st.st_mode))
            result = spl_fail(err, SPL_E_USAGE, "%s is not a directory", part);
        *at = kept;
        if (!kept)
            break;
    }
    free(part);
    return result;
}

static int parse_formats(const char *formats, bool *ptx, bool *ply, struct spl_error *err)
{
    *ptx = *ply = !formats;
    for (const char *at = formats; at;) {
        size_t length = strcspn(at, ",");
        if (length == 3 && !strncmp(at, "ptx", 3))
            *ptx = true;
        else if (length == 3 && !strncmp(at, "ply", 3))
            *ply = true;
        else
            return spl_fail_field(err, SPL_E_USAGE, "format", "no format '%.*s'; there are: ptx, ply", (int)length, at);
        at = at[length] ? at + length + 1 : NULL;
    }
    return 0;
}

static int check(const struct spl_synth_options *options, struct spl_error *err)
{
    if (options->points < points_min || options->points > points_max)
        return spl_fail_field(err, SPL_E_USAGE, "points", "%llu points; a scan has %llu to %llu",
                              (unsigned long long)options->points, (unsigned long long)points_min,
                              (unsigned long long)points_max);
    if (!isfinite(options->noise) || options->noise > 1)
        return spl_fail_field(err, SPL_E_USAGE, "noise", "a range noise of %g m; it must be 0 to 1", options->noise);
    if (!options->directory || !options->directory[0])
        return spl_fail_field(err, SPL_E_USAGE, "directory", "no directory to write to");
    return 0;
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
                                                .done = done,
                                                .total = last || done > r->total ? done : r->total,
                                                .rate = (double)done / ((double)(now - r->start_ns + 1) / 1e9)});
}

static int scan_station(struct scan *s, const struct spl_synth_options *options, struct spl_output *ptx,
                        struct spl_output *ply, uint64_t batch, struct report *progress, uint64_t *points,
                        struct spl_error *err)
{
    char header[SPL_PTX_HEADER_MAX];
    size_t bytes = spl_ptx_header(header, &s->grid, &s->scene->stations[s->station]);
    int result = s->ptx ? spl_output_write(ptx, header, bytes, err) : 0;
    for (s->first_column = 0; !result && s->first_column < s->grid.columns; s->first_column += batch) {
        uint64_t left = s->grid.columns - s->first_column, count = left < batch ? left : batch;
        spl_parallel_for(options->threads, count, 1, cast_columns, s);
        for (uint64_t i = 0; i < count && !result; i++) {
            if (s->ptx)
                result =
                    spl_output_write(ptx, s->ptx + i * s->grid.rows * SPL_PTX_CELL_MAX, s->columns[i].ptx_bytes, err);
            if (s->ply && !result)
                result = spl_output_write(ply, s->ply + i * s->grid.rows * SPL_PLY_POINT_BYTES, s->columns[i].ply_bytes,
                                          err);
            *points += s->columns[i].points;
        }
        report(progress, *points, false);
    }
    return result;
}

int spl_synth(const struct spl_synth_options *options, uint64_t *points_written, struct spl_error *err)
{
    struct spl_scene *scene = NULL;
    struct spl_output ptx = {.fd = -1}, ply = {.fd = -1};
    struct scan s = {.seed = options->seed};
    struct report progress = {.options = options};
    char header[SPL_PLY_HEADER_BYTES];
    bool want_ptx, want_ply;
    uint64_t points = 0;
    int result = parse_formats(options->formats, &want_ptx, &want_ply, err);
    if (!result)
        result = check(options, err);
    if (!result)
        result = spl_scene_create(options->scene, &scene, err);
    if (!result)
        result = make_directories(options->directory, err);
    if (!result && want_ptx)
        result = spl_output_open(&ptx, options->directory, scene->name, "ptx", err);
    if (!result && want_ply)
        result = spl_output_open(&ply, options->directory, scene->name, "ply", err);
    if (result)
        goto done;

    s.scene = scene;
    s.sigma = options->noise < 0 ? scene->scanner.noise : options->noise;
    s.grid = spl_scanner_fit(scene, options->points, options->threads);
    uint64_t batch = s.grid.rows < batch_cells ? batch_cells / s.grid.rows : 1;
    if (batch > s.grid.columns)
        batch = s.grid.columns;
    s.columns = spl_alloc(batch, sizeof *s.columns, err);
    s.ptx = want_ptx ? spl_alloc_raw(batch * s.grid.rows, SPL_PTX_CELL_MAX, err) : NULL;
    s.ply = want_ply ? spl_alloc_raw(batch * s.grid.rows, SPL_PLY_POINT_BYTES, err) : NULL;
    if (!s.columns || (want_ptx && !s.ptx) || (want_ply && !s.ply)) {
        result = SPL_E_NOMEM;
        goto done;
    }
    snprintf(progress.stage, sizeof progress.stage, "scanning %s", scene->name);
    progress.total = s.grid.expected;
    progress.start_ns = spl_now_ns();
    report(&progress, 0, false);
    spl_ply_header(header, 0, scene->name, options->seed, s.sigma);
    if (want_ply)
        result = spl_output_write(&ply, header, sizeof header, err);
    for (s.station = 0; s.station < scene->station_count && !result; s.station++)
        result = scan_station(&s, options, &ptx, &ply, batch, &progress, &points, err);
    if (result)
        goto done;
    report(&progress, points, true);
    spl_ply_header(header, points, scene->name, options->seed, s.sigma);
    if (want_ply)
        result = spl_output_write_at(&ply, header, sizeof header, 0, err);
    if (want_ptx && !result)
        result = spl_output_commit(&ptx, err);
    if (want_ply && !result)
        result = spl_output_commit(&ply, err);
    if (!result && points_written)
        *points_written = points;
done:
    free(s.columns);
    free(s.ptx);
    free(s.ply);
    spl_output_finish(&ptx);
    spl_output_finish(&ply);
    spl_scene_destroy(scene);
    return result;
}
