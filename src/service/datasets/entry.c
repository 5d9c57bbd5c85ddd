/* Opening one dataset for serving, and counting who needs it.
 *
 * Invariant: once `release` is set, only the thread that drops the last reference calls it, and nobody else can hold
 * the entry then. Any thread. */
#include "service/datasets/entry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/dataset.h"
#include "dataset/remote_url.h"

static void encode_uri(char *out, size_t capacity, const char *id)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    size_t used = (size_t)snprintf(out, capacity, "/v1/datasets/");
    for (; *id && used + 4 <= capacity; id++)
        used += (size_t)snprintf(out + used, capacity - used, strchr(plain, *id) ? "%c" : "%%%02X", (unsigned char)*id);
}

int spl_catalog_entry_open(const char *path, const char *place, const struct spl_dataset_opening *how,
                           struct spl_catalog_entry **out, struct spl_error *err)
{
    struct spl_catalog_entry *entry = *out = NULL;
    struct spl_camera camera = {0};
    char shown[1024];
    int rc = SPL_E_NOMEM;
    if (!(entry = spl_alloc(1, sizeof *entry, err)))
        return rc;
    atomic_init(&entry->references, 1);
    for (size_t i = 0; i < SPL_DEVICES_MAX; i++)
        entry->replicas[i].entry = entry;
    if ((rc = spl_dataset_open_as(path, how, &entry->dataset, err)))
        goto done;
    const struct spl_dataset_info *info = entry->info = spl_dataset_get_info(entry->dataset);
    spl_dataset_look_for_tiles(entry->dataset);
    if ((rc = spl_dataset_get_default_camera(entry->dataset, 1280, 720, &camera, err)))
        goto done;
    entry->defaults.dataset = info;
    entry->defaults.fov = info->default_fov;
    entry->defaults.near = camera.near;
    entry->defaults.far = camera.far;
    memcpy(entry->defaults.eye, info->default_eye, sizeof entry->defaults.eye);
    memcpy(entry->defaults.target, info->default_target, sizeof entry->defaults.target);
    memcpy(entry->defaults.up, info->default_up, sizeof entry->defaults.up);
    memcpy(entry->defaults.fit, info->default_fit, sizeof entry->defaults.fit);
    if (spl_remote_is_url(place)) // nothing lies beside it, and its secrets are in no message
        place = spl_remote_show(place, shown, sizeof shown);
    if ((rc = spl_saved_create(place, info, &entry->saved, err)))
        goto done;
    entry->defaults.names = spl_saved_get_names(entry->saved);
    if ((rc = spl_places_create(entry->dataset, &entry->places, err)))
        goto done;
    spl_places_hook_init(&entry->at_once, entry->places, false);
    entry->defaults.places = &entry->at_once.hook;
    encode_uri(entry->uri, sizeof entry->uri, info->id);
    rc = spl_plan_create(place, info, &entry->plan, err);
done:
    if (rc)
        spl_catalog_entry_destroy(entry);
    else
        *out = entry;
    return rc;
}

struct spl_catalog_entry *spl_catalog_entry_ref(struct spl_catalog_entry *entry)
{
    unsigned before = atomic_fetch_add(&entry->references, 1);
    spl_assert(before > 0);
    return entry;
}

struct spl_catalog_entry *spl_catalog_entry_try_ref(struct spl_catalog_entry *entry)
{
    unsigned before = atomic_load(&entry->references);
    while (before && !atomic_compare_exchange_weak(&entry->references, &before, before + 1))
        continue;
    return before ? entry : NULL;
}

void spl_catalog_entry_unref(struct spl_catalog_entry *entry)
{
    if (!entry || atomic_fetch_sub(&entry->references, 1) > 1)
        return;
    if (entry->release)
        entry->release(entry, entry->release_context);
    else
        spl_catalog_entry_destroy(entry);
}

void spl_catalog_entry_destroy(struct spl_catalog_entry *entry)
{
    if (!entry)
        return;
    spl_plan_destroy(entry->plan);
    spl_places_destroy(entry->places);
    spl_saved_destroy(entry->saved);
    spl_dataset_close(entry->dataset);
    free(entry);
}

uint64_t spl_catalog_entry_get_resident_bytes(const struct spl_catalog_entry *entry)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < SPL_DEVICES_MAX; i++)
        bytes += atomic_load(&entry->replicas[i].resident_bytes);
    return bytes;
}

bool spl_catalog_id_is_valid(const char *id, size_t length)
{
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    if (!length || length >= sizeof((struct spl_dataset_info *)0)->id || id[0] == '.')
        return false;
    for (size_t i = 0; i < length; i++)
        if (!id[i] || !strchr(allowed, id[i]))
            return false;
    return true;
}
