/* Bodies of JSON: values and depth are bounded before they are parsed, and what is text counts for neither. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "service/request/body.h"

static int parse(const char *text, size_t most, struct spl_error *err)
{
    size_t length = strlen(text);
    char *exact = malloc(length); // no NUL behind it
    assert_non_null(exact);
    memcpy(exact, text, length);
    *err = (struct spl_error){0};
    json_t *document = spl_body_parse(exact, length, most, 100, err);
    free(exact);
    assert_int_equal(!document, err->code != 0);
    json_decref(document);
    return err->code;
}

static void values_are_counted_before_they_are_parsed(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        size_t values; /* as it is counted: exact, but for one more in each empty array or object */
    } cases[] = {
        {"[1,2,3]", 4},        {"{\"a\":1,\"b\":[true,null]}", 5}, {"[[],{}]", 5}, {"[\"a,b,[{\\\",,\",\"\\\\\",3]", 4},
        {" [ 1 , -2e5 ] ", 3}, {"\xef\xbb\xbf[1,2]", 3}, /* behind the mark of UTF-8 */
    };
    struct spl_error err;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(parse(cases[i].text, cases[i].values, &err), 0);
        assert_int_equal(parse(cases[i].text, cases[i].values - 1, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "body");
    }
}

static void depth_is_bounded(void **state)
{
    (void)state;
    char text[132] = "";
    struct spl_error err;
    for (size_t deep = 64; deep <= 65; deep++) {
        memset(text, '[', deep);
        memset(text + deep, ']', deep);
        assert_int_equal(parse(text, 1000, &err), deep == 64 ? 0 : SPL_E_INPUT);
    }
    memset(text, '[', 64);
    memcpy(text + 64, "\"[[[[]\"", 8);
    memset(text + 71, ']', 60);
    assert_int_equal(parse(text, 1000, &err), SPL_E_INPUT); // four are not closed
    assert_non_null(strstr(err.message, "broken JSON"));
}

static void broken_bodies_are_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {"", "\"", "\"\\", "{", "]", "]]]]", "[1,]", "{\"a\":1,\"a\":2}", "1"};
    struct spl_error err;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        assert_int_equal(parse(texts[i], 1000, &err), SPL_E_INPUT);
        assert_non_null(strstr(err.message, "broken JSON"));
    }
    assert_null(spl_body_parse(NULL, 0, 1000, 1000, &err));
    static const char *const nul[] = {"{\"path\":\"1 0\\u0000 2\"}", "{\"pa\\u0000th\":1}"};
    for (size_t i = 0; i < sizeof nul / sizeof *nul; i++) { /* in our words, not in those of the parser's options */
        assert_int_equal(parse(nul[i], 1000, &err), SPL_E_INPUT);
        assert_non_null(strstr(err.message, "\\u0000"));
        assert_null(strstr(err.message, "JSON_"));
        assert_non_null(strstr(err.message, "line 1"));
    }
}

static void texts_are_no_longer_than_was_said(void **state)
{
    (void)state;
    struct spl_error err;
    char text[128];
    for (int length = 100; length <= 101; length++)
        for (int name = 0; name < 2; name++) { /* with an escape, which counts as it is written */
            snprintf(
                text, sizeof text, name ? "{\"%.*s\\n\":1}" : "[\"%.*s\\n\"]", length - 2,
                "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa");
            assert_int_equal(parse(text, 1000, &err), length == 100 ? 0 : SPL_E_INPUT);
        }
    assert_non_null(strstr(err.message, "a text of 101 bytes"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_counted_before_they_are_parsed),
        cmocka_unit_test(depth_is_bounded),
        cmocka_unit_test(broken_bodies_are_refused),
        cmocka_unit_test(texts_are_no_longer_than_was_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
