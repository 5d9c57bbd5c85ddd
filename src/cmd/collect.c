/* splatd collect: tiles in, a dataset of all of them out; or a collection in, one file of all that its tiles hold out.
 * On SIGINT and SIGTERM the temporary file is removed in a handler; the target is never touched before the library's
 * last rename. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <stdio.h>
#include <unistd.h>

#include <splatd/collect.h>

#include "base/file.h"
#include "cmd/output.h"
#include "cmd/pack_report.h"
#include "cmd/progress.h"
#include "cmd/table.h"
#include "cmd/unfinished.h"
#include "cmd/views.h"
#include "dataset/dataset.h"

static void clean_up_on_signals(const char *output)
{
    char path[4096];
    int length = snprintf(path, sizeof path, "%s" SPL_UNFINISHED, output, (long)getpid());
    if (length >= 0 && (size_t)length < sizeof path)
        spl_cmd_remove_unfinished(path);
}

struct arguments {
    struct spl_collect_options collect;
    struct spl_cmd_views views;
    bool merge;
};

static int take_default_view(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct arguments *a = arguments;
    a->collect.default_view = &a->views.first;
    return spl_cmd_views_take_first(&a->views, option, text, err);
}

static int take_view(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct arguments *a = arguments;
    int rc = spl_cmd_views_take(&a->views, option, text, err);
    a->collect.views = a->views.named;
    a->collect.view_count = a->views.count;
    return rc;
}

static const struct spl_cmd_option options[] = {
    {"output", "NAME.spld",
     "in the folder of the tiles, with --merge in any; replaced in one step when everything has been written",
     .letter = 'o', SPL_CMD_TEXT(struct arguments, collect.output)},
    {"merge", NULL, "of a collection: NAME.spld is one file of all that its tiles hold, and needs them no more",
     SPL_CMD_FLAG(struct arguments, merge)},
    {"title", "TEXT", "what people call it, a line", SPL_CMD_TEXT(struct arguments, collect.title)},
    {"description", "TEXT", "more about it", SPL_CMD_TEXT(struct arguments, collect.description)},
    {"default-view", "VIEW", "the view that is seen first: eye=X,Y,Z,target=X,Y,Z[,up=X,Y,Z][,fov=DEG]",
     .otherwise = "found in the tiles, whatever theirs are", .take = take_default_view},
    {"view", "NAME=VIEW",
     "the same under a name, for view=NAME; up to 64 times; view_height=UNITS: orthographic, so high",
     .take = take_view},
    {"threads", "N", "", .otherwise = "all cores", SPL_CMD_COUNT_32(struct arguments, collect.threads, 1, 64)},
};

static const struct spl_cmd_table table = {
    .command = "collect",
    .before =
        "usage: splatd collect TILE.spld... -o NAME.spld [--title TEXT] [--description TEXT] [--default-view VIEW]\n"
        "                      [--view NAME=VIEW]... [--threads N]\n"
        "       splatd collect --merge COLLECTION.spld -o NAME.spld [--threads N]\n\n"
        "Puts datasets of neighbouring tiles together as one, to serve and to render as a whole. Nothing is packed\n"
        "again: NAME.spld holds what is seen from afar, a few MB, and names the tiles, which hold all that is finer\n"
        "and stay where they are, in the same folder. A tile that changes later needs the collection made anew,\n"
        "with its title and views said again.\n"
        "TILE is a dataset, a folder (all NAME.spld in it but collections) or @LIST, a text with a path a line,\n"
        "relative to its own folder (those with # in front are comments); up to 10,000 tiles. They have one unit,\n"
        "coordinate system and list of attributes, and neither textures nor maps of stations.\n\n"
        "Tiles of a survey packed each on its own, and one city of them:\n"
        "  mkdir -p city\n"
        "  for tile in las/*.laz; do splatd pack $tile --keep intensity -o city/$(basename $tile .laz).spld; done\n"
        "  splatd collect city -o city/city.spld --title 'The city'\n"
        "Some of the tiles, by name, and what the collection is:\n"
        "  splatd collect city/north.spld city/south.spld -o city/both.spld && splatd info city/both.spld\n"
        "From a list of their names:\n"
        "  splatd collect @city/tiles.txt -o city/city.spld\n"
        "All of it as one file, to be sent or served without its tiles (of one on a server: a copy to have here):\n"
        "  splatd collect --merge city/city.spld -o city-whole.spld\n\n",
    .after =
        "\nTwo tiles agree in their attributes where pack was told what to keep: --keep intensity,scan keeps both\n"
        "where all points have the same value too. Progress and the summary go to stderr.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

int spl_cmd_print_collection(const char *output, struct spl_error *err)
{
    struct spl_dataset *dataset;
    int rc = spl_dataset_open(output, false, &dataset, err);
    if (rc)
        return rc;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    spl_cmd_put_text(stderr, output, 0);
    fprintf(stderr, ": a collection of %u tile%s, version %016llx, %.2f MB beside their %.2f MB\n", info->tiles,
            info->tiles == 1 ? "" : "s", (unsigned long long)info->version, (double)info->file_bytes / 1e6,
            (double)info->tile_bytes / 1e6);
    spl_dataset_close(dataset);
    return SPL_OK;
}

int spl_cmd_print_merged(const char *output, struct spl_error *err)
{
    struct spl_dataset_source source;
    struct spl_dataset *dataset;
    int rc = spl_dataset_source_open_file(output, &source, err);
    if (rc)
        return rc;
    rc = spl_dataset_open_source(&source, "merged", false, NULL, &dataset, err); /* its file may have any name */
    if (rc) {
        spl_dataset_source_close(&source);
        return rc;
    }
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    spl_cmd_put_text(stderr, output, 0);
    fprintf(stderr, ": %llu points in one file, version %016llx, %.2f MB\n", (unsigned long long)info->points,
            (unsigned long long)info->version, (double)info->file_bytes / 1e6);
    spl_dataset_close(dataset);
    return SPL_OK;
}

