/* Quaternion algebra for interpolated rotations.
 *
 * A turn is a rotation vector: axis times angle, in radians, in the axes of the rotation it starts from. Near zero the
 * series of sin takes over, so that coincident rotations divide nothing by zero. Pure functions, any thread. */
#include "geom/quaternion.h"

#include <math.h>
#include <string.h>

void spl_quaternion_from_matrix(const double m[9], double q[4])
{
    double w = m[0] + m[4] + m[8], largest = fmax(fmax(m[0], m[4]), m[8]);
    if (w >= largest) {
        double s = sqrt(1 + w);
        q[0] = s / 2;
        q[1] = (m[7] - m[5]) / (2 * s);
        q[2] = (m[2] - m[6]) / (2 * s);
        q[3] = (m[3] - m[1]) / (2 * s);
        return;
    }
    int i = m[0] == largest ? 0 : m[4] == largest ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
    double s = sqrt(1 + m[4 * i] - m[4 * j] - m[4 * k]), turn = (m[3 * k + j] - m[3 * j + k]) / (2 * s);
    double sign = turn < 0 ? -1 : 1;
    q[0] = sign * turn;
    q[1 + i] = sign * s / 2;
    q[1 + j] = sign * (m[3 * j + i] + m[3 * i + j]) / (2 * s);
    q[1 + k] = sign * (m[3 * k + i] + m[3 * i + k]) / (2 * s);
}

void spl_quaternion_to_matrix(const double q[4], double m[9])
{
    double w = q[0], x = q[1], y = q[2], z = q[3], scale = 2 / (w * w + x * x + y * y + z * z);
    double out[9] = {
        1 - scale * (y * y + z * z), scale * (x * y - w * z),     scale * (x * z + w * y),
        scale * (x * y + w * z),     1 - scale * (x * x + z * z), scale * (y * z - w * x),
        scale * (x * z - w * y),     scale * (y * z + w * x),     1 - scale * (x * x + y * y),
    };
    memcpy(m, out, sizeof out);
}

static void multiply(const double a[4], const double b[4], double out[4])
{
    double product[4] = {
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    };
    memcpy(out, product, sizeof product);
}

void spl_quaternion_exp(const double v[3], double q[4])
{
    double angle = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    double scale = angle > 1e-8 ? sin(angle / 2) / angle : 0.5;
    q[0] = cos(angle / 2);
    for (int i = 0; i < 3; i++)
        q[1 + i] = scale * v[i];
}

static void logarithm(const double q[4], bool shortest, double v[3])
{
    double sign = shortest && q[0] < 0 ? -1 : 1;
    double sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    double scale = sine > 1e-8 ? 2 * atan2(sine, sign * q[0]) / sine : 2;
    for (int i = 0; i < 3; i++)
        v[i] = sign * scale * q[1 + i];
}

void spl_quaternion_turn(const double a[4], const double b[4], bool shortest, double v[3])
{
    double inverse[4] = {a[0], -a[1], -a[2], -a[3]}, between[4];
    multiply(inverse, b, between);
    logarithm(between, shortest, v);
}

void spl_quaternion_advance(const double a[4], const double v[3], double share, double out[4])
{
    double part[3] = {share * v[0], share * v[1], share * v[2]}, turn[4];
    spl_quaternion_exp(part, turn);
    multiply(a, turn, out);
}
