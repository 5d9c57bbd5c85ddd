/* Frame times for people and for programs. Pure but for stdout. */
#include <jansson.h>
#include <stdio.h>

#include "cmd/bench.h"

static const char *name_soft(const struct spl_soft_params *soft)
{
    return soft->what.count ? spl_soft_model_name(soft->model) : "solid";
}

void spl_cmd_bench_print_table(const struct spl_bench_options *o, const struct spl_bench_report *r)
{
    printf("%ux%u, %u frames a row, medians in ms; 1 unit = %.1f ms (quartiles %.1f to %.1f)\n", o->width, o->height,
           o->frames, r->calibrator.median, r->calibrator.q1, r->calibrator.q3);
    for (size_t i = 0; i < o->device_count; i++) {
        const struct spl_bench_row *row = &r->rows[i * o->method_count * o->lod_count * o->soft_count];
        printf("%s = %s, %s\n", row->device.backend, row->device.name, row->device.driver);
    }
    const int soft = o->soft_count > 1 ? 11 : 0; // the column is there where it says something
    printf("\n%-16s %-7s %-7s %*s%4s %8s %8s %8s %6s %6s %7s %7s %6s %6s %6s %8s %9s %10s%s\n", "dataset", "device",
           "method", -soft, soft ? "soft" : "", "lod", "frame", "q1", "q3", "units", "floor", "select", "upload",
           "clear", "depth", "shade", "resolve", "readback", "splats", soft ? " soft ms    spheres" : "");
    for (size_t i = 0; i < r->row_count; i++) {
        const struct spl_bench_row *row = &r->rows[i];
        printf("%-16.16s %-7s %-7s %*s%4g %8.1f %8.1f %8.1f %6.2f %6.2f %7.1f %7.1f %6.1f %6.1f %6.1f %8.1f %9.1f "
               "%10.0f",
               spl_dataset_get_info(row->dataset)->id, row->device.backend, spl_method_name(row->method), -soft,
               soft ? name_soft(row->drawn_soft) : "", row->lod, row->frame.median, row->frame.q1, row->frame.q3,
               row->units.median, row->floor / r->calibrator.median, row->select, row->upload, row->clear, row->depth,
               row->shade, row->resolve, row->readback, row->splats);
        if (soft)
            printf(" %7.1f %10.0f", row->soft, row->spheres);
        putchar('\n');
        if (row->panels || row->meshes || row->lines)
            printf("%-16s and %.0f panels, %.0f meshes, %.0f lines\n", "", row->panels, row->meshes, row->lines);
        if (row->incomplete)
            printf("%-16s %u of %u frames with coarser nodes in the place of pages that were not resident\n", "",
                   row->incomplete, o->frames);
    }
    printf("\nunits: frame / calibrator beside it; floor: units that plain C takes to scatter as many one-pixel "
           "points.\n");
}

static json_t *summary_json(const struct spl_summary *s)
{
    return json_pack("{s:f, s:f, s:f, s:f, s:f}", "min", s->min, "q1", s->q1, "median", s->median, "q3", s->q3, "max",
                     s->max);
}

static json_t *passes_json(const struct spl_bench_row *row)
{
    json_t *passes = json_object();
#define STAGE(name) json_object_set_new(passes, #name, json_real(row->name));
#include "render/stages.def"
#undef STAGE
    return passes;
}

static json_t *row_json(const struct spl_bench_row *row)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(row->dataset);
    return json_pack(
        "{s:s, s:I, s:s, s:s, s:s, s:s, s:f, s:o, s:f, s:o, s:f, s:o, s:f, s:f, s:f, s:f, s:f, s:f, s:s, s:i, s:I}",
        "dataset", info->id, "leaf_splats", (json_int_t)info->leaf_splats, "backend", row->device.backend, "device",
        row->device.name, "driver", row->device.driver, "method", spl_method_name(row->method), "lod", row->lod,
        "frame_ms", summary_json(&row->frame), "processor_ms", row->processor, "units", summary_json(&row->units),
        "floor_ms", row->floor, "passes_ms", passes_json(row), "splats_drawn", row->splats, "panels_drawn", row->panels,
        "meshes_drawn", row->meshes, "lines_drawn", row->lines, "chunks_drawn", row->chunks, "spheres_drawn",
        row->spheres, "soft", name_soft(row->drawn_soft), "incomplete_frames", (int)row->incomplete, "memory_bytes",
        (json_int_t)row->memory);
}

int spl_cmd_bench_print_json(const struct spl_bench_options *o, const struct spl_bench_report *r, struct spl_error *err)
{
    json_t *rows = json_array();
    for (size_t i = 0; i < r->row_count; i++)
        json_array_append_new(rows, row_json(&r->rows[i]));
    json_t *root = json_pack("{s:s, s:i, s:i, s:i, s:o, s:o}", "version", SPLATD_VERSION, "width", (int)o->width,
                             "height", (int)o->height, "frames", (int)o->frames, "calibrator_ms",
                             summary_json(&r->calibrator), "rows", rows);
    int failed = !root || json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(6)) || putchar('\n') == EOF;
    json_decref(root);
    return failed ? spl_fail(err, SPL_E_IO, "writing the figures failed") : 0;
}
