/* What is drawn of a panel on the sample grid: a piece of a plane, which is the panel itself (panel_draw.glsl) or a
 * triangle of one with relief (mesh_draw.glsl). A sample's ray meets the plane at z = n.o / n.d (d.z = 1), exact under
 * perspective, or, parallel to the axis through (x, y), at z = (n.o - n.x x - n.y y) / n.z, in a cell whose bit says
 * whether it is there. A hair of SPL_PANEL_HAIR cells beyond the piece's edge is its own too, so that no sample falls
 * between pieces that are rounded each on their own.
 *
 * Of what is thinner than a sample, as a plane seen along its edge or far away, each cell that is there also covers the
 * sample that its middle falls on, as a disc would: rays meet too few of them. The same of pieces that reach the near
 * plane.
 *
 * A kernel that includes this has a panel_fragment(), and covers() says where the piece is. */
#ifndef SPL_PLANE_DRAW_GLSL
#define SPL_PLANE_DRAW_GLSL

#include "common/marks.glsl"
#include "common/panel.glsl"
#ifdef SPL_SHOWN /* kernels of colours define it */
#include "common/paint.glsl"
#endif

#define SPL_PANEL_HAIR 0.015625
#define SPL_PANEL_ROUNDING 0.02 /* samples by which its box may be rounded */

/* What the fragments of a piece share. */
struct panel_draw {
    panel_plane plane;  /* that the panel's cells lie on, but for its relief */
    panel own;
    uint id;            /* dataset-wide */
    vec3 u, v;          /* products with (ray, 1) of sample - principal point: cells along u and v at depth 1 */
    vec2 eye;           /* the foot of the eye in cells of the panel */
    float radius;       /* by which it blends */
    uint known;         /* of shapes that cut it: cut.glsl */
    uint paint;         /* its entry of the palette */
    /* Of the piece: */
    vec3 facing;        /* its normal, view space, unit */
    vec3 normal;        /* product with (ray, 1): n.d */
    float offset;       /* of its plane from the eye, along its normal */
    float least, most;  /* depths of its corners */
    bool back;          /* it turns its back to the eye */
    float behind;       /* as of a disc */
    ivec2 first, last;  /* samples, inclusive; empty when last < first */
    bool thin;
    bool seen; /* anything may lie on the samples that it is drawn to */
};

/* A fragment at view depth z, which is pushed back to `pushed`, at `place` in cells of the panel. `distance` as of a
 * disc: 0, or 1 where it is a cell's middle; any number of these may fall on a sample, so they weigh next to
 * nothing. */
void panel_fragment(panel_draw d, ivec2 at, float z, float distance, float pushed, vec2 place);

/* Does the piece, or the hair beyond its edge, lie at `place` in cells of the panel? */
bool covers(panel_draw d, vec2 place);

panel_draw begin_panel(splat_run run, uint index)
{
    panel_draw d;
    panel_plane plane = load_plane(run.chunk);
    d.plane = plane;
    d.own = load_panel(run.chunk, index);
    if (is_soft(run.chunk, index * 4u * SPL_MARKS_PANEL)) /* all of its cells are, or none */
        d.own.known = false;
    d.known = load_known(run.chunk, index * 4u * SPL_MARKS_PANEL);
    d.id = run.chunk.first_id + index;
    vec3 o = plane.origin, u = plane.u, v = plane.v;
    precise float inverse_cell = 1.0 / plane.cell;
    precise vec2 eye = vec2(u.x * o.x + u.y * o.y + u.z * o.z, v.x * o.x + v.y * o.y + v.z * o.z) * inverse_cell +
                       d.own.first;
    precise vec3 scale = vec3(frame.inverse_fx, frame.inverse_fy, 1.0);
    precise vec3 along_u = u * inverse_cell * scale, along_v = v * inverse_cell * scale;
    d.u = along_u;
    d.v = along_v;
    d.eye = eye;
    d.radius = run.chunk.radius_min;
#ifdef SPL_SHOWN
    d.paint = paint_of_item(run.chunk, index);
#endif
    return d;
}

