/* What a build takes, and what of it lies on disk where memory is bounded.
 *
 * Memory, bytes a point: 28 while reading (40 with given normals), 40 (52) while sorting; then, where coordinates stay
 * doubles, 57 while neighbours are found, 57 while clip lines are, and the inner levels' 11 on top of 53 while
 * encoding; 12 less of each where they are 32 bits (narrow.c). Where memory is bounded nodes are encoded while levels
 * are built, and what they were made of is given back meanwhile (early.c): no more than clip lines take. Where planes
 * are looked for, 93 meanwhile and 4 more from then on; outlining them for an export takes 4, and each thread 60 MB and
 * 20 a point of a plane. Each scalar adds the 1 to 8 of its type (those of LAS 4 in all), and while encoding 1.3. Each
 * on a wire takes 60 more while wires are joined, and besides about 50 of pairs, or of the vertex that becomes of it
 * and stays until the end. Stations have seen points, not panels: where there are both, the scan is written once more
 * without panels.
 * All that grows with the points, but for tables of a byte a point and what joins wires, is in arrays that may lie on
 * disk (spill.h): where memory is bounded these are what is beyond. The same work is done on them, so that nothing
 * depends on the bound. The caller's thread. */
#include "pack/build_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pack/job/part.h"

/* Bytes a point in large arrays, at most: see above. */
static const double bytes_bare = 42, bytes_surface = 50, bytes_planes = 88, bytes_doubles = 12, bytes_normal = 12;
static const double bytes_scalar = 8, bytes_las[] = {2, 1, 1}; /* intensity and returns of LAS */
static const double bytes_written = 16; /* a point, scalars apart: 8 of a wall, 12 of clusters, 15 on wires */

/* The end once more, without panels, for the maps of stations. */
bool spl_build_writes_twice(const struct spl_build *p, const struct spl_passes *later)
{
    return later && p->options->maps && p->options->primitives != SPL_PRIMITIVES_OFF;
}

/* Bytes that memory has no room for. */
static double find_beyond(const struct spl_build *p, double points, double bytes)
{
    return points * bytes + SPL_SPILL_POOL - (double)spl_spill_get_share(p->options->memory_bytes);
}

static int check_disk(const struct spl_build *p, double points, double bytes, double written, struct spl_error *err)
{
    const double beyond = find_beyond(p, points, bytes);
    return beyond > 0
               ? spl_spill_check_disk(p->options->output, (uint64_t)beyond, (uint64_t)(points * written), err)
               : SPL_OK;
}

/* Bytes that a scan's scalars take a point. */
static double count_scalars(const struct spl_scan *scan)
{
    const bool las = scan->coordinates.step[0] > 0;
    double bytes = 0;
    for (int s = 0; s < SPL_SCALAR_COUNT; s++)
        if (scan->scalars >> s & 1)
            bytes += las && s < SPL_SCALAR_KEPT ? bytes_las[s] : bytes_scalar;
    return bytes;
}

/* Whether all coordinates are floats, or steps from one place, so that 32 bits keep them (narrow.c). */
static bool keeps_narrow(const struct spl_scans *scans)
{
    const struct spl_cloud_coordinates *first = scans->count ? &scans->list[0].coordinates : NULL;
    for (size_t i = 0; i < scans->count; i++) {
        const struct spl_cloud_coordinates *c = &scans->list[i].coordinates;
        if (c->floats != first->floats || (!c->floats && !(c->step[0] > 0)) ||
            memcmp(c->step, first->step, sizeof c->step) || memcmp(c->first, first->first, sizeof c->first))
            return false;
    }
    return true;
}

/* Where memory is bounded: what is beyond it goes to disk, of which there must be enough, for the dataset too. Where
 * points are guessed, or cells may be none, half of them must have room; else it is said alone. Says how much it will
 * be, and where the disk is none. */
int spl_build_begin_spill(struct spl_build *p, const struct spl_passes *later, struct spl_error *err)
{
    const struct spl_pack_options *o = p->options;
    double points = 0, least = 0, normals = 0, scalars = 0;
    double bytes = o->points_only ? bytes_bare : o->primitives == SPL_PRIMITIVES_OFF ? bytes_surface : bytes_planes;
    struct spl_error why = {0};
    for (size_t i = 0; i < p->scans.count; i++) {
        const struct spl_scan *scan = &p->scans.list[i];
        double own = (double)(scan->max_points ? scan->max_points : scan->points_expected);
        points += own;
        least += scan->max_points || scan->counted ? own : own / 2;
        normals = scan->attributes & SPL_CLOUD_NORMAL ? bytes_normal : normals;
        scalars = fmax(scalars, count_scalars(scan));
    }
    bytes += keeps_narrow(&p->scans) ? 0 : bytes_doubles;
    if (p->part) {
        points = (double)spl_part_get_expected(p->part);
        least = points / 2;
    }
    bytes += normals + scalars;
    const double beyond = find_beyond(p, points, bytes);
    double written = (bytes_written + scalars) * (spl_build_writes_twice(p, later) ? 2 : 1);
    if (beyond <= 0)
        return SPL_OK;
    spl_build_warn(p,
                   "%.0f points take up to %.1f GB while they are packed, which is beyond --memory: %.1f GB of it lie "
                   "on disk beside %.60s meanwhile, which takes up to %.1f GB itself",
                   points, points * bytes / 1e9, beyond / 1e9, spl_input_name(o->output), points * written / 1e9);
    char *folder = spl_spill_find_memory_folder(o->output);
    if (folder)
        spl_build_warn(p,
                       "'%.200s' lies in memory (tmpfs), and so does what is beyond --memory, which bounds nothing "
                       "there: write the dataset (-o) to a folder on a disk",
                       folder);
    free(folder);
    int rc = check_disk(p, points, bytes, written, &why);
    if (rc && !check_disk(p, least, bytes, written, NULL)) {
        spl_build_warn(p, "%s", why.message);
        return SPL_OK;
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

/* What does not lie in arrays of points (each thread's work, tables of chunks, wires) may be more than a small
 * bound. */
int spl_build_end_spill(struct spl_build *p, int rc, struct spl_error *err)
{
    struct spl_stage *stage = p->stage;
    const uint64_t most = stage->spill ? spl_spill_memory_most(stage->spill) : 0, bound = p->options->memory_bytes;
    rc = spl_spill_explain(stage->spill, rc, err);
    if (!rc && most > bound)
        spl_build_warn(p, "the process took %.0f MB at most, where --memory says %.0f MB%s", (double)most / 1048576,
                       (double)bound / 1048576, stage->threads > 1 ? ": with fewer --threads it takes less" : "");
    spl_spill_destroy(stage->spill);
    stage->spill = NULL;
    return rc;
}
