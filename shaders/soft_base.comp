/* Soft spheres with a density, and the one layer that they are compared with (constant 0: SPL_SOFT_BASE,
 * SPL_SOFT_CONCENTRIC, SPL_SOFT_LAYER), over the lists of tiles that soft_blend.comp walks: sorted by the depth of the
 * spheres' centres. An invocation is a sample.
 *
 * The ray is cut where it enters and leaves spheres. From an event to the next what is open stays the same; the next is
 * found by looking through all spheres that may begin before it and are not over, of which none is farther from the
 * event than the largest radius of the list. An invocation remembers which of them its ray has met, SPL_SOFT_MET at
 * most, and looks those behind up in the list again: most of a tile's spheres miss most of its samples. So there is no
 * limit on spheres that are open. A walk is one event t:
 *   the integrals at t of spheres that were open before it, less those of the same at the event before: the depth of
 *   the stretch between (they are kept as one sum: `before` and `after`);
 *   the colour of what is open behind it (eq. 11), and the next event.
 * A software driver's kernel ends after 65535 rounds of all its loops. After SPL_SOFT_ROUNDS the walk is left where it
 * is, and kept: COUNTS[progress] says that some were left, behind it lie SPL_SOFT_KEPT_WORDS of each invocation. The
 * host runs the kernel again until none is. So there is no limit on the list's length, either.
 * Lists may be those of a window of depth: they have all that overlaps what lies before `until`. Where the next event
 * lies behind that it is not known yet, and the ray ends at the last one, to which the next window comes back: what is
 * open there it has, too. So windows cut no stretch, and change no byte. WALKS have the last event and the optical
 * depth of every sample; of layer the depth up to which spheres count and their weights, and the state the sum of their
 * colours until `ends` is set.
 *
 * Transmittance is e to the sum of depths, in 24 bits: what a stretch hides is the difference of two of them, so that
 * nothing is lost however short stretches are. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/depths.glsl"
#include "common/soft_lists.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint MODEL = SPL_SOFT_BASE;
layout(constant_id = 1) const uint BORDER = 0; /* some spheres are near the border: eq. 22 */
layout(constant_id = 2) const uint THIN = 0;   /* some are thin: soft_share() */

layout(std430, binding = SPL_STORAGE_SOFT) buffer state_buffer { uint state[]; };
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = SPL_STORAGE_WALKS) buffer walk_buffer { uint walks[]; };

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
    listed_item listed = load_listed(load_entry(int(entry)));
    soft_item item;
    item.center = vec3(listed.x, listed.y, uintBitsToFloat(listed.key));
    float own = listed.radius;
    item.radius = THIN != 0u ? soft_radius(own, item.center.z) : own;
    item.share = THIN != 0u ? soft_share(own, item.radius) : 1.0;
    item.color = unpack_bytes(listed.paint);
    item.mark = listed.paint >> 24;
    item.inverse_radius = 1.0 / item.radius;
    item.q = soft_distance(ray, item.center, item.behind) * item.inverse_radius * item.inverse_radius;
    return item;
}

