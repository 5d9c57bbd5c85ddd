/* Soft spheres with a density, and the one layer that they are compared with (constant 0: SPL_SOFT_BASE,
 * SPL_SOFT_CONCENTRIC, SPL_SOFT_LAYER), over the lists of tiles that soft_blend.comp walks: sorted by the depth of the
 * spheres' centres. An invocation is a sample.
 *
 * The ray is cut where it enters and leaves spheres. From an event to the next what is open stays the same; the next is
 * found by looking through all spheres that may begin before it and are not over, of which none is farther from the
 * event than the largest radius of the list. So no sphere is kept, and there is no limit on those that are open. A walk
 * through the list is one event t:
 *   the integrals at t of spheres that were open before it, less those of the same at the event before: the depth of
 *   the stretch between (they are kept as one sum: `before` and `after`);
 *   the colour of what is open behind it (eq. 11), and the next event.
 * A software driver's kernel ends after 65535 rounds of all its loops. After SPL_SOFT_ROUNDS the walk is left at the
 * last event: COUNTS[progress] says that some were left, and behind it lies the depth that each invocation reached. The host
 * runs the kernel again until none is. Where no event was reached none ever will be: SPL_SOFT_STUCK.
 *
 * Transmittance is e to the sum of depths, in 24 bits: what a stretch hides is the difference of two of them, so that
 * nothing is lost however short stretches are. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/depths.glsl"
#include "common/soft.glsl"
#include "common/soft_step.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint MODEL = SPL_SOFT_BASE;
layout(constant_id = 1) const uint BORDER = 0; /* some spheres are near the border: eq. 22 */
layout(constant_id = 2) const uint THIN = 0;   /* some are thin: soft_share() */

layout(std430, binding = SPL_STORAGE_SOFT) buffer state_buffer { uint state[]; };
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_ITEMS) item_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) entry_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_LISTS) list_texels;

vec3 unpack_bytes(uint word)
{
    return vec3(uvec3(word, word >> 8, word >> 16) & 255u);
}

/* A sphere as a ray meets it. */
struct soft_item {
    vec3 center, color;
    float radius, inverse_radius;
    float q, behind; /* see soft_distance(); in radii squared */
    float share;     /* of the opacity of others */
    uint mark;
};

soft_item load_item(uint entry, soft_ray ray)
{
    int at = SPL_SOFT_ITEM_WORDS * int(imageLoad(entry_texels, int(entry)).x);
    soft_item item;
    item.center.x = uintBitsToFloat(imageLoad(item_texels, at).x);
    item.center.y = uintBitsToFloat(imageLoad(item_texels, at + 1).x);
    item.center.z = uintBitsToFloat(imageLoad(item_texels, at + 2).x);
    float own = uintBitsToFloat(imageLoad(item_texels, at + 3).x);
    item.radius = THIN != 0u ? soft_radius(own, item.center.z) : own;
    item.share = THIN != 0u ? soft_share(own, item.radius) : 1.0;
    uint paint = imageLoad(item_texels, at + 4).x;
    item.color = unpack_bytes(paint);
    item.mark = paint >> 24;
    item.inverse_radius = 1.0 / item.radius;
    item.q = soft_distance(ray, item.center, item.behind) * item.inverse_radius * item.inverse_radius;
    return item;
}

