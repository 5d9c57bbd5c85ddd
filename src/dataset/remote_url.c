/* URLs of datasets, taken apart by hand as far as we have to know them: which scheme, what may be shown, which name.
 * The rest is the transport's (remote_curl.c), which judges hosts and ports anew.
 *
 * Invariant: no message and nothing that is shown has what stands before an '@' of the host or behind a '?'. */
#include "dataset/remote_url.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/memory.h"

enum { url_bytes_max = 4096 };

static const char unreserved[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";

static const char *get_variable(const char *name, const char *other)
{
    const char *value = getenv(name);
    return value && *value ? value : other ? getenv(other) : NULL;
}

struct spl_s3_account spl_s3_account_of_environment(void)
{
    return (struct spl_s3_account){
        .key_id = getenv("AWS_ACCESS_KEY_ID"),
        .secret = getenv("AWS_SECRET_ACCESS_KEY"),
        .token = getenv("AWS_SESSION_TOKEN"),
        .region = get_variable("AWS_REGION", "AWS_DEFAULT_REGION"),
        .endpoint = get_variable("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"),
    };
}

/* Bytes of the scheme and its "://"; 0 = it is no URL. */
static size_t scheme_length(const char *path)
{
    size_t length = strspn(path, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+-.");
    bool begins = *path && strchr("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz", *path);
    return begins && length > 1 && !strncmp(path + length, "://", 3) ? length + 3 : 0; // one letter is a drive
}

bool spl_remote_is_url(const char *path)
{
    return scheme_length(path) > 0;
}

static bool has_scheme(const char *path, const char *scheme)
{
    return !strncasecmp(path, scheme, strlen(scheme)) && scheme_length(path) == strlen(scheme) + 3;
}

/* Bytes of `path` before its query; a key of S3 has none. */
static size_t end_of_name(const char *path)
{
    return spl_remote_is_url(path) && !has_scheme(path, "s3") ? strcspn(path, "?#") : strlen(path);
}

const char *spl_remote_show(const char *path, char *out, size_t size)
{
    size_t scheme = scheme_length(path), end = end_of_name(path);
    size_t host = scheme + strcspn(path + scheme, "/?#"), skipped = scheme;
    for (size_t i = scheme; scheme && i < host; i++)
        if (path[i] == '@')
            skipped = i + 1;
    snprintf(out, size, "%.*s%.*s", (int)scheme, path, skipped < end ? (int)(end - skipped) : 0, path + skipped);
    return out;
}

bool spl_remote_has_query(const char *path)
{
    return path[end_of_name(path)];
}

char *spl_remote_make_beside(const char *path, const char *name)
{
    size_t scheme = scheme_length(path), end = end_of_name(path), folder = end;
    while (folder > scheme && path[folder - 1] != '/')
        folder--;
    const bool bare = scheme && folder == scheme; /* a host alone, which stays the host */
    const size_t kept = bare ? end : folder, bytes = kept + 1 + strlen(name) + 1;
    char *text = spl_alloc_raw(bytes, 1, NULL);
    if (text) {
        memcpy(text, path, kept);
        snprintf(text + kept, bytes - kept, "%s%s", bare ? "/" : "", name);
    }
    return text;
}

const char *spl_remote_get_stem(const char *path, size_t *length)
{
    size_t end = end_of_name(path), begin = end;
    while (begin && path[begin - 1] != '/')
        begin--;
    const char *stem = path + begin;
    size_t dot = end - begin;
    while (dot && stem[dot] != '.')
        dot--;
    *length = dot ? dot : end - begin;
    return stem;
}

/* s3://BUCKET/KEY as a URL of its endpoint: host, then bucket, then key, which is written as it is and encoded here. */
static int locate_key(const char *text, const struct spl_s3_account *account, char *out, size_t size,
                      struct spl_error *err)
{
    static const char in_buckets[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-_";
    const char *bucket = text + strlen("s3://"),
               *region = account->region && *account->region ? account->region : "us-east-1";
    size_t length = strspn(bucket, in_buckets);
    if (!length || bucket[length] != '/' || !bucket[length + 1])
        return spl_fail(err, SPL_E_USAGE,
                        "a dataset in S3 is s3://BUCKET/KEY, a bucket's name of letters, digits, '.', '-' "
                        "and '_'; keys of who asks come from the environment"); // not the text: it may have them
    if (strspn(region, "abcdefghijklmnopqrstuvwxyz0123456789-") < strlen(region))
        return spl_fail(err, SPL_E_USAGE,
                        "AWS_REGION is lower case letters, digits and '-', say eu-central-1, not '%.60s'", region);
    int used;
    if (account->endpoint && *account->endpoint) {
        size_t scheme = scheme_length(account->endpoint), end = strlen(account->endpoint);
        bool known = has_scheme(account->endpoint, "https") || has_scheme(account->endpoint, "http");
        if (!known || !account->endpoint[scheme] || strpbrk(account->endpoint, "?#@ "))
            return spl_fail(err, SPL_E_USAGE,
                            "AWS_ENDPOINT_URL is https://HOST[:PORT] or http://HOST[:PORT], without user and query");
        while (end && account->endpoint[end - 1] == '/')
            end--;
        used = snprintf(out, size, "%.*s/%.*s", (int)end, account->endpoint, (int)length, bucket);
    } else {
        used = snprintf(out, size, "https://s3.%s.amazonaws.com/%.*s", region, (int)length, bucket);
    }
    for (const char *key = bucket + length; *key && used > 0 && (size_t)used + 4 < size; key++)
        used +=
            snprintf(out + used, size - (size_t)used, strchr(unreserved, *key) ? "%c" : "%%%02X", (unsigned char)*key);
    return SPL_OK;
}

static int check_account(const struct spl_s3_account *account, struct spl_error *err)
{
    bool key = account->key_id && *account->key_id, secret = account->secret && *account->secret;
    return key == secret ? SPL_OK
                         : spl_fail(err, SPL_E_USAGE,
                                    "s3:// needs AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or neither for public "
                                    "buckets; %s is not set", key ? "AWS_SECRET_ACCESS_KEY" : "AWS_ACCESS_KEY_ID");
}

/* Names a scheme only, so that no secret is told where the rest is not understood. */
static int check_form(const char *text, const char *shown, struct spl_error *err)
{
    size_t scheme = scheme_length(text);
    bool s3 = has_scheme(text, "s3"), http = has_scheme(text, "http") || has_scheme(text, "https");
    if (!s3 && !http)
        return spl_fail(err, SPL_E_USAGE, "datasets are served from files, https://, http:// and s3://, not from %.*s",
                        scheme < 40 ? (int)scheme : 40, text);
    if (strlen(text) >= url_bytes_max)
        return spl_fail(err, SPL_E_USAGE, "%.200s…: a URL has at most %d bytes", shown, url_bytes_max - 1);
    for (const char *c = text; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f || (http && ((unsigned char)*c > 0x7e || *c == ' ')))
            return spl_fail(err, SPL_E_USAGE, "a URL of %.40s… has a blank, a control character or one that is not "
                            "ASCII; write it as %%XX", shown);
    if (http && strchr(text, '#'))
        return spl_fail(err, SPL_E_USAGE, "%.300s: a dataset's URL has no '#'", shown);
    if (http && !strcspn(text + scheme, "/?@:"))
        return spl_fail(err, SPL_E_USAGE, "%.300s names no host", shown);
    return SPL_OK;
}

int spl_remote_url_parse(const char *text, const struct spl_s3_account *account, struct spl_remote_url *out,
                         struct spl_error *err)
{
    char shown[url_bytes_max], get[4 * url_bytes_max];
    *out = (struct spl_remote_url){0};
    spl_remote_show(text, shown, sizeof shown);
    int rc = check_form(text, shown, err);
    if (rc)
        return rc;
    out->s3 = has_scheme(text, "s3");
    if (out->s3 && ((rc = check_account(account, err)) || (rc = locate_key(text, account, get, sizeof get, err))))
        return rc;
    out->shown = strdup(shown);
    out->get = strdup(out->s3 ? get : text);
    out->tls = out->get && has_scheme(out->get, "https");
    if (out->shown && out->get)
        return SPL_OK;
    spl_remote_url_finish(out);
    return spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
}

void spl_remote_url_finish(struct spl_remote_url *url)
{
    free(url->get);
    free(url->shown);
    *url = (struct spl_remote_url){0};
}
