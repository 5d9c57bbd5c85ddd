/* Soft transparency: what of a dataset a view draws as soft spheres that are blended in order, and how. Solid is
 * whatever is not. After: Soft-Transparency for point clouds, sections 3 and 4; api/soft.md says what differs. */
#ifndef SPLATD_SOFT_H
#define SPLATD_SOFT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/error.h>
#include <splatd/terms.h>

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

struct spl_soft_params {
    struct spl_terms what; /* of which any makes a splat soft; none: everything is solid */
    enum spl_soft_model model;
    double opacity; /* at the centre of a sphere, 0 (not drawn at all) to 1; each model's lambda follows from it */
    double blend;   /* how far beyond the ends of a term spheres are still partly solid, in its measure; eq. 22, where
                       at the border they are opaque in their centres, 1 - d / r; 0 = a sharp border, as of classes */
    enum spl_soft_of of; /* depth of a sphere is that of its centre; the rest is its splat's */
    double cover;        /* share, 0 (nothing of it is seen) to 1, by which what the spheres of a sample hold back
                            together, and their colour, is scaled: the most that they ever hide of what is solid */
};

/* spl_terms_parse() of field "soft", into `what`. */
SPL_API int spl_soft_parse(const char *text, struct spl_soft_params *out, struct spl_error *err);

/* spl_terms_print() of `what`. */
SPL_API int spl_soft_print(const struct spl_soft_params *soft, char *text, size_t bytes);

/* Are terms, model, opacity, blend, of and cover in range? SPL_E_USAGE names the field. */
SPL_API int spl_soft_check(const struct spl_soft_params *soft, struct spl_error *err);

SPL_END_DECLARATIONS

#endif
