/* Tokens, signatures and rates without HTTP: what must be refused first, then known vectors. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "service/access/buckets.h"
#include "service/access/secret.h"
#include "service/access/host.h"
#include "service/access/sign.h"
#include "service/access/tokens.h"

#define TOKEN "correct-horse-battery"
#define OTHER "another-secret.1234567890"

static int parse(const char *text, struct spl_tokens **tokens, struct spl_error *err)
{
    return spl_tokens_parse(text, strlen(text), "file", tokens, err);
}

static void bad_token_files_are_refused_by_line_without_the_token(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said;
    } cases[] = {
        {"", "no token"},
        {"# nothing\n\n  \n", "no token"},
        {TOKEN "\n", "line 1: a line is"},
        {TOKEN " view a b\n", "line 1: a line is"},
        {"\n" TOKEN " view a b c d\n", "line 2: a line is"},
        {"short view\n", "line 1: a token has"},
        {"correct-horse-batter! view\n", "line 1: a token has"},
        {"correct-hörse-battery view\n", "line 1: a token has"},
        {TOKEN " View\n", "line 1: the second field holds 'View'"},
        {TOKEN " view,views\n", "holds 'views'; it takes view, tour, admin"},
        {TOKEN " view,\n", "line 1: the second field"},
        {TOKEN " ,view\n", "line 1: the second field"},
        {TOKEN " all\n", "line 1: the second field"},
        {TOKEN " view ../x\n", "line 1: the third field"},
        {TOKEN " view a,,b\n", "line 1: the third field"},
        {TOKEN " view ,a\n", "line 1: the third field"},
        {TOKEN " view a,\n", "line 1: the third field"},
        {"sha256: view\n", "line 1: sha256"},
        {"sha256:12 view\n", "line 1: sha256"},
        {"sha256:zz34567890123456789012345678901234567890123456789012345678901234 view\n", "line 1: sha256"},
        {TOKEN " view\n# x\n" TOKEN " admin\n", "line 3: the token of line 1 again"},
        {TOKEN " view\nbut this one is broken\n", "line 2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_tokens *tokens = NULL;
        struct spl_error err = {0};
        if (parse(cases[i].text, &tokens, &err) != SPL_E_USAGE || tokens || !strstr(err.message, cases[i].said) ||
            strstr(err.message, "correct"))
            fail_msg("case %zu: %d, '%s'", i, err.code, err.message);
    }
    char longer[2000];
    memset(longer, 'a', sizeof longer);
    struct spl_tokens *tokens;
    struct spl_error err = {0};
    assert_int_equal(spl_tokens_parse(longer, sizeof longer, "file", &tokens, &err), SPL_E_USAGE);
    assert_int_equal(spl_tokens_parse(TOKEN " view\0x", strlen(TOKEN) + 7, "file", &tokens, &err), SPL_E_USAGE);
}

static const struct spl_token *find(const struct spl_tokens *tokens, const char *text)
{
    return spl_tokens_find(tokens, text, strlen(text));
}

static void tokens_allow_what_their_line_says(void **state)
{
    (void)state;
    struct spl_tokens *tokens;
    uint8_t digest[SPL_DIGEST_BYTES];
    char text[400] = "# who\r\n" TOKEN "\tview,tour  site-*,vault,[ab]?\r\nsha256:";
    assert_int_equal(spl_sha256(OTHER, strlen(OTHER), digest, NULL), 0);
    for (int i = 0; i < SPL_DIGEST_BYTES; i++)
        sprintf(text + strlen(text), i % 2 ? "%02X" : "%02x", digest[i]);
    strcat(text, " admin"); // no newline at the end, no patterns
    assert_int_equal(parse(text, &tokens, NULL), 0);
    assert_int_equal(spl_tokens_get_count(tokens), 2);
    for (const char *const *wrong = (const char *const[]){"", "correct-horse-batter", TOKEN "y", "sha256:", NULL};
         *wrong; wrong++)
        assert_null(find(tokens, *wrong));
    const struct spl_token *first = find(tokens, TOKEN), *second = find(tokens, OTHER);
    assert_non_null(first);
    assert_non_null(second);
    assert_ptr_not_equal(first, second);
    static const struct {
        const char *id;
        bool allowed;
    } ids[] = {{"", true},      {"vault", true}, {"site-", true}, {"site-1", true},  {"a1", true},    {"b.", true},
               {"site", false}, {"c1", false},   {"a", false},    {"vault2", false}, {"Vault", false}};
    for (size_t i = 0; i < sizeof ids / sizeof *ids; i++) {
        assert_int_equal(spl_token_allows(first, SPL_SCOPE_VIEW, ids[i].id), ids[i].allowed);
        assert_int_equal(spl_token_allows(first, SPL_SCOPE_TOUR, ids[i].id), ids[i].allowed);
        assert_false(spl_token_allows(first, SPL_SCOPE_ADMIN, ids[i].id));
        assert_true(spl_token_allows(second, SPL_SCOPE_ADMIN, ids[i].id));
        assert_false(spl_token_allows(second, SPL_SCOPE_VIEW, ids[i].id));
    }
    spl_tokens_destroy(tokens);
}

static void digests_are_those_of_the_standards(void **state)
{
    (void)state;
    uint8_t digest[SPL_DIGEST_BYTES];
    char text[SPL_DIGEST_TEXT];
    assert_int_equal(spl_sha256("abc", 3, digest, NULL), 0); // FIPS 180-2, B.1
    spl_digest_to_base64url(digest, text);
    assert_string_equal(text, "ungWv48Bz-pBQUDeXa4iI7ADYaOWF3qctBD_YfIAFa0");
    assert_int_equal(spl_hmac_sha256("Jefe", 4, "what do ya want for nothing?", 28, digest, NULL), 0); // RFC 4231, 4.3
    spl_digest_to_base64url(digest, text);
    assert_string_equal(text, "W9zBRr9gdU5qBCQmCJV1x1oAPwidJzmDnexYuWTsOEM");
    assert_true(spl_secret_is_equal("abcd", "abcd", 4));
    assert_false(spl_secret_is_equal("abcd", "abce", 4));
}

static struct spl_sign_key make_key(const char *bytes)
{
    return (struct spl_sign_key){strdup(bytes), strlen(bytes)};
}

enum { expires = 2000000000 };
#define KEY "0123456789abcdef0123456789abcdef"
/* printf '/v1/datasets/wall/view?width=64&exp=2000000000' | openssl dgst -sha256 -hmac KEY -binary | basenc --base64url
 */
