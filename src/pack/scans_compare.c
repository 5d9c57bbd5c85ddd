/* Scans that are merged were often written by different programs, with RGB here and intensity alone there. Nothing of
 * that is an error, so each is taken as it is; but it is said, since nobody sees in a merged dataset why it has a seam.
 * What their headers say of coordinates is system.c's. The caller's thread. */
#include "pack/scans.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "pack/kept.h"
#include "pack/names.h"
#include "pack/warn.h"

static const double like_steps = 10; /* times the finest step of coordinates: nothing to mention */
/* 32 bit floats: coarser than a millimetre, and than the scan's size alone would make them. */
static const double float_step = 1e-3, float_step_diagonals = 1e-6;
static const double far_diagonals = 10; /* of the larger box, from a scan to the nearest other one */

struct saying {
    const struct spl_scans *scans;
    void (*warn)(void *context, const char *text);
    void *context;
};

#define say(s, ...) spl_pack_warn((s)->warn, (s)->context, __VA_ARGS__)

static bool has_points(const struct spl_scan *scan)
{
    return scan->points_from[0] + scan->points_from[1] + scan->points_from[2] > 0;
}

static void compare_kinds(const struct saying *s)
{
    static const char *const what[3] = {"none at all", "RGB", "grey from intensity"};
    struct spl_names groups[3] = {0}, blank = {0};
    char text[800] = "";
    int kinds = 0;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        for (int from = 0; from < 3; from++)
            if (scan->points_from[from])
                spl_names_add(&groups[from], scan->name);
        if (scan->colors.blank && has_points(scan))
            spl_names_add(&blank, scan->name);
    }
    for (int k = 0; k < 3; k++) {
        int from = (k + 1) % 3;
        size_t used = strlen(text);
        if (groups[from].count)
            snprintf(text + used, sizeof text - used, "%s%s in %zu (%s)", kinds++ ? ", " : "", what[from],
                     groups[from].count, spl_names_list(&groups[from]));
    }
    if (blank.count)
        say(s, "colour fields hold nothing but 0 in %s: they were taken as missing", spl_names_list(&blank));
    if (s->scans->how.intensity && !groups[SPL_COLORS_INTENSITY].count && kinds)
        say(s,
            "--intensity changes nothing: no scan has an intensity, or none that is not the same everywhere; colours "
            "are %s",
            text);
    else if (kinds > 1 && s->scans->how.intensity) {
        struct spl_names lack = {0};
        for (size_t i = 0; i < s->scans->count; i++)
            if (s->scans->list[i].points_from[SPL_COLORS_RGB] || s->scans->list[i].points_from[SPL_COLORS_CONSTANT])
                spl_names_add(&lack, s->scans->list[i].name);
        say(s,
            "no intensity, which --intensity asks for, in %zu (%s); the scans' colours are of different kinds: %s. "
            "Each was taken as it is, and a seam shows where they meet. --cameras takes the colours of photographs; or "
            "pack each kind as a dataset of its own",
            lack.count, spl_names_list(&lack), text);
    } else if (kinds > 1)
        say(s,
            "the scans' colours are of different kinds: %s. Each was taken as it is, and a seam shows where they meet. "
            "--intensity takes intensity from all that have it, --cameras the colours of photographs; or pack each "
            "kind as a dataset of its own",
            text);
}

static void compare_endings(const struct saying *s)
{
    struct spl_names wrong = {0};
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        char text[96];
        snprintf(text, sizeof text, "%.40s holds %s", scan->name, scan->format);
        if (scan->named)
            spl_names_add(&wrong, text);
    }
    if (wrong.count)
        say(s, "names end like another format than the file's: %s. Each was read as what it holds",
            spl_names_list(&wrong));
}

enum { BITS = 4 }; /* how many there are of colours */

/* Values that mean black and white where the scans do not say so themselves. */
static void compare_ranges(const struct saying *s)
{
    const struct spl_scan *low = NULL, *high = NULL;
    static const double whites[BITS] = {255, 1023, 4095, 65535};
    static const int bits[BITS] = {8, 10, 12, 16};
    struct spl_names of[BITS] = {0};
    unsigned few = 0, many = BITS - 1;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        const struct spl_cloud_colors *colors = &scan->colors;
        if (!colors->guessed || !scan->points_from[colors->from])
            continue;
        if (colors->from == SPL_COLORS_RGB) {
            unsigned k = 0;
            while (k + 1 < BITS && colors->white > whites[k])
                k++;
            spl_names_add(&of[k], scan->name);
            continue;
        }
        low = !low || colors->white < low->colors.white ? scan : low;
        high = !high || colors->white > high->colors.white ? scan : high;
    }
    while (few < many && !of[few].count)
        few++;
    while (few < many && !of[many].count)
        many--;
    if (few < many)
        say(s,
            "colours are %d bit, none above %g, in %zu (%s) and %d bit in %zu (%s): each was taken by its own range. "
            "If the former are only dark, write all of them with 8 bit first",
            bits[few], whites[few], of[few].count, spl_names_list(&of[few]), bits[many], of[many].count,
            spl_names_list(&of[many]));
    if (low && (low->colors.white < high->colors.white || low->colors.black > high->colors.black))
        say(s,
            "intensities differ in range, from %g..%g in %s to %g..%g in %s: each scan was made grey by its own, and "
            "its brightness does not compare. Write all of them in one unit to avoid that",
            low->colors.black, low->colors.white, low->name, high->colors.black, high->colors.white, high->name);
}

