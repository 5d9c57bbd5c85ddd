/* Chunks against terms; see marks.h. A chunk's header has the base and the width of its codes, so the numbers that it
 * may have are a range, modulo 2^32 as codes decode; its box bounds distances to shapes. What that leaves open becomes
 * a test. W of eq. 22 is computed here and in soft_mark.comp by the same products of floats.
 *
 * A test (SPL_TEST_*): of numbers a code is soft where code + start, modulo 2^32, is at most the span; of few codes
 * there is a table of marks; of a shape its words say where it lies. Pure functions; any thread. */
#include "render/marks.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/float.h"
#include "dataset/chunk.h"
#include "render/terms.h"

static float share_at(const struct spl_marks_term *term, uint32_t past)
{
    const uint32_t above = past >> term->shift, below = (term->span - past) >> term->shift;
    const float low = term->share_low + (float)(above < SPL_TEST_EXACT ? above : SPL_TEST_EXACT) * term->share_step;
    const float high =
        term->share_high + (float)(below < SPL_TEST_EXACT ? below : SPL_TEST_EXACT) * term->share_step_high;
    return fminf(fminf(low, high), 1);
}

static uint32_t mark_of(float share)
{
    return 1 + (uint32_t)(share * SPL_MARK_MOST + 0.5f);
}

/* The codes 0..last of a chunk as numbers, against those that the term takes. A header does not say whether any splat
 * has the last code of steps, that of no value; a dataset does whose values are as many as its splats. */
static enum spl_marks_verdict judge_numbers(const struct spl_marks_term *term, enum spl_stream_type type,
                                  struct spl_stream_code code, uint32_t *test)
{
    const uint64_t last = (1ull << code.width) - 1; /* of values that there may be */
    const bool none = type == SPL_STREAM_STEPS && code.width;
    const uint32_t start = code.base - term->low;
    if (!term->any)
        return SPL_VERDICT_NONE;
    const uint64_t most = none ? last - 1 : last;
    /* code c is soft where (start + c) mod 2^32 <= span: the first such code, if any, is 0 or that where it wraps */
    if (start > term->span && most < (1ull << 32) - start)
        return SPL_VERDICT_NONE;
    test[0] = SPL_TEST_NUMBERS;
    test[2] = code.width | (none ? SPL_TEST_LAST_NONE : 0);
    test[3] = start;
    test[4] = term->span;
    test[5] = term->shift;
    test[6] = spl_float_to_bits(term->share_low);
    test[7] = spl_float_to_bits(term->share_step);
    test[8] = spl_float_to_bits(term->share_high);
    test[9] = spl_float_to_bits(term->share_step_high);
    if (start > term->span || most > term->span - start || (none && !term->complete))
        return SPL_VERDICT_SOME;
    return share_at(term, start) >= 1 && share_at(term, start + (uint32_t)most) >= 1 ? SPL_VERDICT_ALL
                                                                                     : SPL_VERDICT_BLENDED;
}

/* Each of a chunk's few codes has its mark. */
static enum spl_marks_verdict judge_table(const struct spl_marks_term *term, const struct spl_stream *stream,
                                struct spl_stream_code code, uint32_t *test)
{
    enum { codes_max = 32 };
    const uint32_t codes = 1u << (code.width < 5 ? code.width : 5);
    uint32_t soft = 0, whole = 0;
    memset(test, 0, SPL_TEST_WORDS * sizeof *test);
    test[0] = SPL_TEST_TABLE;
    test[2] = code.width;
    for (uint32_t c = 0; c < codes && c < codes_max; c++) {
        const double value = spl_stream_decode(stream, code, (const uint32_t[2]){c, 0}, 0);
        if (!(value > term->least || (term->with_least && value == term->least)) ||
            !(value < term->most || (term->with_most && value == term->most)))
            continue;
        double share = 1;
        if (isfinite(term->least) && term->blend_least > 0)
            share = fmin(share, (value - term->least) / term->blend_least);
        if (isfinite(term->most) && term->blend_most > 0)
            share = fmin(share, (term->most - value) / term->blend_most);
        const uint32_t mark = mark_of((float)share);
        test[SPL_TEST_TABLE_WORD + c / 4] |= mark << 8 * (c % 4);
        soft++;
        whole += mark == SPL_MARK_WHOLE;
    }
    return !soft           ? SPL_VERDICT_NONE
           : soft < codes  ? SPL_VERDICT_SOME
           : whole < codes ? SPL_VERDICT_BLENDED
                           : SPL_VERDICT_ALL;
}