/* Optical depth of the sphere along the ray from its middle to zeta radii behind it; `edge` is where it ends. */
float depth_to(soft_item item, float edge, float zeta)
{
    float part, whole = 1.0;
    if (MODEL == SPL_SOFT_CONCENTRIC) {
        float shells = soft_shells(item.radius, item.center.z);
        part = soft_concentric_part(shells, item.q, zeta);
        if (BORDER != 0u)
            whole = soft_concentric_part(shells, item.q, edge);
    } else {
        part = soft_base_part(item.q, zeta);
        if (BORDER != 0u)
            whole = soft_base_part(item.q, edge);
    }
    return dense_depth(part, whole, item.q, soft_of_mark(item.mark), item.share, BORDER != 0u, THIN != 0u);
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

/* Of COUNTS, how far an invocation came. */
const uint KEPT_NOTHING = 0u, KEPT_FRESH = 1u, KEPT_GOING = 2u, KEPT_END = 3u;

float kept_float(uint at)
{
    return uintBitsToFloat(counts[at]);
}

void keep_float(uint at, float value)
{
    counts[at] = floatBitsToUint(value);
}

/* What layer has seen so far. */
struct layer {
    vec3 color;
    float weights, last;
};

/* The nearest spheres within their margin, and nothing behind them; false where they are more than a run may walk. */
bool see_layer(inout layer l, soft_ray ray, uint begin, uint end, uint kept)
{
    uint i = begin + (counts[kept] == KEPT_GOING ? counts[kept + 1u] : 0u), stop = min(end, i + SPL_SOFT_ROUNDS);
    bool behind = false;
    while (i < stop && !behind) {
        soft_item item = load_item(i, ray);
        bool there = item.q < 1.0 && item.center.z >= frame.near;
        l.last = there ? min(l.last, item.center.z + frame.margin * item.radius) : l.last;
        float weight = there && item.center.z <= l.last ? 1.0 - item.q : 0.0;
        l.color += weight * item.color;
        l.weights += weight;
        behind = item.center.z > l.last;
        i++;
    }
    bool done = behind || i >= end;
    counts[kept] = done ? KEPT_END : KEPT_GOING;
    counts[kept + 1u] = i - begin;
    return done;
}

/* Where it is entered and left. In a function of its own: glslang follows what is precise back through a loop without
 * end. */
vec2 chord_of(float middle, float half_chord)
{
    precise vec2 events = vec2(middle - half_chord, middle + half_chord);
    return events;
}

/* The largest radius of a list, or of all: what is far has larger ones than what is near. */
float find_reach(uint begin, uint end, soft_ray ray)
{
    float reach = 0.0;
    uint last = min(end, begin + SPL_SOFT_ROUNDS / 16u);
    for (uint i = begin; i < last; i++)
        reach = max(reach, load_item(i, ray).radius);
    return last < end ? job.reach : reach * (1.0 + SPL_SOFT_SLACK);
}

/* Rounds that an invocation may take: shells are rounds, too, and no sphere of the list has more of them. */
uint most_rounds(uint begin, soft_ray ray)
{
    uint rounds = SPL_SOFT_ROUNDS;
    if (MODEL == SPL_SOFT_CONCENTRIC) {
        float shells = soft_shells(job.reach, load_item(begin, ray).center.z);
        rounds /= 1u + (uint(shells) + 1u) * (BORDER != 0u ? 2u : 1u);
    }
    return rounds;
}

/* From event to event; true where it comes to its end, or to that of the window. */
bool see_stretches(inout walk w, soft_ray ray, uint begin, uint end, inout float reached, float until, uint kept)
{
    float root = sqrt(ray.inverse), stretched = 1.0 / root;
    float t = reached, next = until, before = 0.0, after = 0.0, was_after = 0.0, weights = 0.0, was_weights = 1.0;
    vec3 color = vec3(0.0), was_color = vec3(0.0);
    bool fresh = true, going = true, done = false;
    float largest = find_reach(begin, end, ray);
    uint most = most_rounds(begin, ray), was = counts[kept];
    uint met[SPL_SOFT_MET], count = 0u, k = 0u, alive = 0u; /* entries; those of this walk that are not over */
    /* Of the list: all before are met or missed; the next; where to begin. */
    uint tail = begin, i = begin, first = begin;
    bool meets = true;
    if (was != KEPT_NOTHING) {
        fresh = was == KEPT_FRESH;
        i += counts[kept + 1u];
        first += counts[kept + 2u];
        meets = i == first;
        tail = i;
        t = kept_float(kept + 3u);
        next = kept_float(kept + 4u);
        before = kept_float(kept + 5u);
        after = kept_float(kept + 6u);
        was_after = kept_float(kept + 7u);
        weights = kept_float(kept + 8u);
        was_weights = kept_float(kept + 9u);
        color = vec3(kept_float(kept + 10u), kept_float(kept + 11u), kept_float(kept + 12u));
        was_color = vec3(kept_float(kept + 13u), kept_float(kept + 14u), kept_float(kept + 15u));
    }
    for (uint rounds = 0u; going; rounds++) {
        bool again = k < count;
        uint entry = again ? met[k] : min(i, end - 1u);
        soft_item item = load_item(entry, ray);
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
        float reach = largest + SPL_SOFT_SLACK * item.center.z; /* rounded events must not be beyond it */
        bool stays = hit && leaves > t, follows = !again && meets && i == tail && i < end;
        bool keeps = stays && (again || (follows && count < SPL_SOFT_MET));
        if (keeps)
            met[alive] = entry;
        alive += keeps ? 1u : 0u;
        tail += follows && (keeps || !stays) ? 1u : 0u;
        i += again ? 0u : 1u;
        k++;
        count = k < count ? count : alive;
        k = k < count ? k : count;
        if (k == count && (i >= end || item.center.z - reach > next)) {
            if (!fresh)
                hide(w, before - was_after, was_color / max(was_weights, 1e-12));
            reached = t;
            done = t >= until || w.clear < SPL_SOFT_CLEAR_LEAST || next >= job.until;
            was_after = after;
            was_color = color;
            was_weights = weights;
            before = 0.0;
            after = 0.0;
            weights = 0.0;
            color = vec3(0.0);
            t = next;
            next = until;
            if (!meets)
                tail = first;
            meets = true;
            i = tail;
            k = 0u;
            alive = 0u;
            fresh = false;
        }
        going = !done && rounds < most;
    }
    counts[kept] = done ? KEPT_END : fresh ? KEPT_FRESH : KEPT_GOING;
    if (!done) {
        counts[kept + 1u] = (k < count ? met[k] : i) - begin;
        counts[kept + 2u] = (!meets ? first : count > 0u ? met[0] : min(tail, i)) - begin;
        keep_float(kept + 3u, t);
        keep_float(kept + 4u, next);
        keep_float(kept + 5u, before);
        keep_float(kept + 6u, after);
        keep_float(kept + 7u, was_after);
        keep_float(kept + 8u, weights);
        keep_float(kept + 9u, was_weights);
        for (uint c = 0u; c < 3u; c++) {
            keep_float(kept + 10u + c, color[c]);
            keep_float(kept + 13u + c, was_color[c]);
        }
    }
    return done;
}

void main()
{
    load_frame();
    load_step();
    const uint lanes = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS;
    uint id = gl_GlobalInvocationID.x, slot = id / lanes, lane = id % lanes;
    bool has = slot < job.count;
    soft_list list = load_list(has ? slot : 0u);
    uint begin = list.begin, end = list.end;
    ivec2 at = list.corner + ivec2(lane % SPL_SOFT_TILE, lane / SPL_SOFT_TILE);
    has = has && uint(at.x) < frame.width && uint(at.y) < frame.height;
    uint kept = job.progress + 1u + SPL_SOFT_KEPT_WORDS * id;
    if (!has || counts[kept] == KEPT_END)
        return;
    uint index = sample_index(at), own = SPL_SOFT_STATE_WORDS * index, walked = SPL_SOFT_WALK_WORDS * index;
    uint solid = depth_word(index);
    float until = min(solid == SPL_NOTHING ? frame.far : uintBitsToFloat(solid), frame.far);
    soft_ray ray = load_soft_ray(at + tile_corner());
    vec2 kept_walk = uintBitsToFloat(uvec2(walks[walked], walks[walked + 1u]));
    uvec4 kept_state = uvec4(state[own], state[own + 1u], state[own + 2u], state[own + 3u]);
    walk w;
    bool done = true;
    if (MODEL == SPL_SOFT_LAYER) {
        layer l;
        l.color = uintBitsToFloat(kept_state.xyz);
        l.weights = kept_walk.y;
        l.last = kept_walk.x > 0.0 ? kept_walk.x : until;
        done = see_layer(l, ray, begin, end, kept);
        kept_walk = vec2(l.last, l.weights);
        kept_state.xyz = floatBitsToUint(l.color);
        w.sums = uvec3(0u);
        w.clear = SPL_SOFT_CLEAR;
        w.depth = 0.0;
        if (done && job.ends != 0u) {
            if (l.weights > 0.0)
                hide(w, job.depth, l.color / l.weights);
            kept_state = uvec4(w.sums, SPL_SOFT_CLEAR - w.clear);
        }
    } else {
        float reached = max(kept_walk.x, frame.near);
        w.sums = kept_state.xyz;
        w.clear = SPL_SOFT_CLEAR - kept_state.w;
        w.depth = kept_walk.y;
        if (begin < end && reached < until && w.clear >= SPL_SOFT_CLEAR_LEAST)
            done = see_stretches(w, ray, begin, end, reached, until, kept);
        kept_walk = vec2(reached, w.depth);
        kept_state = uvec4(w.sums, SPL_SOFT_CLEAR - w.clear);
    }
    if (!done)
        atomicOr(counts[job.progress], 1u);
    walks[walked] = floatBitsToUint(kept_walk.x);
    walks[walked + 1u] = floatBitsToUint(kept_walk.y);
    state[own] = kept_state.x;
    state[own + 1u] = kept_state.y;
    state[own + 2u] = kept_state.z;
    state[own + 3u] = kept_state.w;
}
