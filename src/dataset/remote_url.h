/* Where a dataset lies that is not on this machine: https://, http:// and s3:// URLs. Pure; any thread. */
#ifndef SPL_DATASET_REMOTE_URL_H
#define SPL_DATASET_REMOTE_URL_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

/* What s3:// is asked with; members may be NULL or "". Borrowed from the environment. */
struct spl_s3_account {
    const char *key_id, *secret, *token; /* no key: nothing is signed, as of public buckets */
    const char *region;                  /* else us-east-1 */
    const char *endpoint;                /* https://HOST[:PORT][/PREFIX] of a server other than Amazon's */
};

/* AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN, AWS_REGION (or AWS_DEFAULT_REGION), AWS_ENDPOINT_URL_S3
 * (or AWS_ENDPOINT_URL). */
struct spl_s3_account spl_s3_account_of_environment(void);

struct spl_remote_url {
    char *get;   /* what is asked for, https or http, with whatever secrets its query or user has */
    char *shown; /* for people: the same without user, password and query; of s3:// as it was written */
    bool s3;     /* to be signed as S3, unless the account has no key */
    bool tls;
};

/* Does a path begin as a URL does, of whatever scheme? */
bool spl_remote_is_url(const char *path);

/* SPL_E_USAGE says what is wrong, without secrets. On success the caller finishes *out. */
int spl_remote_url_parse(const char *text, const struct spl_s3_account *account, struct spl_remote_url *out,
                         struct spl_error *err);
void spl_remote_url_finish(struct spl_remote_url *url);

/* What may be shown of `path`, a URL or not: no user, no password, no query. Cut to `size`; returns `out`. */
const char *spl_remote_show(const char *path, char *out, size_t size);

/* Does a URL end in a query, which is good for what it was made for alone? */
bool spl_remote_has_query(const char *path);

/* Where `name`, a file's plain name (SPL_NAME_LETTERS), lies beside `path`: the same folder of the same disk, host or
 * bucket, whatever the name. A query is left behind. NULL: no memory. */
char *spl_remote_make_beside(const char *path, const char *name);

/* The name at the end of a path or URL, without folder, query and ending; *length bytes of it, maybe 0. */
const char *spl_remote_get_stem(const char *path, size_t *length);

#endif
