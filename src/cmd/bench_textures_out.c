/* What 'splatd bench --textures' says: table 1 of the sparse-coding paper, table 3, and the files of its folder. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "cmd/bench_textures.h"
#include "cmd/output.h"

static int write_file(const char *folder, const char *name, const char *text, size_t length, struct spl_error *err)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "%s: the path is too long", folder);
    return spl_cmd_write_output(path, text, length, err);
}

/* One row a coding, as a spreadsheet reads it; inf and nan are words that it knows. */
static int write_rows(const struct spl_textures_report *report, const char *folder, struct spl_error *err)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (!out)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the table");
    fputs("name,geometry_bytes,color_bytes,codes_bytes,shared_bytes,psnr_db,packed_views_db,packed_tile_db,left_out_"
          "views_db,left_out_tile_db,atoms,"
          "dictionary,trained_on,seconds\n",
          out);
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *r = &report->row[i];
        fprintf(out, "\"%s\",%.4f,%.4f,%.4f,%.4f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%u,%llu,%.1f\n", r->name,
                report->geometry, r->color, r->codes, r->shared, r->psnr, r->packed.psnr, r->packed.tile,
                r->left_out.psnr, r->left_out.tile, r->atoms, r->count, (unsigned long long)r->sample, r->seconds);
    }
    int rc = fclose(out) ? spl_fail(err, SPL_E_NOMEM, "out of memory: the table") : 0;
    if (!rc)
        rc = write_file(folder, "textures.csv", text, length, err);
    free(text);
    return rc;
}

static int write_epochs(const struct spl_textures_report *report, const char *folder, struct spl_error *err)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (!out)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the table");
    fputs("method,epoch,seconds,psnr_db,atoms\n", out);
    for (uint32_t i = 0; i < report->batches_epochs; i++)
        fprintf(out, "mini-batches,%u,%.2f,%.3f,%.3f\n", report->batches[i].epoch, report->batches[i].seconds,
                report->batches[i].psnr, report->batches[i].atoms_per_splat);
    for (uint32_t i = 0; i < report->ksvd_epochs; i++)
        fprintf(out, "k-SVD,%u,%.2f,%.3f,%.3f\n", report->ksvd[i].epoch, report->ksvd[i].seconds, report->ksvd[i].psnr,
                report->ksvd[i].atoms_per_splat);
    int rc = fclose(out) ? spl_fail(err, SPL_E_NOMEM, "out of memory: the table") : 0;
    if (!rc)
        rc = write_file(folder, "training.csv", text, length, err);
    free(text);
    return rc;
}

static int write_charts(const struct spl_textures_report *report, const char *folder, struct spl_error *err)
{
    char *svg = NULL;
    size_t length = 0;
    int rc = report->batches_epochs ? spl_textures_chart_training(report, &svg, &length, err) : 0;
    if (!rc && svg)
        rc = write_file(folder, "training.svg", svg, length, err);
    free(svg);
    svg = NULL;
    if (!rc) {
        rc = spl_textures_chart_rate(report, &svg, &length, err);
        if (!rc)
            rc = write_file(folder, "rate.svg", svg, length, err);
        free(svg);
    }
    return rc;
}

int spl_cmd_write_textures(const struct spl_textures_report *report, const char *folder, struct spl_error *err)
{
    int rc = write_rows(report, folder, err);
    if (!rc)
        rc = write_epochs(report, folder, err);
    if (!rc)
        rc = write_charts(report, folder, err);
    return rc;
}

/* A figure, or a dash where it was not measured. */
static void print_figure(int width, int digits, double value)
{
    if (isnan(value))
        printf(" %*s", width, "-");
    else
        printf(" %*.*f", width, digits, value);
}

static void print_row(const struct spl_textures_report *report, const struct spl_textures_row *r,
                      const struct spl_textures_row *whole)
{
    double texture = spl_textures_row_bytes(r), all = report->geometry + texture;
    printf("%-24s", r->name);
    print_figure(7, 2, report->geometry > 0 ? report->geometry : NAN);
    print_figure(7, 2, r->color);
    print_figure(7, 2, r->codes);
    print_figure(7, 2, r->shared);
    print_figure(8, 2, all);
    print_figure(8, 1, all * (double)report->splats / 1e6);
    print_figure(6, 1, whole ? (report->geometry + spl_textures_row_bytes(whole)) / all : NAN);
    print_figure(6, 1, whole ? spl_textures_row_bytes(whole) / texture : NAN);
    print_figure(7, 2, r->psnr);
    print_figure(7, 2, r->packed.psnr);
    print_figure(6, 2, r->packed.tile);
    print_figure(7, 2, r->left_out.psnr);
    print_figure(6, 2, r->left_out.tile);
    print_figure(6, 2, r->atoms);
    if (r->count)
        printf(" %7u", r->count);
    puts("");
}

