/* Signing and checking URLs.
 *
 * The signature is over the bytes of the request's target, undecoded, so there is one text to sign and nothing to
 * normalise; exp and sig stand at its end, in this order. Messages never hold a signature that would have been right.
 */
#include "service/access/sign.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "service/access/secret.h"

enum { key_least = 32, key_most = 4096, target_max = 16 * 1024 };

int spl_sign_key_read(const char *path, struct spl_sign_key *out, struct spl_error *err)
{
    *out = (struct spl_sign_key){0};
    int rc = spl_secret_read(path, key_most + 2, &out->bytes, &out->length, err);
    if (rc)
        return rc;
    while (out->length && strchr("\r\n", out->bytes[out->length - 1]))
        out->length--;
    if (out->length < key_least || out->length > key_most) {
        rc = spl_fail(err, SPL_E_USAGE, "the key in '%s' has %zu bytes, not %d to %d; openssl rand -hex 32 makes one",
                      path, out->length, (int)key_least, (int)key_most);
        spl_sign_key_finish(out);
    }
    return rc;
}

void spl_sign_key_finish(struct spl_sign_key *key)
{
    if (key->bytes)
        spl_secret_wipe(key->bytes, key->length);
    free(key->bytes);
    *key = (struct spl_sign_key){0};
}

/* The query's last parameter. */
static const char *last_of(const char *query)
{
    const char *mark = strrchr(query, '&');
    return mark ? mark + 1 : query;
}

bool spl_sign_is_signed(const char *query)
{
    return !strncmp(last_of(query), "sig=", 4);
}

/* Of `path`?`query`, of which `query_length` bytes count. */
static int make(const struct spl_sign_key *key, const char *path, size_t path_length, const char *query,
                size_t query_length, char out[SPL_DIGEST_TEXT], struct spl_error *err)
{
    char target[target_max];
    uint8_t digest[SPL_DIGEST_BYTES];
    if (path_length + 1 + query_length > sizeof target)
        return spl_fail_field(err, SPL_E_INPUT, "sig", "the URL is too long to be signed");
    memcpy(target, path, path_length);
    target[path_length] = '?';
    memcpy(target + path_length + 1, query, query_length);
    int rc = spl_hmac_sha256(key->bytes, key->length, target, path_length + 1 + query_length, digest, err);
    if (!rc)
        spl_digest_to_base64url(digest, out);
    return rc;
}

/* The decimal number of exp=, which ends at `end`; -1 for anything else. */
static int64_t parse_expiry(const char *text, const char *end)
{
    int64_t value = 0;
    if (end == text || end - text > 15)
        return -1;
    for (; text < end; text++) {
        if (*text < '0' || *text > '9')
            return -1;
        value = 10 * value + (*text - '0');
    }
    return value;
}

int spl_sign_check(const struct spl_sign_key *key, const char *path, const char *query, int64_t now_s, size_t *kept,
                   struct spl_error *err)
{
    char right[SPL_DIGEST_TEXT];
    const char *sig = last_of(query), *exp = sig;
    if (strncmp(sig, "sig=", 4) || sig == query)
        return spl_fail_field(err, SPL_E_INPUT, "sig", "a signed URL ends in &exp=…&sig=…");
    size_t signed_length = (size_t)(sig - query) - 1;
    for (exp = sig - 1; exp > query && exp[-1] != '&';)
        exp--;
    if (strncmp(exp, "exp=", 4))
        return spl_fail_field(err, SPL_E_INPUT, "exp", "a signed URL ends in &exp=…&sig=…");
    int rc = make(key, path, strlen(path), query, signed_length, right, err);
    if (rc)
        return rc;
    if (strlen(sig + 4) != SPL_DIGEST_TEXT - 1 || !spl_secret_is_equal(sig + 4, right, SPL_DIGEST_TEXT - 1))
        return spl_fail_field(err, SPL_E_INPUT, "sig",
                              "the URL was not signed with this service's key, or was changed");
    int64_t expires = parse_expiry(exp + 4, sig - 1);
    if (expires < now_s)
        return spl_fail_field(err, SPL_E_INPUT, "exp", "the URL has expired; ask its author for a new one");
    *kept = exp == query ? 0 : (size_t)(exp - query) - 1;
    return 0;
}

const char *spl_sign_path_of(const char *url)
{
    size_t scheme = strcspn(url, ":/?");
    const char *path =
        scheme && !strncmp(url + scheme, "://", 3) ? url + scheme + 3 + strcspn(url + scheme + 3, "/?") : url;
    return *path == '/' ? path : NULL;
}

int spl_sign_url(const struct spl_sign_key *key, const char *url, int64_t expires_s, char **out, struct spl_error *err)
{
    char sig[SPL_DIGEST_TEXT], exp[32];
    const char *path = spl_sign_path_of(url);
    *out = NULL;
    if (!path || strpbrk(url, "# \t\r\n"))
        return spl_fail(err, SPL_E_USAGE,
                        "'%.200s' is no URL such as https://HOST/v1/datasets/ID/view?width=640 or its "
                        "path, without '#' and blanks",
                        url);
    const char *mark = strchr(path, '?'), *query = mark ? mark + 1 : "";
    if (spl_sign_is_signed(query) || strstr(query, "exp="))
        return spl_fail(err, SPL_E_USAGE, "'%.200s' has exp or sig already", url);
    snprintf(exp, sizeof exp, "%sexp=%" PRId64, *query ? "&" : "", expires_s);
    char *signed_query = NULL;
    int rc = 0;
    if (asprintf(&signed_query, "%s%s", query, exp) < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
    size_t path_length = mark ? (size_t)(mark - path) : strlen(path);
    rc = make(key, path, path_length, signed_query, strlen(signed_query), sig, err);
    if (!rc &&
        asprintf(out, "%.*s?%s&sig=%s", (int)(path - url + (ptrdiff_t)path_length), url, signed_query, sig) < 0) {
        *out = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
    }
    free(signed_query);
    return rc;
}
