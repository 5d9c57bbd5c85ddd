/* Where scanners and cameras stood, as far as they can have stood there. */
#ifndef SPL_PACK_VIEW_STOOD_H
#define SPL_PACK_VIEW_STOOD_H

#include "pack/view/sample.h"

enum { SPL_VIEW_STOOD_MAX = 64 };

/* A place for an eye, in the frame. */
struct spl_view_place {
    double eye[3];
};

struct spl_view_stood {
    struct spl_view_place places[SPL_VIEW_STOOD_MAX]; /* within the sample's box */
    size_t count;
    size_t taken; /* of which were asked, but for those where nobody can have stood; >= count */
    struct spl_view_place feet[SPL_VIEW_STOOD_MAX]; /* on the ground, of scans whose origin lies there */
    size_t foot_count;
    bool origins; /* such and other origins are all that was asked */
};

/* Of stations and cameras many at even steps. No place of an eye is a station that lies on what it scanned, or under
 * it, and are several that have one pose without a turn: those scans were brought into one system, whose origin it is.
 * Pure. */
void spl_view_list_stood(const struct spl_view_sample *sample, const struct spl_points *points,
                         struct spl_view_stood *stood);

#endif
