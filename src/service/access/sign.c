/* Signing and checking URLs.
 *
 * The signature is over the bytes of the request's target, undecoded, so there is one text to sign and nothing to
 * normalise; exp and sig stand at its end, in this order. Messages never hold a signature that would have been right.
 */
#include "service/access/sign.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/memory.h"
#include "service/access/secret.h"
#include "service/request/request.h"

enum { key_least = 32, key_most = 4096, target_max = 16 * 1024, page_max = 512, pyramid_max = 1024 };

static const char datasets[] = "/v1/datasets/", pages[] = "/embed/", tiles[] = "/tiles/", tile_json[] = "/tiles.json";

int spl_sign_key_read(const char *path, struct spl_sign_key *out, struct spl_error *err)
{
    *out = (struct spl_sign_key){0};
    if (access(path, F_OK) && errno == ENOENT)
        return spl_fail(err, SPL_E_USAGE, "there is no key '%s'; openssl rand -hex 32 makes one", path);
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
    const char *last = last_of(query);
    return !strncmp(last, "sig=", 4) || !strncmp(last, "embed=", 6);
}

/* The length of the id behind `prefix` in `path`; 0 when `path` does not begin with it, or the id begins
 * with a '.', which none does: clients take ".." for a folder. */
static size_t find_id(const char *path, const char *prefix)
{
    size_t length = strlen(prefix);
    if (strncmp(path, prefix, length) != 0 || path[length] == '.')
        return 0;
    return strcspn(path + length, "/?#");
}

/* Is `text`[0..length) the name of a tile, "/tiles/3/1/2.png", and nothing that could mean another path? With `holes`,
 * which templates of URLs have: "/tiles/{z}/{x}/{y}{r}.png". */
static bool is_tile(const char *text, size_t length, bool holes)
{
    static const char digits[] = "0123456789";
    const char *at = text, *end = text + length;
    if (length < sizeof tiles || strncmp(text, tiles, sizeof tiles - 1))
        return false;
    at += sizeof tiles - 1;
    for (const char *hole = "zxy"; *hole; hole++) {
        size_t taken =
            holes ? 3 * (size_t)(at + 3 <= end && at[0] == '{' && at[1] == *hole && at[2] == '}') : strspn(at, digits);
        at += taken;
        if (!taken || (*hole != 'y' && *at++ != '/'))
            return false;
    }
    if (at + 3 < end && (!strncmp(at, "@2x", 3) || (holes && !strncmp(at, "{r}", 3))))
        at += 3;
    size_t rest = at < end ? (size_t)(end - at) : 0;
    return (rest == 4 && !strncmp(at, ".png", 4)) || (rest == 5 && !strncmp(at, ".webp", 5));
}

/* What all tiles of a dataset are signed as, /v1/datasets/ID/tiles/ with the ID as it stands: the length of it, of the
 * dataset that `path` names; 0 where that is too long. */
static size_t name_pyramid(const char *path, char out[pyramid_max])
{
    size_t head = sizeof datasets - 1 + find_id(path, datasets);
    if (head + sizeof tiles > pyramid_max)
        return 0;
    memcpy(out, path, head);
    memcpy(out + head, tiles, sizeof tiles);
    return head + sizeof tiles - 1;
}

/* Where the part of `path`[0..length) behind a dataset's id begins; NULL where it is no dataset's. */
static const char *find_rest(const char *path, size_t length)
{
    size_t id = find_id(path, datasets), head = sizeof datasets - 1 + id;
    return id && head <= length ? path + head : NULL;
}

static bool is_rest(const char *path, size_t length, const char *wanted)
{
    const char *rest = find_rest(path, length);
    return rest && (size_t)(path + length - rest) == strlen(wanted) && !strncmp(rest, wanted, strlen(wanted));
}

bool spl_sign_covers(const char *path, size_t length)
{
    static const char *const below[] = {"",         "/view",       "/pick",          "/place", "/stations",
                                        "/profile", "/legend.svg", "/thumbnail.jpg", tile_json};
    size_t id = find_id(path, pages);
    if (id)
        return sizeof pages - 1 + id == length;
    for (size_t i = 0; i < sizeof below / sizeof *below; i++)
        if (is_rest(path, length, below[i]))
            return true;
    const char *rest = find_rest(path, length);
    return rest && is_tile(rest, (size_t)(path + length - rest), false);
}

