/* Marks of splats, or with SPL_CELL_LANES of the cells of panels: which of them are soft, and which are drawn at all,
 * by the tests that the host made of a chunk (src/render/marks.c), which begin where its `texture` says. An invocation
 * makes a word of four, so that none is written twice: SPL_LANES make those of a run of splats, SPL_CELL_LANES two
 * words each of a panel. Whole numbers, and floats by rounded products and sums alone, so that every driver marks the
 * same. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/splat.glsl"
#include "common/terms.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint KINDS = 7; /* bit per kind of test that the tile has: the others cost nothing */

const bool SHAPES = (KINDS >> SPL_TEST_SHAPE & 1u) != 0u, TABLES = (KINDS >> SPL_TEST_TABLE & 1u) != 0u;
const bool NUMBERS = (KINDS >> SPL_TEST_NUMBERS & 1u) != 0u;
const bool CLIPS = (KINDS >> SPL_TESTS_HAVE_CLIP & 1u) != 0u, POLYGONS = (KINDS >> SPL_TESTS_HAVE_POLYGON & 1u) != 0u;

layout(std430, binding = SPL_STORAGE_MARKS) writeonly buffer mark_buffer { uint marks[]; };
/* Of W of eq. 22. */
uint mark_of(float share)
{
    precise float scaled = min(share, 1.0) * float(SPL_MARK_MOST) + 0.5;
    return 1u + uint(scaled);
}

uint test_numbers(uint at, uint code, uint width, bool last_none)
{
    uint past = code + test_word(at + 3u), span = test_word(at + 4u), shift = test_word(at + 5u);
    bool none = last_none && code == 0xffffffffu >> (32u - width);
    precise float low = test_float(at + 6u) + float(min(past >> shift, SPL_TEST_EXACT)) * test_float(at + 7u);
    precise float high = test_float(at + 8u) + float(min((span - past) >> shift, SPL_TEST_EXACT)) * test_float(at + 9u);
    return none || past > span ? 0u : mark_of(min(low, high));
}

uint test_shape(uint at, vec3 p)
{
    uint flags = test_word(at + SPL_SHAPE_FLAGS);
    float distance = distance_to(at, SPL_SHAPE_KIND(flags), p, true, POLYGONS);
    float least = test_float(at + SPL_SHAPE_LEAST), most = test_float(at + SPL_SHAPE_MOST);
    float rise = test_float(at + SPL_SHAPE_RISE), fall = test_float(at + (SPL_SHAPE_RISE + 1u));
    precise float low = (distance - least) * rise, high = (most - distance) * fall;
    return is_within(at, flags, distance) ? mark_of(min(rise > 0.0 ? low : 1.0, fall > 0.0 ? high : 1.0)) : 0u;
}

/* What the test at word `at` makes of item `index`, splat or panel, whose splat or cell lies at `p`. */
uint make_test(uint at, uint index, vec3 p)
{
    uint kind = test_word(at) & 255u, word = test_word(at + 1u), packed_width = test_word(at + 2u);
    uint width = packed_width & (SPL_TEST_LAST_NONE - 1u), own = 0u;
    if (SHAPES && kind == SPL_TEST_SHAPE)
        return test_shape(word, p);
    if (TABLES || NUMBERS) {
        uint code = load_code(word, width, index);
        if (TABLES && kind == SPL_TEST_TABLE)
            own = test_word(at + SPL_TEST_TABLE_WORD + (code & 31u) / 4u) >> 8u * (code & 3u) & 255u;
        else if (NUMBERS)
            own = test_numbers(at, code, width, (packed_width & SPL_TEST_LAST_NONE) != 0u);
    }
    return own;
}

uint turn_around(uint mark)
{
    return mark == 0u ? SPL_MARK_WHOLE : 0u;
}

/* Of what is soft: the largest mark of the tests, of which any makes it soft; `at` goes on to behind them. What is
 * outside a list is so by all of its tests. */
uint make_soft_mark(inout uint at, uint count, uint index, vec3 p)
{
    uint mark = 0u, listed = SPL_MARK_WHOLE; /* of a list that is not done: inverted, nothing */
    for (uint t = 0u; t < count; t++) {
        uint flags = test_word(at), own = make_test(at, index, p);
        bool outside = (flags & SPL_TEST_OUTSIDE) != 0u;
        if (!outside || (flags & SPL_TEST_OR) != 0u) {
            mark = max(mark, turn_around(listed));
            listed = outside ? 0u : SPL_MARK_WHOLE;
        }
        listed = outside ? max(listed, own) : listed;
        mark = outside ? mark : max(mark, own);
        at += SPL_TEST_WORDS;
    }
    return max(mark, turn_around(listed));
}