/* Optical depth of the sphere along the ray from its middle to zeta radii behind it; `edge` is where it ends. */
float depth_to(soft_item item, float edge, float zeta)
{
    float part, whole = 1.0;
    if (MODEL == SPL_SOFT_CONCENTRIC) {
        float samples = frame.fx * item.radius / max(item.center.z, 1e-9);
        float shells = floor(clamp(samples * (1.0 / float(SPL_SOFT_SHELL_SAMPLES)), 1.0, float(SPL_SOFT_SHELLS_MAX)));
        part = soft_concentric_part(shells, item.q, zeta);
        if (BORDER != 0u)
            whole = soft_concentric_part(shells, item.q, edge);
    } else {
        part = soft_base_part(item.q, zeta);
        if (BORDER != 0u)
            whole = soft_base_part(item.q, edge);
    }
    float depth = job.depth * part;
    if (THIN != 0u)
        depth *= item.share * (job.thin + (1.0 - job.thin) * item.share);
    if (BORDER != 0u && item.mark < SPL_MARK_WHOLE) {
        float opacity = 1.0 - exp(-2.0 * job.depth * whole), soft = (float(item.mark) - 1.0) * (1.0 / 254.0);
        float wanted = -log(max(1.0 - soft_modulate(opacity, item.q, soft) * item.share, 1.0 / 1024.0));
        depth = 0.5 * wanted * part / max(whole, 1e-12);
    }
    return depth;
}

/* What a sample has seen. */
struct walk {
    uvec3 sums;  /* colours times the share that they cover, of SPL_SOFT_CLEAR */
    uint clear;
    float depth; /* optical */
};

/* `depth` more hides its share with `color`. */
void hide(inout walk w, float depth, vec3 color)
{
    w.depth += max(depth, 0.0);
    uint clear = min(uint(exp(-w.depth) * float(SPL_SOFT_CLEAR) + 0.5), w.clear), weight = w.clear - clear;
    uvec3 fine = uvec3(color * 256.0 + 0.5);
    w.sums += (weight >> 8) * fine + ((weight & 255u) * fine >> 8);
    w.clear = clear;
}

/* The nearest spheres within their margin, and nothing behind them; false where they are more than may be walked. */
bool see_layer(inout walk w, soft_ray ray, uint begin, uint end, float until)
{
    float last = until, weights = 0.0;
    vec3 color = vec3(0.0);
    bool all = true;
    uint i = begin;
    while (i < end) {
        soft_item item = load_item(i, ray);
        bool there = item.q < 1.0 && item.center.z >= frame.near;
        last = there ? min(last, item.center.z + frame.margin * item.radius) : last;
        float weight = there && item.center.z <= last ? 1.0 - item.q : 0.0;
        color += weight * item.color;
        weights += weight;
        all = item.center.z > last || i + 1u >= end || i - begin < SPL_SOFT_ROUNDS;
        i = item.center.z > last || !all ? end : i + 1u;
    }
    if (weights > 0.0)
        hide(w, job.depth, color / weights);
    return all;
}

/* Where it is entered and left. In a function of its own: glslang follows what is precise back through a loop without
 * end. */
vec2 chord_of(float middle, float half_chord)
{
    precise vec2 events = vec2(middle - half_chord, middle + half_chord);
    return events;
}

/* Rounds that an invocation may take: shells are rounds, too, and no sphere of the list has more of them. */
uint most_rounds(uint begin, soft_ray ray)
{
    uint rounds = SPL_SOFT_ROUNDS;
    if (MODEL == SPL_SOFT_CONCENTRIC) {
        float samples = frame.fx * job.reach / max(load_item(begin, ray).center.z, 1e-9);
        float shells = clamp(samples * (1.0 / float(SPL_SOFT_SHELL_SAMPLES)), 1.0, float(SPL_SOFT_SHELLS_MAX));
        rounds /= 1u + (uint(shells) + 1u) * (BORDER != 0u ? 2u : 1u);
    }
    return rounds;
}

