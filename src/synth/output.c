/* PTX as Leica's tools write it (columns, rows, the scanner's pose twice, then a line a cell in the scanner's frame)
 * and PLY, binary little-endian, world coordinates as floats: a scene of 20 m keeps a micrometre. Numbers are formatted
 * by hand because printf would take most of a scan's time. */
#include "synth/output.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int spl_output_open(struct spl_output *out, const char *directory, const char *name, const char *extension,
                    struct spl_error *err)
{
    *out = (struct spl_output){.fd = -1};
    if (asprintf(&out->path, "%s/%s.%s", directory, name, extension) < 0) {
        out->path = NULL;
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    }
    if (asprintf(&out->temporary, "%s.part-%ld", out->path, (long)getpid()) < 0) {
        out->temporary = NULL;
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    }
    out->fd = open(out->temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (out->fd < 0)
        return spl_fail_errno(err, errno, "%s cannot be created", out->temporary);
    return 0;
}

int spl_output_write(struct spl_output *out, const void *bytes, size_t count, struct spl_error *err)
{
    for (const char *from = bytes; count;) {
        ssize_t wrote = write(out->fd, from, count);
        if (wrote < 0 && errno != EINTR)
            return spl_fail_errno(err, errno, "writing %s", out->temporary);
        if (wrote > 0) {
            from += wrote;
            count -= (size_t)wrote;
        }
    }
    return 0;
}

int spl_output_write_at(struct spl_output *out, const void *bytes, size_t count, uint64_t offset, struct spl_error *err)
{
    if (lseek(out->fd, (off_t)offset, SEEK_SET) < 0)
        return spl_fail_errno(err, errno, "seeking in %s", out->temporary);
    return spl_output_write(out, bytes, count, err);
}

int spl_output_commit(struct spl_output *out, struct spl_error *err)
{
    int fd = out->fd;
    out->fd = -1;
    int synced = fsync(fd);
    if (close(fd) || synced)
        return spl_fail_errno(err, errno, "writing %s", out->temporary);
    if (rename(out->temporary, out->path))
        return spl_fail_errno(err, errno, "renaming %s to %s", out->temporary, out->path);
    free(out->temporary);
    out->temporary = NULL;
    return 0;
}

void spl_output_finish(struct spl_output *out)
{
    if (out->fd >= 0)
        close(out->fd);
    if (out->temporary)
        unlink(out->temporary);
    free(out->temporary);
    free(out->path);
    *out = (struct spl_output){.fd = -1};
}

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

size_t spl_ptx_header(char to[SPL_PTX_HEADER_MAX], const struct spl_scan_grid *grid, const struct spl_station *station)
{
    const double *r = station->rotation, *p = station->position;
    int used = snprintf(to, SPL_PTX_HEADER_MAX, "%llu\n%llu\n%.6f %.6f %.6f\n", (unsigned long long)grid->columns,
                        (unsigned long long)grid->rows, p[0], p[1], p[2]);
    /* The scanner's axes in the world, then the matrix of row vectors: world = (x y z 1) M. */
    for (int i = 0; i < 3; i++)
        used += snprintf(to + used, SPL_PTX_HEADER_MAX - (size_t)used, "%.15f %.15f %.15f\n", r[i], r[i + 3], r[i + 6]);
    for (int i = 0; i < 3; i++)
        used +=
            snprintf(to + used, SPL_PTX_HEADER_MAX - (size_t)used, "%.15f %.15f %.15f 0\n", r[i], r[i + 3], r[i + 6]);
    used += snprintf(to + used, SPL_PTX_HEADER_MAX - (size_t)used, "%.6f %.6f %.6f 1\n", p[0], p[1], p[2]);
    return (size_t)used;
}

size_t spl_ptx_cell(char *to, const struct spl_return *r)
{
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

void spl_ply_header(char to[SPL_PLY_HEADER_BYTES], uint64_t count, const char *scene, uint64_t seed, double sigma)
{
    static const char end[] = "end_header\n";
    int used = snprintf(to, SPL_PLY_HEADER_BYTES,
                        "ply\nformat binary_little_endian 1.0\nelement vertex %llu\n"
                        "property float x\nproperty float y\nproperty float z\n"
                        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                        "comment %s seed %llu noise %g ",
                        (unsigned long long)count, scene, (unsigned long long)seed, sigma);
    size_t tail = SPL_PLY_HEADER_BYTES - (sizeof end - 1);
    spl_assert((size_t)used < tail);
    memset(to + used, '.', tail - (size_t)used);
    to[tail - 1] = '\n';
    memcpy(to + tail, end, sizeof end - 1);
}

size_t spl_ply_point(char *to, const struct spl_return *r)
{
    float position[3] = {(float)r->world[0], (float)r->world[1], (float)r->world[2]};
    memcpy(to, position, sizeof position);
    memcpy(to + sizeof position, r->color, sizeof r->color);
    return SPL_PLY_POINT_BYTES;
}
