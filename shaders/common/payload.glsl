/* Means of payloads of method points: colours and normals are averaged, an id is the nearest's, as is what it is. GROUP
 * is the kernel's constant 0. */
#ifndef SPL_PAYLOAD_GLSL
#define SPL_PAYLOAD_GLSL

#include "common/octahedral.glsl"

vec3 payload_vector(uint payload)
{
    if (GROUP == SPL_SUMS_COLOR)
        return vec3((uvec3(payload) >> uvec3(0u, 8u, 16u)) & 255u);
    if (GROUP == SPL_SUMS_NORMAL)
        return unpack_normal(payload);
    return vec3(0.0);
}

uint payload_of(vec3 sum, float weight, uint nearest)
{
    if (GROUP == SPL_SUMS_COLOR) {
        uvec3 c = uvec3(sum / weight + 0.5);
        return c.x | c.y << 8 | c.z << 16;
    }
    if (GROUP == SPL_SUMS_NORMAL)
        return dot(sum, sum) > 0.0 ? pack_normal(sum) : nearest;
    return nearest;
}

#endif
