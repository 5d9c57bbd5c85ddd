/* What 'splatd bench --textures' draws: training's quality against seconds, textures' against bytes. A point says all
 * of itself to the pointer; photographs as they are have no error, so they are not on the chart. And the bytes that our
 * curve has at a quality. One thread. */
#include <math.h>
#include <stdio.h>

#include "measure/textures.h"

enum { cut_off = 40 };

static uint32_t place_epochs(const struct spl_train_progress *epochs, uint32_t count, struct spl_chart_point *points)
{
    for (uint32_t i = 0; i < count; i++) {
        points[i] = (struct spl_chart_point){
            .ms = epochs[i].seconds, .psnr = epochs[i].psnr, .index = -1, .front = i + 1 == count};
        snprintf(points[i].detail, sizeof points[i].detail, "epoch %u, %.2f atoms a splat", epochs[i].epoch,
                 epochs[i].atoms_per_splat);
    }
    return count;
}

int spl_textures_chart_training(const struct spl_textures_report *report, char **svg, size_t *length,
                                struct spl_error *err)
{
    struct spl_chart_point points[2][SPL_TEXTURES_EPOCHS_MAX];
    struct spl_chart_curve curves[2] = {{.name = "mini-batches", .points = points[0]},
                                        {.name = "k-SVD", .color = 1, .points = points[1]}};
    curves[0].count = place_epochs(report->batches, report->batches_epochs, points[0]);
    curves[1].count = place_epochs(report->ksvd, report->ksvd_epochs, points[1]);
    char subtitle[160];
    snprintf(subtitle, sizeof subtitle,
             "%u atoms, up to %d a splat until %.0f dB, %llu textures; weights not yet quantised", report->dictionary,
             SPL_ATOMS_MAX, (double)cut_off,
             (unsigned long long)(report->batches_epochs ? report->batches[0].sample : 0));
    return spl_chart_write(&(struct spl_chart){.title = "Training: quality against time",
                                               .subtitle = subtitle,
                                               .axis = "seconds",
                                               .unit = "s",
                                               .note = "a point is an epoch",
                                               .curves = curves,
                                               .curve_count = 2},
                           svg, length, err);
}

int spl_textures_chart_rate(const struct spl_textures_report *report, char **svg, size_t *length, struct spl_error *err)
{
    struct spl_chart_point points[4][SPL_TEXTURES_ROWS_MAX];
    struct spl_chart_curve curves[4] = {{.name = "adaptive", .points = points[0]},
                                        {.name = "the paper's coding", .color = 1, .points = points[1]},
                                        {.name = "photographs", .color = 2, .dash = 2, .points = points[2]},
                                        {.name = "the dataset", .color = 3, .points = points[3]}};
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *row = &report->row[i];
        bool ours = row->kind == SPL_TEXTURES_OURS;
        if (!isfinite(row->psnr) || row->kind == SPL_TEXTURES_OTHER)
            continue;
        struct spl_chart_curve *curve = &curves[ours                                    ? 0
                                                : row->kind == SPL_TEXTURES_PAPER       ? 1
                                                : row->kind == SPL_TEXTURES_PHOTOGRAPHS ? 2
                                                                                        : 3];
        struct spl_chart_point *point = &points[curve - curves][curve->count++];
        *point = (struct spl_chart_point){
            .ms = report->geometry + spl_textures_row_bytes(row), .psnr = row->psnr, .index = -1, .front = ours};
        snprintf(point->label, sizeof point->label, "%s", ours ? "" : row->name);
        snprintf(point->detail, sizeof point->detail, "%s: codes %.2f, dictionary or photographs %.2f", row->name,
                 row->codes, row->shared);
    }
    return spl_chart_write(&(struct spl_chart){.title = "Textures: quality against bytes a splat",
                                               .subtitle = report->geometry > 0
                                                               ? "everything counted: geometry, mean colours, codes "
                                                                 "and dictionary, or photographs with mips"
                                                               : "mean colours, codes and dictionary, or photographs "
                                                                 "with mips; without geometry",
                                               .axis = "bytes a splat",
                                               .unit = "bytes",
                                               .note = "PSNR against the splats' textures",
                                               .curves = curves,
                                               .curve_count = 4},
                           svg, length, err);
}

double spl_textures_bytes_at(const struct spl_textures_report *report, double psnr)
{
    const struct spl_textures_row *a = NULL;
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *b = &report->row[i];
        if (b->kind != SPL_TEXTURES_OURS)
            continue;
        if (a && a->psnr <= psnr && psnr <= b->psnr && a->psnr < b->psnr) {
            double share = (psnr - a->psnr) / (b->psnr - a->psnr);
            double low = log(spl_textures_row_bytes(a)), high = log(spl_textures_row_bytes(b));
            return exp(low + share * (high - low));
        }
        a = b;
    }
    return NAN;
}
