/* splatd info: its options, and each dataset that it is given, in turn; of scans see info_scan.c. What a dataset holds
 * is gathered into a struct first (info_report.c), which both outputs print (info_table.c, info_json.c). */
#include "cmd/cmd.h"

#include <getopt.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <jansson.h>

#include "base/decimal.h"
#include "cmd/dictionary.h"
#include "cmd/info_report.h"
#include "cmd/info_scan.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "cmd/table.h"
#include "cmd/waiting.h"
#include "dataset/dataset.h"
#include "dataset/remote_url.h"

struct arguments {
    const char *picture; // may be NULL
    const char *columns; // the same
    bool json, no_verify;
};

static int take_verify(void *arguments, const char *option, char *text, struct spl_error *err)
{
    (void)option, (void)text, (void)err;
    ((struct arguments *)arguments)->no_verify = false;
    return SPL_OK;
}

static const struct spl_cmd_option options[] = {
    {"json", NULL, "one JSON object a line", SPL_CMD_FLAG(struct arguments, json)},
    {"dictionary", "PNG", "where the picture goes; one dataset with textures", SPL_CMD_TEXT(struct arguments, picture)},
    {"columns", "LIST", "of text scans, of which there must be one: x y z r g b intensity class nx ny nz -",
     SPL_CMD_TEXT(struct arguments, columns)},
    {"verify", NULL,
     "check the pages' checksums too, also of a collection's tiles on disk; read all points of scans (default)",
     .take = take_verify},
    {"no-verify", NULL, "trust the pages, and of scans the header; everything else is always checked",
     SPL_CMD_FLAG(struct arguments, no_verify)},
};

static const struct spl_cmd_table table = {
    .command = "info",
    .before =
        "usage: splatd info [--json] [--no-verify] [--dictionary PNG] [--columns LIST] NAME.spld|URL|SCAN…\n\n"
        "Says what packed datasets hold: splats by level of detail, bounds, bytes a splat by attribute, and the\n"
        "histogram of bits that the scene needed. Every section's checksum is verified first.\n"
        "Of scans (also folders of them and @LISTs, as pack takes them): format, points, attributes, coordinates,\n"
        "bounds, stations, panoramas, and what pack would make of them, without packing.\n\n"
        "A table to read:\n"
        "  splatd info courtyard.spld\n"
        "A scan, before it is packed:\n"
        "  splatd info hall.ply\n"
        "The headers of a folder's scans alone:\n"
        "  splatd info --no-verify tiles\n"
        "Only check that files are whole (exit code 2 when one is not):\n"
        "  splatd info *.spld >/dev/null\n"
        "One line of JSON a dataset, for scripts: bytes_per_point are the file's, over the points that were kept;\n"
        "bytes_per_splat over the splats of all levels, or the same points where panels and meshes stand for some:\n"
        "  splatd info --json courtyard.spld | jq .bytes_per_point.total\n"
        "The atoms that textures are sums of, the most used first, as a picture:\n"
        "  splatd info hall.spld --dictionary atoms.png\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

static int print_json(const struct spl_info_report *report, struct spl_error *err)
{
    json_t *json = spl_info_to_json(report);
    char *text = spl_decimal_shorten(json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL);
    json_decref(json);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of %s", report->info->id);
    puts(text);
    free(text);
    return SPL_OK;
}

/* A long way of large ones, so it is shown where somebody looks on. */
static int check_tiles(struct spl_info_report *report, struct spl_error *err)
{
    struct spl_cmd_progress state = {0};
    int rc = spl_info_check_tiles(report, isatty(STDERR_FILENO) ? spl_cmd_progress : NULL, &state, err);
    spl_cmd_progress_finish(&state);
    return rc;
}

/* Of scans the library says which have any use for them. */
static int check_columns(char **paths, struct spl_error *err)
{
    for (char **path = paths; *path; path++)
        if (spl_info_is_scan(*path))
            return SPL_OK;
    return spl_fail(err, SPL_E_USAGE,
                    "--columns names the columns of texts (XYZ, PTS, CSV and such); %.300s is a dataset", *paths);
}

int spl_cmd_info(int argc, char **argv)
{
    struct arguments a = {0};
    struct spl_error wrong = {0};
    int parsed = spl_cmd_table_parse(&table, argc, argv, &a, &wrong);
    if (parsed == SPL_CMD_DONE)
        return 0;
    if (!parsed && optind == argc)
        parsed = spl_fail(&wrong, SPL_E_USAGE, "info needs at least one dataset: splatd info hall.spld; "
                                               "'splatd info --help' shows more");
    if (!parsed && a.picture && argc - optind > 1)
        parsed = spl_fail(&wrong, SPL_E_USAGE, "--dictionary is the picture of one dataset, not of %d", argc - optind);
    if (!parsed && a.picture)
        parsed = spl_cmd_check_png("--dictionary", a.picture, &wrong);
    if (!parsed && a.picture && spl_info_is_scan(argv[optind]))
        parsed = spl_fail(&wrong, SPL_E_USAGE, "--dictionary is the picture of a dataset; %.300s is a scan",
                          argv[optind]);
    if (!parsed && a.columns)
        parsed = check_columns(argv + optind, &wrong);
    if (parsed)
        return spl_cmd_fail(&wrong);
    int worst = 0; /* the remaining files are still told of */
    const char **scans = (const char **)&argv[optind]; /* what is none has been told of when its place is taken */
    size_t scan_count = 0;
    for (int i = optind; i < argc; i++) {
        if (spl_info_is_scan(argv[i])) {
            scans[scan_count++] = argv[i];
            continue;
        }
        struct spl_dataset *dataset = NULL;
        struct spl_error err = {0};
        struct spl_info_report report;
        const struct spl_dataset_opening how = {
            .verify = !a.no_verify, .tables_bytes = SPL_TABLES_BYTES, .verify_all = true};
        struct spl_cmd_waiting waiting;
        spl_cmd_waiting_begin(&waiting, argv[i]);
        int rc = spl_dataset_open_as(argv[i], &how, &dataset, &err);
        spl_cmd_waiting_end(&waiting);
        if (!rc)
            rc = spl_info_gather(&report, dataset, &err);
        if (!rc && report.info->tiles && !a.no_verify && !spl_remote_is_url(argv[i]))
            rc = check_tiles(&report, &err);
        if (!rc && a.json)
            rc = print_json(&report, &err);
        else if (!rc)
            spl_info_print_table(&report);
        if (!rc && a.picture)
            rc = spl_cmd_write_dictionary(dataset, a.picture, &err);
        if (!rc && report.lost_count)
            rc = spl_fail(&err, SPL_E_CORRUPT, "%s: %u of its %u tiles cannot be used", argv[i], report.lost_count,
                          report.info->tiles);
        spl_dataset_close(dataset);
        int code = rc ? spl_cmd_fail(&err) : 0;
        worst = code > worst ? code : worst;
    }
    if (scan_count) {
        const struct spl_info_scan_options of_scans = {a.json, !a.no_verify, a.columns};
        int code = spl_info_print_scans(scans, scan_count, &of_scans);
        worst = code > worst ? code : worst;
    }
    return worst;
}
