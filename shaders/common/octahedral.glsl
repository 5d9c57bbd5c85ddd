/* Unit vectors in one word: 16 bits for each octahedral coordinate. */
#ifndef SPL_OCTAHEDRAL_GLSL
#define SPL_OCTAHEDRAL_GLSL

uint pack_normal(vec3 n)
{
    precise vec2 e = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    if (n.z < 0.0)
        e = (1.0 - abs(e.yx)) * vec2(e.x >= 0.0 ? 1.0 : -1.0, e.y >= 0.0 ? 1.0 : -1.0);
    uvec2 code = uvec2((e + 1.0) * 32767.0 + 0.5);
    return min(code.x, 65534u) | min(code.y, 65534u) << 16;
}

vec3 unpack_normal(uint code)
{
    vec2 e = vec2(float(code & 0xffffu), float(code >> 16)) / 32767.0 - 1.0;
    vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (v.z < 0.0)
        v.xy = (1.0 - abs(v.yx)) * vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
    return normalize(v);
}

#endif