/* Figure 9 of the paper, a line a coding. */
static void print_atoms(const struct spl_textures_report *report)
{
    bool any = false;
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *r = &report->row[i];
        if (!r->count || r->kind == SPL_TEXTURES_PACKED)
            continue;
        if (!any)
            printf("\n%-24s %6d %6d %6d %6d %6d %6d %6d %6d %6d\n", "% of textures by atoms", 0, 1, 2, 3, 4, 5, 6, 7,
                   8);
        any = true;
        printf("%-24s", r->name);
        for (int k = 0; k <= SPL_ATOMS_MAX; k++)
            printf(" %6.1f", 100 * r->shares[k]);
        puts("");
    }
}

/* What the adaptive coding needs at the quality of each other row. */
static void print_rates(const struct spl_textures_report *report)
{
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *r = &report->row[i];
        double ours = spl_textures_bytes_at(report, r->psnr), theirs = spl_textures_row_bytes(r);
        if (r->kind == SPL_TEXTURES_OURS || isnan(ours))
            continue;
        printf("at the quality of %s, %.2f dB: adaptive %.2f bytes a splat without geometry, %.0f %% of its %.2f",
               r->name, r->psnr, ours, 100 * ours / theirs, theirs);
        if (report->geometry > 0)
            printf("; with geometry %.2f of %.2f, %.0f %%", report->geometry + ours, report->geometry + theirs,
                   100 * (report->geometry + ours) / (report->geometry + theirs));
        puts("");
    }
}

void spl_cmd_print_textures(const struct spl_textures_report *report, const struct spl_projected_report *projected)
{
    const struct spl_textures_row *whole = NULL;
    for (uint32_t i = 0; i < report->rows && !whole; i++)
        if (report->row[i].kind == SPL_TEXTURES_PHOTOGRAPHS)
            whole = &report->row[i];
    static const char layout[] = "%-24s %7s %7s %7s %7s %8s %8s %6s %6s %7s %7s %6s %7s %6s %6s %7s\n";
    printf(layout, "bytes a splat", "geo-", "colour", "codes", "atoms,", "in all", "in all", "T_all", "T_tex",
           "PSNR of", "packed", "", "left", "", "atoms", "dictio-");
    printf(layout, "", "metry", "or id", "", "photos", "", "MB", "", "", "texture", "views", "tile", "out", "tile", "",
           "nary");
    for (uint32_t i = 0; i < report->rows; i++)
        print_row(report, &report->row[i], whole);
    for (uint32_t i = 0; i < report->rows; i++)
        if (report->row[i].sample)
            printf("%s: trained on %llu of the textures, measured on others\n", report->row[i].name,
                   (unsigned long long)report->row[i].sample);
    if (*report->left_away)
        printf("left away, %s\n", report->left_away);
    if (projected)
        printf("views: %u that were packed, %llu pixels; %u left out, %llu pixels; PSNR of frames against photographs, "
               "of all pixels and of the median tile of %d x %d\n",
               projected->packed.views, (unsigned long long)projected->packed.pixels, projected->left_out.views,
               (unsigned long long)projected->left_out.pixels, SPL_PROJECTED_TILE, SPL_PROJECTED_TILE);
    print_rates(report);
    print_atoms(report);
}

void spl_cmd_print_passes(const struct spl_device_info *device, const struct spl_passes_view *views)
{
    printf("\n%s, %s: milliseconds at lod 1, medians\n", device->name, device->backend);
    for (int v = 0; v < SPL_PASSES_VIEWS; v++) {
        printf("%.1f of the default view's distance, %llu splats, %.0f %% of the pixels covered\n", views[v].distance,
               (unsigned long long)views[v].splats, 100 * views[v].covered);
        printf("  %-10s %8s %10s %9s %8s %8s %8s\n", "atoms", "culling", "visibility", "attribute", "resolve", "frame",
               "times 0");
        for (int cap = 0; cap < SPL_PASSES_CAPS; cap++) {
            const struct spl_passes_times *t = &views[v].times[cap];
            printf("  %-10u %8.2f %10.2f %9.2f %8.2f %8.2f %8.2f\n", spl_passes_caps[cap], t->select, t->depth,
                   t->shade, t->resolve, t->frame, t->frame / views[v].times[0].frame);
        }
    }
}
