/* Soft spheres on the ray of a sample: how wide they are drawn, how far off the ray they lie, and the integrals of
 * their densities along it; src/render/soft/models.h says what of, tests/support/soft_rays.c is the same in doubles.
 * Depths are along the viewing axis; a sphere's entries and exits, too, so that they compare with those of what is
 * solid. */
#ifndef SPL_SOFT_GLSL
#define SPL_SOFT_GLSL

#include "common/frame.glsl"
#include "shared_soft.h"

/* What is narrower than a sample is drawn as wide as one, and hides as much of it as it did: opacity times area
 * stays. */
float soft_radius(float own, float z)
{
    precise float least = frame.low_pass * ray_scale(z) * frame.inverse_fx;
    return max(own, least);
}

/* The share of its opacity that is left. */
float soft_share(float own, float drawn)
{
    precise float share = own * own * (1.0 / (drawn * drawn));
    return own < drawn ? share : 1.0;
}

/* What is added before its opacity becomes a whole number: many whose shares are less than one are as much together as
 * they should be, since they are not all rounded alike. */
float soft_rounding(float own, float drawn, float x, float y)
{
    uint mixed = (floatBitsToUint(x) * 2654435761u) ^ (floatBitsToUint(y) * 2246822519u);
    return own < drawn ? float(mixed >> 8) * (1.0 / 16777216.0) : 0.5;
}

struct soft_ray {
    vec2 slope;     /* the ray goes through (slope, 1) */
    float inverse;  /* 1 / |(slope, 1)|^2; of parallel rays 1 */
};

soft_ray load_soft_ray(ivec2 at)
{
    soft_ray ray;
    precise vec2 slope = vec2(at) + 0.5 - vec2(frame.cx, frame.cy);
    slope *= vec2(frame.inverse_fx, frame.inverse_fy);
    precise float inverse = 1.0 / (1.0 + slope.x * slope.x + slope.y * slope.y);
    ray.slope = slope;
    ray.inverse = PARALLEL != 0u ? 1.0 : inverse;
    return ray;
}

/* The squared distance of the ray to a sphere's centre, and how much deeper than the centre the ray's point next to it
 * lies. The centre's offset from the ray at its own depth is small where it matters, so nothing cancels. */
float soft_distance(soft_ray ray, vec3 center, out float behind)
{
    precise vec2 off = center.xy - ray.slope * ray_scale(center.z);
    precise float along = off.x * ray.slope.x + off.y * ray.slope.y;
    along = PARALLEL != 0u ? 0.0 : along;
    precise float shift = along * ray.inverse;
    precise float distance = max(off.x * off.x + off.y * off.y - along * shift, 0.0);
    behind = shift;
    return distance;
}

/* Eq. 22: spheres near the border to what is solid are as dense as 1 - d / r; soft = W. */
float soft_modulate(float opacity, float q, float soft)
{
    precise float modulated = (1.0 - sqrt(q)) * (1.0 - soft) + opacity * soft;
    return modulated;
}

/* spl_soft_shells() of a sphere's radius in samples. */
float soft_shells(float radius, float z)
{
    float samples = frame.fx * radius / max(ray_scale(z), 1e-9);
    return floor(clamp(samples * (1.0 / float(SPL_SOFT_SHELL_SAMPLES)), 1.0, float(SPL_SOFT_SHELLS_MAX)));
}

/* spl_soft_base_part() of delta = sqrt(q): share of the depth through the centre, from the middle to zeta radii. */
float soft_base_part(float q, float zeta)
{
    float square = zeta * zeta + q, root = sqrt(square), far = abs(zeta);
    float tail = q * (log(far + root + 1e-12) - 0.5 * log(q + 1e-24));
    return 0.5 * sign(zeta) * (far * (2.0 - root) - tail);
}

/* spl_soft_concentric_part() */
float soft_concentric_part(float shells, float q, float zeta)
{
    float part = 0.0, delta = sqrt(q), share = 1.0 / shells;
    for (float radius = 1.0;;) {
        float half_chord = sqrt(max(radius * radius - q, 0.0)), inverse = share / radius;
        part += max(inverse * (1.0 - delta * inverse), 0.0) * clamp(zeta, -half_chord, half_chord);
        radius -= share;
        if (radius < max(delta, 0.5 * share))
            break;
    }
    return 0.5 * part;
}

#endif
