/* What the fuzz targets of the readers share: bytes as a file, read to its end, and what must hold for any bytes. */
#ifndef SPL_FUZZ_CLOUD_H
#define SPL_FUZZ_CLOUD_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "cloud/cloud.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

/* `prefix` replaces the first bytes, so that the file reaches the reader under test. */
static inline void fuzz_cloud(const uint8_t *data, size_t size, const char *prefix, const char *columns)
{
    static struct spl_point_batch batch;
    static int file = -1;
    static const struct spl_keep keep = {.count = 3, .names = {"extra", "gps_time", "scan_angle"}};
    const struct spl_cloud_options options = {.columns = columns, .keep = &keep};
    struct spl_cloud *cloud = NULL;
    struct spl_error err = {0};
    uint64_t points = 0;
    char path[64];

    if (file < 0) {
        file = memfd_create("fuzz", MFD_CLOEXEC);
        require(file >= 0 && spl_point_batch_init(&batch, 100, NULL) == 0);
    }
    require(ftruncate(file, 0) == 0 && pwrite(file, data, size, 0) == (ssize_t)size);
    require(pwrite(file, prefix, strlen(prefix), 0) == (ssize_t)strlen(prefix));
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    int code = spl_cloud_open(path, &options, &cloud, &err);
    require((code == 0) == (cloud != NULL));
    while (cloud && (code = spl_cloud_read(cloud, &batch, &err)) > 0) {
        require(batch.count > 0 && batch.count <= batch.capacity);
        for (size_t i = 0; i < batch.count; i++) {
            double n = 0;
            for (int k = 0; k < 3; k++) {
                require(isfinite(batch.position[i][k]));
                n += (double)batch.normal[i][k] * batch.normal[i][k];
            }
            require(n == 0 || fabs(n - 1) < 1e-5);
        }
        points += batch.count;
    }
    if (cloud) { /* a byte each, at least, where they are not compressed: 88 come of one in a PCD */
        const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
        uint64_t a_byte = !strcmp(info->format, "LAZ")   ? 1024
                          : !strcmp(info->format, "PCD") ? 88
                          : !strcmp(info->format, "E57") ? 8
                                                         : 1;
        require(points + info->points_skipped <= a_byte * (size + strlen(prefix)));
    }
    require(code == err.code && (code == 0) == (err.message[0] == 0));
    spl_cloud_destroy(cloud);
}

#endif
