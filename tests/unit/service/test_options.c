/* The parameters of the service: bad values first, then who wins, then that help, manual and status know every row. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "service/ops/options.h"

static struct spl_service_options options;

static int begin(void **state)
{
    (void)state;
    return spl_service_options_init(&options, NULL);
}

static int end(void **state)
{
    (void)state;
    spl_service_options_finish(&options);
    return 0;
}

static int parse(const char *text, struct spl_error *err)
{
    return spl_service_options_parse(&options, "x.conf", text, strlen(text), err);
}

static void set_flag(size_t index, const char *text)
{
    assert_int_equal(spl_service_options_set(&options, index, text, SPL_FROM_FLAG, "--", NULL), 0);
}

static void bad_lines_say_where_and_what(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        const char *said[4];
    } cases[] = {
        {"queue = 0", {"x.conf, line 1", "queue", "'0'", "1 to 4096"}},
        {"# fine\n\nqueue = 4097\n", {"x.conf, line 3", "queue", "'4097'", "1 to 4096"}},
        {"queue = -1", {"line 1", "'-1'", "1 to 4096"}},
        {"queue = 1e2", {"line 1", "'1e2'"}},
        {"queue = 5 # five", {"line 1", "'5 # five'"}},
        {"queue =", {"line 1", "queue", "''"}},
        {"queue = 99999999999999999999999", {"line 1", "1 to 4096"}},
        {"queue = 4K", {"line 1", "'4K'"}},
        {"memory-limit = 5X", {"line 1", "memory-limit", "'5X'", "bytes"}},
        {"memory-limit = 5KK", {"line 1", "'5KK'"}},
        {"memory-limit = 99999999999T", {"line 1", "'99999999999T'"}},
        {"require-gpu = yes", {"line 1", "require-gpu", "true or false", "'yes'"}},
        {"log-level = loud", {"line 1", "log-level", "error|warning|info|debug", "'loud'"}},
        {"log-level = info|debug", {"line 1", "'info|debug'"}},
        {"log-level =", {"line 1", "log-level"}},
        {"dataset =", {"line 1", "dataset", "PATH"}},
        {"deadlin = 5", {"line 1", "'deadlin'", "--help"}},
        {"queue 5", {"line 1", "'queue 5'", "name = value"}},
        {"= 5", {"line 1", "''"}},
        {"[server]\nqueue = 5", {"line 1", "'[server]'", "name = value"}},
        {"# a\r\n\r\nqueue = 0\r\n", {"line 3", "queue", "'0'"}},
        {"# a\rqueue = 5\r", {"line 1", "carriage return"}},
        {"queue = 5\n\xef\xbb\xbf" "encoders = 1", {"line 2", "no parameter"}},
        {"\n\nlisten = nonsense", {"x.conf, line 3: listen takes ADDR:PORT", "127.0.0.1:8080", "'nonsense'"}},
        {"listen =", {"line 1: listen takes", "''"}},
        {"listen = 1.2.3.4:65536", {"line 1: listen takes", "'1.2.3.4:65536'"}},
        {"listen = ::1:80", {"line 1: listen takes", "[::1]:8080"}},
        {"ops-listen = 8081", {"line 1: ops-listen takes", "'8081'"}},
        {"cors = dash.example", {"line 1: cors takes", "https://dash.example", "'dash.example'"}},
        {"cors = https://dash.example/", {"line 1: cors takes"}},
        {"cors = https://", {"line 1: cors takes"}},
        {"host-name = scans.example:8080", {"line 1: host-name takes", "'scans.example:8080'"}},
        {"host-name = https://scans.example", {"line 1: host-name takes"}},
        {"queue = 5\nencoders = 1\nqueue = 6", {"line 3: queue", "second", "'6'", "line 1 has it already"}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        assert_int_equal(parse(cases[i].text, &err), SPL_E_USAGE);
        for (int j = 0; j < 4 && cases[i].said[j]; j++)
            if (!strstr(err.message, cases[i].said[j]))
                fail_msg("%s: '%s' is not in '%s'", cases[i].text, cases[i].said[j], err.message);
        end(NULL);
        begin(NULL);
    }
    struct spl_error err = {0};
    assert_int_equal(spl_service_options_parse(&options, "x.conf", "\nqueue = 5\0", 11, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "x.conf, line 2"));
    assert_int_equal(spl_service_options_read(&options, "/no/such.conf", NULL), SPL_E_USAGE);
    assert_int_equal(spl_service_options_read(&options, "/", NULL), SPL_E_USAGE);
}

static void every_mistake_of_a_file_is_kept(void **state)
{
    (void)state;
    static const char *const said[] = {"line 3: there is no parameter", "line 4: 'oops'", "line 5: queue is given"};
    struct spl_error err = {0};
    assert_int_equal(parse("listen = x\nqueue = 5\nqueu = 5\noops\nqueue = 6\nencoders = 2", &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "line 1: listen"));
    assert_int_equal(options.mistakes, 3);
    for (int i = 0; i < 3; i++)
        if (!strstr(options.mistake[i].message, said[i]))
            fail_msg("'%s' is not in '%s'", said[i], options.mistake[i].message);
    assert_int_equal(options.queue, 5);
    char lines[100 * 5 + 1] = "";
    for (int i = 0; i < 100; i++)
        strcat(lines, "oops\n");
    end(NULL);
    begin(NULL);
    assert_int_equal(parse(lines, NULL), SPL_E_USAGE);
    assert_int_equal(options.mistakes, SPL_MISTAKES_MAX);
}

static void a_file_sets_every_type(void **state)
{
    (void)state;
    struct spl_error err = {0};
    const char *text = "\xef\xbb\xbf queue=7 \r\n\t# comment\n\nmemory-limit = 3G\nrequire-gpu = true\nverify = false\n"
                       "log-level = debug\ndevice = part of a # name\ndataset = /a b/x.spld\ndataset = y";
    assert_int_equal(parse(text, &err), 0);
    assert_int_equal(options.queue, 7);
    assert_true(options.memory_limit == 3ull << 30);
    assert_true(options.require_gpu && !options.verify);
    assert_int_equal(options.log_level, 3);
    assert_string_equal(options.device, "part of a # name");
    assert_int_equal(options.datasets.count, 2);
    assert_string_equal(options.datasets.items[0], "/a b/x.spld");
    assert_string_equal(options.datasets.items[1], "y");
    assert_int_equal(options.deadline_ms, 10000); // not in the file
}

/* Each alone is in its range. */
static void values_that_contradict_each_other_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *field, *said;
    } cases[] = {
        {"url-key = k", "url-key", "tokens"},
        {"listen = 127.0.0.1:8080\nops-listen = 127.0.0.1:8080", "ops-listen", "127.0.0.1:8080"},
        {"ops-listen = 127.0.0.1:8080", "ops-listen", "listen"},
        {"connections = 5\nconnections-per-address = 6", "connections-per-address", "5"},
        {"rate-limit = 9\nrate-limit-total = 8", "rate-limit", "8"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        assert_int_equal(parse(cases[i].text, NULL), 0);
        assert_int_equal(spl_service_options_check(&options, &err), SPL_E_USAGE);
        assert_string_equal(err.field, cases[i].field);
        assert_non_null(strstr(err.message, cases[i].said));
        char where[300];
        spl_service_options_locate(&options, cases[i].field, where, sizeof where);
        assert_memory_equal(where, "x.conf, line ", 13);
        end(NULL);
        begin(NULL);
    }
    assert_int_equal(parse("connections = 5\nlisten = 127.0.0.1:0\nops-listen = 127.0.0.1:0\ntokens = t\nurl-key = k\n"
                           "rate-limit = 9\ncors = *\ncors = http://[::1]:8\nhost-name = a.b\nhost-name = *", NULL), 0);
    assert_int_equal(spl_service_options_check(&options, NULL), 0);
    char where[300];
    set_flag(SPL_PARAMETER_rate_limit, "1");
    for (int i = 0; i < 3; i++) { // of a flag, a default, no parameter
        spl_service_options_locate(&options, ((const char *[]){"rate-limit", "queue", "frobnicate"})[i], where,
                                   sizeof where);
        assert_string_equal(where, "");
    }
}

