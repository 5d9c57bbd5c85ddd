/* The arithmetic of a plan. A line's value is what its terms make, one after the other, and what is printed later are
 * these same terms, so that no line says another sum than it was reckoned by. A figure at a size is the one measured at
 * the next size up; beyond the largest it grows with the pixels. Where a device lacks a figure its lines, and those
 * made of them, are not known. Owned by whoever calls; no state. */
#include "cmd/plan_model.h"

#include <math.h>
#include <stddef.h>

#include "base/error.h"

enum rounding { EXACT, UP, UP_ONE };

enum of_device { OF_cores, OF_memory, OF_paged, OF_resident, OF_COUNT };

enum family { RATE, JPEG, ENCODE, CACHED, FAMILIES };

static const struct spl_plan_figure_row figures[] = {
#define FIGURE(name, value, unit, width, height, what, where) {#name, value, unit, width, height, what, where},
#include "cmd/plan_figures.def"
#undef FIGURE
};

static const struct {
    struct spl_plan_device_row row;
    enum spl_plan_figure first, last, of[OF_COUNT];
} devices[] = {
#define DEVICE(name, units, what, first, last, cores, memory, paged, resident)                                         \
    {{#name, units, what},                                                                                             \
     SPL_PLAN_FIGURE_##first,                                                                                          \
     SPL_PLAN_FIGURE_##last,                                                                                           \
     {SPL_PLAN_FIGURE_##cores, SPL_PLAN_FIGURE_##memory, SPL_PLAN_FIGURE_##paged, SPL_PLAN_FIGURE_##resident}},
#include "cmd/plan_devices.def"
#undef DEVICE
};

/* From the smallest size measured to the largest; the device's own stand in its row. */
static const struct {
    enum spl_plan_figure first, last;
} families[FAMILIES] = {
    [JPEG] = {SPL_PLAN_FIGURE_jpeg_360, SPL_PLAN_FIGURE_jpeg_1080},
    [ENCODE] = {SPL_PLAN_FIGURE_encode_ms, SPL_PLAN_FIGURE_encode_ms},
    [CACHED] = {SPL_PLAN_FIGURE_cached_us, SPL_PLAN_FIGURE_cached_us},
};

#define NUMBER SPL_PLAN_NUMBER
#define BYTES SPL_PLAN_BYTES
#define BITS SPL_PLAN_BITS
#define SHARE SPL_PLAN_SHARE
#define DEVICES SPL_PLAN_DEVICES_USED
#define DEVICE_HOURS SPL_PLAN_DEVICE_HOURS
#define INPUT(op, name)                                                                                                \
    {                                                                                                                  \
        op, SPL_PLAN_FROM_INPUT, SPL_PLAN_INPUT_##name                                                                 \
    }
#define FIGURE(op, name)                                                                                               \
    {                                                                                                                  \
        op, SPL_PLAN_FROM_FIGURE, SPL_PLAN_FIGURE_##name                                                               \
    }
#define DEVICE(op, name)                                                                                               \
    {                                                                                                                  \
        op, SPL_PLAN_FROM_DEVICE, OF_##name                                                                            \
    }
#define SIZED(op, name)                                                                                                \
    {                                                                                                                  \
        op, SPL_PLAN_FROM_SIZED, name                                                                                  \
    }
#define RESULT(op, name)                                                                                               \
    {                                                                                                                  \
        op, SPL_PLAN_FROM_LINE, SPL_PLAN_LINE_##name                                                                   \
    }
static const struct {
    struct spl_plan_line_row row;
    enum rounding rounding;
    struct spl_plan_term terms[SPL_PLAN_TERMS_MAX];
} lines[] = {
#define LINE(name, section, what, kind, unit, rounding, note, ...)                                                     \
    {{#name, SPL_PLAN_##section, what, kind, unit, note}, rounding, {__VA_ARGS__}},
#include "cmd/plan_lines.def"
#undef LINE
};
#undef INPUT
#undef FIGURE
#undef DEVICE
#undef SIZED
#undef RESULT

static double pixels_of(int figure)
{
    return (double)figures[figure].width * figures[figure].height;
}

/* Whether the term could be added. */
static bool add(struct spl_plan *plan, int line, struct spl_plan_term term)
{
    double *value = &plan->lines[line].value, factor = 0;
    switch (term.from) {
    case SPL_PLAN_FROM_INPUT:
        factor = plan->inputs[term.which];
        break;
    case SPL_PLAN_FROM_FIGURE:
        factor = figures[term.which].value;
        break;
    case SPL_PLAN_FROM_PIXELS:
        factor = pixels_of(term.which);
        break;
    case SPL_PLAN_FROM_LINE:
        if (!plan->lines[term.which].known)
            return false;
        factor = plan->lines[term.which].value;
        break;
    case SPL_PLAN_FROM_NONE:
    case SPL_PLAN_FROM_DEVICE:
    case SPL_PLAN_FROM_SIZED:
        spl_assert(false);
    }
    if (!plan->lines[line].count)
        *value = factor;
    else
        *value = term.op == '*' ? *value * factor : term.op == '/' ? *value / factor : *value + factor;
    spl_assert(plan->lines[line].count < SPL_PLAN_TERMS_MAX);
    plan->lines[line].terms[plan->lines[line].count++] = term;
    return true;
}

/* The time or the bytes of a view grow with its pixels beyond what was measured: a figure that is multiplied by is one
 * of them, one that is divided by says how many views there are. */
static void add_sized(struct spl_plan *plan, int line, char op, int family)
{
    int figure = family == RATE ? (int)devices[plan->asked.device].first : (int)families[family].first;
    int last = family == RATE ? (int)devices[plan->asked.device].last : (int)families[family].last;
    const double pixels = plan->inputs[SPL_PLAN_INPUT_pixels];
    while (figure < last && pixels > pixels_of(figure))
        figure++;
    add(plan, line, (struct spl_plan_term){op, SPL_PLAN_FROM_FIGURE, figure});
    if (pixels <= pixels_of(figure))
        return;
    add(plan, line, (struct spl_plan_term){'*', SPL_PLAN_FROM_INPUT, SPL_PLAN_INPUT_pixels});
    add(plan, line, (struct spl_plan_term){'/', SPL_PLAN_FROM_PIXELS, figure});
    plan->beyond = true;
}

/* The row's terms, those of device and size as the figures they are here. */
static bool reckon(struct spl_plan *plan, int line)
{
    for (int i = 0; i < SPL_PLAN_TERMS_MAX && lines[line].terms[i].from; i++) {
        struct spl_plan_term term = lines[line].terms[i];
        if (term.from == SPL_PLAN_FROM_SIZED) {
            add_sized(plan, line, term.op, term.which);
            continue;
        }
        if (term.from == SPL_PLAN_FROM_DEVICE)
            term =
                (struct spl_plan_term){term.op, SPL_PLAN_FROM_FIGURE, (int)devices[plan->asked.device].of[term.which]};
        if ((term.from == SPL_PLAN_FROM_FIGURE && term.which == SPL_PLAN_FIGURE_none) || !add(plan, line, term))
            return false;
    }
    /* a product that is whole but for its last bit is not rounded up to the next */
    if (lines[line].rounding != EXACT)
        plan->lines[line].value = ceil(plan->lines[line].value * (1 - 1e-12));
    if (lines[line].rounding == UP_ONE)
        plan->lines[line].value = fmax(plan->lines[line].value, 1);
    return true;
}

struct spl_plan spl_plan_reckon(const struct spl_plan_asked *asked)
{
    struct spl_plan plan = {
        .asked = *asked,
        .inputs = {asked->points, asked->views, asked->headroom, 1 - asked->cached, asked->cached, asked->copies,
                   (double)asked->size[0] * asked->size[1]},
    };
    for (int line = 0; line < SPL_PLAN_LINES; line++) {
        plan.lines[line].known = reckon(&plan, line);
        for (int i = 0; plan.lines[line].known && i < plan.lines[line].count; i++)
            if (plan.lines[line].terms[i].from == SPL_PLAN_FROM_FIGURE)
                plan.used[plan.lines[line].terms[i].which] = true;
    }
    return plan;
}

const struct spl_plan_figure_row *spl_plan_figure_row(enum spl_plan_figure figure)
{
    return &figures[figure];
}

const struct spl_plan_device_row *spl_plan_device_row(enum spl_plan_device device)
{
    return &devices[device].row;
}

const struct spl_plan_line_row *spl_plan_line_row(enum spl_plan_line line)
{
    return &lines[line].row;
}
