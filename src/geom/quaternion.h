/* Unit quaternions (w, x, y, z) for rotations that move. Pure functions, any thread; outputs may be inputs. */
#ifndef SPL_GEOM_QUATERNION_H
#define SPL_GEOM_QUATERNION_H

#include <stdbool.h>

/* Of a rotation matrix, row-major, orthonormal; w >= 0 except at rounding's edge. */
void spl_quaternion_from_matrix(const double m[9], double q[4]);
void spl_quaternion_to_matrix(const double q[4], double m[9]);

/* exp: the rotation about `v` by |v| radians. */
void spl_quaternion_exp(const double v[3], double q[4]);

/* log(a^-1 b): the turn from a to b in a's own axes. log is the inverse of exp, |v| <= 2 pi; with `shortest` the sign
 * of the quaternion does not matter and |v| <= pi. */
void spl_quaternion_turn(const double a[4], const double b[4], bool shortest, double v[3]);

/* a exp(share v): `share` of the turn `v` away from a. */
void spl_quaternion_advance(const double a[4], const double v[3], double share, double out[4]);

#endif
