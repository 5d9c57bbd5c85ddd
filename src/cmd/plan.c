/* splatd plan: what a service of many points and many views takes, from measured figures. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cmd/options.h"
#include "cmd/plan_model.h"
#include "cmd/plan_print.h"
#include "cmd/table.h"
#include "render/view.h"

struct arguments {
    double points, views, cached, headroom;
    uint64_t copies;
    uint32_t size[2];
    int device;
    bool json;
};

static int take_points(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct arguments *a = arguments;
    int rc = spl_cmd_parse_real(option, text, 1, 1e15, &a->points, err);
    if (!rc && a->points != floor(a->points))
        rc = spl_fail(err, SPL_E_USAGE, "%s takes a whole number such as 5000000 or 1e12, not '%s'", option, text);
    return rc;
}

static int device_from_name(const char *name)
{
    for (int i = 0; i < SPL_PLAN_DEVICES; i++)
        if (!strcmp(spl_plan_device_row(i)->name, name))
            return i;
    return -1;
}

static const char *device_name(int device)
{
    return spl_plan_device_row(device)->name;
}

static int take_device(void *arguments, const char *option, char *text, struct spl_error *err)
{
    return spl_cmd_take_name(option, text, device_from_name, device_name, SPL_PLAN_DEVICES,
                             &((struct arguments *)arguments)->device, err);
}

static const struct spl_cmd_option options[] = {
    {"points", "N", "of all scans together, 1 to 1e15", .letter = 'n', .take = take_points},
    {"views-per-second", "R", "asked for, in the mean of a month; up to 1e9", .fallback = "1",
     SPL_CMD_REAL(struct arguments, views, 0, 1e9)},
    {"gpu", "NAME", "what draws: h100, or cpu (two cores without a GPU)", .otherwise = "h100", .take = take_device},
    {"size", "WxH", "pixels of a view", .fallback = "1280x720", SPL_CMD_PIXELS(struct arguments, size)},
    {"cached", "SHARE", "of the views, answered from the cache or by 304", .fallback = "0",
     SPL_CMD_REAL(struct arguments, cached, 0, 1)},
    {"headroom", "TIMES", "the mean that peaks are", .fallback = "1.3",
     SPL_CMD_REAL(struct arguments, headroom, 1, 100)},
    {"copies", "N", "of what is packed", .fallback = "2", SPL_CMD_COUNT(struct arguments, copies, 1, 100)},
    {"json", NULL, "one JSON object", SPL_CMD_FLAG(struct arguments, json)},
};

static const struct spl_cmd_table table = {
    .command = "plan",
    .before =
        "usage: splatd plan --points N [--views-per-second R] [--gpu NAME] [--size WxH] [--cached SHARE]\n"
        "                   [--headroom TIMES] [--copies N] [--json]\n\n"
        "Says which machines, disks and networks a service takes that is larger than the machine at hand, and what\n"
        "drives its cost: each line with its sum, each figure in it with the place where it was measured. Nothing is\n"
        "opened or measured now, and no price is known.\n\n"
        "A country's lidar, a thousand views a second:\n"
        "  splatd plan --points 1e12 --views-per-second 1000 --gpu h100\n"
        "The same where half of the views have been asked before, in HD, with peaks of twice the mean:\n"
        "  splatd plan --points 1e12 --views-per-second 1000 --cached 0.5 --size 1920x1080 --headroom 2\n"
        "A city on machines without a GPU:\n"
        "  splatd plan --points 5e9 --views-per-second 2 --gpu cpu\n"
        "One line of JSON, for scripts:\n"
        "  splatd plan --points 1e12 --json | jq '.lines[] | select(.name == \"packed\").value'\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

static int print(const struct arguments *a)
{
    const struct spl_plan_asked asked = {
        .points = a->points,
        .views = a->views,
        .headroom = a->headroom,
        .cached = a->cached,
        .copies = (double)a->copies,
        .size = {a->size[0], a->size[1]},
        .device = (enum spl_plan_device)a->device,
    };
    const struct spl_plan plan = spl_plan_reckon(&asked);
    struct spl_error err = {0};
    if (a->json) {
        json_t *json = spl_plan_to_json(&plan);
        if (!json || json_dumpf(json, stdout, JSON_COMPACT))
            spl_fail(&err, SPL_E_IO, "the plan could not be written");
        json_decref(json);
        putchar('\n');
    } else {
        spl_plan_print(stdout, &plan);
    }
    return err.code ? spl_cmd_fail(&err) : 0;
}

int spl_cmd_plan(int argc, char **argv)
{
    struct arguments a = {.device = SPL_PLAN_DEVICE_h100};
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && optind < argc)
        rc = spl_fail(&err, SPL_E_USAGE, "plan takes no argument '%.80s'; 'splatd plan --help' shows examples",
                      argv[optind]);
    if (!rc && !(a.points >= 1))
        rc = spl_fail(&err, SPL_E_USAGE, "--points N is missing: splatd plan --points 1e12 --views-per-second 1000");
    if (!rc && (a.size[0] > SPL_VIEW_SIDE_MAX || a.size[1] > SPL_VIEW_SIDE_MAX))
        rc = spl_fail(&err, SPL_E_USAGE, "--size takes up to %d pixels a side, not %ux%u", SPL_VIEW_SIDE_MAX, a.size[0],
                      a.size[1]);
    return rc ? spl_cmd_fail(&err) : print(&a);
}