static int run_collect(const struct spl_collect_options *o, struct spl_cmd_progress *progress, struct spl_error *err)
{
    if (!o->input_count)
        return spl_fail(err, SPL_E_USAGE,
                        "collect takes at least one dataset: splatd collect city -o city/city.spld");
    int rc = spl_cmd_check_dataset("collect", o->output, err);
    if (rc)
        return rc;
    clean_up_on_signals(o->output);
    rc = spl_collect(o, err);
    spl_cmd_progress_finish(progress);
    return rc ? rc : spl_cmd_print_collection(o->output, err);
}

static int run_merge(const struct spl_collect_options *o, struct spl_cmd_progress *progress, struct spl_error *err)
{
    if (o->input_count != 1)
        return spl_fail(err, SPL_E_USAGE,
                        "--merge takes one dataset, a collection: splatd collect --merge city.spld -o whole.spld");
    if (o->title || o->description || o->default_view || o->view_count)
        return spl_fail(err, SPL_E_USAGE, "--merge keeps title, description and views: leave out --title, "
                                          "--description, --default-view and --view, or give them to the collection");
    int rc = spl_cmd_check_dataset("collect --merge", o->output, err);
    if (rc)
        return rc;
    const struct spl_merge_options how = {.size = sizeof how,
                                          .collection = o->inputs[0],
                                          .output = o->output,
                                          .threads = o->threads,
                                          .progress = o->progress,
                                          .progress_context = o->progress_context};
    clean_up_on_signals(o->output);
    rc = spl_merge(&how, err);
    spl_cmd_progress_finish(progress);
    return rc ? rc : spl_cmd_print_merged(o->output, err);
}

int spl_cmd_collect(int argc, char **argv)
{
    struct spl_cmd_progress progress = {0};
    struct arguments a = {.collect = {.size = sizeof a.collect,
                                      .progress = spl_cmd_progress,
                                      .progress_context = &progress,
                                      .left_out = spl_cmd_pack_name_refused}};
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    a.collect.inputs = (const char *const *)&argv[optind];
    a.collect.input_count = (size_t)(argc - optind);
    if (!rc)
        rc = a.merge ? run_merge(&a.collect, &progress, &err) : run_collect(&a.collect, &progress, &err);
    return rc ? spl_cmd_fail(&err) : 0;
}
