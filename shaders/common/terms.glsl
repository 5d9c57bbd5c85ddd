/* Shapes of terms, as words of the tests say where they lie (src/render/marks.h): distances of points to them. Whole
 * numbers, and floats by rounded products and sums, so that every driver decides the same. */
#ifndef SPL_TERMS_GLSL
#define SPL_TERMS_GLSL

#include "common/frame.glsl"

SPL_TEXEL_BUFFER(SPL_TEXELS_TESTS) test_texels;

uint test_word(uint at)
{
    return imageLoad(test_texels, int(at)).x;
}

float test_float(uint at)
{
    return uintBitsToFloat(test_word(at));
}

/* What a row of the shape makes of p. */
float shape_row(uint at, vec3 p)
{
    precise float q =
        test_float(at) * p.x + test_float(at + 1u) * p.y + test_float(at + 2u) * p.z + test_float(at + 3u);
    return q;
}

/* Distance of q to the sides of the polygon whose corners begin at word `at`, negative inside. */
float polygon_distance(uint at, uint count, vec2 q)
{
    float least = 3e38;
    bool inside = false;
    uint last = at + 2u * (count - 1u);
    vec2 a = vec2(test_float(last), test_float(last + 1u));
    for (uint i = 0u; i < count; i++) {
        vec2 b = vec2(test_float(at + 2u * i), test_float(at + 2u * i + 1u));
        precise vec2 way = b - a, off = q - a, rest = q - b;
        precise float t = clamp((off.x * way.x + off.y * way.y) / (way.x * way.x + way.y * way.y), 0.0, 1.0);
        precise vec2 beside = off - t * way;
        precise float square = beside.x * beside.x + beside.y * beside.y, side = way.x * off.y - way.y * off.x;
        least = min(least, square);
        bool below = rest.y < 0.0;
        inside = inside != ((off.y < 0.0) != below && (below ? side > 0.0 : side < 0.0));
        a = b;
    }
    return inside ? -sqrt(least) : sqrt(least);
}

/* Of p, view space, to the shape at word `at`; bodies, polygons: whether any such may be asked for. */
float distance_to(uint at, uint kind, vec3 p, bool bodies, bool polygons)
{
    if (!bodies && !polygons)
        return shape_row(at + 8u, p);
    precise vec3 q;
    for (uint i = 0u; i < 3u; i++) /* of fixed length: it is unrolled */
        q[i] = test_float(at + 4u * i) * p.x + test_float(at + 4u * i + 1u) * p.y + test_float(at + 4u * i + 2u) * p.z +
               test_float(at + 4u * i + 3u);
    precise vec3 beyond = abs(q) - vec3(test_float(at + SPL_SHAPE_HALF), test_float(at + (SPL_SHAPE_HALF + 1u)),
                                             test_float(at + (SPL_SHAPE_HALF + 2u)));
    precise vec3 outside = max(beyond, 0.0);
    precise float axis = sqrt(q.x * q.x + q.y * q.y);
    precise float box = sqrt(outside.x * outside.x + outside.y * outside.y + outside.z * outside.z) +
                        min(max(max(beyond.x, beyond.y), beyond.z), 0.0);
    float distance = kind == SPL_SHAPE_AXIS ? axis : kind == SPL_SHAPE_PLANE ? q.z : box;
    if (polygons) {
        uint count = kind == SPL_SHAPE_POLYGON ? test_word(at + SPL_SHAPE_HALF) : 0u;
        float across = polygon_distance(at + SPL_SHAPE_WORDS, count, q.xy);
        precise vec2 away = vec2(max(across, 0.0), outside.z);
        precise float prism = sqrt(away.x * away.x + away.y * away.y) + min(max(across, beyond.z), 0.0);
        distance = kind == SPL_SHAPE_POLYGON ? prism : distance;
    }
    return distance;
}

/* Is a distance within the shape's ends? */
bool is_within(uint at, uint flags, float distance)
{
    float least = test_float(at + SPL_SHAPE_LEAST), most = test_float(at + SPL_SHAPE_MOST);
    bool above = distance > least || ((flags & SPL_SHAPE_WITH_LEAST) != 0u && distance == least);
    bool below = distance < most || ((flags & SPL_SHAPE_WITH_MOST) != 0u && distance == most);
    return above && below;
}

/* Conditions, all of which hold, test by test; a condition holds where any of its lists, or what is outside one,
 * does. */
struct term_fold {
    bool all, any;        /* conditions before; of this one, lists before */
    bool within, outside; /* of this list */
    uint bit;             /* of this condition, as SPL_TEST_BIT has it */
    uint bits;            /* of those before that have one and hold: these do not count in `all` */
};

term_fold begin_fold()
{
    term_fold f;
    f.all = true;
    f.any = true;
    f.within = false;
    f.outside = false;
    f.bit = 0u;
    f.bits = 0u;
    return f;
}

void end_condition(inout term_fold f)
{
    bool holds = f.any || f.within != f.outside;
    f.all = f.all && (holds || f.bit != 0u);
    f.bits |= holds && f.bit != 0u ? 1u << (f.bit - 1u) : 0u;
}

/* The next test, of `flags`, and whether it holds; of one that begins a condition, whether that is known to. */
void fold_test(inout term_fold f, uint flags, bool holds, bool known)
{
    bool item = (flags & (SPL_TEST_OR | SPL_TEST_AND)) == 0u, begins = (flags & SPL_TEST_AND) != 0u;
    if (begins)
        end_condition(f);
    f.any = begins ? known : f.any || (!item && f.within != f.outside);
    f.bit = flags >> SPL_TEST_BIT & 15u;
    f.outside = (flags & SPL_TEST_OUTSIDE) != 0u;
    f.within = holds || (item && f.within);
}

#endif
