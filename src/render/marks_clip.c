/* Chunks against a view's clip: conditions, all of which hold for what is drawn; each of terms, or lists of which none
 * holds, any of which makes it hold (splatd/terms.h). What a chunk's header and its box decide is decided here; what is
 * left becomes tests of each splat, and of shapes that cut its discs and panels a few words for each sample.
 *
 * Discs and panels are cut by asking where a sample lies. So of a condition that has attributes and shapes, both open,
 * a splat's mark has a bit that says whether its attributes make it hold (shared.h). Pure functions; any thread. */
#include <string.h>

#include "render/marks.h"

/* The terms [first, end) of a condition, and what of them is open. */
struct condition {
    uint32_t first, end;
    enum spl_marks_verdict of[SPL_TERMS_MAX]; /* by term */
    enum spl_marks_verdict values;            /* what its attributes say of it */
    bool open_values, open_shapes;
};

static uint32_t end_of(const struct spl_marks *clip, uint32_t first, bool of_list)
{
    uint32_t end = first + 1;
    while (end < clip->count &&
           (of_list ? clip->terms[end].joint == SPL_TERM_ITEM : clip->terms[end].joint != SPL_TERM_AND))
        end++;
    return end;
}

/* Of a list, or a term alone; where it is not open its terms are none. Clips blend nothing. */
static enum spl_marks_verdict fold(const struct spl_marks *clip, struct condition *c, uint32_t first, uint32_t end)
{
    enum spl_marks_verdict verdict = SPL_VERDICT_NONE;
    for (uint32_t t = first; t < end; t++)
        verdict = c->of[t] > verdict ? c->of[t] : verdict;
    verdict = verdict == SPL_VERDICT_BLENDED ? SPL_VERDICT_ALL : verdict;
    if (clip->terms[first].outside && verdict != SPL_VERDICT_SOME)
        verdict = verdict == SPL_VERDICT_NONE ? SPL_VERDICT_ALL : SPL_VERDICT_NONE;
    for (uint32_t t = first; t < end && verdict != SPL_VERDICT_SOME; t++)
        c->of[t] = SPL_VERDICT_NONE;
    return verdict;
}

/* Vertices of lines have no values: lists of attributes say nothing of them, not even by what they leave out. */
static enum spl_marks_verdict pass_over(struct condition *c, uint32_t first, uint32_t end)
{
    for (uint32_t t = first; t < end; t++)
        c->of[t] = SPL_VERDICT_NONE;
    return SPL_VERDICT_NONE;
}

/* What the condition says, given what each of its terms does; of a chunk of `lines`, what its shapes do. */
static enum spl_marks_verdict decide(const struct spl_marks *clip, struct condition *c, bool lines)
{
    enum spl_marks_verdict whole = SPL_VERDICT_NONE;
    c->values = SPL_VERDICT_NONE;
    c->open_values = c->open_shapes = false;
    for (uint32_t t = c->first, end; t < c->end; t = end) {
        end = end_of(clip, t, true);
        const bool value = clip->terms[t].stream >= 0;
        const enum spl_marks_verdict own = value && lines ? pass_over(c, t, end) : fold(clip, c, t, end);
        whole = own > whole ? own : whole;
        c->values = value && own > c->values ? own : c->values;
        if (own == SPL_VERDICT_SOME)
            *(value ? &c->open_values : &c->open_shapes) = true;
    }
    return whole;
}

/* How term `t` is joined to what is open before it in its condition, of which `first` says whether there is nothing. */
static uint32_t flags_of(const struct spl_marks *clip, uint32_t t, uint32_t before, bool first)
{
    bool of_list = false; /* the one before is an item of the same */
    for (uint32_t i = before + 1; !first && i <= t; i++)
        of_list =
            i == before + 1 ? clip->terms[i].joint == SPL_TERM_ITEM : of_list && clip->terms[i].joint == SPL_TERM_ITEM;
    return (first ? SPL_TEST_AND : of_list ? 0 : SPL_TEST_OR) | (clip->terms[t].outside ? SPL_TEST_OUTSIDE : 0);
}