static void flags_win_over_the_file_in_either_order(void **state)
{
    const char *text = "queue = 7\nencoders = 3\ndevice = file\ndataset = file\nverify = false";
    for (int flags_first = 0; flags_first < 2; flags_first++) {
        if (!flags_first)
            assert_int_equal(parse(text, NULL), 0);
        set_flag(SPL_PARAMETER_queue, "9");
        set_flag(SPL_PARAMETER_device, "flag");
        set_flag(SPL_PARAMETER_datasets, "one");
        set_flag(SPL_PARAMETER_datasets, "two");
        set_flag(SPL_PARAMETER_verify, "true");
        if (flags_first) {
            struct spl_error err = {0};
            assert_int_equal(parse(text, NULL), 0);
            assert_int_equal(parse("queue = 0", &err), SPL_E_USAGE); // checked although it does not count
        }
        assert_int_equal(options.queue, 9);
        assert_int_equal(options.encoders, 3);
        assert_string_equal(options.device, "flag");
        assert_true(options.verify);
        assert_int_equal(options.datasets.count, 2);
        assert_string_equal(options.datasets.items[1], "two");
        end(state);
        begin(state);
    }
}

static void every_row_is_sound_and_shown(void **state)
{
    (void)state;
    char *help = NULL, *manual = NULL;
    size_t length;
    FILE *out = open_memstream(&help, &length);
    spl_parameters_print_help(out);
    fclose(out);
    out = open_memstream(&manual, &length);
    spl_parameters_print_manual(out);
    fclose(out);
    json_t *status = spl_service_options_describe(&options);
    for (size_t i = 0; i < SPL_PARAMETERS; i++) {
        const struct spl_parameter *p = &spl_parameters[i];
        char flag[80], bold[80] = ".B ";
        bool path = !strcmp(p->unit, "PATH") || !strcmp(p->unit, "FILE") || !strcmp(p->unit, "DIR");
        assert_int_equal(spl_parameter_find(p->name), i); // so names are unique
        assert_true(strspn(p->name, "abcdefghijklmnopqrstuvwxyz-") == strlen(p->name));
        assert_true(p->type == SPL_PARAMETER_FLAG || *p->unit);
        snprintf(flag, sizeof flag, " --%s%s",
                 p->type == SPL_PARAMETER_FLAG && options.origin[i] == 0 && !strcmp(p->fallback, "true") ? "no-" : "",
                 p->name);
        assert_non_null(strstr(help, flag));
        for (const char *c = p->name; *c; c++)
            strcat(strcat(bold, *c == '-' ? "\\" : ""), (char[]){*c, 0});
        assert_non_null(strstr(manual, bold));
        assert_int_equal(json_object_get(status, p->name) != NULL, !path);
    }
    assert_int_equal(json_integer_value(json_object_get(status, "queue")), 32);
    assert_string_equal(json_string_value(json_object_get(status, "log-level")), "info");
    assert_true(json_is_true(json_object_get(status, "verify")));
    json_decref(status);
    free(manual);
    free(help);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(bad_lines_say_where_and_what, begin, end),
        cmocka_unit_test_setup_teardown(every_mistake_of_a_file_is_kept, begin, end),
        cmocka_unit_test_setup_teardown(a_file_sets_every_type, begin, end),
        cmocka_unit_test_setup_teardown(values_that_contradict_each_other_are_refused, begin, end),
        cmocka_unit_test_setup_teardown(flags_win_over_the_file_in_either_order, begin, end),
        cmocka_unit_test_setup_teardown(every_row_is_sound_and_shown, begin, end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
