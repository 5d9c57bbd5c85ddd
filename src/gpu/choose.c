/* Listing the devices of every backend, and opening the one that is asked for. A device is used only after the
 * self-test kernels gave the right answers on it; when none is left, the error names each and why. Any thread may list.
 */
#include "gpu/backend.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct spl_gpu_backend *const backends[] = {&spl_gpu_vulkan, &spl_gpu_egl};
enum { BACKENDS = sizeof backends / sizeof *backends, DEVICES_MAX = 128 };

size_t spl_gpu_list(struct spl_device_info *devices, size_t capacity)
{
    size_t count = 0;
    for (size_t i = 0; i < BACKENDS; i++)
        count += backends[i]->list(count < capacity ? devices + count : NULL, count < capacity ? capacity - count : 0);
    return count;
}

size_t spl_device_list(struct spl_device_info *devices, size_t capacity)
{
    return spl_gpu_list(devices, capacity);
}

uint64_t spl_gpu_host_memory(void)
{
    /* A container's limit: control groups version 2, then 1. "max" does not parse and is none. */
    static const char *const files[] = {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"};
    uint64_t bytes = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGESIZE);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        unsigned long long limit;
        FILE *file = fopen(files[i], "r");
        if (file && fscanf(file, "%llu", &limit) == 1 && limit < bytes)
            bytes = limit;
        if (file)
            fclose(file);
    }
    return bytes;
}

/* 32 hex digits, dashes anywhere between them. */
static bool parse_uuid(const char *text, uint8_t uuid[16])
{
    int digits = 0;
    for (; *text; text++) {
        if (*text == '-')
            continue;
        if (!isxdigit((unsigned char)*text) || digits == 32)
            return false;
        int value = isdigit((unsigned char)*text) ? *text - '0' : tolower((unsigned char)*text) - 'a' + 10;
        uuid[digits / 2] = (uint8_t)(digits % 2 ? uuid[digits / 2] | value : value << 4);
        digits++;
    }
    return digits == 32;
}

bool spl_gpu_matches(const struct spl_device_info *info, const char *wanted)
{
    static const uint8_t no_uuid[16];
    uint8_t uuid[16] = {0};
    size_t length = strlen(info->backend);
    if (!wanted || !strcmp(wanted, "auto") || !strcmp(wanted, info->backend))
        return true;
    if (!strncmp(wanted, info->backend, length) && wanted[length] == ':' &&
        isdigit((unsigned char)wanted[length + 1])) {
        char *end;
        return strtoul(wanted + length + 1, &end, 10) == info->index && !*end;
    }
    if (parse_uuid(wanted, uuid))
        return memcmp(uuid, no_uuid, 16) && !memcmp(uuid, info->uuid, 16);
    return strcasestr(info->name, wanted) != NULL;
}

/* Appends to a message that may end up too long for struct spl_error: what does not fit is cut. */
static void append(char *text, size_t capacity, const struct spl_device_info *info, const char *reason)
{
    size_t used = strlen(text);
    snprintf(text + used, capacity - used, "%s%s:%u %s: %s", used ? "; " : "", info->backend, info->index, info->name,
             reason);
}

static int open_device(const struct spl_gpu_backend *backend, uint32_t index, const struct spl_gpu_options *options,
                       struct spl_gpu **out, struct spl_error *err)
{
    struct spl_gpu *gpu = NULL;
    int code = backend->open(index, options, &gpu, err);
    if (code < 0)
        return code;
    struct spl_gpu_limits *limits = &gpu->limits;
    limits->buffer_bytes &= ~UINT64_C(15); /* buffers are rounded up to 16 */
    if ((code = spl_gpu_selftest(gpu, err)) < 0) {
        spl_gpu_close(gpu);
        return code;
    }
    if (getenv("SPLATD_INJECT_HARDWARE")) // tests: it is drawn with as a GPU is, which a machine may have none of
        gpu->info.software = false;
    // after the test, which says what the device can do and not what it may take
    uint64_t share = limits->memory_bytes / 4 * 3 / (options->sharers ? options->sharers : 1);
    limits->memory_bytes = options->memory_limit ? options->memory_limit : share;
    if (limits->memory_bytes < spl_gpu_get_memory(gpu))
        limits->memory_bytes = spl_gpu_get_memory(gpu);
    *out = gpu;
    return 0;
}

int spl_gpu_open(const struct spl_gpu_options *options, struct spl_gpu **out, struct spl_error *err)
{
    struct spl_device_info devices[DEVICES_MAX];
    size_t count = spl_gpu_list(devices, DEVICES_MAX);
    char reasons[1024] = "";
    *out = NULL;
    if (count > DEVICES_MAX)
        count = DEVICES_MAX;
    for (int software = 0; software <= 1; software++) {
        for (size_t i = 0; i < count; i++) {
            const struct spl_device_info *info = &devices[i];
            struct spl_error failure = {0};
            if (info->software != software || !spl_gpu_matches(info, options->device))
                continue;
            if (info->unusable[0]) {
                append(reasons, sizeof reasons, info, info->unusable);
                continue;
            }
            if (software && options->require_gpu) {
                append(reasons, sizeof reasons, info, "a software renderer, and a GPU is required");
                continue;
            }
            const struct spl_gpu_backend *backend = backends[0];
            for (size_t b = 1; b < BACKENDS; b++)
                if (!strcmp(backends[b]->name, info->backend))
                    backend = backends[b];
            if (open_device(backend, info->index, options, out, &failure) >= 0)
                return 0;
            append(reasons, sizeof reasons, info, failure.message);
        }
    }
    if (reasons[0])
        return spl_fail_field(err, SPL_E_NO_DEVICE, "device", "no usable device: %.470s", reasons);
    return spl_fail_field(err, SPL_E_NO_DEVICE, "device",
                          "no device matches '%.200s' (%zu found); 'splatd devices' lists them",
                          options->device ? options->device : "auto", count);
}
