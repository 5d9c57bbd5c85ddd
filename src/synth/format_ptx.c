/* PTX as Leica's tools write it: columns, rows, the scanner's pose twice, then a line a pulse in the scanner's frame,
 * with a line of zeros where nothing came back. Numbers are formatted by hand because printf would take most of a
 * scan's time. Pure functions; any thread. */
#include "synth/format.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "geom/vector.h"

static char *put_digits(char *to, uint64_t value, int at_least)
{
    char digits[20];
    int count = 0;
    for (; value || count < at_least; value /= 10)
        digits[count++] = (char)('0' + value % 10);
    while (count)
        *to++ = digits[--count];
    return to;
}

/* `decimals` places; `scale` is their power of ten. */
static char *put_fixed(char *to, double value, uint64_t scale, int decimals)
{
    uint64_t units = (uint64_t)(fabs(value) * (double)scale + 0.5);
    if (value < 0 && units)
        *to++ = '-';
    to = put_digits(to, units / scale, 1);
    *to++ = '.';
    return put_digits(to, units % scale, decimals);
}

static size_t pass_header(char *to, const struct spl_scan_file *file, size_t pass)
{
    const struct spl_station *station = &file->scene->stations[pass];
    const double *r = station->rotation;
    double p[3];
    spl_scanner_displacement(file->faults, pass, p);
    mad3(p, 1, station->position, p);
    mad3(p, 1, file->scene->offset, p);
    int used =
        snprintf(to, SPL_SCAN_HEADER_MAX, "%llu\n%llu\n%.6f %.6f %.6f\n", (unsigned long long)file->grid->columns,
                 (unsigned long long)file->grid->rows, p[0], p[1], p[2]);
    /* The scanner's axes in the world, then the matrix of row vectors: world = (x y z 1) M. */
    for (int i = 0; i < 3; i++)
        used +=
            snprintf(to + used, SPL_SCAN_HEADER_MAX - (size_t)used, "%.15f %.15f %.15f\n", r[i], r[i + 3], r[i + 6]);
    for (int i = 0; i < 3; i++)
        used +=
            snprintf(to + used, SPL_SCAN_HEADER_MAX - (size_t)used, "%.15f %.15f %.15f 0\n", r[i], r[i + 3], r[i + 6]);
    used += snprintf(to + used, SPL_SCAN_HEADER_MAX - (size_t)used, "%.6f %.6f %.6f 1\n", p[0], p[1], p[2]);
    return (size_t)used;
}

static size_t record(char *to, const struct spl_scan_file *file, const struct spl_return *r)
{
    (void)file;
    static const char nothing[] = "0 0 0 0.5 0 0 0\n";
    if (!r->hit) {
        memcpy(to, nothing, sizeof nothing - 1);
        return sizeof nothing - 1;
    }
    char *at = to;
    for (int i = 0; i < 3; i++) {
        at = put_fixed(at, r->local[i], 100000, 5);
        *at++ = ' ';
    }
    at = put_fixed(at, (double)r->intensity, 10000, 4);
    for (int i = 0; i < 3; i++) {
        *at++ = ' ';
        at = put_digits(at, r->color[i], 1);
    }
    *at++ = '\n';
    return (size_t)(at - to);
}

const struct spl_scan_format spl_format_ptx = {
    .name = "ptx", .structured = true, .record_max = 64, .pass_header = pass_header, .record = record};
