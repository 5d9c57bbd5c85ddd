/* What soft_opacity, the opacity at a sphere's centre, means to each model. Pure; any thread. */
#ifndef SPL_RENDER_SOFT_MODELS_H
#define SPL_RENDER_SOFT_MODELS_H

#include <stdint.h>

/* Coefficients of a falloff: opacity m (f[0] + f[1] m + ... + f[4] m^4), m = 1 - (d / r)^2 in 0..1. */
enum { SPL_SOFT_FALLOFF = 5 };

/* The optical depth along the ray through a sphere's centre: -ln(1 - opacity); that of opacity 1 is taken for that of
 * 1 - 2^-10, after which the walk ends anyhow. With it lambda of base is depth / r^2 (eq. 2 to 8) and that of
 * concentric depth / (2 r) (eq. 13, 14, shells added). */
double spl_soft_depth(double opacity);

/* Share of that depth along the ray at distance d = delta r from the centre, from the point next to it to zeta r
 * behind; odd in zeta, which lies within the sphere; 1/2 at delta = 0, zeta = 1. P(z) of eq. 7 over r^2. */
double spl_soft_base_part(double delta, double zeta);

/* The same of `shells` shells of radius r (1 - i / shells), densities as in eq. 13, weighted by 1 - d / (shells r_i):
 * as eq. 15 has it where there is one shell, and not at all where there are so many that they need no weight. zeta may
 * lie outside the sphere. */
double spl_soft_concentric_part(uint32_t shells, double delta, double zeta);

/* A sphere that is drawn with a share s of the opacity that others have, since it is drawn wider than it is, has
 * s (a + (1 - a) s) of their optical depth, a being this: over its disc it hides s of what others hide, exactly where s
 * is 0 or 1. */
double spl_soft_thin(double opacity);

/* One shell for every SPL_SOFT_SHELL_SAMPLES samples of the radius on the image. */
uint32_t spl_soft_shells(double radius_samples);

/* Falloff of express: the polynomial nearest to the opacity of base along the whole ray, weighted by area; in the
 * middle it is `opacity`. Eq. 19, lambda (cos(pi d / r) + 1) / 2, is as near as that only where spheres are thin: off
 * by rms 0.05 at opacity 0.5, 0.2 at 0.9, the polynomial by 0.001. It costs no more, and no driver has a cosine of its
 * own. */
void spl_soft_falloff(double opacity, float f[SPL_SOFT_FALLOFF]);

#endif
