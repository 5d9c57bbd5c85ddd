/* The cloud in memory while it is packed: structure of arrays, one element a point. Coordinates are exact doubles, kept
 * as 32 bits where these say all of them. */
#ifndef SPL_PACK_POINTS_H
#define SPL_PACK_POINTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "pack/scalars.h"
#include "pack/scans.h"
#include "pack/spill.h"

#define SPL_NO_STATION UINT16_MAX
#define SPL_POINTS_MAX (UINT32_MAX - 1) /* of a dataset: indices have 32 bits */
enum { SPL_CELLS_ALIGNED = 64 };  /* cells of a part: cubes begin a multiple of so many apart */
enum { SPL_NEIGHBOURS_MAX = 64 }; /* nearest points that are asked for */
enum { SPL_POINTS_PAD = 16 };   /* elements behind the last one that vector loops may read */

/* A clip line: its direction in 127ths, world, and its distance in 255ths of the radius; direction 0 = none. */
struct spl_point_clip {
    int8_t direction[3];
    uint8_t offset;
};

/* How coordinates are kept: what they are, and what a scan wrote them as, which takes half the room. */
enum spl_points_kind { SPL_POINTS_DOUBLES, SPL_POINTS_FLOATS, SPL_POINTS_STEPS };

struct spl_points {
    struct spl_spill *spill;     /* where the arrays lie, borrowed; NULL: in memory */
    size_t count, capacity;      /* arrays have room for capacity + SPL_POINTS_PAD elements */
    union {                      /* x, y, z; sorted in Morton order by spl_points_order() */
        double *axis[3];         /* SPL_POINTS_DOUBLES */
        float *floats[3];        /* SPL_POINTS_FLOATS */
        int32_t *steps[3];       /* SPL_POINTS_STEPS: as many of `step` from `first` on */
    };
    enum spl_points_kind kind;
    double step[3], first[3];
    uint32_t *color_class;       /* r | g << 8 | b << 16 | class << 24 */
    uint16_t *station;           /* index into stations or SPL_NO_STATION; NULL when no input has any */
    float (*normal)[3];          /* given ones (0,0,0 = none); NULL when no input has any; spl_surface() fills it */
    uint8_t *linear;             /* 1 on a wire, a pole or a cable; made by spl_linear_find(); may be NULL: none is */
    float *radius, *uncertainty; /* made by spl_surface() or spl_bare_points(); between spl_linear_find() and these,
                                    `radius` is the most that a linear point's line asks for; 0: it does not say */
    struct spl_scalar_values scalar[SPL_POINT_SCALARS]; /* settled by spl_points_gather() */
    const struct spl_keep *keep;                        /* what they are called; borrowed */
    struct spl_point_clip *clip; /* made by spl_surface(); NULL = none */
    uint8_t *halo;               /* 1 beside the part that is packed (job/rules.h); NULL: none is */
    uint32_t *plane;             /* made by spl_planes_find(): index or SPL_NO_PLANE; NULL: not looked for */
    double (*stations)[16];      /* row-major station-to-world */
    uint32_t station_count;
    size_t station_capacity;
    bool has_halo; /* of a part, so that halo grows with the others */
    bool has_color, has_class, no_surface;          /* the last: made by spl_bare_points() */
    double bounds_min[3], bounds_max[3]; /* set by spl_points_order() */
    double cube_min[3], cube_size;       /* the cube that they are sorted in, of no other use; set by it too */
    double cells;                        /* of a part: as of struct spl_part_rules; 0: of none */
    double (*eyes)[3]; /* set by spl_eyes_take() */
    size_t eye_count;
    double up[3]; /* unit vector; z, as spl_points_gather() leaves it, unless somebody knows better */
    uint64_t points_read, points_skipped, duplicates;
    uint64_t halo_points; /* dropped by spl_part_drop_halo() */
};

/* A coordinate as it is kept: what is nearly 0 is 0, and so is -0; no two places are closer than floats relative to a
 * node can tell. */
static inline double spl_points_coordinate(double v)
{
    return v < 1e-15 && v > -1e-15 ? 0 : v;
}

static inline double spl_points_at(const struct spl_points *points, int c, size_t i)
{
    if (points->kind == SPL_POINTS_DOUBLES)
        return points->axis[c][i];
    if (points->kind == SPL_POINTS_FLOATS)
        return (double)points->floats[c][i];
    return points->steps[c][i] * points->step[c] + points->first[c];
}

/* All three, for loops that take many. */
static inline __attribute__((always_inline)) void spl_points_place(const struct spl_points *points, size_t i,
                                                                   double at[3])
{
    if (points->kind == SPL_POINTS_DOUBLES)
        for (int c = 0; c < 3; c++)
            at[c] = points->axis[c][i];
    else if (points->kind == SPL_POINTS_FLOATS)
        for (int c = 0; c < 3; c++)
            at[c] = (double)points->floats[c][i];
    else
        for (int c = 0; c < 3; c++)
            at[c] = points->steps[c][i] * points->step[c] + points->first[c];
}

