/* The methods that splats are drawn by, and the parameters that they take. This is their table: names, parsing, checks,
 * HTTP parameters, options of commands, help, cache keys and the planner are made from it and from each method's row in
 * src/render/methods/. A new method is a line here, and its parameters, where it has any, a struct and lines. */
#ifndef SPLATD_METHOD_H
#define SPLATD_METHOD_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/color.h>
#include <splatd/dataset.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

/* METHOD(NAME, name); the first is drawn where none is asked for. src/render/methods/name.c has its row. */
#define SPL_METHODS(METHOD)                                                                                            \
    METHOD(SPLAT, splat)                                                                                               \
    METHOD(POINTS, points)                                                                                             \
    METHOD(FILL, fill)                                                                                                 \
    METHOD(NEAREST, nearest)

enum spl_method {
#define SPL_METHOD_VALUE(NAME, name) SPL_METHOD_##NAME,
    SPL_METHODS(SPL_METHOD_VALUE)
#undef SPL_METHOD_VALUE
    SPL_METHOD_COUNT
};
#define SPL_METHOD_DEFAULT ((enum spl_method)0)
/* Shows each splat in the one sample it falls on: what measuring looks through. */
#define SPL_METHOD_RAW SPL_METHOD_POINTS

/* Discs. */
struct spl_disc_params {
    double margin;  /* blend margin, multiple of the splat radius */
    uint32_t atoms; /* of a splat's texture that are drawn at most; 0 = its mean colour */
};

/* Screen-space filling: which points are removed as hidden, and how holes are found. */
enum spl_visibility {
    SPL_VISIBILITY_ADAPTIVE, /* as far as the points lie apart on the image, in proportion to inverse depth */
    SPL_VISIBILITY_CONSTANT, /* as far as the kernel everywhere, every pixel of it: the earlier work, slow */
    SPL_VISIBILITY_NONE,     /* no point is removed; holes as adaptive finds them */
    SPL_VISIBILITY_COUNT
};
SPL_API const char *spl_visibility_name(enum spl_visibility visibility);
SPL_API int spl_visibility_from_name(const char *name); /* -1 for an unknown name */

struct spl_fill_params {
    enum spl_visibility visibility;
    double kernel;    /* side of the visibility kernel where it is largest, pixels; 0 = from the points' spacing on the
                         image */
    double threshold; /* share of the eight sectors that must be open where a point is visible */
    uint32_t pyramid; /* levels of the pyramid that holes are filled from; 0 = from the kernel */
};

/* Maps of a dataset's stations: what each saw, as colours and ranges. Colours are looked up in them by where a sample
 * lies, and what a splat's own station saw through is not drawn. Nothing where a dataset has none. */
enum spl_maps { SPL_MAPS_ON, SPL_MAPS_OFF, SPL_MAPS_COUNT };
SPL_API const char *spl_maps_name(enum spl_maps maps);
SPL_API int spl_maps_from_name(const char *name); /* -1 for an unknown name */

/* What of a dataset's primitives is drawn as such by methods that draw discs; the rest of them as discs: lines as those
 * of their points, panels and meshes as one for each of their cells. Meshes are drawn as such with all. */
enum spl_shapes { SPL_SHAPES_OFF, SPL_SHAPES_LINES, SPL_SHAPES_PANELS, SPL_SHAPES_ALL, SPL_SHAPES_COUNT };
SPL_API const char *spl_shapes_name(enum spl_shapes shapes);
SPL_API int spl_shapes_from_name(const char *name); /* -1 for an unknown name */

/* What a parameter changes. */
enum spl_param_changes {
    SPL_CHANGES_SHAPES,     /* what is seen where */
    SPL_CHANGES_TEXTURES,   /* colours alone, and those of datasets with textures */
    SPL_CHANGES_MAPS,       /* colours and silhouettes, and those of datasets with maps of stations */
    SPL_CHANGES_PRIMITIVES, /* what is seen where, and that of datasets with lines or panels */
    SPL_CHANGES_SHADE,      /* colours alone, and those of views that eye-dome lighting shades (splatd/color.h) */
    SPL_CHANGES_COLORS,     /* the same, and those of views whose colours show something else */
    SPL_CHANGES_SOFT,       /* what is seen where, and that of views with a term of what is soft (splatd/soft.h) */
};

/* Every parameter of a method, in the order of --help:
 *   REAL, COUNT(name, field of struct spl_view, least, most, default, SPL_CHANGES_*, help): a number, a whole number;
 *   the default may lie outside of what else is allowed
 *   CHOICE(name, field, prefix, default, SPL_CHANGES_*, help): one of the names of spl_PREFIX_name() */