/* Puts the open terms of a condition, or its attributes alone, behind the `count` tests of `out`. */
static uint32_t put_tests(const struct spl_marks *clip, const struct condition *c, const uint32_t *tests, bool values,
                          uint32_t bit, uint32_t *out, uint32_t count)
{
    uint32_t before = c->first;
    bool first = true;
    for (uint32_t t = c->first; t < c->end; t++) {
        if (c->of[t] != SPL_VERDICT_SOME || (values && clip->terms[t].stream < 0))
            continue;
        uint32_t *to = out + SPL_TEST_WORDS * count++;
        memcpy(to, tests + SPL_TEST_WORDS * t, SPL_TEST_WORDS * sizeof *to);
        to[0] |= flags_of(clip, t, before, first) | bit << SPL_TEST_BIT;
        before = t;
        first = false;
    }
    return count;
}

void spl_clip_judge(const struct spl_marks *clip, const struct spl_marks_view *view, const struct spl_tables *tables,
                    uint32_t index, const struct spl_view_box *box, struct spl_clip_chunk *out)
{
    uint32_t tests[SPL_TEST_WORDS * SPL_TERMS_MAX];
    const bool lines = spl_chunk_kind(&tables->chunks[index]) == SPL_CHUNK_LINES;
    struct condition c;
    out->dropped = false;
    out->of_lines = true;
    out->cut = out->at_center = out->by_value = 0;
    for (c.first = 0; c.first < clip->count; c.first = c.end) {
        bool values = false, shapes = false;
        c.end = end_of(clip, c.first, false);
        for (uint32_t t = c.first; t < c.end; t++) {
            c.of[t] = spl_marks_judge_term(clip, t, view, tables, index, box, tests + SPL_TEST_WORDS * t);
            values |= clip->terms[t].stream >= 0;
            shapes |= clip->terms[t].stream < 0;
        }
        if (lines && !shapes) /* it leaves all splats that they stand for, or they would not be drawn */
            continue;
        const enum spl_marks_verdict whole = decide(clip, &c, lines);
        /* Lines have no attributes: where these decide, whole or in part, splats are drawn instead of them. */
        if (values && (shapes ? c.values != SPL_VERDICT_NONE : whole != SPL_VERDICT_ALL))
            out->of_lines = false;
        if (whole == SPL_VERDICT_NONE)
            out->dropped = true;
        if (whole != SPL_VERDICT_SOME)
            continue;
        out->at_center = put_tests(clip, &c, tests, false, 0, out->center_tests, out->at_center);
        if (c.open_values)
            out->by_value = put_tests(clip, &c, tests, true, c.open_shapes ? clip->terms[c.first].mixed : 0,
                                      out->value_tests, out->by_value);
        for (uint32_t t = c.first; t < c.end; t++)
            if (c.of[t] == SPL_VERDICT_SOME && clip->terms[t].stream < 0)
                out->cut |= 1u << t;
    }
}

bool spl_clip_drops_box(const struct spl_marks *clip, const struct spl_marks_view *view, const struct spl_view_box *box)
{
    uint32_t test[SPL_TEST_WORDS];
    struct condition c;
    for (c.first = 0; c.first < clip->count; c.first = c.end) {
        c.end = end_of(clip, c.first, false);
        for (uint32_t t = c.first; t < c.end; t++)
            c.of[t] = clip->terms[t].stream >= 0 ? SPL_VERDICT_SOME : spl_marks_judge_shape(clip, t, view, box, test);
        if (decide(clip, &c, false) == SPL_VERDICT_NONE)
            return true;
    }
    return false;
}

uint32_t spl_clip_write_cut(const struct spl_marks *clip, const struct spl_marks_view *view, uint32_t cut,
                            uint32_t words[SPL_CLIP_CUT_WORDS])
{
    uint32_t count = 0;
    for (uint32_t first = 0, end; first < clip->count; first = end) {
        uint32_t before = first;
        bool begins = true;
        end = end_of(clip, first, false);
        for (uint32_t t = first; t < end; t++) {
            if (!(cut >> t & 1))
                continue;
            words[1 + 2 * count] = view->shapes[t].word;
            words[2 + 2 * count++] = flags_of(clip, t, before, begins) | clip->terms[t].mixed << SPL_TEST_BIT;
            before = t;
            begins = false;
        }
    }
    words[0] = count;
    return 1 + 2 * count;
}

uint32_t spl_clip_get_kinds(const struct spl_marks *clip, uint32_t cut)
{
    uint32_t kinds = 0;
    for (uint32_t t = 0; t < clip->count; t++)
        if (cut >> t & 1)
            kinds |= clip->terms[t].measure == SPL_TERM_PLANE || clip->terms[t].measure == SPL_TERM_COORDINATE
                         ? SPL_CUT_PLANES
                         : SPL_CUT_PLANES | SPL_CUT_BODIES;
    return kinds;
}
