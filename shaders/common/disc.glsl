/* The footprint of an oriented disc on the sample grid, and its depth there.
 *
 * The sample's ray meets the disc's plane at z = n.p / n.d (d.z = 1), exact under perspective. A splat that is smaller
 * than a sample still covers the sample that its centre falls on: within `low_pass` samples of the centre it counts as
 * covered, with its plane's depth there as long as that is near the centre's (SPL_LOW_PASS_REACH). */
#ifndef SPL_DISC_GLSL
#define SPL_DISC_GLSL

#include "common/splat.glsl"

struct disc {
    ivec2 first, last; /* samples, inclusive; empty when last < first */
    vec2 center;       /* samples */
    float depth;       /* of the centre */
    float margin;      /* metres that the disc is pushed back for blending */
    /* With (u, v) = sample - centre: z = depth * k, k = facing / (facing + slope.u u + slope.v v); the hit is off the
     * centre by depth * (ray.x (k - 1) + u k / fx, ray.y (k - 1) + v k / fy, k - 1). */
    float facing;
    vec2 slope;
    vec2 ray;          /* the centre's */
    float inverse_radius_squared; /* (depth / radius)^2 */
};

/* Extent of the disc along one image axis: the tangents s of (p - s q)^2 = r^2 (1 + s^2 - (n_p - s n_q)^2), where p is
 * the position along that axis, q the depth, n_other the normal's remaining component. Returns centre and half width. */
vec2 disc_extent(float p, float q, float n_p, float n_q, float n_other, float radius)
{
    precise float a = q * q - radius * radius * (1.0 - n_q * n_q);
    precise float b = p * q + radius * radius * n_p * n_q;
    precise float cross = p * n_q - q * n_p;
    precise float root = p * p + q * q - cross * cross - radius * radius * n_other * n_other;
    if (!(a > 0.0))
        return vec2(0.0, 1e9); /* the disc crosses the eye's plane: no bound */
    precise float inverse = 1.0 / a;
    precise vec2 result = vec2(b * inverse, radius * sqrt(max(root, 0.0)) * inverse);
    return result;
}

disc make_disc(splat s)
{
    disc d;
    vec3 p = s.position, n = s.normal;
    precise float inverse = 1.0 / p.z;
    precise vec2 ray = p.xy * inverse;
    precise vec2 center = vec2(frame.fx * ray.x + frame.cx, frame.fy * ray.y + frame.cy);
    vec2 ex = disc_extent(p.x, p.z, n.x, n.z, n.y, s.radius), ey = disc_extent(p.y, p.z, n.y, n.z, n.x, s.radius);
    precise vec2 middle = vec2(frame.fx * ex.x + frame.cx, frame.fy * ey.x + frame.cy);
    precise vec2 half_size = vec2(frame.fx * ex.y, frame.fy * ey.y);
    vec2 low = min(middle - half_size, center - frame.low_pass);
    vec2 high = max(middle + half_size, center + frame.low_pass);
    vec2 limit = vec2(float(frame.width), float(frame.height));
    d.first = ivec2(ceil(clamp(low - 0.5, vec2(0.0), limit)));
    d.last = ivec2(floor(clamp(high - 0.5, vec2(-1.0), limit - 1.0)));
    if (d.last.x < d.first.x)
        d.last.y = d.first.y - 1;
    d.center = center;
    d.depth = p.z;
    d.ray = ray;
    precise float facing = n.x * ray.x + n.y * ray.y + n.z;
    precise vec2 slope = vec2(n.x / frame.fx, n.y / frame.fy);
    precise float scale = p.z / s.radius;
    precise float margin = frame.margin * max(s.radius, frame.low_pass * p.z / frame.fx);
    precise float inverse_radius_squared = scale * scale;
    d.facing = facing;
    d.slope = slope;
    d.margin = margin;
    d.inverse_radius_squared = inverse_radius_squared;
    return d;
}

/* Walks the footprint row by row in one flat loop: nested loops cost a lane mask each. A footprint that is empty in x is
 * made empty in y by make_disc(). */
void next_sample(disc d, inout ivec2 at)
{
    at.x++;
    bool wrap = at.x > d.last.x;
    at = ivec2(wrap ? d.first.x : at.x, at.y + int(wrap));
}

/* Squared distance to the centre (covered below 1) and view depth at sample `at`. */
float disc_sample(disc d, ivec2 at, out float z)
{
    precise vec2 uv = vec2(at) + (0.5 - d.center);
    precise float near_center = (uv.x * uv.x + uv.y * uv.y) * frame.inverse_low_pass_squared;
    precise float k = d.facing / (d.facing + (d.slope.x * uv.x + d.slope.y * uv.y));
    precise float w = k - 1.0;
    precise vec2 q = d.ray * w + vec2(uv.x * frame.inverse_fx, uv.y * frame.inverse_fy) * k;
    precise float distance = (q.x * q.x + q.y * q.y + w * w) * d.inverse_radius_squared;
    bool on_disc = distance < 1.0 && k > 0.0;
    bool on_plane = on_disc || abs(w) <= SPL_LOW_PASS_REACH * frame.inverse_fx;
    precise float along = d.depth * (on_plane ? k : 1.0);
    z = along;
    return on_disc ? min(distance, near_center) : near_center;
}

#endif
