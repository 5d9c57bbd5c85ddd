/* Soft transparency: what of a dataset a view draws as soft spheres that are blended in order, and how. Solid is
 * whatever is not. After: Soft-Transparency for point clouds, sections 3 and 4; api/soft.md says what differs. */
#ifndef SPLATD_SOFT_H
#define SPLATD_SOFT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

/* How dense a sphere of radius r is along a ray that passes its centre at distance d. */
enum spl_soft_model {
    SPL_SOFT_MODEL_EXPRESS,    /* a disc that faces the eye, of nearly base's opacity */
    SPL_SOFT_MODEL_CONCENTRIC, /* shells of constant density; eq. 13 to 15, whose densities add */
    SPL_SOFT_MODEL_BASE,       /* density r - distance from the centre, integrated; eq. 2 to 12 */
    SPL_SOFT_MODEL_LAYER,      /* the first soft surface alone, as discs of one opacity: for comparison */
    SPL_SOFT_MODEL_COUNT
};
SPL_API const char *spl_soft_model_name(enum spl_soft_model model);
SPL_API int spl_soft_model_from_name(const char *name); /* -1 for an unknown name */

/* Of what layers depth, range, normal, id and primitive, and picks, speak where something is soft. */
enum spl_soft_of {
    SPL_SOFT_OF_SOLID,  /* of what is solid, as if nothing soft were there */
    SPL_SOFT_OF_FIRST,  /* of the nearest: the solid, or a sphere whose opacity there is 1/255 or more */
    SPL_SOFT_OF_MEDIAN, /* of the sphere that lets less than half through, with those before it; else of the solid */
    SPL_SOFT_OF_COUNT
};
SPL_API const char *spl_soft_of_name(enum spl_soft_of of);
SPL_API int spl_soft_of_from_name(const char *name); /* -1 for an unknown name */

/* What a term measures of a splat. */
enum spl_soft_measure {
    SPL_SOFT_ATTRIBUTE, /* an optional attribute by name: of uncertainty its share of the dataset's 99th percentile, of
                           others the value as the dataset has it */
    SPL_SOFT_QUANTILE,  /* the same as the share of the dataset's splats that have less, 0 to 1 */
    SPL_SOFT_AXIS,      /* distance to the line through shape[0..2] along shape[3..5] */
    SPL_SOFT_PLANE,     /* distance to the plane through shape[0..2], positive on the side of shape[3..5] */
    SPL_SOFT_BOX,       /* distance to the box from shape[0..2] to shape[3..5], negative inside */
};

enum { SPL_SOFT_TERMS_MAX = 16, SPL_SOFT_NAME_MAX = 32, SPL_SOFT_TEXT_MAX = 4096 };

/* A splat is soft where least < measure < most, or where the measure is one of both ends that are included. Splats that
 * have no value of an attribute are solid. */
struct spl_soft_term {
    enum spl_soft_measure measure;
    char name[SPL_SOFT_NAME_MAX]; /* of the attribute; "" of shapes */
    double least, most;           /* -INFINITY, INFINITY = no end */
    bool with_least, with_most;   /* the ends are included */
    double shape[6];              /* world; directions of any length but 0 */
};

struct spl_soft_params {
    uint32_t count; /* terms, of which any makes a splat soft; 0 = everything is solid */
    struct spl_soft_term terms[SPL_SOFT_TERMS_MAX];
    enum spl_soft_model model;
    double opacity; /* at the centre of a sphere, 0 (not drawn at all) to 1; each model's lambda follows from it */
    double blend;   /* how far beyond the ends of a term spheres are still partly solid, in its measure; eq. 22, where
                       at the border they are opaque in their centres, 1 - d / r; 0 = a sharp border. Classes have none */
    enum spl_soft_of of; /* depth of a sphere is that of its centre; the rest is its splat's */
    double cover;        /* share, 0 (nothing of it is seen) to 1, by which what the spheres of a sample hold back
                            together, and their colour, is scaled: the most that they ever hide of what is solid */
};

/* Reads terms, joined by " or ", and appends them to `out`:
 *   uncertainty>0.4   intensity<=300   gps_time:1.5..2   class:3-5,9   uncertainty>q0.9   0.2<uncertainty<=0.4
 *   axis:x,y,z,dx,dy,dz<4   plane:x,y,z,nx,ny,nz>0   box:x0,y0,z0,x1,y1,z1   box:…<2   NAME:* (any value)
 * Ends of ranges are included; 3-5 and 3..5 are the same, and the second reads better with signs: -5..-2. A box alone
 * is its inside. At most SPL_SOFT_TEXT_MAX bytes. SPL_E_INPUT (field "soft") says what is wrong with which term, at
 * which character; SPL_E_LIMIT above SPL_SOFT_TERMS_MAX. On failure `out` is as it was. */
SPL_API int spl_soft_parse(const char *text, struct spl_soft_params *out, struct spl_error *err);

/* Writes the terms so that spl_soft_parse() gives the same ones; returns the length, as snprintf(). What has passed
 * spl_soft_check() is never longer than SPL_SOFT_TEXT_MAX. */
SPL_API int spl_soft_print(const struct spl_soft_params *soft, char *text, size_t bytes);

/* Are terms, model, opacity, blend, of and cover in range? SPL_E_USAGE names the field. */
SPL_API int spl_soft_check(const struct spl_soft_params *soft, struct spl_error *err);

SPL_END_DECLARATIONS

#endif
