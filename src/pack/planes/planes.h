/* The planes of a scan: which points lie on a common flat thing, so that a dataset can say the thing and not each of
 * its points. After the robust octree patches of Araujo and Oliveira ("A robust statistics approach for plane detection
 * in unorganized point clouds", 2020): cells whose points lie on a plane are taken whole, patches that agree are one
 * plane, planes grow over the points beside them. */
#ifndef SPL_PACK_PLANES_H
#define SPL_PACK_PLANES_H

#include "pack/points.h"
#include "pack/stage.h"

#define SPL_NO_PLANE UINT32_MAX

/* Fewest points of a plane. A chunk of panels takes 60 bytes, a panel 8 and a cell less than one, where a disc takes 6:
 * from some 14 points on the panel is less. Of fewer than 20 points noise makes planes where there are none; a few more
 * than that let what is curved fall into facets (columns, pipes, bodies of cars) and foliage stays without. */
enum { SPL_PLANE_POINTS = 24 };

/* Lengths are in units of the coordinates. */
struct spl_heights;
struct spl_plane {
    double origin[3];            /* a point of it, world: the middle of its points */
    double normal[3];            /* unit, towards the side that it was seen from */
    double error_rms, error_max; /* of its points' distances */
    uint64_t points;             /* >= SPL_PLANE_POINTS */
    double bound;                /* with heights: that its points keep to, the mean */
    struct spl_heights *heights; /* NULL: it is flat; else distances are from these, over it (heights.h); owned */
};

struct spl_planes {
    struct spl_plane *list; /* flat ones, then those with relief, each by their first points; owned */
    uint32_t count;
    uint32_t flat; /* how many of them are */
    double bound; /* no point lies farther off its plane; the largest, where it changes from place to place */
    double own_bound; /* what the largest would be if none were given */
    double noise; /* sigma of the scan's distances to small planes, the median; 0 = none could be measured */
};

struct spl_planes_options {
    /* No point lies farther off its plane, and what is no noise (a bend, a step, a tilt) keeps to two fifths of
     * it. 0 = place by place the larger of 4 sigma of the noise there, so that noise tears no holes, and a fifth
     * of the median spacing of its points, which is less than their discs are off any surface that bends. */
    double error;
    bool relief; /* what is left is searched for smooth pieces, and points->plane is theirs too */
};

/* Finds the planes of `points`, which have been through spl_surface(), and sets points->plane, an index into
 * planes->list a point or SPL_NO_PLANE. Points of one plane were seen from the same side of it: by the stations where
 * they are known, else by the signs of the normals. Linear points make no planes; those that lie on one that others
 * make join it, and are linear no longer.
 *
 * planes: filled on success, and finished by the caller; empty on failure, and points->plane NULL then.
 * Parallel, on stage->threads; the result does not depend on how many there are. Memory while it runs: about 30 bytes a
 * point, 38 with relief, of which points->plane keeps 4. SPL_E_NOMEM, SPL_E_CANCELLED. */
int spl_planes_find(struct spl_planes *planes, struct spl_points *points, const struct spl_planes_options *options,
                    struct spl_stage *stage, struct spl_error *err);

void spl_planes_finish(struct spl_planes *planes);

#endif
