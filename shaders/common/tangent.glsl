/* The frame in which a splat's texture lies; src/geom/tangent.h is this function in C. Rows of texels are level
 * wherever the surface is not. */
#ifndef SPL_TANGENT_GLSL
#define SPL_TANGENT_GLSL

#define SPL_TANGENT_LEVEL 0.0625

void tangent_frame(vec3 n, out vec3 u, out vec3 v)
{
    precise float level = n.x * n.x + n.y * n.y;
    precise float flat_level = 1.0 - n.x * n.x;
    bool steep = level > SPL_TANGENT_LEVEL;
    precise float inverse = 1.0 / sqrt(steep ? level : flat_level);
    precise vec3 a = (steep ? vec3(-n.y, n.x, 0.0) : vec3(flat_level, -n.x * n.y, -n.x * n.z)) * inverse;
    precise vec3 b = vec3(n.y * a.z - n.z * a.y, n.z * a.x - n.x * a.z, n.x * a.y - n.y * a.x);
    u = a;
    v = b;
}

#endif
