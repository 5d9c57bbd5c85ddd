/* URLs of datasets: which are taken, what is asked for, what may be shown; and when a server is asked again. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include <cmocka.h>

#include "base/clock.h"
#include "dataset/remote_retry.h"
#include "dataset/remote_url.h"

static const struct spl_s3_account nobody,
    somebody = {.key_id = "AKIDEXAMPLE", .secret = "wJalrXUtn", .region = "eu-central-1"};

static void expect_url(const char *text, const struct spl_s3_account *account, const char *get, const char *shown,
                       const char *stem)
{
    struct spl_remote_url url;
    struct spl_error err = {0};
    size_t length;
    if (spl_remote_url_parse(text, account, &url, &err))
        fail_msg("%s: %s", text, err.message);
    assert_string_equal(url.get, get);
    assert_string_equal(url.shown, shown);
    assert_int_equal(url.tls, !strncasecmp(get, "https", 5));
    assert_int_equal(url.s3, !strncmp(text, "s3", 2));
    const char *found = spl_remote_get_stem(text, &length);
    assert_int_equal(length, strlen(stem));
    assert_memory_equal(found, stem, length);
    spl_remote_url_finish(&url);
}

static void test_urls(void **state)
{
    (void)state;
    expect_url("https://h.example/a/hall.spld", &nobody, "https://h.example/a/hall.spld",
               "https://h.example/a/hall.spld", "hall");
    expect_url("http://u:p@w@h:81/x.y.spld?sig=a/b.c", &nobody, "http://u:p@w@h:81/x.y.spld?sig=a/b.c",
               "http://h:81/x.y.spld", "x.y");
    expect_url("HTTPS://h/hall.spld", &nobody, "HTTPS://h/hall.spld", "HTTPS://h/hall.spld", "hall");
    expect_url("https://[::1]:8/hall", &nobody, "https://[::1]:8/hall", "https://[::1]:8/hall", "hall");
    expect_url("s3://b/k/hall.spld", &nobody, "https://s3.us-east-1.amazonaws.com/b/k/hall.spld", "s3://b/k/hall.spld",
               "hall");
    expect_url("s3://b/a b+ü?.spld", &somebody, "https://s3.eu-central-1.amazonaws.com/b/a%20b%2B%C3%BC%3F.spld",
               "s3://b/a b+ü?.spld", "a b+ü?");
    const struct spl_s3_account other = {.endpoint = "http://127.0.0.1:9000/"};
    expect_url("s3://bucket/hall.spld", &other, "http://127.0.0.1:9000/bucket/hall.spld", "s3://bucket/hall.spld",
               "hall");
}

/* A tile lies where its collection does, whatever both are called. */
static void test_what_lies_beside(void **state)
{
    (void)state;
    static const struct {
        const char *path, *name, *beside;
    } rows[] = {{"/data/city.spld", "t-1.spld", "/data/t-1.spld"},
                {"city.spld", "t-1.spld", "t-1.spld"},
                {"a/b?c/city.spld", "t", "a/b?c/t"},
                {"a/what?.spld", "t", "a/t"},
                {"https://h:81/a/city.spld", "t-1.spld", "https://h:81/a/t-1.spld"},
                {"https://u:p@h/a%20b/city", "t.x.spld", "https://u:p@h/a%20b/t.x.spld"},
                {"https://h/a/city.spld?sig=a/b", "t", "https://h/a/t"},
                {"https://h/city.spld", "t", "https://h/t"},
                {"https://city.spld", "evil.example", "https://city.spld/evil.example"}, // no host of its own
                {"http://u:p@h:8", "t", "http://u:p@h:8/t"},
                {"https://h?a/b", "t", "https://h/t"},
                {"s3://bucket/a b/city.spld", "t", "s3://bucket/a b/t"},
                {"s3://bucket/city?x/y.spld", "t", "s3://bucket/city?x/t"},
                {"S3://bucket/city.spld", "t", "S3://bucket/t"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *beside = spl_remote_make_beside(rows[i].path, rows[i].name);
        assert_string_equal(beside, rows[i].beside);
        free(beside);
    }
    assert_true(spl_remote_has_query("https://h/a?b") && spl_remote_has_query("http://h?") &&
                spl_remote_has_query("https://h/a#b"));
    assert_false(spl_remote_has_query("https://h/a") || spl_remote_has_query("s3://b/a?b") ||
                 spl_remote_has_query("/a/b?c"));
}

static void test_what_is_no_url(void **state)
{
    (void)state;
    static const char *const paths[] = {"hall.spld", "/a/b.spld", "./http:/x", "c://x",
                                        "a b://x",   "://x",      "",          "1http://x"};
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++)
        assert_false(spl_remote_is_url(paths[i]));
    assert_true(spl_remote_is_url("file:///etc/passwd") && spl_remote_is_url("ftp://h/x") &&
                spl_remote_is_url("S3://b/k"));
}

