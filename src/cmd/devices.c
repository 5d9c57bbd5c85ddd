/* splatd devices: what can render here, and why the rest cannot. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>
#include <splatd/render.h>

#include "base/memory.h"
#include "cmd/table.h"

enum { UUID_TEXT = 37 };

struct arguments {
    bool json;
};

static const struct spl_cmd_option options[] = {
    {"json", NULL, "an array of objects: device, backend, index, name, driver, uuid, software, usable, reason",
     SPL_CMD_FLAG(struct arguments, json)},
};

static const struct spl_cmd_table table = {
    .command = "devices",
    .before =
        "usage: splatd devices [--json]\n\n"
        "Lists every Vulkan and EGL device that was found, GPUs and software renderers, a line each, unusable ones\n"
        "with the reason.\n\n"
        "Which devices are there:\n"
        "  splatd devices\n"
        "The first that renders, for a script:\n"
        "  splatd devices --json | jq -r '[.[] | select(.usable)][0].device'\n"
        "Every command that renders takes one of them, by backend, number, UUID or part of its name:\n"
        "  splatd render --device vulkan:0 ...    splatd serve --device nvidia ...\n\n",
    .after = "\nExit code 0 when at least one device is usable, else 1.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

static void format_uuid(const uint8_t uuid[16], char text[UUID_TEXT])
{
    char *at = text;
    *at = '\0';
    static const uint8_t none[16];
    if (!memcmp(uuid, none, 16))
        return;
    for (int i = 0; i < 16; i++)
        at += snprintf(at, 4, "%s%02x", i == 4 || i == 6 || i == 8 || i == 10 ? "-" : "", uuid[i]);
}

static int print_json(const struct spl_device_info *devices, size_t count)
{
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++) {
        const struct spl_device_info *d = &devices[i];
        char device[32], uuid[UUID_TEXT];
        snprintf(device, sizeof device, "%s:%u", d->backend, d->index);
        format_uuid(d->uuid, uuid);
        json_array_append_new(array, json_pack("{s:s, s:s, s:I, s:s, s:s, s:s, s:b, s:b, s:s}", "device", device,
                                               "backend", d->backend, "index", (json_int_t)d->index, "name", d->name,
                                               "driver", d->driver, "uuid", uuid, "software", d->software, "usable",
                                               !d->unusable[0], "reason", d->unusable));
    }
    int failed = json_dumpf(array, stdout, JSON_INDENT(2));
    putchar('\n');
    json_decref(array);
    return failed;
}

static void print_table(const struct spl_device_info *devices, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const struct spl_device_info *d = &devices[i];
        char device[32], uuid[UUID_TEXT];
        snprintf(device, sizeof device, "%s:%u", d->backend, d->index);
        format_uuid(d->uuid, uuid);
        printf("%-9s %-8s %s\n", device, d->unusable[0] ? "unusable" : d->software ? "software" : "gpu", d->name);
        if (d->unusable[0])
            printf("%18s because %s\n", "", d->unusable);
        if (d->driver[0])
            printf("%18s driver  %s\n", "", d->driver);
        if (uuid[0])
            printf("%18s uuid    %s\n", "", uuid);
    }
}

int spl_cmd_devices(int argc, char **argv)
{
    struct arguments a = {0};
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && optind < argc)
        rc = spl_fail(&err, SPL_E_USAGE, "devices takes no argument '%.80s'; 'splatd devices --help' shows examples",
                      argv[optind]);
    if (rc)
        return spl_cmd_fail(&err);
    size_t count = spl_device_list(NULL, 0), usable = 0;
    struct spl_device_info *devices = spl_alloc(count, sizeof *devices, &err);
    if (!devices)
        return spl_cmd_fail(&err);
    size_t found = spl_device_list(devices, count);
    count = found < count ? found : count; /* one may come or go between the two calls */
    for (size_t i = 0; i < count; i++)
        usable += !devices[i].unusable[0];
    int failed = 0;
    if (a.json)
        failed = print_json(devices, count);
    else
        print_table(devices, count);
    free(devices);
    if (failed)
        spl_fail(&err, SPL_E_IO, "the list could not be written");
    else if (!usable)
        spl_fail(&err, SPL_E_NO_DEVICE, "no usable device; Debian's mesa-vulkan-drivers brings one that needs no GPU");
    return err.code ? spl_cmd_fail(&err) : 0;
}