/* From event to event; true where it comes to its end. */
bool see_stretches(inout walk w, soft_ray ray, uint begin, uint end, inout float reached, float until)
{
    float root = sqrt(ray.inverse), stretched = 1.0 / root;
    float t = reached, next = until, before = 0.0, after = 0.0, was_after = 0.0, weights = 0.0, was_weights = 1.0;
    vec3 color = vec3(0.0), was_color = vec3(0.0);
    bool fresh = true, going = true, done = false;
    uint first = begin, i = begin, most = most_rounds(begin, ray);
    for (uint rounds = 0u; going; rounds++) {
        soft_item item = load_item(i, ray);
        bool hit = item.q < 1.0;
        float edge = sqrt(max(1.0 - item.q, 0.0)), middle = item.center.z + item.behind;
        vec2 events = chord_of(middle, edge * item.radius * root);
        float enters = events.x, leaves = events.y;
        float zeta = clamp((t - middle) * stretched * item.inverse_radius, -edge, edge);
        float depth = depth_to(item, edge, zeta);
        bool is_open = hit && enters <= t && leaves > t;
        float weight = is_open ? 1.0 - sqrt(item.q) : 0.0;
        before += hit && enters < t && leaves >= t ? depth : 0.0;
        after += is_open ? depth : 0.0;
        color += weight * item.color;
        weights += weight;
        float event = enters > t ? enters : leaves > t ? leaves : until;
        next = hit ? min(next, event) : next;
        first += i == first && item.center.z + job.reach < t ? 1u : 0u;
        i++;
        if (i >= end || item.center.z - job.reach > next) {
            if (!fresh)
                hide(w, before - was_after, was_color / max(was_weights, 1e-12));
            reached = t;
            done = t >= until || w.clear < SPL_SOFT_CLEAR_LEAST;
            was_after = after;
            was_color = color;
            was_weights = weights;
            before = 0.0;
            after = 0.0;
            weights = 0.0;
            color = vec3(0.0);
            t = next;
            next = until;
            i = min(first, end - 1u);
            fresh = false;
        }
        going = !done && rounds < most;
    }
    return done;
}

void main()
{
    load_frame();
    load_step();
    const uint lanes = SPL_SOFT_TILE * SPL_SOFT_TILE;
    uint id = gl_GlobalInvocationID.x, slot = id / lanes, lane = id % lanes;
    bool has = slot < job.count;
    int list = int(job.first + 3u * (has ? slot : 0u));
    uint place = imageLoad(list_texels, list).x, begin = imageLoad(list_texels, list + 1).x;
    uint end = imageLoad(list_texels, list + 2).x;
    ivec2 at = ivec2(place & 65535u, place >> 16) * SPL_SOFT_TILE + ivec2(lane % SPL_SOFT_TILE, lane / SPL_SOFT_TILE);
    has = has && uint(at.x) < frame.width && uint(at.y) < frame.height;
    if (!has)
        return;
    uint index = sample_index(at), own = SPL_SOFT_STATE_WORDS * index, kept = job.progress + 1u + id;
    uint solid = depth_word(index);
    float until = min(solid == SPL_NOTHING ? frame.far : uintBitsToFloat(solid), min(frame.far, job.until));
    soft_ray ray = load_soft_ray(at + tile_corner());
    walk w;
    w.sums = uvec3(state[own], state[own + 1u], state[own + 2u]);
    w.clear = SPL_SOFT_CLEAR - state[own + 3u];
    w.depth = -log(max(float(w.clear), 0.5) / float(SPL_SOFT_CLEAR));
    float reached = max(uintBitsToFloat(counts[kept]), frame.near);
    uint left = 0u;
    if (MODEL == SPL_SOFT_LAYER) {
        if (w.clear == SPL_SOFT_CLEAR)
            left = see_layer(w, ray, begin, end, until) ? 0u : SPL_SOFT_STUCK;
    } else if (begin < end && reached < until && w.clear >= SPL_SOFT_CLEAR_LEAST) {
        float started = reached;
        if (!see_stretches(w, ray, begin, end, reached, until))
            left = reached > started ? 1u : SPL_SOFT_STUCK;
        counts[kept] = floatBitsToUint(reached);
    }
    if (left != 0u)
        atomicOr(counts[job.progress], left);
    state[own] = w.sums.x;
    state[own + 1u] = w.sums.y;
    state[own + 2u] = w.sums.z;
    state[own + 3u] = SPL_SOFT_CLEAR - w.clear;
}
