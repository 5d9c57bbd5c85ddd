/* The footprint of an oriented disc on the sample grid, and its depth there.
 *
 * The sample's ray meets the disc's plane at z = n.p / n.d (d.z = 1), exact under perspective; a parallel ray where the
 * plane, whose depth is linear along the image then, is there. A splat that is smaller
 * than a sample still covers the sample that its centre falls on: within `low_pass` samples of the centre it counts as
 * covered. Its depth there is the plane's, clamped to what the disc spans, r sqrt(1 - n.z^2) around its centre, or to
 * SPL_LOW_PASS_REACH if that is more. Along parallel rays a whole wall is seen edge-on at once, and would be dots:
 * there a disc is as wide as SPL_THIN says. Written without comparisons: software drivers pay more for a select than
 * for a product. */
#ifndef SPL_DISC_GLSL
#define SPL_DISC_GLSL

#include "common/splat.glsl"

struct disc {
    ivec2 first, last; /* samples of the image, inclusive; empty when last < first */
    vec2 center;       /* samples */
    float depth;       /* of the centre */
    float margin;      /* metres that the disc is pushed back for blending */
    uint side;         /* as of side_of() */
    float behind;      /* metres that its back is pushed back besides, so that what faces the eye wins */
    /* With uv = sample - centre: the plane is hit at depth k, k = 1 / (1 + slope . uv) (never behind the eye: there the
     * divisor is not positive), off the centre by scale (ray (k - 1) + uv k / f, k - 1) radii, scale = depth /
     * radius. Along parallel rays it is hit slope . uv nearer, off by (uv / f, - slope . uv) / radius. */
    vec2 slope;
    float eased; /* along parallel rays: the slope's share with which the footprint is as wide as SPL_THIN */
    float reach;
    vec2 ray, pitch;   /* the centre's ray, one over the focal lengths; both times scale */
    float scale;
    float short_radius; /* samples, seen at its slant */
};

/* Extent of the disc along one image axis: the tangents s of (p - s q)^2 = r^2 (1 + s^2 - (n_p - s n_q)^2), where p is
 * the position along that axis, q the depth, n_other the normal's remaining component. Returns centre and half
 * width. */
vec2 disc_extent(float p, float q, float n_p, float n_q, float n_other, float radius)
{
    if (PARALLEL != 0u)
        return vec2(p, radius * sqrt(max(1.0 - n_p * n_p, 0.0)));
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

/* What a slope along parallel rays is multiplied with, so that its disc is seen SPL_THIN samples wide at least; discs
 * of few samples, which others are near, as wide as at a slant of 76 degrees. */
float ease(vec2 slope, float scale)
{
    precise float steep = sqrt(slope.x * slope.x + slope.y * slope.y);
    float least = SPL_LOW_PASS_REACH / frame.low_pass * frame.inverse_fx;
    precise float eased = max(2.0 / (SPL_THIN * scale), least) / max(steep, 1e-30);
    return min(eased, 1.0);
}

/* The part of the disc that lies on the image's samples window_low to window_high, inclusive. */
disc make_disc(splat s, vec2 window_low, vec2 window_high)
{
    disc d;
    vec3 p = s.position, n = s.normal;
    precise float inverse = 1.0 / ray_scale(p.z);
    precise vec2 ray = p.xy * inverse;
    precise vec2 center = vec2(frame.fx * ray.x + frame.cx, frame.fy * ray.y + frame.cy);
    vec2 ex = disc_extent(p.x, p.z, n.x, n.z, n.y, s.radius), ey = disc_extent(p.y, p.z, n.y, n.z, n.x, s.radius);
    precise vec2 middle = vec2(frame.fx * ex.x + frame.cx, frame.fy * ey.x + frame.cy);
    precise vec2 half_size = vec2(frame.fx * ex.y, frame.fy * ey.y);
    precise float towards = n.x * ray.x + n.y * ray.y + n.z;
    precise float facing = PARALLEL != 0u ? n.z : towards;
    precise float tilt = 1.0 / (abs(facing) < 1e-6 ? 1e-6 : facing);
    precise vec2 slope = vec2(n.x * frame.inverse_fx * tilt, n.y * frame.inverse_fy * tilt);
    precise float scale = ray_scale(p.z) / s.radius;
    float eased = PARALLEL != 0u ? ease(slope, scale) : 1.0;
    half_size += eased < 1.0 ? 0.5 * SPL_THIN : 0.0;
    vec2 low = min(middle - half_size, center - frame.low_pass);
    vec2 high = max(middle + half_size, center + frame.low_pass);
    d.first = ivec2(ceil(clamp(low - 0.5, window_low, window_high + 1.0)));
    d.last = ivec2(floor(clamp(high - 0.5, window_low - 1.0, window_high)));
    if (d.last.x < d.first.x)
        d.last.y = d.first.y - 1;
    d.center = center;
    d.depth = p.z;
    precise float spans = sqrt(max(1.0 - n.z * n.z, 0.0)) / scale;
    precise vec2 scaled_ray = ray * scale, pitch = vec2(frame.inverse_fx * scale, frame.inverse_fy * scale);
    precise float slant = min(max(abs(tilt), 1.0), SPL_MARGIN_SLANT);
    precise float margin = frame.margin * max(s.radius, frame.low_pass * ray_scale(p.z) * frame.inverse_fx) * slant;
    d.slope = slope;
    d.eased = eased;
    d.reach = max(spans, SPL_LOW_PASS_REACH * frame.inverse_fx);
    d.ray = PARALLEL != 0u ? vec2(0.0) : scaled_ray;
    d.pitch = pitch;
    d.scale = scale;
    precise float short_radius = frame.fx * min(abs(facing), 1.0) / scale;
    d.short_radius = short_radius;
    d.margin = margin;
    d.side = side_of(margin, p.z, facing > 0.0);
    d.behind = facing > 0.0 && (frame.flags & SPL_FRAME_SIDED) != 0u ? s.radius : 0.0;
    return d;
}

/* Walks the footprint row by row in one flat loop: nested loops cost a lane mask each. A footprint that is empty in x
 * is made empty in y by make_disc(). */
void next_sample(disc d, inout ivec2 at)
{
    at.x++;
    bool wrap = at.x > d.last.x;
    at = ivec2(wrap ? d.first.x : at.x, at.y + int(wrap));
}

/* Squared distance to the centre (covered below 1), view depth at sample `at`, and how far it lies off the centre in
 * radii, view space. */
float disc_sample(disc d, ivec2 at, out float z, out vec3 offset)
{
    precise vec2 uv = vec2(at) + (0.5 - d.center);
    precise float near_center = (uv.x * uv.x + uv.y * uv.y) * frame.inverse_low_pass_squared;
    precise float rise = d.slope.x * uv.x + d.slope.y * uv.y;
    precise float ratio = 1.0 / max(1.0 + rise, 1e-6), eased = rise * d.eased;
    float k = PARALLEL != 0u ? 1.0 : ratio;
    precise float w = PARALLEL != 0u ? -eased : k - 1.0;
    precise vec2 q = d.ray * w + d.pitch * uv * k;
    precise float fall = d.scale * w;
    precise float distance = q.x * q.x + q.y * q.y + fall * fall;
    precise float along = d.depth * (1.0 + clamp(w, -d.reach, d.reach));
    precise float beside = d.depth - clamp(rise, -d.reach, d.reach);
    z = PARALLEL != 0u ? beside : along;
    offset = vec3(q, fall);
    return min(distance, near_center);
}

#endif
