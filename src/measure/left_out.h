/* Photographs left out of packing, compared with renders from their poses: what textures or maps gain over coloured
 * splats. */
#ifndef SPL_MEASURE_LEFT_OUT_H
#define SPL_MEASURE_LEFT_OUT_H

#include <splatd/render.h>

#include "cloud/views.h"

enum {
    SPL_LEFT_OUT_SHIFT = 2,  /* pixels that a block of the photograph is moved by at most, either way */
    SPL_LEFT_OUT_BLOCK = 16, /* pixels of its side */
    SPL_LEFT_OUT_BAR = 3     /* dB */
};

/* Of the splat that is seen in a pixel: up to 2 pixels, up to 8, more. */
enum spl_left_out_width { SPL_LEFT_OUT_NARROW, SPL_LEFT_OUT_WIDE, SPL_LEFT_OUT_BROAD, SPL_LEFT_OUT_WIDTHS };
enum spl_left_out_kind { SPL_LEFT_OUT_COLORED, SPL_LEFT_OUT_TEXTURED, SPL_LEFT_OUT_KINDS };
enum spl_left_out_step {
    SPL_LEFT_OUT_PLAIN,      /* as they are */
    SPL_LEFT_OUT_MATCHED,    /* the render times a factor a channel that makes the means equal */
    SPL_LEFT_OUT_LEVELLED,   /* and each block's means made equal: what is left is detail */
    SPL_LEFT_OUT_REGISTERED, /* and each block of the photograph where it fits best */
    SPL_LEFT_OUT_STEPS
};

/* Sums over pixels and channels of squared differences, of 255 squared. Sums of several photographs add up. */
struct spl_left_out {
    uint64_t pixels[SPL_LEFT_OUT_WIDTHS];
    uint64_t worse[SPL_LEFT_OUT_WIDTHS]; /* of them, in blocks whose textured error, levelled, is the larger */
    uint64_t good[SPL_LEFT_OUT_WIDTHS];  /* in blocks where it is smaller by SPL_LEFT_OUT_BAR dB or more */
    double squared[SPL_LEFT_OUT_WIDTHS][SPL_LEFT_OUT_KINDS][SPL_LEFT_OUT_STEPS];
};

void spl_left_out_add(struct spl_left_out *sums, const struct spl_left_out *more);

/* NAN without pixels. */
double spl_left_out_psnr(const struct spl_left_out *sums, enum spl_left_out_width width, enum spl_left_out_kind kind,
                         enum spl_left_out_step step);

/* What is compared: all of one size, colours RGBA8; `width_px` is NAN where no splat covers the whole pixel, else the
 * diameter in pixels of the splat that is seen there. A pixel counts where the photograph is opaque all around it, as
 * far as blocks are moved, and lies inside. */
struct spl_left_out_images {
    const struct spl_image *photograph, *render[SPL_LEFT_OUT_KINDS];
    const float *width_px;
};

/* Fills *out; the same to the bit for any number of `threads` (0 = all cores). Any thread; SPL_E_INPUT where sizes or
 * types differ, SPL_E_NOMEM. */
int spl_left_out_compare(const struct spl_left_out_images *images, unsigned threads, struct spl_left_out *out,
                         struct spl_error *err);

/* The photograph of `view` as a pinhole of the same camera would have taken it: a copy without distortion, else
 * bilinear through the lens, transparent where the lens saw nothing. SPL_E_INPUT where its size is not the camera's. */
int spl_left_out_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err);

/* Renders `dataset` (added to `renderer`) from the view at `lod`; the caller owns the renders, and *width_px as above
 * (free()). On failure nothing is held. The renderer's thread; blocks. */
int spl_left_out_render(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                        const struct spl_named_view *view, double lod, struct spl_image render[SPL_LEFT_OUT_KINDS],
                        float **width_px, struct spl_error *err);

#endif