/* From a place to point i. */
static inline __attribute__((always_inline)) void spl_points_apart(const struct spl_points *points,
                                                                   const double from[3], size_t i, double apart[3])
{
    spl_points_place(points, i, apart);
    for (int c = 0; c < 3; c++)
        apart[c] -= from[c];
}

/* The same of many, axis by axis, which vectors take where the caller is compiled for them. */
static inline __attribute__((always_inline)) void spl_points_list_apart(const struct spl_points *points,
                                                                        const double from[3], const uint32_t *index,
                                                                        unsigned count,
                                                                        double apart[3][SPL_NEIGHBOURS_MAX])
{
    for (int c = 0; c < 3; c++) {
        int32_t steps[SPL_NEIGHBOURS_MAX];
        if (points->kind == SPL_POINTS_DOUBLES)
            for (unsigned a = 0; a < count; a++)
                apart[c][a] = points->axis[c][index[a]] - from[c];
        else if (points->kind == SPL_POINTS_FLOATS)
            for (unsigned a = 0; a < count; a++)
                apart[c][a] = (double)points->floats[c][index[a]] - from[c];
        else {
            for (unsigned a = 0; a < count; a++)
                steps[a] = points->steps[c][index[a]];
            for (unsigned a = 0; a < count; a++)
                apart[c][a] = steps[a] * points->step[c] + points->first[c] - from[c];
        }
    }
}

static inline size_t spl_points_axis_bytes(const struct spl_points *points) /* of a coordinate */
{
    return points->kind == SPL_POINTS_DOUBLES ? sizeof(double) : sizeof(float);
}

/* SPL_E_LIMIT where the scans' headers say that they have more points than there can be, SPL_POINTS_MAX. */
int spl_points_check_count(const struct spl_scans *scans, struct spl_error *err);

/* Reads all scans, and counts in them what came of each. SPL_E_INPUT when none has a usable point or a coordinate is
 * beyond SPL_COORDINATE_MAX. Of a part (scans->rules) it reads what is in it and in its halo, which may be nothing, and
 * keeps attributes as the rules say; points_read are those inside then. */
int spl_points_gather(struct spl_points *points, struct spl_scans *scans, struct spl_stage *stage,
                      struct spl_error *err);

/* Decides which of the scalars are kept and their steps: those of a part (`rules`; else NULL) as of all others, else
 * those that say something. SPL_E_INPUT where a part's are not as its rules say. */
int spl_points_settle(struct spl_points *points, const struct spl_part_rules *rules, struct spl_error *err);

/* Fills `list` with the indices of the scalars that the points have, in order; returns how many. */
unsigned spl_points_list_scalars(const struct spl_points *points, int list[SPL_POINT_SCALARS]);

/* Sorts all arrays in Morton order and drops points with equal coordinates. Which of them stays depends on what they
 * have alone, so that the result is the same in whatever order points were read. */
int spl_points_order(struct spl_points *points, struct spl_stage *stage, struct spl_error *err);

/* Of no points yet: those that spl_points_put() adds are kept as floats or, where the scan counts so, as the steps of
 * `steps` (NULL: of none), as long as all are exactly that. */
void spl_points_begin_narrow(struct spl_points *points, const struct spl_cloud_coordinates *steps);

/* Writes the coordinates of `more` points behind the others, for which there is room; `count` stays. All become doubles
 * with the first that is not as it is to be kept. SPL_E_NOMEM. */
int spl_points_put(struct spl_points *points, const double (*position)[3], size_t more, struct spl_error *err);

/* Of doubles the same afterwards: keeps them as floats, or as the steps of `steps`, where all are exactly that. Nobody
 * sees a difference who reads them by spl_points_at(). */
int spl_points_narrow(struct spl_points *points, const struct spl_cloud_coordinates *steps, struct spl_stage *stage,
                      struct spl_error *err);

/* Normals, radii and uncertainties from the `neighbours` nearest (3..SPL_NEIGHBOURS_MAX), with `clip_lines`
 * where discs end; needs sorted points. */
int spl_surface(struct spl_points *points, unsigned neighbours, bool clip_lines, struct spl_stage *stage,
                struct spl_error *err);

/* Instead: normals are (0, 0, 1), uncertainties 0, and radii those of a square grid as dense as the points around,
 * which are counted in cells, not searched. What levels of detail are chosen by; no surface to draw. Needs sorted
 * points. */
int spl_bare_points(struct spl_points *points, struct spl_stage *stage, struct spl_error *err);

void spl_points_finish(struct spl_points *points);

#endif
