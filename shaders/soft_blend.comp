/* Blends the lists of tiles front to back, model express: a disc that faces the eye, whose opacity falls with the
 * distance d of the sample's ray to the centre (for eq. 19 a polynomial: src/render/soft/models.h). All invocations of
 * a tile walk the same list, each for SPL_SOFT_SAMPLES of a column. In fixed point, so that every driver gives the
 * same. Constants: 0: some items are partly solid (eq. 22); 1: the first time that a sample is blended in this tile; 2:
 * some are thin. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/depths.glsl"
#include "common/soft_lists.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint BORDER = 0;
layout(constant_id = 1) const uint FIRST = 0;
layout(constant_id = 2) const uint THIN = 0;
layout(std430, binding = SPL_STORAGE_SOFT) buffer state_buffer { uint state[]; };

void main()
{
    load_frame();
    load_step();
    const uint lanes = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS / SPL_SOFT_SAMPLES;
    uint slot = gl_GlobalInvocationID.x / lanes, lane = gl_GlobalInvocationID.x % lanes;
    bool has = slot < job.count;
    soft_list list = load_list(has ? slot : 0u);
    uint end = has ? list.end : list.begin + 1u;
    ivec2 corner = list.corner + ivec2(lane % SPL_SOFT_TILE, lane / SPL_SOFT_TILE * SPL_SOFT_SAMPLES);
    int clear[SPL_SOFT_SAMPLES], solid[SPL_SOFT_SAMPLES], last = 0;
    uvec3 sum[SPL_SOFT_SAMPLES];
    float ry[SPL_SOFT_SAMPLES], inverse[SPL_SOFT_SAMPLES];
    precise float rx = (float(corner.x + int(frame.tile_x)) + (0.5 - frame.cx)) * frame.inverse_fx;
    for (int k = 0; k < SPL_SOFT_SAMPLES; k++) {
        ivec2 at = corner + ivec2(0, k);
        bool inside = has && uint(at.x) < frame.width && uint(at.y) < frame.height;
        uint index = sample_index(inside ? at : ivec2(0));
        precise float y = (float(at.y + int(frame.tile_y)) + (0.5 - frame.cy)) * frame.inverse_fy;
        precise float over = 1.0 / (1.0 + rx * rx + y * y);
        ry[k] = y;
        inverse[k] = PARALLEL != 0u ? 1.0 : over;
        sum[k] = uvec3(0u);
        clear[k] = int(SPL_SOFT_CLEAR);
        if (FIRST == 0u) {
            uint word = SPL_SOFT_STATE_WORDS * index;
            sum[k] = uvec3(state[word], state[word + 1u], state[word + 2u]);
            clear[k] -= int(state[word + 3u]);
        }
        bool seen = inside && clear[k] >= int(SPL_SOFT_CLEAR_LEAST);
        solid[k] = seen ? int(min(depth_word(index), uint(SPL_SOFT_FARTHEST))) : 0;
        last = max(last, solid[k]);
    }
    int entry = int(list.begin), end_entry = int(end) - 1;
    listed_item next = load_listed(load_entry(entry));
    int following = load_entry(min(entry + 1, end_entry));
    for (;;) {
        listed_item item = next;
        next = load_listed(following); /* an item ahead: nothing of a round waits for memory */
        following = load_entry(min(entry + 2, end_entry));
        float x = item.x, y = item.y, z = uintBitsToFloat(item.key), own = item.radius;
        int key = int(item.key);
        uint paint = item.paint;
        uvec3 color = uvec3(paint & 255u, paint >> 8 & 255u, paint >> 16 & 255u);
        float radius = THIN != 0u ? soft_radius(own, z) : own, whole = soft_share(own, radius);
        float rounding = THIN != 0u ? soft_rounding(own, radius, x, y) : 0.5;
        precise float closer = 1.0 / (radius * radius);
        precise float ox = x - rx * ray_scale(z);
        precise float ox_squared = ox * ox, ox_along = PARALLEL != 0u ? 0.0 : ox * rx;
        float soft = soft_of_mark(paint >> 24);
        int left = 0;
        for (int k = 0; k < SPL_SOFT_SAMPLES; k++) {
            precise float oy = y - ry[k] * ray_scale(z);
            precise float along = PARALLEL != 0u ? 0.0 : ox_along + oy * ry[k];
            precise float share = (ox_squared + oy * oy - along * along * inverse[k]) * closer;
            precise float inner = 1.0 - share;
            precise float m = intBitsToFloat(max(floatBitsToInt(inner), 0));
            precise float rounded = express_opacity(m, soft, whole, BORDER != 0u, THIN != 0u) + rounding;
            int opacity = key <= solid[k] ? clamp(int(rounded), 0, 65536) : 0;
            uint weight = (uint(clear[k] >> 8) * uint(opacity)) >> 8;
            clear[k] -= int(weight);
            sum[k] += weight * color;
            solid[k] = clear[k] >= int(SPL_SOFT_CLEAR_LEAST) ? solid[k] : 0;
            left = max(left, solid[k]);
        }
        last = left;
        if (++entry > end_entry || key > last)
            break;
    }
    for (int k = 0; k < SPL_SOFT_SAMPLES; k++) {
        ivec2 at = corner + ivec2(0, k);
        if (has && uint(at.x) < frame.width && uint(at.y) < frame.height) {
            uint word = SPL_SOFT_STATE_WORDS * sample_index(at);
            state[word] = sum[k].x;
            state[word + 1u] = sum[k].y;
            state[word + 2u] = sum[k].z;
            state[word + 3u] = SPL_SOFT_CLEAR - uint(clear[k]);
        }
    }
}
