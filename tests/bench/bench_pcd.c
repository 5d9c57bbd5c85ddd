/* Points a second out of PCD files with x, y, z, rgb and intensity, as batches: binary and binary_compressed, which are
 * written here. In processor time, so that a shared machine does not decide; best of some runs.
 *
 * The floor: reading must not be what a pack waits for, which takes 1 to 2 M points a second and core.
 * Exits 1 below it. */
#include <lzf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cloud/cloud.h"
#include "timing.h"

enum { runs = 5, points = 2000000, fields = 5 };
static const double floor_points = 10e6;

static void write_file(FILE *file, int compressed)
{
    float *values = malloc(sizeof(float) * fields * points);
    uint8_t *packed = malloc(sizeof(float) * fields * points * 2);
    for (size_t i = 0; i < points; i++)
        for (size_t f = 0; f < fields; f++) { /* a wall of a grid, so that there is something to compress */
            float v = f == 0   ? (float)(i % 2000) / 1000
                      : f == 1 ? (float)(i / 2000) / 1000
                      : f == 4 ? (float)(i % 251)
                               : 0;
            uint32_t rgb = (uint32_t)(i % 199) * 0x10101;
            if (f == 3)
                memcpy(&v, &rgb, sizeof v);
            values[compressed ? f * points + i : i * fields + f] = v;
        }
    fprintf(file, "# .PCD v0.7\nFIELDS x y z rgb intensity\nSIZE 4 4 4 4 4\nTYPE F F F F F\nWIDTH %d\nDATA binary%s\n",
            points, compressed ? "_compressed" : "");
    uint32_t sizes[2] = {0, sizeof(float) * fields * points};
    if (compressed) {
        sizes[0] = lzf_compress(values, sizes[1], packed, 2 * sizes[1]);
        fwrite(sizes, sizeof sizes, 1, file);
    }
    fwrite(compressed ? (const void *)packed : values, compressed ? sizes[0] : sizes[1], 1, file);
    free(values);
    free(packed);
}

static double measure(const char *path)
{
    double best = INFINITY;
    struct spl_point_batch batch;
    if (spl_point_batch_init(&batch, 65536, NULL))
        exit(1);
    for (int run = 0; run < runs; run++) {
        struct spl_cloud *cloud = NULL;
        struct spl_error err = {0};
        uint64_t count = 0;
        double begin = bench_now_ms(CLOCK_PROCESS_CPUTIME_ID);
        int code = spl_cloud_open(path, NULL, &cloud, &err);
        while (code >= 0 && (code = spl_cloud_read(cloud, &batch, &err)) > 0)
            count += batch.count;
        best = fmin(best, bench_now_ms(CLOCK_PROCESS_CPUTIME_ID) - begin);
        spl_cloud_destroy(cloud);
        if (count != points) {
            fprintf(stderr, "%llu points; %s\n", (unsigned long long)count, err.message);
            exit(1);
        }
    }
    spl_point_batch_finish(&batch);
    return points / best * 1e3;
}

int main(void)
{
    int slow = 0;
    for (int compressed = 0; compressed < 2; compressed++) {
        char path[] = "/tmp/splatd-bench-pcd-XXXXXX";
        int fd = mkstemp(path);
        FILE *file = fd < 0 ? NULL : fdopen(fd, "wb");
        if (!file)
            return 1;
        write_file(file, compressed);
        fclose(file);
        double rate = measure(path);
        unlink(path);
        printf("PCD binary%-12s %6.1f M points/s, at least %.0f\n", compressed ? "_compressed" : "", rate / 1e6,
               floor_points / 1e6);
        slow |= rate < floor_points;
    }
    return slow;
}
