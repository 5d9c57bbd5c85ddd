/* The stability suite: what must hold always, and how badly each method fails where it does.
 *
 *   stability invariants vulkan|egl [THEME…]    limits from the truth and from arithmetic; all themes or these
 *   stability drivers [--whole]                 Vulkan against EGL
 *   stability conditions [NAME…] [--others] [--whole]   measures what degrades and compares it with table.json, either
 *                                               way: all of it, or the conditions that begin so, or all the others
 *   stability conditions [NAME…] [--method METHOD] --update [--whole]   writes the table's rows anew, those of these
 *                                               conditions and of the method; read it before it is committed
 *   stability plant half-pixel|margin-0|pop|no-trim|six-axes     a planted fault: exits 0 only where the check meant
 * for it
 *                                               catches it
 *
 * The small form is what tests/run.sh runs; --whole takes every view of every scene and larger sizes; --verbose
 * prints what passes as well. Exit code 77: no such device here. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "conditions.h"
#include "themes.h"

enum { SKIPPED = 77 };

static const struct {
    const char *name;
    enum plant plant;
    const char *caught_by;
    void (*check)(struct suite *suite); /* the theme that it is in */
} plants[] = {
    {"half-pixel", PLANT_HALF_PIXEL, "lies-on-the-truth", check_places},
    {"margin-0", PLANT_MARGIN_0, "depth-unbiased", check_walls},
    {"pop", PLANT_POP, "no-pop", check_motion},
    {"no-trim", PLANT_NO_TRIM, "halo-is-trimmed", check_maps},
    {"six-axes", PLANT_SIX_AXES, "no-flip", check_flips},
};

static bool open_renderer(const char *backend, struct spl_renderer **renderer)
{
    struct spl_error err = {0};
    if (spl_renderer_create(&SPL_SIZED(spl_renderer_options, .device = backend), renderer, &err)) {
        printf("%s: %s\n", backend, err.message);
        return false;
    }
    printf("%s: %s\n", backend, spl_renderer_get_device(*renderer)->name);
    return true;
}

static const struct {
    const char *name;
    void (*check)(struct suite *suite);
} themes[] = {
    {"places", check_places}, {"walls", check_walls},   {"far-away", check_far_away}, {"levels", check_levels},
    {"sums", check_sums},     {"motion", check_motion}, {"layers", check_layers},     {"maps", check_maps},
    {"soft", check_soft},     {"flips", check_flips},
};

static bool is_named(const char *const *names, const char *name)
{
    bool named = !*names;
    for (; *names; names++)
        named |= !strcmp(*names, name);
    return named;
}

static int run_invariants(struct suite *suite, const char *backend, const char *const *wanted)
{
    if (!open_renderer(backend, &suite->renderer))
        return SKIPPED;
    for (size_t i = 0; i < sizeof themes / sizeof *themes; i++) {
        if (!is_named(wanted, themes[i].name))
            continue;
        uint64_t begin = spl_now_ns();
        size_t before = suite->report.passed;
        themes[i].check(suite);
        printf("%s: %zu checks passed, %.1f s\n", themes[i].name, suite->report.passed - before,
               (double)(spl_now_ns() - begin) / SPL_NS_PER_S);
    }
    return report_finish(&suite->report);
}

static int run_drivers(struct suite *suite)
{
    if (!open_renderer("vulkan", &suite->renderer) || !open_renderer("egl", &suite->other))
        return SKIPPED;
    check_drivers(suite);
    return report_finish(&suite->report);
}

static int run_plant(struct suite *suite, const char *name)
{
    for (size_t i = 0; i < sizeof plants / sizeof *plants; i++)
        if (!strcmp(plants[i].name, name)) {
            suite->plant = plants[i].plant;
            suite->report.must_fail = plants[i].caught_by;
            if (!open_renderer("vulkan", &suite->renderer))
                return SKIPPED;
            plants[i].check(suite);
            return report_finish(&suite->report);
        }
    return 2;
}

static int run_conditions(struct suite *suite, struct conditions *conditions)
{
    char path[512];
    const char *root = getenv("SPLATD_SOURCE_ROOT");
    snprintf(path, sizeof path, "%s/tests/stability/table.json", root ? root : ".");
    if (!open_renderer("vulkan", &suite->renderer))
        return SKIPPED;
    if (suite->whole) /* else OpenGL's frames are held against Vulkan's, by `drivers` */
        open_renderer("egl", &suite->other);
    conditions->suite = suite;
    conditions->table = table_open(path);
    conditions_of_scans(conditions);
    conditions_of_views(conditions);
    conditions_of_shapes(conditions);
    conditions_of_photographs(conditions);
    conditions_of_maps(conditions);
    conditions_of_primitives(conditions);
    bool all = !*conditions->only && !conditions->method;
    if (!conditions->method && !(conditions->update && suite->whole))
        table_find_stale(conditions->table, &suite->report, conditions, suite->whole);
    if (conditions->update)
        table_save(conditions->table, suite->whole && all);
    table_close(conditions->table);
    return report_finish(&suite->report);
}

int main(int argc, char **argv)
{
    struct suite suite = {0};
    const char *words[8] = {""}; /* NULL at the end */
    int count = 0, rc = 2;
    struct conditions conditions = {.only = words + 1};
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--whole"))
            suite.whole = true;
        else if (!strcmp(argv[i], "--verbose"))
            suite.report.verbose = true;
        else if (!strcmp(argv[i], "--update"))
            conditions.update = true;
        else if (!strcmp(argv[i], "--others"))
            conditions.others = true;
        else if (!strcmp(argv[i], "--method") && i + 1 < argc)
            conditions.method = argv[++i];
        else if (!strcmp(argv[i], "--pictures") && i + 1 < argc)
            conditions.pictures = argv[++i];
        else if (count < 7)
            words[count++] = argv[i];
    }
    if (!strcmp(words[0], "invariants") && words[1])
        rc = run_invariants(&suite, words[1], words + 2);
    else if (!strcmp(words[0], "drivers"))
        rc = run_drivers(&suite);
    else if (!strcmp(words[0], "conditions"))
        rc = run_conditions(&suite, &conditions);
    else if (!strcmp(words[0], "plant") && words[1])
        rc = run_plant(&suite, words[1]);
    if (rc == 2)
        fprintf(stderr, "usage: stability invariants vulkan|egl [THEME…] | drivers | conditions [NAME…] [--others] "
                        "[--method METHOD] [--update] | plant "
                        "half-pixel|margin-0|pop|no-trim|six-axes [--whole]\n");
    spl_renderer_destroy(suite.renderer);
    spl_renderer_destroy(suite.other);
    return rc;
}
