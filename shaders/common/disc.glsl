/* The footprint of an oriented disc on the sample grid, and its depth there.
 *
 * The pixel's ray meets the disc's plane at z = n.p / n.d (d.z = 1), exact under perspective. A splat that is smaller
 * than a sample still covers the sample that its centre falls on: within `low_pass` samples of the centre it counts as
 * covered, at the centre's depth where the ray misses the disc itself. */
#ifndef SPL_DISC_GLSL
#define SPL_DISC_GLSL

#include "common/splat.glsl"

struct footprint {
    ivec2 first, last; /* samples, inclusive; empty when last < first */
    vec2 center;       /* samples */
    float margin;      /* metres that the disc is pushed back for blending */
};

/* Extent of the disc along one image axis: the tangents s of (p - s q)^2 = r^2 (1 + s^2 - (n_p - s n_q)^2), where p is
 * the position along that axis, q the depth, n_other the normal's remaining component. Returns centre and half width. */
vec2 extent(float p, float q, float n_p, float n_q, float n_other, float radius)
{
    precise float a = q * q - radius * radius * (1.0 - n_q * n_q);
    precise float b = p * q + radius * radius * n_p * n_q;
    precise float cross = p * n_q - q * n_p;
    precise float root = p * p + q * q - cross * cross - radius * radius * n_other * n_other;
    if (!(a > 0.0))
        return vec2(0.0, 1e9); /* the disc crosses the eye's plane: no bound */
    precise vec2 result = vec2(b / a, radius * sqrt(max(root, 0.0)) / a);
    return result;
}

footprint disc_footprint(splat s)
{
    footprint f;
    vec3 p = s.position, n = s.normal;
    precise float inverse = 1.0 / p.z;
    precise vec2 center = vec2(frame.fx * (p.x * inverse) + frame.cx, frame.fy * (p.y * inverse) + frame.cy);
    vec2 ex = extent(p.x, p.z, n.x, n.z, n.y, s.radius), ey = extent(p.y, p.z, n.y, n.z, n.x, s.radius);
    precise vec2 middle = vec2(frame.fx * ex.x + frame.cx, frame.fy * ey.x + frame.cy);
    precise vec2 half_size = vec2(frame.fx * ex.y, frame.fy * ey.y);
    vec2 low = min(middle - half_size, center - frame.low_pass);
    vec2 high = max(middle + half_size, center + frame.low_pass);
    vec2 limit = vec2(float(frame.width), float(frame.height));
    f.first = ivec2(ceil(clamp(low - 0.5, vec2(0.0), limit)));
    f.last = ivec2(floor(clamp(high - 0.5, vec2(-1.0), limit - 1.0)));
    f.center = center;
    f.margin = frame.margin * max(s.radius, frame.low_pass * p.z / frame.fx);
    return f;
}

/* Squared distance to the centre (covered below 1) and view depth at sample `at`. */
float disc_sample(splat s, footprint f, ivec2 at, out float z)
{
    vec3 p = s.position, n = s.normal;
    precise vec2 offset = vec2(at) + 0.5 - f.center;
    precise float near_center = (offset.x * offset.x + offset.y * offset.y) / (frame.low_pass * frame.low_pass);
    /* d - p / p.z, so that nothing is lost when the splat is far smaller than its distance */
    precise vec2 tilt = vec2(offset.x / frame.fx, offset.y / frame.fy);
    precise float facing = n.x * p.x + n.y * p.y + n.z * p.z;
    precise float slope = n.x * tilt.x + n.y * tilt.y;
    /* z = p.z facing / (facing + p.z slope), written as a difference so that small discs keep their digits */
    precise float rise = p.z * slope;
    precise float dz = -p.z * (rise / (facing + rise));
    precise float along = p.z + dz;
    precise vec3 q = vec3(p.x / p.z * dz + tilt.x * along, p.y / p.z * dz + tilt.y * along, dz);
    precise float distance = (q.x * q.x + q.y * q.y + q.z * q.z) / (s.radius * s.radius);
    bool on_disc = distance < 1.0 && along > 0.0;
    z = on_disc ? along : p.z;
    return on_disc ? min(distance, near_center) : near_center;
}

#endif