#define SPL_METHOD_PARAMS(REAL, COUNT, CHOICE)                                                                         \
    REAL(margin, disc.margin, 0, 16, 1, SPL_CHANGES_SHAPES,                                                            \
         "depth behind the first surface that is blended, in splat radii")                                             \
    COUNT(atoms, disc.atoms, 0, 8, 8, SPL_CHANGES_TEXTURES, "of a splat's texture at most; 0 = its mean colour")       \
    CHOICE(maps, maps, maps, SPL_MAPS_ON, SPL_CHANGES_MAPS,                                                            \
           "colours and silhouettes from the maps of stations, where there are any")                                   \
    CHOICE(primitives, shapes, shapes, SPL_SHAPES_ALL, SPL_CHANGES_PRIMITIVES,                                         \
           "what is drawn as lines, panels and, with all, meshes, where there are any; off: all of it as discs")       \
    CHOICE(visibility, fill.visibility, visibility, SPL_VISIBILITY_ADAPTIVE, SPL_CHANGES_SHAPES,                       \
           "which points are hidden; constant: the whole kernel everywhere, slow; none: removes none")                 \
    REAL(kernel, fill.kernel, 3, 129, 0, SPL_CHANGES_SHAPES,                                                           \
         "side of the visibility kernel where it is largest, pixels; 0: six times the points' spacing where they are " \
         "sparsest")                                                                                                   \
    REAL(threshold, fill.threshold, 0, 1, 0.38, SPL_CHANGES_SHAPES,                                                    \
         "share of the sectors that is open where a point is visible")                                                 \
    COUNT(pyramid, fill.pyramid, 0, 8, 0, SPL_CHANGES_SHAPES,                                                          \
          "levels that holes are filled from; 0: as the kernel needs")                                                 \
    CHOICE(soft_model, soft.model, soft_model, SPL_SOFT_MODEL_EXPRESS, SPL_CHANGES_SOFT,                               \
           "how a soft sphere fades from its centre; express: a disc, fast; concentric: shells; base: exact, slow; "   \
           "layer: the first sphere alone, for comparison")                                                            \
    REAL(soft_opacity, soft.opacity, 0, 1, 0.3, SPL_CHANGES_SOFT,                                                      \
         "of a soft sphere at its centre; 0: what is soft is not drawn")                                               \
    REAL(soft_cover, soft.cover, 0, 1, 1, SPL_CHANGES_SOFT,                                                            \
         "share of what soft spheres hide together; less than 1: however dense, they never hide all of what is solid") \
    REAL(soft_blend, soft.blend, 0, 1e9, 0, SPL_CHANGES_SOFT,                                                          \
         "how far beyond the ends of a term spheres are still partly solid, in what it measures; 0: a sharp border")  \
    CHOICE(of, soft.of, soft_of, SPL_SOFT_OF_SOLID, SPL_CHANGES_SOFT,                                                  \
           "what layers but color and coverage, and picks, speak of; solid: what is solid alone; first: the nearest, " \
           "soft or solid; median: the sphere that lets less than half through, else the solid")                       \
    REAL(edl_strength, shade.strength, 0, 1, 0.5, SPL_CHANGES_SHADE,                                                   \
         "share of its light that the deepest gap loses, with shade edl")                                              \
    COUNT(edl_radius, shade.radius, 1, 5, 2, SPL_CHANGES_SHADE, "pixels that are looked away for it")                  \
    CHOICE(ramp, color.ramp, ramp, SPL_RAMP_AUTO, SPL_CHANGES_COLORS,                                                  \
           "what values become colours by, with color_by; auto: grey of intensity, terrain of height, else viridis")

enum spl_method_param {
#define SPL_PARAM_VALUE(name, ...) SPL_PARAM_##name,
    SPL_METHOD_PARAMS(SPL_PARAM_VALUE, SPL_PARAM_VALUE, SPL_PARAM_VALUE)
#undef SPL_PARAM_VALUE
    SPL_PARAM_COUNT
};
#define SPL_PARAM_BIT(name) (1u << SPL_PARAM_##name)
/* Those that every method takes: its row names them as well. */
#define SPL_PARAMS_OF_ALL                                                                                              \
    (SPL_PARAM_BIT(soft_model) | SPL_PARAM_BIT(soft_opacity) | SPL_PARAM_BIT(soft_cover) |                             \
     SPL_PARAM_BIT(soft_blend) | SPL_PARAM_BIT(of) | SPL_PARAM_BIT(edl_strength) | SPL_PARAM_BIT(edl_radius) |   \
     SPL_PARAM_BIT(ramp))

enum spl_param_kind { SPL_PARAM_REAL, SPL_PARAM_WHOLE, SPL_PARAM_CHOICE };

struct spl_method_param_info {
    const char *name, *help;
    enum spl_param_kind kind;
    double least, most, otherwise; /* otherwise: the default, which is always allowed */
    enum spl_param_changes changes;
    const char *(*choice_name)(int choice); /* CHOICE, as the next; choices are 0 … most */
    int (*choice_from_name)(const char *name);
};
/* Static; NULL for none. */
SPL_API const struct spl_method_param_info *spl_method_param_get(enum spl_method_param param);
SPL_API int spl_method_param_from_name(const char *name); /* -1 for an unknown name */
/* Is `value` within the parameter's range? SPL_E_USAGE names it. */
SPL_API int spl_method_param_check(const struct spl_method_param_info *param, double value, struct spl_error *err);

/* What everyone may know of a method; static. */
struct spl_method_info {
    const char *name;
    const char *help; /* what it draws, in a line */
    uint32_t params;  /* SPL_PARAM_BIT() of those that it takes */
    bool textures;    /* draws them where there are any; else their mean colours */
    bool needs_surface;           /* of a dataset; where it has none, `stand_in` is drawn */
    enum spl_method stand_in;
    bool finds_normals;           /* also where a dataset has none */
};
SPL_API const struct spl_method_info *spl_method_get(enum spl_method method); /* NULL for none */

/* What is no method has no textures, normals and parameters, and nothing stands in for it. */
SPL_API const char *spl_method_name(enum spl_method method); /* "unknown" for none */
SPL_API int spl_method_from_name(const char *name);          /* -1 for an unknown name */
SPL_API const char *spl_method_names(void);                  /* "splat, points, …"; static */
SPL_API bool spl_method_has_textures(enum spl_method method);

/* What is drawn of a dataset where `method` is asked for. */
SPL_API enum spl_method spl_method_for(enum spl_method method, const struct spl_dataset_info *dataset);
/* Has what is drawn normals? */
SPL_API bool spl_method_has_normals(enum spl_method method, const struct spl_dataset_info *dataset);
/* The parameters that `method` takes, or what stands in for it. */
SPL_API uint32_t spl_method_get_params(enum spl_method method);

SPL_END_DECLARATIONS

#endif
