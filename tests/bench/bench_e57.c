/* Points a second out of an E57 file that is made here, checksums and all: scaled integers as scanners' programs write
 * them (position 24 bits, colour 8, intensity 15), all fields and position alone; and doubles. Processor time of one
 * thread, best of some runs.
 *
 * The floor is what the issue asks: 10 M points/s of scaled integers. Exits 1 below it. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "cloud/cloud.h"
#include "support/e57_writer.h"
#include "timing.h"

enum { count = 1 << 20, runs = 5, batch_points = 65536, packet_points = 4000 };

static int64_t position[3][count], color[count], intensity[count];
static double value[count];

static struct e57_field integers(const char *name, int64_t least, int64_t most, double scale, const int64_t *raw)
{
    unsigned bits = 0;
    for (uint64_t span = (uint64_t)(most - least); span; span >>= 1)
        bits++;
    return (struct e57_field){.name = name,
                              .type = scale == 1 ? E57_INTEGER : E57_SCALED,
                              .least = least,
                              .most = most,
                              .scale = scale,
                              .raw = raw,
                              .step = packet_points * bits / 8};
}

static struct e57_field doubles(const char *name)
{
    return (struct e57_field){.name = name, .type = E57_DOUBLE, .values = value, .step = 16384};
}

/* M points/s of a pass over a file of this scan, in processor time. */
static double measure(const struct e57_field *fields, size_t field_count)
{
    char path[] = "/tmp/splatd-bench-e57-XXXXXX";
    struct e57_writer w;
    struct spl_point_batch batch;
    size_t length;
    int file = mkstemp(path);
    double best = 1e30;
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"bench", e57_pose(0.8, 0, 0, 0.6, 1, 2, 3), fields, field_count, count, 0});
    uint8_t *bytes = e57_end(&w, NULL, &length);
    if (file < 0 || write(file, bytes, length) != (ssize_t)length || close(file) ||
        spl_point_batch_init(&batch, batch_points, NULL))
        abort();
    free(bytes);
    for (int run = 0; run < runs; run++) {
        struct spl_cloud *cloud;
        uint64_t points = 0;
        double start = bench_now_ms(CLOCK_PROCESS_CPUTIME_ID);
        if (spl_cloud_open(path, NULL, &cloud, NULL))
            abort();
        while (spl_cloud_read(cloud, &batch, NULL) > 0)
            points += batch.count;
        spl_cloud_destroy(cloud);
        double took = bench_now_ms(CLOCK_PROCESS_CPUTIME_ID) - start;
        if (points != count)
            abort();
        best = took < best ? took : best;
    }
    spl_point_batch_finish(&batch);
    unlink(path);
    return count / best / 1e3;
}

int main(void)
{
    uint32_t x = 1;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            x = x * 1664525 + 1013904223;
            position[k][i] = (int64_t)(x >> 8) - 8388608;
        }
        color[i] = x >> 24;
        intensity[i] = x >> 17;
        value[i] = x / 1e6;
    }
    const struct e57_field scaled[] = {integers("cartesianX", -8388608, 8388607, 1e-4, position[0]),
                                       integers("cartesianY", -8388608, 8388607, 1e-4, position[1]),
                                       integers("cartesianZ", -8388608, 8388607, 1e-4, position[2]),
                                       integers("colorRed", 0, 255, 1, color),
                                       integers("colorGreen", 0, 255, 1, color),
                                       integers("colorBlue", 0, 255, 1, color),
                                       integers("intensity", 0, 32767, 1, intensity)},
                           floats[] = {doubles("cartesianX"), doubles("cartesianY"), doubles("cartesianZ")};
    double all = measure(scaled, 7), alone = measure(scaled, 3), wide = measure(floats, 3);
    printf("M points/s: scaled integers with colour and intensity %.1f, position alone %.1f, doubles %.1f\n", all,
           alone, wide);
    return all < 10;
}