static double distance_to(const struct spl_marks_term *term, const struct spl_marks_view *view,
                          const struct spl_marks_shape *shape, const double p[3])
{
    double q[3];
    for (int i = 0; i < 3; i++) {
        const double *row = shape->rows + 4 * i;
        q[i] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
    }
    if (term->measure == SPL_TERM_AXIS)
        return hypot(q[0], q[1]);
    if (term->measure == SPL_TERM_PLANE || term->measure == SPL_TERM_COORDINATE)
        return q[2] + shape->base;
    if (term->measure == SPL_TERM_POLYGON) {
        const double across = spl_polygon_distance(view->corners[term->first_corner], term->corners, q);
        const double above = fabs(q[2]) - shape->half[2];
        return hypot(fmax(across, 0), fmax(above, 0)) + fmin(fmax(across, above), 0);
    }
    double outside[3], inside = -INFINITY;
    for (int i = 0; i < 3; i++) {
        double beyond = fabs(q[i]) - shape->half[i];
        outside[i] = fmax(beyond, 0);
        inside = fmax(inside, beyond);
    }
    return hypot(hypot(outside[0], outside[1]), outside[2]) + fmin(inside, 0);
}

/* Distances change by no more than one goes, of planes along their normal; and kernels round in floats. */
enum spl_marks_verdict spl_marks_judge_shape(const struct spl_marks *marks, uint32_t index,
                                             const struct spl_marks_view *view, const struct spl_view_box *box,
                                             uint32_t test[SPL_TEST_WORDS])
{
    const struct spl_marks_term *term = &marks->terms[index];
    const struct spl_marks_shape *shape = &view->shapes[index];
    const double *h = box->half, *c = box->center, *n = shape->rows + 8;
    double reach = hypot(hypot(h[0], h[1]), h[2]), middle = distance_to(term, view, shape, c), largest = 0;
    for (int i = 0; i < 3; i++)
        largest += fabs(shape->rows[4 * i + 3]) + fabs(c[i]) + h[i] + (isfinite(shape->half[i]) ? shape->half[i] : 0);
    if (term->measure == SPL_TERM_PLANE || term->measure == SPL_TERM_COORDINATE)
        reach = fabs(n[0]) * h[0] + fabs(n[1]) * h[1] + fabs(n[2]) * h[2];
    reach += 4e-6 * largest;
    test[0] = SPL_TEST_SHAPE;
    test[1] = shape->word;
    const double low = middle - reach, high = middle + reach;
    if (high < term->least || low > term->most)
        return SPL_VERDICT_NONE;
    if (!(low > term->least && high < term->most))
        return SPL_VERDICT_SOME;
    return low - term->least > term->blend_least && term->most - high > term->blend_most ? SPL_VERDICT_ALL
                                                                                         : SPL_VERDICT_BLENDED;
}

