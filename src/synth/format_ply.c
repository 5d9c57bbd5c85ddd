/* PLY, binary little-endian, world coordinates: floats near the origin, where 20 m keep a micrometre, doubles in a
 * scene that lies elsewhere. Classes follow where they were asked for.
 * The comment that says how the scan was made fills the header up to its fixed length. Pure
 * functions; any thread. */
#include "synth/format.h"

#include <stdio.h>
#include <string.h>

enum { header_bytes = 384 };

static bool is_far(const struct spl_scene *scene)
{
    return scene->offset[0] != 0 || scene->offset[1] != 0 || scene->offset[2] != 0;
}

static size_t header(char *to, const struct spl_scan_file *file)
{
    static const char end[] = "end_header\n";
    const struct spl_scan_faults *f = file->faults;
    const char *type = is_far(file->scene) ? "double" : "float";
    int used = snprintf(to, header_bytes,
                        "ply\nformat binary_little_endian 1.0\nelement vertex %llu\n"
                        "property %s x\nproperty %s y\nproperty %s z\n"
                        "property uchar red\nproperty uchar green\nproperty uchar blue\n%s"
                        "comment %s seed %llu noise %g ",
                        (unsigned long long)file->points, type, type, type,
                        file->classes ? "property uchar classification\n" : "", file->scene->name,
                        (unsigned long long)f->seed, f->noise);
    if (f->mixed > 0 || f->dropout > 0 || f->misregister > 0)
        used += snprintf(to + used, header_bytes - (size_t)used, "mixed %g dropout %g misregister %g ", f->mixed,
                         f->dropout, f->misregister);
    size_t tail = header_bytes - (sizeof end - 1);
    spl_assert((size_t)used < tail);
    memset(to + used, '.', tail - (size_t)used);
    to[tail - 1] = '\n';
    memcpy(to + tail, end, sizeof end - 1);
    return header_bytes;
}

static size_t record(char *to, const struct spl_scan_file *file, const struct spl_return *r)
{
    size_t bytes;
    if (is_far(file->scene)) {
        double position[3];
        for (int i = 0; i < 3; i++)
            position[i] = r->scene[i] + file->scene->offset[i];
        memcpy(to, position, bytes = sizeof position);
    } else {
        float position[3] = {(float)r->scene[0], (float)r->scene[1], (float)r->scene[2]};
        memcpy(to, position, bytes = sizeof position);
    }
    memcpy(to + bytes, r->color, sizeof r->color);
    bytes += sizeof r->color;
    if (file->classes)
        to[bytes++] = (char)r->class;
    return bytes;
}

const struct spl_scan_format spl_format_ply = {.name = "ply", .record_max = 28, .header = header, .record = record};
