/* Histograms as Prometheus reads them: each bound holds what equals it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "service/ops/latency.h"

/* What has been printed; the caller frees. */
static char *print(const struct spl_latencies *latencies)
{
    char *text = NULL;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    assert_non_null(out);
    spl_latency_print(latencies, out);
    assert_int_equal(fclose(out), 0);
    return text;
}

static void a_bound_holds_what_equals_it(void **state)
{
    (void)state;
    struct spl_latencies none = {0};
    spl_latency_observe(&none, "/a", SPL_LATENCY_FRAME, 1000);
    char *bounds = print(&none), *rest = bounds;
    int seen = 0;
    for (char *at; (at = strstr(rest, "le=\"")); rest = at + 4) {
        double bound = strtod(at + 4, NULL);
        if (!(bound < 1000))
            continue;
        struct spl_latencies one = {0};
        char *end = strchr(at + 4, '"'), wanted[64];
        spl_latency_observe(&one, "/a", SPL_LATENCY_FRAME, bound);
        spl_latency_observe(&one, "/a", SPL_LATENCY_FRAME, bound * 1.001);
        snprintf(wanted, sizeof wanted, "{route=\"/a\",le=\"%.*s\"} 1\n", (int)(end - at - 4), at + 4);
        char *text = print(&one);
        assert_non_null(strstr(text, wanted));
        assert_non_null(strstr(text, "_count{route=\"/a\"} 2\n"));
        free(text);
        seen++;
    }
    assert_int_equal(seen, SPL_HISTOGRAM_BUCKETS);
    free(bounds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_bound_holds_what_equals_it)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