/* The signed path of the page of the dataset that `path` names behind `prefix`. */
static int name_page(const char *path, const char *prefix, char out[page_max], struct spl_error *err)
{
    size_t id = find_id(path, prefix);
    if (!id)
        return spl_fail_field(err, SPL_E_INPUT, "sig", "a page's signature is for its dataset");
    memcpy(out, pages, sizeof pages);
    return spl_percent_decode(path + strlen(prefix), id, out + sizeof pages - 1, page_max - sizeof pages, "sig", err);
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

/* Whether `shown` signs all tiles of the dataset of `path`: its TileJSON or a tile. */
static bool signs_pyramid(const struct spl_sign_key *key, const char *path, const char *query, size_t query_length,
                          const char *shown)
{
    char right[SPL_DIGEST_TEXT], pyramid[pyramid_max];
    struct spl_error ignored = {0};
    size_t length = strlen(path), signed_length;
    const char *rest = find_rest(path, length);
    bool one = rest && (!strcmp(rest, tile_json) || is_tile(rest, strlen(rest), false));
    return one && (signed_length = name_pyramid(path, pyramid)) &&
           !make(key, pyramid, signed_length, query, query_length, right, &ignored) &&
           spl_secret_is_equal(shown, right, SPL_DIGEST_TEXT - 1);
}

int spl_sign_check(const struct spl_sign_key *key, const char *path, const char *query, int64_t now_s,
                   struct spl_signed *out, struct spl_error *err)
{
    char right[SPL_DIGEST_TEXT], page[page_max];
    const char *last = last_of(query), *exp = last, *shown = strchr(last, '=');
    bool passed_on = !strncmp(last, "embed=", 6);
    if (!spl_sign_is_signed(query) || last == query)
        return spl_fail_field(err, SPL_E_INPUT, "sig", "a signed URL ends in &exp=…&sig=…");
    size_t signed_length = (size_t)(last - query) - 1;
    for (exp = last - 1; exp > query && exp[-1] != '&';)
        exp--;
    if (strncmp(exp, "exp=", 4))
        return spl_fail_field(err, SPL_E_INPUT, "exp", "a signed URL ends in &exp=…&sig=…");
    int rc = 0;
    if (passed_on || find_id(path, pages)) {
        rc = name_page(path, passed_on ? datasets : pages, page, err);
        path = page;
    }
    const char *from = passed_on ? exp : query;
    if (rc || (rc = make(key, path, strlen(path), from, signed_length - (size_t)(from - query), right, err)))
        return rc;
    if (strlen(++shown) != SPL_DIGEST_TEXT - 1 ||
        (!spl_secret_is_equal(shown, right, SPL_DIGEST_TEXT - 1) &&
         (path == page || !signs_pyramid(key, path, query, signed_length, shown))))
        return spl_fail_field(err, SPL_E_INPUT, "sig",
                              "the URL was not signed with this service's key, or was changed");
    int64_t expires = parse_expiry(exp + 4, last - 1);
    if (expires < now_s)
        return spl_fail_field(err, SPL_E_INPUT, "exp", "the URL has expired; ask its author for a new one");
    *out =
        (struct spl_signed){.kept = exp == query ? 0 : (size_t)(exp - query) - 1, .expires_s = expires, .grant = exp};
    return 0;
}

const char *spl_sign_path_of(const char *url)
{
    size_t scheme = strcspn(url, ":/?");
    const char *path =
        scheme && !strncmp(url + scheme, "://", 3) ? url + scheme + 3 + strcspn(url + scheme + 3, "/?") : url;
    return *path == '/' ? path : NULL;
}

/* Is `path`[0..length) a template of all tiles, or their TileJSON? */
static bool is_pyramid(const char *path, size_t length)
{
    const char *rest = find_rest(path, length);
    return rest && (is_rest(path, length, tile_json) || is_tile(rest, (size_t)(path + length - rest), true));
}

/* Why `url`, whose path is `path` (may be NULL), cannot be signed. */
static int refuse(const char *url, const char *path, struct spl_error *err)
{
    if (!path || strpbrk(url, " \t\r\n"))
        return spl_fail(err, SPL_E_USAGE,
                        "'%.200s' is no URL such as https://HOST/v1/datasets/ID/view?width=640 or its path, without "
                        "blanks; https://HOST/embed/ID is one as well",
                        url);
    size_t length = strcspn(path, "?#");
    bool page = find_id(path, pages);
    if (!spl_sign_covers(path, length) && !is_pyramid(path, length))
        return spl_fail(
            err, SPL_E_USAGE,
            "'%.200s' cannot be signed: a signature allows to GET /v1/datasets/ID, its /view, /pick, "
            "/place, /stations, /profile, /legend.svg and /thumbnail.jpg, its tiles /tiles/{z}/{x}/{y}.png, and the "
            "page /embed/ID; anything else needs a token",
            url);
    if (page && path[length] == '?')
        return spl_fail(err, SPL_E_USAGE,
                        "'%.200s' cannot be signed: /embed/ID takes camera and settings behind '#', not behind '?'",
                        url);
    if (!page && strchr(path, '#'))
        return spl_fail(err, SPL_E_USAGE, "'%.200s' cannot be signed: only /embed/ID has something behind '#'", url);
    return 0;
}

/* `query` with what browsers write otherwise in one, "<>' and what is not ASCII, as they write it: they would ask for
 * bytes that were not signed. NULL without memory; the caller frees it. */
static char *write_as_browsers_do(const char *query)
{
    char *out = spl_alloc(3 * strlen(query) + 1, 1, NULL), *to = out;
    for (; out && *query; query++) {
        const unsigned char c = (unsigned char)*query;
        if (strchr("\"<>'", c) || c < 0x21 || c > 0x7e)
            to += sprintf(to, "%%%02X", c);
        else
            *to++ = *query;
    }
    return out;
}

int spl_sign_url(const struct spl_sign_key *key, const char *url, int64_t expires_s, char **out, struct spl_error *err)
{
    char sig[SPL_DIGEST_TEXT], exp[32], page[page_max], pyramid[pyramid_max];
    const char *path = spl_sign_path_of(url);
    *out = NULL;
    int rc = refuse(url, path, err);
    if (rc)
        return rc;
    size_t path_length = strcspn(path, "?#"), signed_length = path_length;
    const char *query = path[path_length] == '?' ? path + path_length + 1 : "";
    if (spl_sign_is_signed(query) || strstr(query, "exp="))
        return spl_fail(err, SPL_E_USAGE, "'%.200s' has exp or sig already", url);
    snprintf(exp, sizeof exp, "%sexp=%" PRId64, *query ? "&" : "", expires_s);
    char *written = write_as_browsers_do(query), *signed_query = NULL;
    if (!written || asprintf(&signed_query, "%s%s", written, exp) < 0) {
        free(written);
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
    }
    free(written);
    const char *signed_path = path, *fragment = path + strcspn(path, "#");
    if (find_id(path, pages)) {
        struct spl_error why = {0};
        if (name_page(path, pages, page, &why))
            rc = spl_fail(err, SPL_E_USAGE, "'%.200s' cannot be signed: %s", url, why.message);
        signed_path = page;
        signed_length = rc ? 0 : strlen(page);
    } else if (is_pyramid(path, path_length)) {
        signed_path = pyramid;
        if (!(signed_length = name_pyramid(path, pyramid)))
            rc = spl_fail(err, SPL_E_USAGE, "'%.200s' cannot be signed: its id is too long", url);
    }
    if (!rc)
        rc = make(key, signed_path, signed_length, signed_query, strlen(signed_query), sig, err);
    if (!rc && asprintf(out, "%.*s?%s&sig=%s%s", (int)(path - url + (ptrdiff_t)path_length), url, signed_query, sig,
                        fragment) < 0) {
        *out = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
    }
    free(signed_query);
    return rc;
}
