/* What the default view is chosen from: an even part of the sorted points, in a frame whose third axis is up, without
 * what lies far off all else. */
#ifndef SPL_PACK_VIEW_SAMPLE_H
#define SPL_PACK_VIEW_SAMPLE_H

#include "pack/points.h"

struct spl_view_sample {
    size_t count;          /* > 0 */
    double (*at)[3];       /* in the frame; within [low, high] */
    float (*normal)[3];    /* the same; NULL without surfaces */
    float *area;           /* squares of radii */
    double low[3], high[3];
    double frame[3][3];    /* rows: the frame's axes in the world */
    double metre;          /* in the unit of coordinates; 0 = not known */
    bool sides;            /* normals show to where the surface was seen from */
};

/* `unit_m` as of the coordinate system, 0 = not known. The caller finishes *sample, also after an error.
 * SPL_E_NOMEM. */
int spl_view_sample_init(struct spl_view_sample *sample, const struct spl_points *points, double unit_m, bool sides,
                         struct spl_error *err);
void spl_view_sample_finish(struct spl_view_sample *sample);

/* A point or a direction of the frame in the world, and back. */
void spl_view_to_world(const struct spl_view_sample *sample, const double local[3], double world[3]);
void spl_view_to_frame(const struct spl_view_sample *sample, const double world[3], double local[3]);

/* The larger of width and depth; what lengths are compared with. */
double spl_view_sample_width(const struct spl_view_sample *sample);

#endif
