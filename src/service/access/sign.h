/* URLs that carry their own permission: ...?PARAMETERS&exp=UNIX-SECONDS&sig=SIGNATURE, where SIGNATURE is base64url of
 * HMAC-SHA-256 over everything from the path's '/' to the last byte before "&sig=", as it stands in the request.
 *
 * A signed page, /embed/ID?exp=…&sig=SIGNATURE, lets its reader look at dataset ID at will: the page's requests under
 * /v1/datasets/ID end in &exp=UNIX-SECONDS&embed=SIGNATURE, the same two values. The signed text is
 * /embed/ID?exp=UNIX-SECONDS with the ID decoded, so it is no other URL's, and says of which dataset and how long. Pure
 * functions but for the reading of the key; any thread.
 *
 * The tiles of a dataset are signed together: the text is /v1/datasets/ID/tiles/?PARAMETERS&exp=UNIX-SECONDS, which is
 * no path of its own, and good for /v1/datasets/ID/tiles/Z/X/Y.png (.webp, @2x) of any Z, X and Y with these
 * parameters, and for /v1/datasets/ID/tiles.json with them. One tile can be signed by itself, as any other URL. */
#ifndef SPL_SERVICE_SIGN_H
#define SPL_SERVICE_SIGN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_sign_key {
    char *bytes; // NULL = none
    size_t length;
};

/* A key is the file's content without newlines at its end, 32 to 4096 bytes. SPL_E_USAGE. Blocks on disk. */
int spl_sign_key_read(const char *path, struct spl_sign_key *out, struct spl_error *err);
void spl_sign_key_finish(struct spl_sign_key *key);

/* Does a query have the form of a signed one: is its last parameter sig or embed? */
bool spl_sign_is_signed(const char *query);

/* Can a signature allow to GET `path`[0..length): a dataset, its profile, views, picks, thumbnail, tiles, its page? */
bool spl_sign_covers(const char *path, size_t length);

/* What a signed query says. */
struct spl_signed {
    size_t kept;       // length of the query without exp and sig
    int64_t expires_s; // Unix time
    const char *grant; // in the query: its end, "exp=…&sig=…"
};

/* Checks the signature of `path`?`query` and that it has not expired at `now_s`, Unix time. SPL_E_INPUT with field sig
 * or exp. */
int spl_sign_check(const struct spl_sign_key *key, const char *path, const char *query, int64_t now_s,
                   struct spl_signed *out, struct spl_error *err);

/* Where the path of `url` begins, behind scheme and host if it has them; NULL where there is none. */
const char *spl_sign_path_of(const char *url);

/* Appends exp and sig to `url`, with or without scheme and host, and before its fragment, which only
 * a page has; a URL of tiles may be a template, with {z}/{x}/{y}; "<>' and what is not ASCII in its query become %22
 * and so on, as browsers write them. The caller frees *out. SPL_E_USAGE for what is no URL, is signed already, or
 * cannot be signed. */
int spl_sign_url(const struct spl_sign_key *key, const char *url, int64_t expires_s, char **out, struct spl_error *err);

#endif