enum spl_marks_verdict spl_marks_judge_term(const struct spl_marks *marks, uint32_t index,
                                            const struct spl_marks_view *view, const struct spl_tables *tables,
                                            uint32_t chunk_index, const struct spl_view_box *box,
                                            uint32_t test[SPL_TEST_WORDS])
{
    const struct spl_marks_term *term = &marks->terms[index];
    if (term->stream < 0)
        return spl_marks_judge_shape(marks, index, view, box, test);
    const struct spl_chunk *chunk = &tables->chunks[chunk_index];
    const uint32_t s = (uint32_t)term->stream;
    const struct spl_stream_code code = {tables->base[s][chunk_index], tables->width[s][chunk_index]};
    enum spl_stream_type type = spl_stream_type_from_name(marks->streams[s].type);
    enum spl_marks_verdict verdict = spl_chunk_kind(chunk) == SPL_CHUNK_LINES ? SPL_VERDICT_NONE
                                     : type == SPL_STREAM_HALF_OCTAVES
                                         ? judge_table(term, &marks->streams[s], code, test)
                                         : judge_numbers(term, type, code, test);
    test[1] = chunk->geometry_word + spl_chunk_words(chunk) + spl_tables_get_stream_words(tables, s, chunk_index);
    return verdict;
}

/* What is in none of a list's items is soft, at once: W is not theirs. */
static enum spl_marks_verdict turn_around(enum spl_marks_verdict verdict)
{
    return verdict == SPL_VERDICT_NONE ? SPL_VERDICT_ALL : verdict == SPL_VERDICT_SOME ? SPL_VERDICT_SOME
                                                                                      : SPL_VERDICT_NONE;
}

void spl_marks_judge(const struct spl_marks *marks, const struct spl_marks_view *view, const struct spl_tables *tables,
                     uint32_t index, const struct spl_view_box *box, struct spl_marks_chunk *out)
{
    enum spl_marks_verdict whole = SPL_VERDICT_NONE;
    uint32_t count = 0;
    out->by_cells = false;
    for (uint32_t i = 0, end; i < marks->count && whole < SPL_VERDICT_ALL; i = end) {
        const bool outside = marks->terms[i].outside; /* of all its items, which are as one; others are one each */
        enum spl_marks_verdict verdict = SPL_VERDICT_NONE;
        const uint32_t first = count;
        end = i;
        do {
            const struct spl_marks_term *term = &marks->terms[end];
            uint32_t *test = out->tests + 1 + SPL_TEST_WORDS * count;
            enum spl_marks_verdict own = spl_marks_judge_term(marks, end, view, tables, index, box, test);
            const bool open = own == SPL_VERDICT_SOME || (own == SPL_VERDICT_BLENDED && !outside);
            if (open && outside)
                test[0] |= SPL_TEST_OUTSIDE | (count == first ? SPL_TEST_OR : 0);
            out->by_cells |= open && term->stream < 0;
            count += open;
            verdict = own > verdict ? own : verdict;
        } while (++end < marks->count && outside && marks->terms[end].joint == SPL_TERM_ITEM);
        verdict = outside ? turn_around(verdict) : verdict;
        if (outside && verdict != SPL_VERDICT_SOME)
            count = first;
        whole = verdict > whole ? verdict : whole;
    }
    out->solid = whole < SPL_VERDICT_BLENDED;
    out->soft = whole > SPL_VERDICT_NONE;
    out->test_words = whole == SPL_VERDICT_SOME || whole == SPL_VERDICT_BLENDED ? 1 + SPL_TEST_WORDS * count : 0;
    out->by_cells &= out->test_words > 0;
    out->tests[0] = count;
}

/* Two unit vectors across `n`, a unit one. */
static void across(const double n[3], double u[3], double v[3])
{
    int least = fabs(n[0]) < fabs(n[1]) ? (fabs(n[0]) < fabs(n[2]) ? 0 : 2) : fabs(n[1]) < fabs(n[2]) ? 1 : 2;
    double axis[3] = {least == 0, least == 1, least == 2}, dot = n[least], length = sqrt(1 - dot * dot);
    for (int i = 0; i < 3; i++)
        u[i] = (axis[i] - dot * n[i]) / length;
    for (int i = 0; i < 3; i++)
        v[i] = n[(i + 1) % 3] * u[(i + 2) % 3] - n[(i + 2) % 3] * u[(i + 1) % 3];
}

