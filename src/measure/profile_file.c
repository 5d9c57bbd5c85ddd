/* Profiles as files. One of another dataset version or another device is refused, because its promises would be about
 * something else. Any thread; blocks on disk. */
#include "measure/profile.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "geom/json.h"

enum { file_max = 1 << 20 };

static int compare(const struct spl_profile *profile, const struct spl_dataset_info *dataset,
                   const struct spl_device_info *device, const char *path, struct spl_error *err)
{
    if (dataset && profile->dataset_version != dataset->version)
        return spl_fail_field(err, SPL_E_INPUT, "version",
                              "%s is about version %016" PRIx64 " of dataset '%s', which is now %016" PRIx64
                              "; 'splatd bench' measures it anew",
                              path, profile->dataset_version, dataset->id, dataset->version);
    if (device && (strcmp(profile->backend, device->backend) || strcmp(profile->device, device->name) ||
                   strcmp(profile->driver, device->driver)))
        return spl_fail_field(err, SPL_E_INPUT, "device",
                              "%.150s is about %s: %.60s (%.60s), not %s: %.60s (%.60s); 'splatd bench' measures anew",
                              path, profile->backend, profile->device, profile->driver, device->backend, device->name,
                              device->driver);
    return 0;
}

/* The file's bytes, malloc'd; NULL on failure. */
static char *read_file(const char *path, size_t *length, struct spl_error *err)
{
    char *bytes = NULL;
    struct stat status;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // a FIFO of this name has nobody wait for its writer
    FILE *file = fd < 0 ? NULL : fdopen(fd, "r");
    if (!file && fd >= 0)
        close(fd);
    if (!file && errno == ENOENT) {
        spl_fail(err, SPL_E_NOT_FOUND, "there is no profile '%s'; 'splatd bench' makes one", path);
        return NULL;
    }
    if (!file || fstat(fileno(file), &status))
        spl_fail_errno(err, errno, "cannot read '%s'", path);
    else if (!S_ISREG(status.st_mode) || status.st_size > file_max)
        spl_fail(err, SPL_E_INPUT, "'%s' is no profile: no plain file, or larger than %d bytes", path, (int)file_max);
    else if ((bytes = spl_alloc_raw((size_t)status.st_size + 1, 1, err)))
        *length = fread(bytes, 1, (size_t)status.st_size, file);
    if (bytes && ferror(file)) {
        spl_fail_errno(err, errno, "cannot read '%s'", path);
        free(bytes);
        bytes = NULL;
    }
    if (file)
        fclose(file);
    return bytes;
}

int spl_profile_load(const char *path, const struct spl_dataset_info *dataset, const struct spl_device_info *device,
                     struct spl_profile *profile, struct spl_error *err)
{
    struct spl_error own = {0};
    size_t length = 0;
    *profile = (struct spl_profile){0};
    if (!err)
        err = &own; // the code is read back below
    char *bytes = read_file(path, &length, err);
    if (!bytes)
        return err->code;
    int rc = spl_profile_parse(bytes, length, path, profile, err);
    free(bytes);
    if (!rc && (rc = compare(profile, dataset, device, path, err)))
        spl_profile_finish(profile);
    return rc;
}

int spl_profile_save(const char *path, const struct spl_profile *profile, struct spl_error *err)
{
    struct spl_profile copy = *profile, again = {0};
    int rc = SPL_E_NOMEM;
    if (!profile->count || profile->count > SPL_PROFILE_POINTS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "points", "a profile holds 1 to %d settings, not %zu",
                              (int)SPL_PROFILE_POINTS_MAX, profile->count);
    if (!(copy.points = spl_alloc_raw(copy.count, sizeof *copy.points, err)))
        return SPL_E_NOMEM;
    memcpy(copy.points, profile->points, copy.count * sizeof *copy.points);
    for (size_t i = 0; i < copy.count; i++) {
        copy.points[i].psnr = fmin(copy.points[i].psnr, SPL_PROFILE_PSNR_MAX); // NAN would become the maximum
        copy.points[i].psnr_q05 = fmin(copy.points[i].psnr_q05, SPL_PROFILE_PSNR_MAX);
        if (isnan(profile->points[i].psnr))
            copy.points[i].psnr = NAN;
        if (isnan(profile->points[i].psnr_q05))
            copy.points[i].psnr_q05 = NAN;
    }
    char *text = spl_json_print(spl_profile_to_json(&copy));
    if (!text)
        spl_fail(err, SPL_E_NOMEM, "out of memory for the profile '%s'", path);
    else if (!(rc = spl_profile_check(&copy, path, err)) &&
             !(rc = spl_profile_parse(text, strlen(text), path, &again, err)))
        rc = spl_file_replace(path, text, strlen(text), err);
    spl_profile_finish(&again);
    free(text);
    free(copy.points);
    return rc;
}
