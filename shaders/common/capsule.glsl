/* The picture of a piece of a line that has a width: what lies within `half` of its axis on the image. It is a sample
 * wide at least, so that a line is whole however thin. The depth is the axis'.
 *
 * The planes through the eye beside an axis at distance r from it cut the image at depth z in lines that are
 * r / (z g) off the axis' picture, where g is the gradient of the plane through eye and axis (unit normal n), a sample
 * apart: g = |(n.x / fx, n.y / fy)|. Of parallel rays the plane is along the viewing axis, and the lines r / g off. */
#ifndef SPL_CAPSULE_GLSL
#define SPL_CAPSULE_GLSL

#include "common/cut.glsl"
#include "common/piece.glsl"

struct capsule {
    bool upright;      /* places are (row, column), else (column, row), so that it goes along x more than along y */
    vec2 a, along;     /* samples: where it begins, the way to its end */
    float inverse;     /* one over the square of that way's length; 0 of none */
    float slope;       /* samples across for a sample along, within 1 */
    float w, fall;     /* inverse depth where it begins, and what more it is where it ends; of parallel rays depth */
    float half_width;  /* samples times depth, or of parallel rays samples */
    float thick;       /* half its width, metres */
    float middle;      /* as of the piece, along the picture */
    int first, end;    /* samples along; empty when end <= first */
    int low, high;     /* samples across that are drawn to, inclusive */
    float reach;       /* samples across within which the picture lies, from its axis on */
    int across;        /* samples that are looked at for each along */
};

/* Where the walk over a capsule is: place, and samples across that are left. */
struct capsule_walk {
    ivec2 at;
    int left;
};

/* One over the gradient, within what lines in an image have; as straight ahead where the axis is a point. */
float capsule_scale(vec3 p, vec3 q)
{
    precise vec3 n = vec3(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x);
    n = PARALLEL != 0u ? vec3(q.y - p.y, p.x - q.x, 0.0) : n;
    precise float squared = n.x * n.x + n.y * n.y + n.z * n.z;
    precise vec2 g = vec2(n.x * frame.inverse_fx, n.y * frame.inverse_fy);
    precise float gradient = g.x * g.x + g.y * g.y;
    precise float scale = sqrt(squared / gradient);
    return gradient > 0.0 ? min(scale, SPL_LINE_SLANT * max(frame.fx, frame.fy)) : max(frame.fx, frame.fy);
}

/* The capsule of `cut` on the image's samples window_low to window_high, inclusive, of chunk's width. */
capsule make_capsule(piece cut, spl_draw_chunk chunk, vec2 window_low, vec2 window_high)
{
    capsule c;
    vec2 a = image_place(cut.from), b = image_place(cut.to);
    c.upright = abs(b.y - a.y) > abs(b.x - a.x);
    c.a = c.upright ? a.yx : a;
    precise vec2 along = c.upright ? b.yx - a.yx : b - a;
    precise float squared = along.x * along.x + along.y * along.y;
    precise float w0 = PARALLEL != 0u ? cut.from.z : 1.0 / cut.from.z, w1 = PARALLEL != 0u ? cut.to.z : 1.0 / cut.to.z;
    precise float half_width = chunk.texture_scale * capsule_scale(cut.from, cut.to);
    precise float widest = max(half_width * (PARALLEL != 0u ? 1.0 : max(w0, w1)), SPL_LINE_THIN);
    precise float slope = along.y / along.x;
    precise float inverse = 1.0 / squared;
    c.along = along;
    c.inverse = squared > 1e-6 ? inverse : 0.0;
    c.slope = squared > 1e-6 ? clamp(slope, -1.0, 1.0) : 0.0;
    c.w = w0;
    c.fall = w1 - w0;
    c.half_width = half_width;
    c.thick = chunk.texture_scale;
    precise float middle = cut.middle * ray_scale(cut.to.z);
    c.middle = middle;
    precise float reach = widest * sqrt(1.0 + c.slope * c.slope);
    c.reach = reach;
    vec2 low = c.upright ? window_low.yx : window_low, high = c.upright ? window_high.yx : window_high;
    float least = min(c.a.x, c.a.x + along.x) - widest - 0.5, most = max(c.a.x, c.a.x + along.x) + widest - 0.5;
    /* Clamped as whole numbers too: ends of a forged chunk may be no numbers. */
    c.low = int(low.y);
    c.high = int(high.y);
    c.first = clamp(int(ceil(clamp(least, low.x, high.x + 1.0))), int(low.x), int(high.x) + 1);
    c.end = clamp(int(floor(clamp(most, low.x - 1.0, high.x))) + 1, c.first, int(high.x) + 1);
    c.across = clamp(int(ceil(min(2.0 * reach, 65536.0))) + 1, 1, max(c.high - c.low + 1, 1));
    c.end = min(c.end, c.first + SPL_LINE_ROUNDS / c.across);
    return c;
}

