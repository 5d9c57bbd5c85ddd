/* Where points lie and how they spread: what a plane is fitted to, and what adds up. Doubles about the points' own
 * mean, so that coordinates of any size cost no precision. Pure functions; any thread. */
#ifndef SPL_PACK_PLANES_MOMENTS_H
#define SPL_PACK_PLANES_MOMENTS_H

struct spl_plane_moments {
    double count, mean[3];
    double square[6]; /* about the mean: xx xy xz yy yz zz, sums */
};

/* Makes moments of sums about `origin` (count, of x y z, of their products). Of no points: zeros. */
struct spl_plane_moments spl_plane_moments_of(const double origin[3], double count, const double sum[3],
                                              const double square[6]);

/* Adds the points of `from` to those of `to`. */
void spl_plane_moments_add(struct spl_plane_moments *to, const struct spl_plane_moments *from);

/* Sigma of the points along the unit vector `v`. There is a point. */
double spl_plane_moments_spread(const struct spl_plane_moments *moments, const double v[3]);

/* The plane of least squares: its unit normal, of either sign, and the sigmas of the points across it and along it,
 * ascending. There is a point. */
void spl_plane_moments_fit(const struct spl_plane_moments *moments, double sigma[3], double normal[3]);

#endif