#define SIG "2XBn4JAxAIJXdgiOaQIWbDoR9Qvc7eY8dFymrv6PWI0"

static int check(const struct spl_sign_key *key, const char *url, int64_t now, struct spl_signed *found,
                 struct spl_error *err)
{
    char path[400];
    snprintf(path, sizeof path, "%s", url);
    char *mark = strchr(path, '?');
    *mark = '\0';
    *err = (struct spl_error){0};
    return spl_sign_check(key, path, mark + 1, now, found, err);
}

static void signed_urls_hold_until_they_expire_and_not_when_changed(void **state)
{
    (void)state;
    struct spl_sign_key key = make_key(KEY), wrong = make_key("x123456789abcdef0123456789abcdef");
    struct spl_error err = {0};
    char *url = NULL;
    struct spl_signed found = {0};
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/wall/view?width=64", expires, &url, &err), 0);
    assert_string_equal(url, "/v1/datasets/wall/view?width=64&exp=2000000000&sig=" SIG);
    assert_int_equal(check(&key, url, expires, &found, &err), 0);
    assert_int_equal(found.kept, strlen("width=64"));
    assert_int_equal(check(&key, url, expires + 1, &found, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "exp");
    assert_int_equal(check(&wrong, url, 0, &found, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "sig");
    for (size_t i = strlen("/v1/datasets/wall/view?"); url[i]; i++) { // every byte of the query counts
        url[i] ^= 1;
        assert_int_equal(check(&key, url, 0, &found, &err), SPL_E_INPUT);
        assert_null(strstr(err.message, SIG));
        url[i] ^= 1;
    }
    url[4] = 'e'; // and of the path
    assert_int_equal(check(&key, url, 0, &found, &err), SPL_E_INPUT);
    free(url);
    static const char *const broken[] = {"/a?sig=" SIG,
                                         "/a?exp=9",
                                         "/a?exp=2000000000&sig=",
                                         "/a?x=1&sig=" SIG,
                                         "/a?exp=2000000000&sig=" SIG SIG,
                                         "/a?exp=2000000000&sig=" SIG "&x=1"};
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++)
        assert_int_equal(check(&key, broken[i], 0, &found, &err), SPL_E_INPUT);
    spl_sign_key_finish(&wrong);
    spl_sign_key_finish(&key);
}

static void urls_are_signed_with_or_without_host_and_query(void **state)
{
    (void)state;
    struct spl_sign_key key = make_key(KEY);
    struct spl_error err = {0};
    char *whole = NULL, *path = NULL;
    struct spl_signed found = {.kept = 7};
    assert_int_equal(spl_sign_url(&key, "https://h:1/v1/datasets/a", expires, &whole, &err), 0);
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/a", expires, &path, &err), 0);
    assert_string_equal(whole + strlen("https://h:1"), path);
    assert_int_equal(check(&key, path, 0, &found, &err), 0);
    assert_int_equal(found.kept, 0);
    free(whole);
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/x/view?from=http://y/z", expires, &whole, &err), 0);
    assert_int_equal(check(&key, whole, 0, &found, &err), 0);
    free(whole);
    /* as a browser asks for it */
    assert_int_equal(
        spl_sign_url(&key, "/v1/datasets/x/view?clip='z'<2.5>\"&title=\xc3\xa4~%20+", expires, &whole, &err), 0);
    assert_non_null(strstr(whole, "?clip=%27z%27%3C2.5%3E%22&title=%C3%A4~%20+&exp="));
    assert_int_equal(check(&key, whole, 0, &found, &err), 0);
    free(whole);
    const char *const bad[] = {"",     "v1/x", "https://host", "https://host?/x", "://h/x",
                               "/a#b", "/a b", path,           "/v1/datasets/a?exp=3",
                               "/v1/datasets/a#b", "/v1/datasets/a b", "/v1/datasets", "/v1/datasets/a/tours",
                               "/v1/datasets/../view", "/embed/..", "/embed/a?x=1", "/embed/a?",
                               "/embed/%4", "/embed/a/b", "/v1/status"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        err = (struct spl_error){0};
        assert_int_equal(spl_sign_url(&key, bad[i], expires, &whole, &err), SPL_E_USAGE);
        assert_null(whole);
    }
    free(path);
    spl_sign_key_finish(&key);
}

/* printf '/embed/wall?exp=2000000000' | openssl dgst -sha256 -hmac KEY -binary | basenc --base64url */
#define EMBED_SIG "uGFR9oN68ejwIId_oJQIftuQOqh13V6-6sa9ooo_RZc"

static void a_signed_page_passes_its_signature_on(void **state)
{
    (void)state;
    struct spl_sign_key key = make_key(KEY);
    struct spl_error err = {0};
    char *url = NULL;
    struct spl_signed found = {.kept = 7};
    assert_int_equal(spl_sign_url(&key, "https://h/embed/w%61ll#eye=1,2,3", expires, &url, &err), 0);
    assert_string_equal(url, "https://h/embed/w%61ll?exp=2000000000&sig=" EMBED_SIG "#eye=1,2,3");
    free(url);
    static const char *const good[] = {"/v1/datasets/wall?exp=2000000000&embed=" EMBED_SIG,
                                       "/v1/datasets/w%61ll/pick?exp=2000000000&embed=" EMBED_SIG,
                                       "/embed/wall?exp=2000000000&sig=" EMBED_SIG};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        assert_int_equal(check(&key, good[i], expires, &found, &err), 0);
        assert_int_equal(found.kept, 0);
    }
    assert_int_equal(check(&key, "/v1/datasets/wall/view?eye=1&exp=2000000000&embed=" EMBED_SIG, 0, &found, &err), 0);
    assert_int_equal(found.kept, strlen("eye=1"));
    static const char *const bad[] = {"/v1/datasets/walls/view?exp=2000000000&embed=" EMBED_SIG,
                                      "/v1/datasets/wall?exp=2000000001&embed=" EMBED_SIG,
                                      "/v1/datasets/wall?exp=02000000000&embed=" EMBED_SIG,
                                      "/v1/datasets/wall?exp=2000000000&sig=" EMBED_SIG,
                                      "/v1/datasets/wall?embed=" EMBED_SIG,
                                      "/v1/datasets/%?exp=2000000000&embed=" EMBED_SIG,
                                      "/v1/tours/wall?exp=2000000000&embed=" EMBED_SIG,
                                      "/wall?exp=2000000000&embed=" EMBED_SIG};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(check(&key, bad[i], 0, &found, &err), SPL_E_INPUT);
    assert_int_equal(check(&key, good[0], expires + 1, &found, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "exp");
    spl_sign_key_finish(&key);
}

/* printf '/v1/datasets/wall/tiles/?class=2&exp=2000000000' | openssl dgst -sha256 -hmac KEY -binary | basenc
 * --base64url */
#define TILES_SIG "yrkxvyh_BaSnOvUxw7sTyeVgNJe8ZJxTatgjUQt5iMI"

/* One signature holds for every tile with these parameters, and for nothing that is written otherwise. */
static void all_tiles_are_signed_together(void **state)
{
    (void)state;
    struct spl_sign_key key = make_key(KEY);
    struct spl_error err = {0};
    struct spl_signed found = {0};
    char *url = NULL, path[200];
    static const char grant[] = "?class=2&exp=2000000000&sig=" TILES_SIG;
    static const char *const templates[] = {"{z}/{x}/{y}.png", "{z}/{x}/{y}{r}.png", "{z}/{x}/{y}@2x.webp",
                                            "{z}/{x}/{y}.webp"};
    for (size_t i = 0; i < sizeof templates / sizeof *templates; i++) {
        snprintf(path, sizeof path, "https://h/v1/datasets/wall/tiles/%s?class=2", templates[i]);
        assert_int_equal(spl_sign_url(&key, path, expires, &url, &err), 0);
        assert_string_equal(strchr(url, '?'), grant);
        free(url);
    }
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/wall/tiles.json?class=2", expires, &url, &err), 0);
    assert_string_equal(strchr(url, '?'), grant);
    free(url);
    static const char *const good[] = {"/tiles/0/0/0.png", "/tiles/30/1073741823/0.webp", "/tiles/3/1/2@2x.png",
                                       "/tiles.json"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        snprintf(path, sizeof path, "/v1/datasets/wall%s", good[i]);
        assert_true(spl_sign_covers(path, strlen(path)));
        snprintf(path, sizeof path, "/v1/datasets/wall%s%s", good[i], grant);
        assert_int_equal(check(&key, path, expires, &found, &err), 0);
        assert_int_equal(found.kept, strlen("class=2"));
        assert_int_equal(found.expires_s, expires);
        assert_int_equal(check(&key, path, expires + 1, &found, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "exp");
    }
    static const char *const other[] = {"/v1/datasets/wall/tiles/", "/v1/datasets/wall/tiles/{z}/{x}/{y}.png",
                                        "/v1/datasets/wall/tiles/0/0/0.jpg", "/v1/datasets/wall/tiles/0/0/0.png/",
                                        "/v1/datasets/wall/tiles/0/0/0", "/v1/datasets/wall/tiles/0/0/.png",
                                        "/v1/datasets/wall/tiles//0/0/0.png", "/v1/datasets/wall//tiles/0/0/0.png",
                                        "/v1/datasets/wall/tiles/-1/0/0.png", "/v1/datasets/wall/tiles/../0/0.png",
                                        "/v1/datasets/wall/tiles/%2e%2e/0/0.png",
                                        "/v1/datasets/wall/tiles/0/0/0.png%00",
                                        "/v1/datasets/wall/tiles/0%2f0/0/0.png", "/v1/datasets/wall/tiles/%30/0/0.png",
                                        "/v1/datasets/wall/tiles/0/0/0@3x.png", "/v1/datasets/wall/tiles/0/0/0@2x",
                                        "/v1/datasets//tiles/0/0/0.png", "/v1/datasets/wall/tiles.json/"};
    for (size_t i = 0; i < sizeof other / sizeof *other; i++)
        assert_false(spl_sign_covers(other[i], strlen(other[i])));
    static const char *const bad[] = {"/v1/datasets/walk/tiles/0/0/0.png?class=2&exp=2000000000&sig=" TILES_SIG,
                                      "/v1/datasets/w%61ll/tiles/0/0/0.png?class=2&exp=2000000000&sig=" TILES_SIG,
                                      "/v1/datasets/wall/tiles/0/0/0.png?class=3&exp=2000000000&sig=" TILES_SIG,
                                      "/v1/datasets/wall/tiles/0/0/0.png?exp=2000000000&sig=" TILES_SIG,
                                      "/v1/datasets/wall/tiles/0/0/0.png?class=2&exp=2000000001&sig=" TILES_SIG,
                                      "/v1/datasets/wall/tiles/0/0/0.png?class=2&exp=2000000000&embed=" TILES_SIG,
                                      "/v1/datasets/wall/view?class=2&exp=2000000000&sig=" TILES_SIG,
                                      "/v1/datasets/wall?class=2&exp=2000000000&sig=" TILES_SIG};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(check(&key, bad[i], 0, &found, &err), SPL_E_INPUT);
    /* this one alone */
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/wall/tiles/3/1/2.png", expires, &url, &err), 0);
    assert_int_equal(check(&key, url, 0, &found, &err), 0);
    url[strlen("/v1/datasets/wall/tiles/")] = '4';
    assert_int_equal(check(&key, url, 0, &found, &err), SPL_E_INPUT);
    free(url);
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/wall/tiles/{z}/{y}/{x}.png", expires, &url, &err), SPL_E_USAGE);
    assert_int_equal(spl_sign_url(&key, "/v1/datasets/wall/thumbnail.jpg?width=64", expires, &url, &err), 0);
    assert_int_equal(check(&key, url, 0, &found, &err), 0);
    free(url);
    spl_sign_key_finish(&key);
}

static void keys_that_are_too_short_are_refused(void **state)
{
    (void)state;
    char path[] = "/tmp/splatd-key-XXXXXX";
    int fd = mkstemp(path);
    struct spl_sign_key key;
    struct spl_error err = {0};
    assert_int_equal(write(fd, "0123456789abcdef0123456789abcde\n", 32), 32); // 31 and a newline
    assert_int_equal(spl_sign_key_read(path, &key, &err), SPL_E_USAGE);
    assert_null(key.bytes);
    assert_null(strstr(err.message, "0123456789abcdef"));
    assert_int_equal(pwrite(fd, "0123456789abcdef0123456789abcdef\r\n", 34, 0), 34);
    assert_int_equal(spl_sign_key_read(path, &key, &err), 0);
    assert_int_equal(key.length, 32);
    spl_sign_key_finish(&key);
    close(fd);
    unlink(path);
    assert_int_equal(spl_sign_key_read(path, &key, &(struct spl_error){0}), SPL_E_USAGE);
    assert_int_equal(spl_sign_key_read("/tmp", &key, &(struct spl_error){0}), SPL_E_USAGE);
}

static void buckets_empty_and_fill_again(void **state)
{
    (void)state;
    struct spl_buckets *buckets;
    uint8_t a[SPL_BUCKET_KEY] = {1}, b[SPL_BUCKET_KEY] = {2};
    uint64_t now = 1000 * SPL_NS_PER_S;
    assert_int_equal(spl_buckets_create(10, &buckets, NULL), 0);
    for (int i = 0; i < 20; i++)
        assert_int_equal(spl_buckets_take(buckets, a, now), 0);
    assert_int_equal(spl_buckets_take(buckets, a, now), 1);
    assert_int_equal(spl_buckets_take(buckets, b, now), 0); // others are not touched
    now += SPL_NS_PER_S / 2;
    for (int i = 0; i < 5; i++)
        assert_int_equal(spl_buckets_take(buckets, a, now), 0);
    assert_int_not_equal(spl_buckets_take(buckets, a, now), 0);
    assert_int_not_equal(spl_buckets_take(buckets, a, now - SPL_NS_PER_S), 0); // a clock that stands back gives nothing
    now += 1000 * SPL_NS_PER_S;
    for (int i = 0; i < 20; i++)
        assert_int_equal(spl_buckets_take(buckets, a, now), 0);
    assert_int_equal(spl_buckets_take(buckets, a, now), 1);
    now += 1000 * SPL_NS_PER_S;
    assert_int_equal(spl_buckets_take(buckets, a, now), 0);
    assert_int_equal(spl_buckets_charge(buckets, a, 49), 0); // 20 - 50: a debt of 30, and 1 to go on
    assert_int_equal(spl_buckets_charge(buckets, a, 49), 1 + 3); // nothing on top of a debt
    assert_int_equal(spl_buckets_take(buckets, a, now), 1 + 3);
    assert_int_equal(spl_buckets_take(buckets, b, now), 0);
    assert_int_equal(spl_buckets_take(buckets, a, now + 3 * SPL_NS_PER_S), 1);
    assert_int_equal(spl_buckets_take(buckets, a, now + 4 * SPL_NS_PER_S), 0);
    spl_buckets_destroy(buckets);
    spl_buckets_destroy(NULL);
}

static void a_table_full_of_addresses_still_works(void **state)
{
    (void)state;
    struct spl_buckets *buckets;
    uint8_t key[SPL_BUCKET_KEY] = {0};
    uint64_t now = SPL_NS_PER_S;
    assert_int_equal(spl_buckets_create(1, &buckets, NULL), 0);
    for (uint32_t i = 0; i < 100000; i++) {
        memcpy(key, &i, sizeof i);
        assert_int_equal(spl_buckets_take(buckets, key, now + i), 0);
    }
    assert_int_equal(spl_buckets_take(buckets, key, now + 100000), 0);
    assert_int_not_equal(spl_buckets_take(buckets, key, now + 100001), 0); // the latest is still known
    spl_buckets_destroy(buckets);
}

/* Who asks again and again is known among very many others: a new address takes the place of who was longest away. */
static void who_was_longest_away_makes_room(void **state)
{
    (void)state;
    struct spl_buckets *buckets;
    uint8_t key[SPL_BUCKET_KEY] = {0}, busy[SPL_BUCKET_KEY];
    uint64_t now = SPL_NS_PER_S;
    memset(busy, 0xff, sizeof busy);
    assert_int_equal(spl_buckets_create(1, &buckets, NULL), 0);
    assert_int_equal(spl_buckets_take(buckets, busy, now), 0);
    assert_int_equal(spl_buckets_take(buckets, busy, now), 0);
    for (uint32_t i = 0; i < 100000; i++) {
        memcpy(key, &i, sizeof i);
        spl_buckets_take(buckets, key, ++now);
        if (i % 10 == 0)
            assert_int_not_equal(spl_buckets_take(buckets, busy, now), 0);
    }
    spl_buckets_destroy(buckets);
}

static void a_host_is_an_address_or_a_name_that_is_listed(void **state)
{
    (void)state;
    char *items[] = {"Scans.example.", "[2001:db8::1]", "*", "not a name"};
    const struct spl_text_list none = {0}, some = {.items = items, .count = 2}, any = {.items = items, .count = 4};
    static const char *const bad[] = {"", ":80", ".", "..", "a..", "[", "[]", "[::1", "[::1]x", "[::1]:x", "[a]", "::1",
                                      "a b", "a/b", "a@b", "a:1:2", "a:80x", "a,b", "\xc3\xa4.example", "a%2e", "a#b"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_false(spl_host_is_name(bad[i]));
        assert_false(spl_host_is_ours(bad[i], &any));
    }
    char longest[300];
    memset(longest, 'a', sizeof longest);
    longest[254] = '\0';
    assert_false(spl_host_is_ours(longest, &any));
    longest[253] = '\0';
    assert_true(spl_host_is_ours(longest, &any) && !spl_host_is_ours(longest, &some));
    static const char *const ours[] = {"127.0.0.1", "1.2.3.4:80", "1.2.3.4.", "[::]", "[::1]:8080", "LOCALHOST.:1"};
    for (size_t i = 0; i < sizeof ours / sizeof *ours; i++)
        assert_true(spl_host_is_ours(ours[i], &none));
    assert_false(spl_host_is_ours("scans.example", &none));
    assert_true(spl_host_is_ours("scans.EXAMPLE:1", &some) && !spl_host_is_ours("x.scans.example", &some));
    assert_true(spl_host_is_name("a.b-c_d") && spl_host_is_name("[::1]") && spl_host_is_name("10.0.0.1"));
    assert_false(spl_host_is_name("a:80") || spl_host_is_name("[::1]:80"));

    assert_true(spl_origin_is_ours("https://a:1", "A:1", &none) &&
                spl_origin_is_ours("http://[::1]:8", "[::1]:8", &none));
    assert_true(spl_origin_is_ours("http://scans.example:8443", "127.0.0.1", &some));
    static const char *const foreign[] = {"null", "", "https://b", "https://a:2", "https://a", "a:1", "https://a:1/",
                                          "https://x@a:1", "file://", "https://a:1.evil"};
    for (size_t i = 0; i < sizeof foreign / sizeof *foreign; i++)
        assert_false(spl_origin_is_ours(foreign[i], "a:1", &any) || spl_origin_is_ours(foreign[i], NULL, &some));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_token_files_are_refused_by_line_without_the_token),
        cmocka_unit_test(tokens_allow_what_their_line_says),
        cmocka_unit_test(digests_are_those_of_the_standards),
        cmocka_unit_test(signed_urls_hold_until_they_expire_and_not_when_changed),
        cmocka_unit_test(urls_are_signed_with_or_without_host_and_query),
        cmocka_unit_test(a_signed_page_passes_its_signature_on),
        cmocka_unit_test(all_tiles_are_signed_together),
        cmocka_unit_test(keys_that_are_too_short_are_refused),
        cmocka_unit_test(buckets_empty_and_fill_again),
        cmocka_unit_test(a_table_full_of_addresses_still_works),
        cmocka_unit_test(who_was_longest_away_makes_room),
        cmocka_unit_test(a_host_is_an_address_or_a_name_that_is_listed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
