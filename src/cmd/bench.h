/* What the files of 'splatd bench' share: bench_options.c reads the options and bench_lists.c those that are lists,
 * bench_table.c prints frame times, bench_sweep.c runs the comparison with a reference, bench_textures.c that of
 * texture coders, bench_left_out.c that with photographs left out of packing. */
#ifndef SPL_CMD_BENCH_H
#define SPL_CMD_BENCH_H

#include "cmd/table.h"
#include "measure/bench.h"
#include "measure/sweep.h"

enum { SPL_CMD_BENCH_LIST_MAX = 64 };

void spl_cmd_bench_print_table(const struct spl_bench_options *options, const struct spl_bench_report *report);
int spl_cmd_bench_print_json(const struct spl_bench_options *options, const struct spl_bench_report *report,
                             struct spl_error *err);

struct spl_cmd_bench_sweep {
    const char *dataset_path, *output; /* file; folder */
    const char *views;                 /* JSON or COLMAP folder; NULL = `path` */
    const struct spl_path *path;       /* NULL = the dataset's own orbit */
    uint32_t places;                   /* on a path */
    uint32_t width, height;            /* 0 = 1280x720 on a path, the views' own otherwise; one 0: at that ratio */
    const char *peers, *profile;       /* CSV, may be NULL; NULL = beside the dataset */
    bool no_profile;
    struct spl_sweep_options sweep; /* all but dataset, views, settings, folder, progress */
    const enum spl_method *methods;
    const double *lods, *supersamples;
    const uint32_t *atoms; /* only for datasets with textures and methods that draw them */
    size_t method_count, lod_count, supersample_count, atom_count;
    bool atoms_listed;          /* asked for, not the default */
    enum spl_setting_maps maps; /* only for datasets with maps and methods that take them; NO_MAPS = on and off */
    bool maps_asked;
    const struct spl_soft_params *softs; /* solid, then what is compared with it */
    size_t soft_count;
};

struct spl_cmd_bench_arguments {
    struct spl_dataset *datasets[SPL_CMD_BENCH_LIST_MAX];
    const char *devices[SPL_CMD_BENCH_LIST_MAX];
    enum spl_method methods[SPL_CMD_BENCH_LIST_MAX];
    double lods[SPL_CMD_BENCH_LIST_MAX], supersamples[SPL_CMD_BENCH_LIST_MAX];
    uint32_t atoms[SPL_CMD_BENCH_LIST_MAX];
    struct spl_soft_params soft, softs[1 + SPL_SOFT_MODEL_COUNT]; /* of --soft; solid, then what it is drawn as */
    enum spl_soft_model soft_models[SPL_SOFT_MODEL_COUNT];
    size_t soft_model_count;
    size_t supersample_count, atom_count;
    struct spl_path path;
    const char *views, *set;
    uint32_t size[2];     /* of --size; a side that was left out is 0 */
    bool json;
    struct spl_bench_options bench;
    struct spl_cmd_bench_sweep sweep;
};

/* Fills zeroed `arguments` from the command line and opens the datasets, which the caller closes on failure too; lists
 * point into `argv`. SPL_CMD_DONE after --help, SPL_E_USAGE, and what opening fails with. */
int spl_cmd_bench_parse(struct spl_cmd_bench_arguments *arguments, int argc, char **argv, struct spl_error *err);

/* Takes --device, --method, --lod, --supersample, --atoms and --soft-model of struct spl_cmd_bench_arguments: a list,
 * instead of what was given before. SPL_E_USAGE. */
int spl_cmd_bench_take_list(void *arguments, const char *option, char *text, struct spl_error *err);

/* What lists have that were not given: one entry each, with -o (whose all of these are) many. */
void spl_cmd_bench_fill_lists(struct spl_cmd_bench_arguments *arguments);

/* Measures, writes OUT/{bench.json, bench.csv, chart.svg, index.html} and the profile, prints a table to stdout. */
int spl_cmd_bench_sweep(struct spl_cmd_bench_sweep *options, const struct spl_dataset *dataset, struct spl_error *err);

/* splatd bench --textures, argv[0] being that option: coders of the textures in a file beside each other. SPL_CMD_DONE
 * after --help, as below. */
int spl_cmd_bench_textures(int argc, char **argv, struct spl_error *err);

/* splatd bench --left-out, argv[0] being that option: renders against photographs that packing did not have. */
int spl_cmd_bench_left_out(int argc, char **argv, struct spl_error *err);

/* The options of each. */
extern const struct spl_cmd_table spl_cmd_bench_table, spl_cmd_bench_textures_table, spl_cmd_bench_left_out_table;

#endif
