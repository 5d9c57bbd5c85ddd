/* splatd bench --textures: options in, the table to stdout, charts and figures into a folder. */
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "cmd/bench.h"
#include "cmd/cmd.h"
#include "cmd/options.h"
#include "cmd/output.h"
#include "measure/textures.h"
#include "sparse/texture_file.h"

static void show_epoch(void *context, const char *what, const struct spl_train_progress *epoch)
{
    (void)context;
    fprintf(stderr, "%s: epoch %u, %.1f s, %.2f dB, %.2f atoms a splat, dictionary of %u\n", what, epoch->epoch,
            epoch->seconds, epoch->psnr, epoch->atoms_per_splat, epoch->dictionary);
}

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
    fputs("name,codes_bytes,dictionary_bytes,psnr_db,atoms,dictionary,seconds\n", out);
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *r = &report->row[i];
        fprintf(out, "\"%s\",%.4f,%.4f,%.3f,%.3f,%u,%.1f\n", r->name, r->codes, r->dictionary, r->psnr, r->atoms,
                r->count, r->seconds);
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
    int rc = spl_textures_chart_training(report, &svg, &length, err);
    if (!rc)
        rc = write_file(folder, "training.svg", svg, length, err);
    free(svg);
    if (!rc) {
        rc = spl_textures_chart_rate(report, &svg, &length, err);
        if (!rc)
            rc = write_file(folder, "rate.svg", svg, length, err);
        free(svg);
    }
    return rc;
}

static void print_table(const struct spl_textures_report *report)
{
    printf("%-24s %8s %10s %8s %9s %7s %10s %8s\n", "", "codes", "dictionary", "in all", "PSNR, dB", "atoms",
           "dictionary", "seconds");
    printf("%-24s %29s %17s %10s\n", "", "bytes a splat", "a splat", "of atoms");
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *r = &report->row[i];
        printf("%-24s %8.3f %10.3f %8.3f %9.2f", r->name, r->codes, r->dictionary, r->codes + r->dictionary, r->psnr);
        if (isnan(r->atoms))
            puts("");
        else
            printf(" %7.2f %10u %8.1f\n", r->atoms, r->count, r->seconds);
    }
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *r = &report->row[i];
        double ours = spl_textures_bytes_at(report, r->psnr), theirs = r->codes + r->dictionary;
        if (i < report->first_adaptive && theirs > 0 && !isnan(ours))
            printf("at the quality of %s, %.2f dB: adaptive %.3f bytes a splat, %.0f %% of its %.3f\n", r->name,
                   r->psnr, ours, 100 * ours / theirs, theirs);
    }
}

int spl_cmd_bench_textures(int argc, char **argv, struct spl_error *err)
{
    static const struct option options[] = {{"output", required_argument, NULL, 'o'},
                                            {"epochs", required_argument, NULL, 'e'},
                                            {"threads", required_argument, NULL, 't'},
                                            {"memory", required_argument, NULL, 'm'},
                                            {NULL, 0, NULL, 0}};
    const char *folder = NULL;
    uint64_t epochs = 12, threads = 0, memory_mb = 2048;
    struct spl_texture_file file = {.fd = -1};
    struct spl_textures_report *report = NULL;
    int option, rc = 0;
    while (!rc && (option = getopt_long(argc, argv, "o:", options, NULL)) != -1)
        if (option == 'o')
            folder = optarg;
        else if (option == 'e')
            rc = spl_cmd_parse_count("--epochs", optarg, 1, SPL_TEXTURES_EPOCHS_MAX, &epochs, err);
        else if (option == 't')
            rc = spl_cmd_parse_count("--threads", optarg, 1, 64, &threads, err);
        else if (option == 'm')
            rc = spl_cmd_parse_count("--memory", optarg, 1, 1u << 24, &memory_mb, err);
        else
            rc = spl_fail(err, SPL_E_USAGE, "'splatd bench --help' shows how");
    if (!rc && (argc - optind != 1 || !folder))
        rc = spl_fail(err, SPL_E_USAGE, "bench --textures takes one file of textures and -o OUT");
    if (!rc && mkdir(folder, 0777) && errno != EEXIST)
        rc = spl_fail_errno(err, errno, "%s", folder);
    if (!rc)
        rc = spl_texture_file_open(argv[optind], &file, err);
    report = rc ? NULL : calloc(1, sizeof *report);
    if (!rc && !report)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory: the report");
    if (rc)
        goto done;
    const struct spl_textures_options how = {.source = &file.source,
                                             .splats = file.header.splats,
                                             .pixels = file.header.pixels,
                                             .epochs = (uint32_t)epochs,
                                             .memory_bytes = memory_mb << 20,
                                             .seed = 1,
                                             .threads = (unsigned)threads,
                                             .progress = show_epoch};
    rc = spl_textures_measure(&how, report, err);
    if (rc)
        goto done;
    print_table(report);
    rc = write_rows(report, folder, err);
    if (!rc)
        rc = write_epochs(report, folder, err);
    if (!rc)
        rc = write_charts(report, folder, err);
done:
    spl_texture_file_close(&file);
    free(report);
    return rc;
}