/* The first sample to look at, of sample `along`. */
int capsule_row(capsule c, int along)
{
    precise float axis = c.a.y + (float(along) + 0.5 - c.a.x) * c.slope;
    return clamp(int(ceil(clamp(axis - c.reach - 0.5, float(c.low), float(c.high)))), c.low, c.high);
}

capsule_walk begin_walk(capsule c)
{
    capsule_walk walk;
    walk.at = ivec2(c.first, capsule_row(c, c.first));
    walk.left = c.across;
    return walk;
}

/* In one flat loop: see disc.glsl. */
void next_step(capsule c, inout capsule_walk walk)
{
    bool wrap = --walk.left <= 0;
    walk.at = wrap ? ivec2(walk.at.x + 1, capsule_row(c, walk.at.x + 1)) : ivec2(walk.at.x, walk.at.y + 1);
    walk.left = wrap ? c.across : walk.left;
}

bool is_inside(capsule c, capsule_walk walk)
{
    return walk.at.x < c.end && walk.at.y <= c.high;
}

ivec2 sample_of(capsule c, capsule_walk walk)
{
    return c.upright ? walk.at.yx : walk.at;
}

/* Squared distance to the axis, a share of the half width there (covered below 1); view depth; and whether the sample
 * shows the second vertex. */
float capsule_sample(capsule c, capsule_walk walk, out float z, out bool second)
{
    precise vec2 off = vec2(walk.at) + (0.5 - c.a);
    precise float t = clamp((off.x * c.along.x + off.y * c.along.y) * c.inverse, 0.0, 1.0);
    precise vec2 beside = off - t * c.along;
    precise float w = c.w + t * c.fall;
    precise float depth = PARALLEL != 0u ? w : 1.0 / w;
    precise float half_width = max(c.half_width * (PARALLEL != 0u ? 1.0 : w), SPL_LINE_THIN);
    precise float distance = (beside.x * beside.x + beside.y * beside.y) / (half_width * half_width);
    precise float way = t * ray_scale(depth);
    z = depth;
    second = !(way < c.middle);
    return distance;
}

/* The point of view space at depth z of the sample. */
vec3 capsule_point(capsule c, capsule_walk walk, float z)
{
    precise vec2 uv = vec2(sample_of(c, walk)) + 0.5 - vec2(frame.cx, frame.cy);
    return view_point(uv, z);
}

/* How far depth z is pushed back for blending: as a disc's of the half width that faces the eye. */
float capsule_margin(capsule c, float z)
{
    precise float margin = frame.margin * max(c.thick, frame.low_pass * ray_scale(z) * frame.inverse_fx);
    return margin;
}

/* The word of method splat of depth z. A line has no sides: what is shown behind it shows its front. */
uint capsule_word(capsule c, float z)
{
    float margin = capsule_margin(c, z);
    precise float pushed = z + margin;
    return sided_word(pushed, side_of(margin, z, false));
}

#endif