#ifdef SPL_SHOWN
/* What a fragment shows, whose own colour is `own`. */
uvec3 shown_on_panel(panel_draw d, vec3 own, ivec2 at, float z)
{
    if (!PAINTS)
        return uvec3(own + 0.5);
    precise vec2 ray = (vec2(at) + 0.5 - vec2(frame.cx, frame.cy)) * vec2(frame.inverse_fx, frame.inverse_fy);
    precise vec3 p = vec3(ray * ray_scale(z), z);
    return paint_over(uvec3(own + 0.5), paint_color(d.paint, p, d.facing));
}
#endif

/* The plane of the piece, of unit normal n through o. */
void set_plane(inout panel_draw d, vec3 n, vec3 o)
{
    precise vec3 normal = n * vec3(frame.inverse_fx, frame.inverse_fy, 1.0);
    precise float offset = n.x * o.x + n.y * o.y + n.z * o.z;
    d.facing = n;
    d.normal = normal;
    d.offset = offset;
    d.back = (PARALLEL != 0u ? n.z : offset) > 0.0;
    d.behind = d.back && (frame.flags & SPL_FRAME_SIDED) != 0u ? d.radius : 0.0;
}

/* Where it lies: `corners`, view space, in order around it; of a triangle the first one again. What it is a piece of is
 * `pieces` times as thick on the image. */
void set_corners(inout panel_draw d, splat_run run, vec3 corners[4], float pieces)
{
    vec2 places[4]; /* on the image */
    vec2 low = vec2(3e38), high = vec2(-3e38);
    d.least = 3e38;
    d.most = -3e38;
    for (uint i = 0u; i < 4u; i++) { /* of fixed length: it is unrolled */
        vec3 p = corners[i];
        places[i] = image_place(p);
        bool before = p.z >= frame.near;
        low = before ? min(low, places[i]) : low;
        high = before ? max(high, places[i]) : high;
        d.least = min(d.least, p.z);
        d.most = max(d.most, p.z);
    }
    bool crosses = d.least < frame.near;
    for (uint i = 0u; i < 4u; i++) { /* where its edges meet the near plane */
        vec3 p = corners[i], q = corners[(i + 1u) % 4u];
        bool meets = crosses && (p.z < frame.near) != (q.z < frame.near);
        precise float t = (frame.near - p.z) / (q.z - p.z);
        vec2 place = image_place(vec3(p.xy + t * (q.xy - p.xy), frame.near));
        low = meets ? min(low, place) : low;
        high = meets ? max(high, place) : high;
    }
    vec2 across = places[2] - places[0], other = places[3] - places[1];
    precise float area = 0.5 * abs(across.x * other.y - across.y * other.x);
    precise float thick = pieces * area;
    d.thin = crosses || !(thick >= max(high.x - low.x, high.y - low.y));
    low -= crosses ? 2.0 : SPL_PANEL_ROUNDING;
    high += crosses ? 2.0 : SPL_PANEL_ROUNDING;
    bvec4 inside = bvec4(greaterThanEqual(high, run.low), lessThan(low, run.high + 1.0));
    d.seen = all(inside) && d.own.known && d.most >= frame.near && d.least <= frame.far;
    d.first = ivec2(ceil(clamp(low - 0.5, run.low, run.high + 1.0)));
    d.last = ivec2(floor(clamp(high - 0.5, run.low - 1.0, run.high)));
    if (d.last.x < d.first.x)
        d.last.y = d.first.y - 1;
}

/* The depth that a fragment is pushed back to: as a disc of the blend radius there. */
float panel_push(panel_draw d, float z, float tilt)
{
    precise float slant = min(max(abs(tilt), 1.0), SPL_MARGIN_SLANT);
    precise float margin = frame.margin * max(d.radius, frame.low_pass * ray_scale(z) * frame.inverse_fx) * slant;
    precise float pushed = z + margin + d.behind;
    return pushed;
}

/* As of side_of(), of a fragment that is pushed back so. */
uint panel_side(panel_draw d, float z, float pushed)
{
    precise float margin = pushed - d.behind - z;
    return side_of(margin, z, d.back);
}

/* One over n.d of the ray through uv = sample - principal point, and the depth where it meets the plane. */
float plane_tilt(panel_draw d, vec2 uv)
{
    precise float tilt = 1.0 / (d.normal.x * uv.x + d.normal.y * uv.y + d.normal.z);
    return PARALLEL != 0u ? 1.0 / d.normal.z : tilt;
}