/* The axes of a box that is turned, as rows. */
static void turn_axes(const double degrees[3], double axes[9])
{
    double c[3], s[3];
    for (int i = 0; i < 3; i++) {
        const double quarter = remainder(degrees[i], 360) / 90; /* quarters are exact */
        const double angle = degrees[i] * (3.14159265358979323846 / 180);
        c[i] = quarter == floor(quarter) ? (fabs(quarter) == 2 ? -1 : quarter == 0) : cos(angle);
        s[i] = quarter == floor(quarter) ? (fabs(quarter) == 1 ? quarter : 0) : sin(angle);
    }
    const double z[2] = {c[0], s[0]}, y[2] = {c[1], s[1]}, x[2] = {c[2], s[2]};
    const double rows[9] = {z[0] * y[0],
                            z[1] * y[0],
                            -y[1],
                            z[0] * y[1] * x[1] - z[1] * x[0],
                            z[1] * y[1] * x[1] + z[0] * x[0],
                            y[0] * x[1],
                            z[0] * y[1] * x[0] + z[1] * x[1],
                            z[1] * y[1] * x[0] - z[0] * x[1],
                            y[0] * x[0]};
    memcpy(axes, rows, sizeof rows);
}

/* From where to where a shape reaches along a world axis: its middle, and half of it. Of an inside that is much larger
 * than the dataset only what lies around the dataset: from a middle far away floats would not tell where the near end
 * is. */
static void place_extent(const struct spl_marks *marks, const struct spl_marks_term *term, int axis, double least,
                         double most, double *middle, double *half)
{
    const double low = fmax(least, marks->middle[axis] - 2 * marks->reach),
                 high = fmin(most, marks->middle[axis] + 2 * marks->reach);
    if (term->least == -INFINITY && term->most == 0 && most - least > 8 * marks->reach && low < high) {
        least = low;
        most = high;
    }
    *middle = least + (most - least) / 2;
    *half = (most - least) / 2;
}

/* The middle of a polygon, how far it reaches from there, and its corners from there. */
static void place_polygon(const struct spl_marks *marks, const struct spl_marks_term *term, struct spl_marks_view *view,
                          double middle[3], double half[3])
{
    const double *corners = marks->corners[term->first_corner];
    for (int a = 0; a < 2; a++) {
        double least = INFINITY, most = -INFINITY;
        for (uint32_t i = 0; i < term->corners; i++) {
            least = fmin(least, corners[2 * i + (uint32_t)a]);
            most = fmax(most, corners[2 * i + (uint32_t)a]);
        }
        middle[a] = least + (most - least) / 2;
        half[a] = (most - least) / 2;
        for (uint32_t i = 0; i < term->corners; i++)
            view->corners[term->first_corner + i][a] = corners[2 * i + (uint32_t)a] - middle[a];
    }
    middle[2] = 0;
    half[2] = INFINITY;
    if (isfinite(term->shape[0]))
        place_extent(marks, term, 2, term->shape[0], term->shape[1], &middle[2], &half[2]);
}

/* The shape's axes and its middle, world; of a box how far it reaches from there; of a coordinate `base`, which is at
 * one of its ends, so that floats have what lies around it. */
static void place_shape(const struct spl_marks *marks, const struct spl_marks_term *term,
                        const struct spl_camera *camera, struct spl_marks_view *view, struct spl_marks_shape *shape,
                        double axes[9], double middle[3])
{
    const double *s = term->shape;
    for (int i = 0; i < 9; i++)
        axes[i] = i % 4 == 0;
    const bool turned = s[6] || s[7] || s[8];
    for (int i = 0; i < 3; i++) {
        middle[i] = term->measure == SPL_TERM_BOX ? s[i] + (s[i + 3] - s[i]) / 2 : s[i];
        shape->half[i] = term->measure == SPL_TERM_BOX ? (s[i + 3] - s[i]) / 2 : 0;
        if (term->measure == SPL_TERM_BOX && !turned) /* others turn around their own middle */
            place_extent(marks, term, i, s[i], s[i + 3], &middle[i], &shape->half[i]);
    }
    if (term->measure == SPL_TERM_POLYGON) {
        place_polygon(marks, term, view, middle, shape->half);
        return;
    }
    if (term->measure == SPL_TERM_BOX) {
        if (turned)
            turn_axes(s + 6, axes);
        return;
    }
    const double length = hypot(hypot(s[3], s[4]), s[5]);
    for (int i = 0; i < 3; i++)
        axes[6 + i] = s[3 + i] / length;
    across(axes + 6, axes, axes + 3);
    if (term->measure == SPL_TERM_COORDINATE) {
        shape->base = isfinite(term->least) ? term->least : isfinite(term->most) ? term->most : 0;
        for (int i = 0; i < 3; i++)
            middle[i] = s[3 + i] ? shape->base : camera->eye[i];
    }
}