/* The mark of item `index`, whose splat or cell lies at `p`. */
uint make_mark(spl_draw_chunk chunk, uint index, vec3 p)
{
    uint head = test_word(chunk.texture), at = chunk.texture + 1u, mode = head >> SPL_TESTS_MODE;
    uint mark = make_soft_mark(at, head & 255u, index, p);
    if (!CLIPS || mode == SPL_TESTS_SOFT)
        return mark;
    uint count = head >> SPL_TESTS_CLIP & 255u;
    term_fold f = begin_fold();
    for (uint t = 0u; t < count; t++) {
        fold_test(f, test_word(at), make_test(at, index, p) != 0u, false);
        at += SPL_TEST_WORDS;
    }
    end_condition(f);
    if (mode == SPL_TESTS_OF_SOLID)
        return mark != 0u || !f.all ? SPL_MARK_WHOLE : f.bits;
    return !f.all ? 0u : mode == SPL_TESTS_OF_SOFT ? mark : SPL_MARK_WHOLE;
}

#ifdef SPL_CELL_LANES
#define UNKNOWN 256u

/* The mark that all cells of the panel have, which lie within `reach` of `p`, or UNKNOWN: distances change by no more
 * than one goes, and what floats may be off is left to the cells. Its codes are the same for all of them. */
uint make_panel_mark(spl_draw_chunk chunk, uint index, vec3 p, float reach)
{
    uint first = chunk.texture, count = test_word(first), mark = 0u;
    if (count > 255u) /* what is drawn is asked of the cells */
        return UNKNOWN;
    for (uint t = 0u; t < count; t++) {
        uint at = test_word(first + 1u + t * SPL_TEST_WORDS + 1u), kind = test_word(first + 1u + t * SPL_TEST_WORDS);
        if (kind != SPL_TEST_SHAPE)
            return UNKNOWN;
        float far = abs(p.x) + abs(p.y) + abs(p.z);
        for (uint i = 0u; i < 3u; i++)
            far += abs(test_float(at + 4u * i + 3u)) + test_float(at + SPL_SHAPE_HALF + i);
        float distance = distance_to(at, SPL_SHAPE_KIND(test_word(at + SPL_SHAPE_FLAGS)), p, true, POLYGONS);
        float most = test_float(at + SPL_SHAPE_MOST);
        float above = distance - reach - 1e-5 * far - test_float(at + SPL_SHAPE_LEAST);
        float below = most - distance - reach - 1e-5 * far;
        float rise = test_float(at + SPL_SHAPE_RISE), fall = test_float(at + (SPL_SHAPE_RISE + 1u));
        bool none = above < -2.0 * (reach + 1e-5 * far) || below < -2.0 * (reach + 1e-5 * far);
        bool whole = above > 0.0 && below > 0.0 && (rise == 0.0 || above * rise > 1.001) &&
                     (fall == 0.0 || below * fall > 1.001);
        if (!none && !whole)
            return UNKNOWN;
        mark = max(mark, whole ? uint(SPL_MARK_WHOLE) : 0u);
    }
    return mark;
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    uint index = item_of(run.first), lane = run.first >> SPL_CELL, known = UNKNOWN;
#ifndef SPL_MESHES /* how far relief reaches is not known here */
    if (SHAPES && run.end > 0u) {
        float half_side = 0.5 * float(SPL_PANEL_SIDE);
        known = make_panel_mark(run.chunk, index, plane_point(own_plane, own_panel.first + half_side),
                                1.4143 * half_side * own_plane.cell);
    }
#endif
    for (uint word = run.end > 0u ? lane : SPL_MARKS_PANEL; word < SPL_MARKS_PANEL; word += SPL_CELL_LANES) {
        uint four = SHAPES ? 0u : make_mark(run.chunk, index, vec3(0.0)) * 0x01010101u; /* a panel has one code */
        if (known != UNKNOWN)
            four = known * 0x01010101u;
        for (uint i = SHAPES && known == UNKNOWN ? 0u : 4u; i < 4u; i++) {
            splat s = load_splat(run.chunk, index | (4u * word + i) << SPL_CELL, true);
            four |= make_mark(run.chunk, index, s.position) << 8u * i;
        }
        marks[run.chunk.marks + index * SPL_MARKS_PANEL + word] = four;
    }
}
#else
void main()
{
    load_frame();
    splat_run run = load_run_of(gl_GlobalInvocationID.x / SPL_LANES);
    uint word = run.first / 4u + gl_GlobalInvocationID.x % SPL_LANES, four = 0u;
    if (4u * word >= run.end)
        return;
    for (uint i = 0u; i < 4u; i++) {
        uint index = min(4u * word + i, run.end - 1u);
        vec3 p = SHAPES ? load_splat(run.chunk, index, true).position : vec3(0.0);
        four |= make_mark(run.chunk, index, p) << 8u * i;
    }
    marks[run.chunk.marks + word] = four;
}
#endif
