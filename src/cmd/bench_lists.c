/* The lists that 'splatd bench' takes, split at commas: devices, methods and whatever else is measured in turn; and
 * what stands for those that are not given. */
#include "cmd/bench.h"

#include <string.h>

#include "cmd/options.h"
#include "render/view.h"
#include "shared.h"

_Static_assert((int)SPL_METHOD_COUNT <= (int)SPL_CMD_BENCH_LIST_MAX, "all methods fit the list");

/* Each takes the entry behind those that are there. */
static int take_device(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    (void)err;
    a->devices[a->bench.device_count] = text;
    return 0;
}

static int take_method(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    int method = spl_method_from_name(text);
    if (method < 0)
        return spl_fail(err, SPL_E_USAGE, "--method takes %s, not '%s'", spl_method_names(), text);
    a->methods[a->bench.method_count] = (enum spl_method)method;
    return 0;
}

static int take_lod(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    return spl_cmd_parse_real("--lod", text, 0, 1024, &a->lods[a->bench.lod_count], err);
}

static int take_supersample(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    double side = 0;
    int status = spl_cmd_parse_real("--supersample", text, 0.25, 4, &side, err);
    if (!status && !spl_supersample_is_known(side))
        status = spl_fail(err, SPL_E_USAGE, "--supersample takes " SPL_SUPERSAMPLES ", not '%s'", text);
    a->supersamples[a->supersample_count] = side;
    return status;
}

static int take_atoms(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    uint64_t count = 0;
    int status = spl_cmd_parse_count("--atoms", text, 0, SPL_TEXTURE_ATOMS, &count, err);
    a->atoms[a->atom_count] = (uint32_t)count;
    return status;
}

static const char *name_of_model(int model)
{
    return spl_soft_model_name((enum spl_soft_model)model);
}

static int take_soft_model(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    int model = 0;
    int status = spl_cmd_take_name("--soft-model", text, spl_soft_model_from_name, name_of_model, SPL_SOFT_MODEL_COUNT,
                                   &model, err);
    for (size_t i = 0; !status && i < a->soft_model_count; i++)
        if (a->soft_models[i] == (enum spl_soft_model)model)
            status = spl_fail(err, SPL_E_USAGE, "--soft-model has '%s' twice", text);
    if (!status)
        a->soft_models[a->soft_model_count] = (enum spl_soft_model)model;
    return status;
}

static const struct list {
    const char *option;
    size_t count; /* offset of how many entries there are */
    int (*take)(struct spl_cmd_bench_arguments *arguments, const char *entry, struct spl_error *err);
} lists[] = {
    {"--device", offsetof(struct spl_cmd_bench_arguments, bench.device_count), take_device},
    {"--method", offsetof(struct spl_cmd_bench_arguments, bench.method_count), take_method},
    {"--lod", offsetof(struct spl_cmd_bench_arguments, bench.lod_count), take_lod},
    {"--supersample", offsetof(struct spl_cmd_bench_arguments, supersample_count), take_supersample},
    {"--atoms", offsetof(struct spl_cmd_bench_arguments, atom_count), take_atoms},
    {"--soft-model", offsetof(struct spl_cmd_bench_arguments, soft_model_count), take_soft_model},
};

int spl_cmd_bench_take_list(void *arguments, const char *option, char *text, struct spl_error *err)
{
    const struct list *list = lists;
    while (strcmp(list->option, option) != 0)
        list++;
    size_t *count = (size_t *)((char *)arguments + list->count);
    const char *entry;
    for (*count = 0; (entry = strsep(&text, ",")); ++*count) {
        if (*count == SPL_CMD_BENCH_LIST_MAX)
            return spl_fail(err, SPL_E_USAGE, "%s takes at most %d entries", option, SPL_CMD_BENCH_LIST_MAX);
        int rc = list->take(arguments, entry, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

void spl_cmd_bench_fill_lists(struct spl_cmd_bench_arguments *a)
{
    static const double lods[] = {0.5, 0.75, 1, 1.5, 2, 3}, supersamples[] = {0.25, 0.5, 1, 1.25, 2};
    static const uint32_t atoms[] = {0, 2, SPL_TEXTURE_ATOMS};
    const bool sweep = a->sweep.output;
    a->sweep.atoms_listed = a->atom_count;
    if (!a->bench.device_count)
        a->devices[a->bench.device_count++] = "auto";
    for (int i = 0, count = a->bench.method_count ? 0 : sweep ? SPL_METHOD_COUNT : 1; i < count; i++)
        a->methods[a->bench.method_count++] = sweep ? (enum spl_method)i : SPL_METHOD_DEFAULT;
    if (!a->bench.lod_count) {
        a->bench.lod_count = sweep ? sizeof lods / sizeof *lods : 1;
        memcpy(a->lods, sweep ? lods : (const double[]){1}, a->bench.lod_count * sizeof *lods);
    }
    if (!a->supersample_count) {
        a->supersample_count = sizeof supersamples / sizeof *supersamples;
        memcpy(a->supersamples, supersamples, sizeof supersamples);
    }
    if (!a->atom_count) {
        a->atom_count = sizeof atoms / sizeof *atoms;
        memcpy(a->atoms, atoms, sizeof atoms);
    }
}
