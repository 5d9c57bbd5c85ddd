/* What a camera sees of an analytic scene, without any splat in between. */
#ifndef SPL_SYNTH_EXACT_H
#define SPL_SYNTH_EXACT_H

#include <splatd/camera.h>
#include <splatd/image.h>

#include "synth/lens.h"
#include "synth/scene.h"

enum { SPL_EXACT_SAMPLES_MAX = 64, SPL_EXACT_PIXELS_MAX = 64 << 20 };

/* Fills COLOR, DEPTH, NORMAL, ID and COVERAGE of `images` (the caller's, to be released with spl_image_finish(); RANGE
 * is zeroed, all are after a failure) with the exact picture of `camera`, which stands in world coordinates.
 *
 * COLOR is the integral over the pixel's area in linear light, as a sensor takes it, brought to 8 bit sRGB with one
 * rounding; alpha is 255 times the share of the area that is covered, colour is straight. It is sampled at up to
 * samples × samples places a pixel (1 to SPL_EXACT_SAMPLES_MAX a side, rounded up to a power of two; 1 is the centre
 * alone): at 16; at 64 or 256 at least where surfaces meet beside or in the pixel; and at more where the colour
 * differs, until the estimated error is below half a level or the limit is reached. COVERAGE is that share. DEPTH
 * (along the viewing axis), NORMAL (towards the eye, world axes) and ID (the object's) are those of the ray through the
 * pixel's centre. Where it meets nothing between camera->near and camera->far: NaN, (0,0,0), UINT32_MAX.
 *
 * Uses `threads` threads (0 = all cores); the bytes do not depend on them. Any thread; blocks.
 * Errors: as spl_camera_check(); "samples"; SPL_E_LIMIT above 64 Mi pixels; SPL_E_NOMEM. */
int spl_exact_render(const struct spl_scene *scene, const struct spl_camera *camera, uint32_t samples, unsigned threads,
                     struct spl_image images[SPL_LAYER_COUNT], struct spl_error *err);

/* The same through any lens; a panorama fills RANGE instead of DEPTH. */
int spl_exact_trace(const struct spl_scene *scene, const struct spl_lens *lens, uint32_t samples, unsigned threads,
                    struct spl_image images[SPL_LAYER_COUNT], struct spl_error *err);

#endif
