/* See device_list.h. A name that fits several devices means the one that opening it would try first. */
#include "service/view/device_list.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <splatd/render.h>

#include "gpu/gpu.h"

enum { listed_most = 128 };

static int add(struct spl_device_list *list, const char *name, size_t length, struct spl_error *err)
{
    while (length && *name == ' ')
        name++, length--;
    while (length && name[length - 1] == ' ')
        length--;
    if (!length)
        return spl_fail_field(err, SPL_E_USAGE, "device", "a name between the commas is empty; say vulkan:0,vulkan:1");
    if (list->count == SPL_DEVICES_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "device", "more than %d devices", SPL_DEVICES_MAX);
    char *copy = strndup(name, length);
    if (!copy)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the names of devices");
    list->names[list->count++] = copy;
    return SPL_OK;
}

static bool is_usable_gpu(const struct spl_device_info *info)
{
    return !info->software && !info->unusable[0];
}

static size_t count_gpus(const struct spl_device_info *devices, size_t count, const char *backend)
{
    size_t gpus = 0;
    for (size_t i = 0; i < count; i++)
        gpus += is_usable_gpu(&devices[i]) && !strcmp(devices[i].backend, backend);
    return gpus;
}

static int add_all(struct spl_device_list *list, const struct spl_device_info *devices, size_t count,
                   struct spl_error *err)
{
    const char *backend = NULL;
    size_t most = 0;
    for (size_t i = 0; i < count; i++) {
        size_t gpus = count_gpus(devices, count, devices[i].backend);
        if (gpus > most) {
            most = gpus;
            backend = devices[i].backend;
        }
    }
    if (!backend)
        return spl_fail_field(err, SPL_E_NO_DEVICE, "device",
                              "all: no usable GPU; 'splatd devices' lists what there is");
    for (size_t i = 0; i < count; i++) {
        char name[32];
        int length = snprintf(name, sizeof name, "%s:%u", devices[i].backend, devices[i].index);
        int rc = is_usable_gpu(&devices[i]) && !strcmp(devices[i].backend, backend)
                     ? add(list, name, (size_t)length, err)
                     : SPL_OK;
        if (rc)
            return rc;
    }
    return SPL_OK;
}

static const struct spl_device_info *find(const struct spl_device_info *devices, size_t count, const char *name)
{
    for (int software = 0; software <= 1; software++)
        for (size_t i = 0; i < count; i++)
            if (devices[i].software == software && !devices[i].unusable[0] && spl_gpu_matches(&devices[i], name))
                return &devices[i];
    return NULL;
}

static bool share_memory(const struct spl_device_info *a, const struct spl_device_info *b)
{
    static const uint8_t none[sizeof a->uuid];
    return a == b || (a->software && b->software) ||
           (memcmp(a->uuid, none, sizeof none) && !memcmp(a->uuid, b->uuid, sizeof none));
}

static void count_sharers(struct spl_device_list *list, const struct spl_device_info *devices, size_t count)
{
    for (size_t i = 0; i < list->count; i++)
        for (size_t other = 0; other < list->count; other++) {
            const struct spl_device_info *a = find(devices, count, list->names[i]);
            const struct spl_device_info *b = find(devices, count, list->names[other]);
            list->sharers[i] += a && b ? share_memory(a, b) : !strcmp(list->names[i], list->names[other]);
        }
}

int spl_device_list_init(struct spl_device_list *list, const char *text, struct spl_error *err)
{
    struct spl_device_info devices[listed_most];
    size_t count = 0;
    int rc = SPL_OK;
    *list = (struct spl_device_list){0};
    bool all = !strcmp(text, "all");
    if (all || strchr(text, ',')) {
        count = spl_device_list(devices, listed_most);
        count = count < listed_most ? count : listed_most;
    }
    if (all)
        rc = add_all(list, devices, count, err);
    else if (!*text)
        rc = add(list, "auto", 4, err);
    for (const char *name = text; !rc && !all && *text && name;) {
        const char *comma = strchr(name, ',');
        rc = add(list, name, comma ? (size_t)(comma - name) : strlen(name), err);
        name = comma ? comma + 1 : NULL;
    }
    if (rc)
        spl_device_list_finish(list);
    else
        count_sharers(list, devices, count);
    return rc;
}

void spl_device_list_finish(struct spl_device_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->names[i]);
    *list = (struct spl_device_list){0};
}
