/* Eigen decomposition of symmetric 3×3 matrices. Pure functions; any thread. */
#ifndef SPL_GEOM_EIGEN_H
#define SPL_GEOM_EIGEN_H

/* `m` is xx xy xz yy yz zz. values: ascending. least: unit eigenvector of values[0], most: of values[2]; where an
 * eigenvalue is not simple, some unit vector of its eigenspace, the same one for the same matrix. The zero matrix gives
 * z and x. Every element must be finite. */
void spl_eigen_symmetric(const double m[6], double values[3], double least[3], double most[3]);

enum { SPL_EIGEN_LANES = 8 };

/* The same of eight matrices at once, m[element][matrix] and so on, but for the vector of the largest: to the bit what
 * spl_eigen_symmetric() gives. */
void spl_eigen_symmetric_eight(const double m[6][SPL_EIGEN_LANES], double values[3][SPL_EIGEN_LANES],
                               double least[3][SPL_EIGEN_LANES]);

#endif