float plane_depth(panel_draw d, vec2 uv, float tilt)
{
    precise float z = d.offset * tilt;
    precise float beside = (d.offset - d.normal.x * uv.x - d.normal.y * uv.y) * tilt;
    return PARALLEL != 0u ? beside : z;
}

void draw_sample(panel_draw d, ivec2 at)
{
    precise vec2 uv = vec2(at) + 0.5 - vec2(frame.cx, frame.cy);
    precise float tilt = plane_tilt(d, uv);
    precise float z = plane_depth(d, uv, tilt);
    precise vec2 place = vec2(d.u.x * uv.x + d.u.y * uv.y + d.u.z, d.v.x * uv.x + d.v.y * uv.y + d.v.z) * z - d.eye;
    precise vec2 beside =
        vec2(d.u.x * uv.x + d.u.y * uv.y + d.u.z * z, d.v.x * uv.x + d.v.y * uv.y + d.v.z * z) - d.eye;
    place = PARALLEL != 0u ? beside : place;
    float within = clamp(z, d.least, d.most);
    uvec2 cell = uvec2(clamp(place, vec2(0.0), vec2(float(SPL_PANEL_SIDE) - 0.5)));
    bool inside = z > 0.0 && covers(d, place) && within >= frame.near && within <= frame.far;
    if (inside && at.y <= d.last.y && panel_has(d.own, cell) && is_kept(view_point(uv, within), d.known, CUT_OPEN))
        panel_fragment(d, at, within, 0.0, panel_push(d, within, tilt), place);
}

/* The samples of the piece's box, dealt row by row to `lanes` invocations, of which this is number `lane`. */
void draw_samples(panel_draw d, uint lane, uint lanes)
{
    int width = d.last.x - d.first.x + 1;
    precise float inverse_width = 1.0 / float(max(width, 1));
    int rows = int((float(lanes) + 0.5) * inverse_width), row = int((float(lane) + 0.5) * inverse_width);
    ivec2 step = ivec2(int(lanes) - rows * width, rows);
    ivec2 at = d.first + ivec2(int(lane) - row * width, row);
    for (;;) { /* the end is asked for at the end: see common/walk.glsl */
        draw_sample(d, at);
        at += step;
        bool wrap = at.x > d.last.x;
        at = ivec2(wrap ? at.x - width : at.x, at.y + int(wrap));
        if (at.y > d.last.y)
            break;
    }
}

/* The middle p of a cell of the piece, on the sample that it falls on. Its depth is the plane's there, as the samples
 * beside it have it: that of the middle would be nearer, of the nearest of many that fall on a sample, by all that the
 * sample spans. */
void draw_cell(splat_run run, panel_draw d, uvec2 cell, vec3 p)
{
    vec2 place = image_place(p);
    precise vec2 uv = floor(place) + 0.5 - vec2(frame.cx, frame.cy);
    precise float through = d.offset / (d.normal.x * uv.x + d.normal.y * uv.y + d.normal.z);
    float there = PARALLEL != 0u ? plane_depth(d, uv, plane_tilt(d, uv)) : through;
    precise float behind = p.z * (1.0 + SPL_CELL_REACH * frame.inverse_fx),
                  beside = p.z + SPL_CELL_REACH * frame.inverse_fx;
    float farthest = max(d.most, PARALLEL != 0u ? beside : behind);
    float z = clamp(there > 0.0 ? there : p.z, d.least, farthest);
    precise float tilt = z / max(abs(d.offset), 1e-30);
    tilt = PARALLEL != 0u ? plane_tilt(d, uv) : tilt;
    bool inside = z >= frame.near && z <= frame.far && place.x >= run.low.x && place.y >= run.low.y &&
                  place.x < run.high.x + 1.0 && place.y < run.high.y + 1.0;
    if (inside && panel_has(d.own, cell) && is_kept(p, d.known, CUT_OPEN))
        panel_fragment(d, ivec2(place), z, 1.0, panel_push(d, z, tilt), vec2(cell) + 0.5);
}

#endif