static uint32_t float_word(double value)
{
    return spl_float_to_bits((float)fmax(fmin(value, FLT_MAX), -FLT_MAX));
}

static uint32_t kind_of(const struct spl_marks_term *term)
{
    switch (term->measure) {
    case SPL_TERM_AXIS:
        return SPL_SHAPE_AXIS;
    case SPL_TERM_BOX:
        return SPL_SHAPE_BOX;
    case SPL_TERM_POLYGON:
        return SPL_SHAPE_POLYGON;
    default:
        return SPL_SHAPE_PLANE;
    }
}

uint32_t spl_marks_see(const struct spl_marks *marks, const struct spl_camera *camera, uint32_t first_word,
                       struct spl_marks_view *view, uint32_t words[SPL_MARKS_SHAPES_MAX])
{
    uint32_t used = 0;
    for (uint32_t t = 0; t < marks->count; t++) {
        const struct spl_marks_term *term = &marks->terms[t];
        struct spl_marks_shape *shape = &view->shapes[t];
        double axes[9], middle[3];
        if (term->stream >= 0)
            continue;
        *shape = (struct spl_marks_shape){.word = first_word + used};
        place_shape(marks, term, camera, view, shape, axes, middle);
        for (int i = 0; i < 3; i++) {
            const double *a = axes + 3 * i;
            for (int c = 0; c < 3; c++) { /* the axis, turned as the camera is; from the eye to the middle */
                const double *r = camera->rotation + 3 * c;
                shape->rows[4 * i + c] = a[0] * r[0] + a[1] * r[1] + a[2] * r[2];
                shape->rows[4 * i + 3] += a[c] * (camera->eye[c] - middle[c]);
            }
        }
        uint32_t *out = words + used;
        for (int i = 0; i < 12; i++)
            out[i] = float_word(shape->rows[i]);
        for (int i = 0; i < 3; i++)
            out[SPL_SHAPE_HALF + (uint32_t)i] = float_word(shape->half[i]);
        const bool blends[2] = {term->blend_least > 0 && isfinite(term->least),
                                term->blend_most > 0 && isfinite(term->most)};
        out[SPL_SHAPE_LEAST] = float_word(term->least - shape->base);
        out[SPL_SHAPE_MOST] = float_word(term->most - shape->base);
        out[SPL_SHAPE_RISE] = float_word(blends[0] ? 1 / term->blend_least : 0);
        out[SPL_SHAPE_RISE + 1] = float_word(blends[1] ? 1 / term->blend_most : 0);
        out[SPL_SHAPE_FLAGS] = kind_of(term) | (term->with_least ? SPL_SHAPE_WITH_LEAST : 0) |
                               (term->with_most ? SPL_SHAPE_WITH_MOST : 0);
        used += SPL_MARKS_SHAPE_WORDS;
        if (term->measure != SPL_TERM_POLYGON)
            continue;
        out[SPL_SHAPE_HALF] = term->corners;
        for (uint32_t i = 0; i < 2 * term->corners; i++)
            words[used++] = float_word(view->corners[term->first_corner + i / 2][i % 2]);
    }
    return used;
}
