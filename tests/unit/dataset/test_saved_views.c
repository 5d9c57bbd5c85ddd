/* Views as JSON, of META, of a file beside a dataset and of requests: what is up where they do not say so. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "dataset/saved_views.h"

#define PLAN "\"eye\":[3,4,50],\"target\":[3,4,0]"
#define SIDE "\"eye\":[0,9,0],\"target\":[0,0,0]"

/* +y of a plan, -z where y is up; what is given stands, and is refused where one looks along it. */
static void up_is_that_of_views_that_are_asked_for(void **state)
{
    (void)state;
    static const struct {
        const char *json;
        double usual[3], up[3]; /* zeros: refused */
    } cases[] = {
        {"{" PLAN ",\"view_height\":4}", {0, 0, 1}, {0, 1, 0}},
        {"{" PLAN ",\"projection\":\"orthographic\"}", {0, 0, 1}, {0, 1, 0}},
        {"{" PLAN ",\"view_height\":4}", {0, -1, 0}, {0, -1, 0}},
        {"{" PLAN ",\"view_height\":4,\"up\":[1,0,0]}", {0, 0, 1}, {1, 0, 0}},
        {"{" PLAN ",\"view_height\":4,\"up\":[0,0,2]}", {0, 0, 1}, {0}},
        {"{" PLAN "}", {0, 0, 1}, {0}},
        {"{" SIDE ",\"view_height\":4}", {0, -1, 0}, {0, 0, -1}},
        {"{" SIDE ",\"view_height\":4}", {0, 0, 1}, {0, 0, 1}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_saved_view view;
        struct spl_error err = {0};
        json_t *json = json_loads(cases[i].json, 0, NULL);
        assert_non_null(json);
        const bool refused = !memcmp(cases[i].up, (double[3]){0}, sizeof view.up);
        const int rc = spl_saved_view_from_json(json, cases[i].usual, false, true, &view, &err);
        json_decref(json);
        if (refused ? rc != SPL_E_INPUT || strcmp(err.field, "up") : rc != 0)
            fail_msg("%s: %d, %s", cases[i].json, rc, err.message);
        for (int c = 0; !refused && c < 3; c++)
            assert_true(view.up[c] == cases[i].up[c]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(up_is_that_of_views_that_are_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
