/* Normals of the filled depth, for datasets without any: of a plane through the sample that fits those around it, 5 x 5
 * of the same surface, by least squares. Along a plane's image inverse depth is linear, w = w0 + b x + c y, and the
 * plane's normal is (b fx, c fy, w0 - b (x0 - cx) - c (y0 - cy)). Along that of parallel rays depth is, z = z0 + b x +
 * c y, and the normal is (-b fx, -c fy, 1). Towards the eye. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/fill.glsl"
#include "common/octahedral.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint WIDE = 0;

layout(std430, binding = SPL_STORAGE_DEPTH) writeonly buffer depth_buffer { uint depth[]; };
layout(std430, binding = SPL_STORAGE_IDS) writeonly buffer id_buffer { uint payloads[]; };

void main()
{
    load_frame();
    uint i = gl_GlobalInvocationID.x;
    if (i >= frame.width * frame.height)
        return;
    ivec2 at = place_of(i, frame.width);
    uint own = depth_word(i, WIDE);
    float z0 = uintBitsToFloat(own), w0 = PARALLEL != 0u ? z0 : 1.0 / z0;
    vec2 slope = vec2(0.0);
    vec3 squares = vec3(0.0); /* xx, yy, xy */
    ivec2 step = ivec2(-2);
    for (int k = 0;;) {
        ivec2 c = at + step;
        bool inside = uint(c.x) < frame.width && uint(c.y) < frame.height;
        uint word = depth_word(inside ? sample_index(c) : i, WIDE);
        float there = uintBitsToFloat(word), difference = (PARALLEL != 0u ? there : 1.0 / there) - w0;
        vec2 d = vec2(step);
        bool same = inside && word != SPL_NOTHING &&
                    abs(difference) <= (PARALLEL != 0u ? 1.0 : w0) * SPL_FILL_SLOPE * frame.inverse_fx * length(d);
        slope += same ? d * difference : vec2(0.0);
        squares += same ? vec3(d * d, d.x * d.y) : vec3(0.0);
        step = step.x == 2 ? ivec2(-2, step.y + 1) : ivec2(step.x + 1, step.y);
        if (++k >= 25)
            break;
    }
    float determinant = squares.x * squares.y - squares.z * squares.z;
    vec2 gradient = determinant > 0.5 ? vec2(slope.x * squares.y - slope.y * squares.z,
                                             slope.y * squares.x - slope.x * squares.z) / determinant
                                      : vec2(0.0);
    vec2 place = vec2(at + tile_corner()) + 0.5 - vec2(frame.cx, frame.cy);
    vec3 n = vec3(gradient * vec2(frame.fx, frame.fy), w0 - dot(gradient, place));
    n = PARALLEL != 0u ? vec3(-gradient * vec2(frame.fx, frame.fy), 1.0) : n;
    uint payload = own != SPL_NOTHING ? pack_normal(-normalize(n)) : 0u;
    if (WIDE != 0u)
        depth[2u * i] = payload;
    else
        payloads[i] = payload;
}
