/* Photographs put straight onto splats, the baseline of splat textures: the colour of a fragment is looked up in the
 * photograph that its splat chose, as it is, at half the size, and both in BC7 and BC1 (table 1 of the sparse-coding
 * paper: LOD 0, LOD 1, BPTC, DXT1). Nothing is evened out between photographs. */
#ifndef SPL_MEASURE_PROJECTED_H
#define SPL_MEASURE_PROJECTED_H

#include <splatd/render.h>

#include "cloud/views.h"
#include "image/pyramid.h"
#include "sparse/texture_file.h"

enum spl_projected {
    SPL_PROJECTED_WHOLE,
    SPL_PROJECTED_WHOLE_BC7,
    SPL_PROJECTED_WHOLE_BC1,
    SPL_PROJECTED_HALF,
    SPL_PROJECTED_HALF_BC7,
    SPL_PROJECTED_HALF_BC1,
    SPL_PROJECTED_COUNT
};

struct spl_projected_options {
    struct spl_renderer *renderer;
    const struct spl_dataset *dataset; /* added to it */
    const struct spl_texture_origin *origin;
    const struct spl_view_list *photographs; /* those that were packed, by name; others count as left out */
    uint32_t texture_size;                   /* texels a side of the textures that are compared */
    uint32_t views;                          /* compared at most, evenly, of either kind */
    uint64_t memory_bytes;
    unsigned threads;
    void (*progress)(void *context, const char *photograph); /* as each is begun; may be NULL */
    void *context;
};

/* PSNR over R, G, B of all pixels, dB, and the median of it over tiles, which says what most of a picture looks like:
 * where the splats' surface is wrong, over sky and beside silhouettes, a few pixels make up nearly all of the mean. */
struct spl_projected_figure {
    double psnr, tile;
};

enum { SPL_PROJECTED_TILE = 32 }; /* pixels a side; tiles that are covered in part are left out */

/* Of the pixels of views that a splat covers and the photograph shows. */
struct spl_projected_views {
    uint32_t views;
    uint64_t pixels;
    struct spl_projected_figure colored, textured; /* the dataset's own frames at lod 1 without and with atoms */
    struct spl_projected_figure projected[SPL_PROJECTED_COUNT]; /* where no photograph is, the coloured frame */
};

struct spl_projected_report {
    double texture[SPL_PROJECTED_COUNT]; /* PSNR of the textures sampled from each, against the photographs', dB */
    struct spl_projected_views packed, left_out;
};

/* Blocks; the renderer's thread. A photograph with a lens is a source, but no view to compare. SPL_E_INPUT: a packed
 * photograph is missing from the list or has another size, the dataset has other splats; SPL_E_LIMIT names memory. */
int spl_projected_measure(const struct spl_projected_options *options, struct spl_projected_report *report,
                          struct spl_error *err);

/* The colour (0..255) that `photograph` has for what lies at view depth `depth` behind `pixel` of `camera`, averaged
 * over what the pixel spans there, at least `footprint` of its own pixels. False where it shows nothing. Pure. */
bool spl_projected_look(const struct spl_camera *camera, const double pixel[2], double depth,
                        const struct spl_named_view *photograph, const struct spl_pyramid *pyramid, double footprint,
                        float rgb[3]);

#endif
