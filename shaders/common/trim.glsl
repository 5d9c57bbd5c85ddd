/* Fragments that their splat's own station saw through: dropped, where its chunk is said to have any. With SPL_TRIMS,
 * for such chunks alone, so that the others do not pay for them; frame.map_* are of the chunk's own station. */
#ifndef SPL_TRIM_GLSL
#define SPL_TRIM_GLSL

#include "common/disc.glsl"

#ifdef SPL_TRIMS
#include "common/polar.glsl"

/* What a splat's fragments share. */
struct trim_rule {
    vec3 normal;     /* station's frame */
    float tolerance; /* of ranges, before what the slant adds */
};

trim_rule load_trim(splat s)
{
    trim_rule rule;
    rule.normal = map_direction(s.normal);
    precise float tolerance = frame.map_slack + SPL_MAP_TOLERANCE * s.radius;
    rule.tolerance = tolerance;
    return rule;
}

/* Does a sample of view depth z lie where the station's ranges around it are all behind it, further than ranges of one
 * surface differ (spl_map_code_of_range() of a larger range is larger, that of no return the largest, and unknown the
 * least)? */
bool is_trimmed(trim_rule rule, ivec2 at, float z)
{
    float range;
    vec3 d = map_look(map_point(view_point(at, z)), range);
    vec2 along;
    uvec4 codes = map_range_codes(polar_chart(d), along);
    precise float tolerance = rule.tolerance + map_slant(map_facing(rule.normal, d), range);
    float least = float(min(min(codes.x, codes.y), min(codes.z, codes.w)));
    return least > map_code(range + tolerance);
}

/* A body behind `if` costs software drivers what it costs where some lane is on; a loop of no rounds costs nothing. */
#define SPL_WHERE(condition) for (bool once = (condition); once; once = false)

#else

struct trim_rule {
    uint none;
};

trim_rule load_trim(splat s)
{
    trim_rule rule;
    rule.none = 0u;
    return rule;
}

bool is_trimmed(trim_rule rule, ivec2 at, float z)
{
    return false;
}

#define SPL_WHERE(condition) if (condition)

#endif
#endif
