/* Log lines: hostile text stays inside its line, long text is cut, and a reader that has gone to sleep holds nobody up.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include <jansson.h>

#include "base/log.h"

static int saved = -1, out = -1;

static int begin(void **state)
{
    (void)state;
    int ends[2];
    if (pipe2(ends, O_CLOEXEC | O_NONBLOCK))
        return -1;
    fcntl(ends[1], F_SETFL, 0); // stderr blocks, as it does in real life
    fcntl(ends[1], F_SETPIPE_SZ, 1 << 16); // some systems have others
    saved = dup(STDERR_FILENO);
    dup2(ends[1], STDERR_FILENO);
    close(ends[1]);
    out = ends[0];
    return 0;
}

static int end(void **state)
{
    (void)state;
    dup2(saved, STDERR_FILENO);
    close(saved);
    close(out);
    spl_log_set_level(SPL_LOG_INFO);
    spl_log_set_format(SPL_LOG_TEXT);
    return 0;
}

/* What was written since the last call, as a string. */
static char *take(void)
{
    static char text[1 << 18];
    size_t used = 0;
    for (ssize_t got; (got = read(out, text + used, sizeof text - 1 - used)) > 0;)
        used += (size_t)got;
    text[used] = '\0';
    return text;
}

static size_t count_lines(const char *text)
{
    size_t lines = 0;
    for (; *text; text++)
        lines += *text == '\n';
    return lines;
}

static void text_lines_hold_outside_text(void **state)
{
    (void)state;
    const struct spl_log_field fields[] = {
        {"path", "/a\nb\x1b[31m", 0}, {"say", "so \"it\" is", 0}, {"n", NULL, 12}, {"ms", NULL, 0.25}, {"none", "", 0}};
    spl_log_fields(SPL_LOG_INFO, "one\r\ntwo", fields, 5);
    char *line = take();
    assert_int_equal(count_lines(line), 1);
    assert_non_null(
        strstr(line, "Z splatd: info: one??two path=/a?b?[31m say=\"so \\\"it\\\" is\" n=12 ms=0.250 none=\"\"\n"));
    spl_log_set_level(SPL_LOG_WARN);
    spl_log_info("not this");
    spl_log_warn("%s %d", "but", 5);
    line = take();
    assert_true(count_lines(line) == 1 && strstr(line, "splatd: warning: but 5\n"));
}

static void json_lines_are_json(void **state)
{
    (void)state;
    char hostile[256], longest[5000];
    for (int i = 0; i < 255; i++)
        hostile[i] = (char)(i + 1);
    hostile[255] = '\0';
    spl_log_set_format(SPL_LOG_JSON);
    for (size_t length = 0; length < sizeof longest; length += length < 1900 || length > 2100 ? 97 : 1) {
        memset(longest, length % 2 ? '"' : 'x', length);
        longest[length] = '\0';
        const struct spl_log_field fields[] = {{"path", longest, 0}, {"status", NULL, 200}, {"h", hostile, 0}};
        spl_log_fields(SPL_LOG_ERROR, length % 3 ? "request" : hostile, fields, 3);
        char *line = take();
        json_t *json = json_loads(line, 0, NULL);
        if (!json || count_lines(line) != 1)
            fail_msg("length %zu: %s", length, line);
        assert_string_equal(json_string_value(json_object_get(json, "level")), "error");
        assert_int_equal(strlen(json_string_value(json_object_get(json, "time"))), strlen("2026-01-01T00:00:00.000Z"));
        if (length < 500)
            assert_int_equal(json_integer_value(json_object_get(json, "status")), 200);
        json_decref(json);
    }
}

static void a_reader_that_sleeps_holds_nobody_up(void **state)
{
    (void)state;
    for (int i = 0; i < 5000; i++) // far beyond the 64 KiB of the pipe; a write that blocks would hang here
        spl_log_info("line %d of many that nobody reads for a while", i);
    char *text = take();
    size_t through = count_lines(text);
    assert_in_range(through, 100, 4999);
    spl_log_info("after");
    text = take();
    char said[32];
    snprintf(said, sizeof said, "lines=%zu\n", 5000 - through);
    assert_non_null(strstr(text, said));
    assert_non_null(strstr(text, "info: after\n"));
    assert_int_equal(count_lines(text), 2);
}

static char said[256];
static int calls;

static void listen(void *context, enum spl_log_level level, const char *message)
{
    calls++;
    snprintf(said, sizeof said, "%s %d %s", (const char *)context, (int)level, message);
}

static void a_programs_callback_has_the_messages_instead(void **state)
{
    (void)state;
    const struct spl_log_field field = {"ms", NULL, 0.25};
    spl_log_set_callback(listen, "mine");
    for (int format = SPL_LOG_TEXT; format <= SPL_LOG_JSON; format++) {
        spl_log_set_format((enum spl_log_format)format);
        spl_log_fields(SPL_LOG_WARN, "one\ntwo", &field, 1);
        assert_string_equal(said, "mine 1 one?two ms=0.250");
    }
    spl_log_debug("not this");
    assert_int_equal(calls, 2);
    assert_string_equal(take(), "");
    spl_log_set_callback(NULL, NULL);
    spl_log_warn("back");
    assert_int_equal(calls, 2);
    assert_non_null(strstr(take(), "back"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(text_lines_hold_outside_text, begin, end),
        cmocka_unit_test_setup_teardown(json_lines_are_json, begin, end),
        cmocka_unit_test_setup_teardown(a_reader_that_sleeps_holds_nobody_up, begin, end),
        cmocka_unit_test_setup_teardown(a_programs_callback_has_the_messages_instead, begin, end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
