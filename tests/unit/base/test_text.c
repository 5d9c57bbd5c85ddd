/* Texts of files as they may be shown: one line of UTF-8 that no terminal acts on. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/error.h"
#include "base/text.h"

static void what_a_terminal_acts_on_becomes_a_mark(void **state)
{
    (void)state;
    static const char *const rows[][2] = {
        {"", ""},
        {"hall.las", "hall.las"},
        {"Zürich, 東京 😀 – ½°", "Zürich, 東京 😀 – ½°"},
        {"\033[2J\033]0;x\a", "?[2J?]0;x?"},
        {"one\ntwo\r\tthree\177", "one?two??three?"},
        {"\xc2\x9b" "2J\xc2\x85", "?2J?"},         /* C1: CSI and NEL */
        {"\x9b" "2J\xff", "?2J?"},                 /* the same as a byte, and what is no UTF-8 */
        {"a\xe2\x80\xae" "b\xe2\x80\xa8" "c", "a?b?c"}, /* from right to left; a line's end */
        {"\xc0\x9b\xe0\x80\x8a", "?????"},         /* not the shortest form */
        {"\xed\xa0\x80\xf4\x90\x80\x80", "???????"}, /* surrogates, beyond the last */
        {"cut \xe6\x9d", "cut ??"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[64];
        strcpy(text, rows[i][0]);
        spl_text_clean(text);
        assert_string_equal(text, rows[i][1]);
    }
}

static void it_is_cut_between_characters(void **state)
{
    (void)state;
    char out[6];
    assert_string_equal(spl_text_show("abcdefg", out, sizeof out), "abcde");
    assert_string_equal(spl_text_show("ab東京", out, sizeof out), "ab東");
    assert_string_equal(spl_text_show("abc東京", out, sizeof out), "abc");
    assert_string_equal(spl_text_show("東", out, 1), "");
}

static void errors_are_one_line(void **state)
{
    (void)state;
    struct spl_error err = {0}, io = {0}, cut = {0};
    char large[2 * sizeof err.message];
    spl_fail_field(&err, SPL_E_INPUT, "a\nb", "%s: \033[2J is no name", "Zürich\n.las");
    assert_string_equal(err.message, "Zürich?.las: ?[2J is no name");
    assert_string_equal(err.field, "a?b");
    spl_fail_errno(&io, 2, "cannot read '\r%s'", "x");
    assert_non_null(strstr(io.message, "cannot read '?x': "));
    for (size_t i = 0; i < sizeof large; i++)
        large[i] = "東"[i % 3];
    large[sizeof large - 1] = '\0';
    spl_fail(&cut, SPL_E_INPUT, "a%s", large); /* the last character does not fit as a whole */
    bool printable = true;
    for (const char *p = cut.message; *p && printable;)
        p += spl_text_next(p, &printable);
    assert_true(printable && strlen(cut.message) > sizeof cut.message - 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_a_terminal_acts_on_becomes_a_mark),
        cmocka_unit_test(it_is_cut_between_characters),
        cmocka_unit_test(errors_are_one_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