static void test_refused(void **state)
{
    (void)state;
    static const char *const urls[] = {"file:///etc/passwd", "ftp://h/x.spld", "gopher://h/x", "https:///x.spld",
                                       "https://", "https://h/a b.spld", "https://h/\xc3\xa4.spld",
                                       "https://h/a\n.spld", "https://h/x#y", "s3://bucket", "s3://bucket/",
                                       "s3:///key", "s3://b@d/key", "http://@h/x", "http://:8/x"};
    for (size_t i = 0; i < sizeof urls / sizeof *urls; i++) {
        struct spl_remote_url url;
        struct spl_error err = {0};
        assert_int_equal(spl_remote_url_parse(urls[i], &nobody, &url, &err), SPL_E_USAGE);
        assert_true(!url.get && !url.shown && strlen(err.message) > 10);
    }
    const struct spl_s3_account bad[] = {{.key_id = "A"}, {.secret = "HIDDEN"}, {.region = "eu/../x"}, {.region = "EU"},
                                         {.endpoint = "h:1"}, {.endpoint = "file:///x"}, {.endpoint = "https://"},
                                         {.endpoint = "https://u:HIDDEN@h"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_remote_url url;
        struct spl_error err = {0};
        assert_int_equal(spl_remote_url_parse("s3://b/k.spld", &bad[i], &url, &err), SPL_E_USAGE);
        assert_null(strstr(err.message, "HIDDEN"));
    }
}

static void test_secrets_are_in_no_message(void **state)
{
    (void)state;
    static const char *const urls[] = {"ftp://u:HIDDEN@h/x?HIDDEN", "https://u:HIDDEN@h/a b?HIDDEN",
                                       "https://u:HIDDEN@h/x?HIDDEN#y", "http://u:HID?DEN@h",
                                       "https://u:HIDDEN@h/\x01"};
    for (size_t i = 0; i < sizeof urls / sizeof *urls; i++) {
        struct spl_remote_url url;
        struct spl_error err = {0};
        char shown[64];
        if (!spl_remote_url_parse(urls[i], &nobody, &url, &err))
            spl_remote_url_finish(&url);
        assert_null(strstr(err.message, "HIDDEN"));
        assert_null(strstr(spl_remote_show(urls[i], shown, sizeof shown), "HIDDEN"));
    }
    char small[10];
    assert_string_equal(spl_remote_show("https://user:pw@host/path", small, sizeof small), "https://h");
    char plain[64];
    assert_string_equal(spl_remote_show("a/b@c?d.spld", plain, sizeof plain), "a/b@c?d.spld");
}

static void test_policy(void **state)
{
    (void)state;
    static const long again[] = {408, 429, 500, 502, 503, 504},
                      never[] = {0, 200, 204, 206 + 1, 301, 307, 400, 401, 403, 404, 410, 416, 501, 505};
    for (size_t i = 0; i < sizeof again / sizeof *again; i++)
        assert_int_equal(spl_remote_judge(again[i]), SPL_REMOTE_AGAIN);
    for (size_t i = 0; i < sizeof never / sizeof *never; i++) {
        assert_int_equal(spl_remote_judge(never[i]), SPL_REMOTE_REFUSE);
        assert_true(strlen(spl_remote_get_advice(never[i])) > 10);
    }
    assert_int_equal(spl_remote_judge(206), SPL_REMOTE_TAKE);
    assert_int_equal(spl_remote_judge(412), SPL_REMOTE_CHANGED);
    uint64_t whole = 100 * SPL_NS_PER_MS, least = UINT64_MAX, most = 0;
    for (unsigned failures = 1; failures < 40; failures++) {
        for (uint64_t chance = 0; chance < 200; chance++) {
            uint64_t pause = spl_remote_get_pause_ns(failures, 0, chance);
            assert_true(pause >= whole / 2 && pause <= whole);
            if (failures == 1) {
                least = pause < least ? pause : least;
                most = pause > most ? pause : most;
            }
        }
        whole = whole * 2 < 5 * SPL_NS_PER_S ? whole * 2 : 5 * SPL_NS_PER_S;
    }
    assert_true(most - least > 40 * SPL_NS_PER_MS); // they do not come back together
    assert_int_equal(spl_remote_get_pause_ns(1, 7, 3), 7 * SPL_NS_PER_S);
    assert_true(spl_remote_get_pause_ns(60, UINT64_MAX, 3) >= 1000000 * SPL_NS_PER_S);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_urls), cmocka_unit_test(test_what_is_no_url),
                                       cmocka_unit_test(test_what_lies_beside),
                                       cmocka_unit_test(test_refused), cmocka_unit_test(test_secrets_are_in_no_message),
                                       cmocka_unit_test(test_policy)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