static void compare_attributes(const struct saying *s)
{
    static const struct {
        uint32_t attribute;
        const char *what, *done;
    } rows[] = {{SPL_CLOUD_NORMAL, "normals", "estimated"}, {SPL_CLOUD_CLASS, "classes", "0"}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct spl_names with = {0}, without = {0};
        for (size_t i = 0; i < s->scans->count; i++)
            if (has_points(&s->scans->list[i]))
                spl_names_add(s->scans->list[i].attributes & rows[r].attribute ? &with : &without,
                              s->scans->list[i].name);
        if (with.count && without.count)
            say(s, "%s are given in %zu (%s), in the others (%s) they are %s", rows[r].what, with.count,
                spl_names_list(&with), spl_names_list(&without), rows[r].done);
    }
    for (int scalar = 0; scalar < SPL_SCALAR_COUNT; scalar++) {
        struct spl_names with = {0}, without = {0};
        for (size_t i = 0; i < s->scans->count; i++)
            if (has_points(&s->scans->list[i]))
                spl_names_add(s->scans->list[i].scalars >> scalar & 1 ? &with : &without, s->scans->list[i].name);
        if (with.count && without.count)
            say(s, "%s is given in %zu (%s), points of the others (%s) have none",
                spl_kept_name(s->scans->how.keep, scalar), with.count, spl_names_list(&with),
                spl_names_list(&without));
    }
}

/* The first scan whose coordinates have a step against each other one; one sentence is enough. */
static void compare_steps(const struct saying *s)
{
    const struct spl_scan *of = NULL;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        const double *step = scan->coordinates.step;
        of = of || !(step[0] > 0) ? of : scan;
        for (int k = 0; k < 3 && step[0] > 0; k++) {
            double ratio = step[k] / of->coordinates.step[k];
            if (!(ratio >= like_steps) && !(ratio <= 1 / like_steps))
                continue;
            say(s, "coordinates of %s are multiples of %g, of %s of %g: the coarser scan is no finer than that",
                of->name, of->coordinates.step[k], scan->name, step[k]);
            return;
        }
    }
}

static double diagonal(const struct spl_scan *a)
{
    return sqrt(pow(a->max[0] - a->min[0], 2) + pow(a->max[1] - a->min[1], 2) + pow(a->max[2] - a->min[2], 2));
}

/* Between two boxes. */
static double gap(const struct spl_scan *a, const struct spl_scan *b)
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double apart = fmax(fmax(a->min[k] - b->max[k], b->min[k] - a->max[k]), 0);
        square += apart * apart;
    }
    return sqrt(square);
}

static void look_at_floats(const struct saying *s)
{
    struct spl_names coarse = {0};
    double step = 0, of = 0;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        double largest = 0;
        for (int k = 0; k < 3; k++)
            largest = fmax(largest, fmax(fabs(scan->min[k]), fabs(scan->max[k])));
        if (!scan->coordinates.floats || !has_points(scan) || !isfinite(largest))
            continue;
        double own = nextafterf((float)largest, INFINITY) - (float)largest;
        if (own <= float_step || own <= float_step_diagonals * diagonal(scan))
            continue;
        spl_names_add(&coarse, scan->name);
        of = own > step ? largest : of;
        step = fmax(own, step);
    }
    if (coarse.count)
        say(s,
            "coordinates are 32 bit floats in %s, which at %.6g are multiples of %g: what was finer was lost when they "
            "were written. Write them as doubles, or less a whole number that brings them near 0",
            spl_names_list(&coarse), of, step);
}

/* A writer that was stopped before it came back to the header. A few records' room may be padding. */
static void look_at_counts(const struct saying *s)
{
    struct spl_names short_of = {0};
    uint64_t behind = 0;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        if (scan->points_behind <= scan->points_total / 100)
            continue;
        spl_names_add(&short_of, scan->name);
        behind += scan->points_behind;
    }
    if (short_of.count)
        say(s,
            "the header counts fewer points than the file has room for in %s: %llu more could lie there and are not "
            "read. If they are points, mend the header's number",
            spl_names_list(&short_of), (unsigned long long)behind);
}

/* Each scan against all others until one is not far, which in a street or among tiles is one of the next. */
static void compare_places(const struct saying *s)
{
    struct spl_names empty = {0}, far = {0};
    double farthest = 0, size = 0;
    for (size_t i = 0; i < s->scans->count; i++)
        if (has_points(&s->scans->list[i]))
            size = fmax(size, diagonal(&s->scans->list[i]));
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        double nearest = INFINITY;
        if (!has_points(scan)) {
            spl_names_add(&empty, scan->name);
            continue;
        }
        for (size_t k = 1; k < s->scans->count && nearest > far_diagonals * size; k++) {
            const struct spl_scan *other = &s->scans->list[(i + k) % s->scans->count];
            if (has_points(other))
                nearest = fmin(nearest, gap(scan, other));
        }
        if (isfinite(nearest) && nearest > far_diagonals * size) {
            spl_names_add(&far, scan->name);
            farthest = fmax(farthest, nearest);
        }
    }
    if (empty.count)
        say(s, "no usable point in %zu (%s)", empty.count, spl_names_list(&empty));
    if (far.count)
        say(s,
            "scans lie far apart: %.4g from the nearest other one (%s). They may be in different coordinates; if not, "
            "pack them as datasets of their own, since the first view and the levels of detail span the gap",
            farthest, spl_names_list(&far));
}

void spl_scans_compare(const struct spl_scans *scans, void (*warn)(void *context, const char *text), void *context)
{
    const struct saying saying = {scans, warn, context};
    compare_endings(&saying);
    compare_kinds(&saying);
    compare_ranges(&saying);
    compare_attributes(&saying);
    compare_steps(&saying);
    look_at_floats(&saying);
    look_at_counts(&saying);
    compare_places(&saying);
}
