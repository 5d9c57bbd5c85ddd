/* Where requests end up: scheme, host and port of URLs, as libcurl reads them, and whether a redirect may be followed.
 * Any thread. */
#include <stdio.h>
#include <string.h>

#include "dataset/remote_curl.h"
#include "dataset/remote_link.h"

static bool get_origin(const struct spl_curl *curl, CURLU *url, char out[SPL_REMOTE_ORIGIN_MAX])
{
    char *scheme = NULL, *host = NULL, *port = NULL;
    const bool known = !curl->curl_url_get(url, CURLUPART_SCHEME, &scheme, 0) &&
                       !curl->curl_url_get(url, CURLUPART_HOST, &host, 0) &&
                       !curl->curl_url_get(url, CURLUPART_PORT, &port, CURLU_DEFAULT_PORT);
    const int length =
        known ? snprintf(out, SPL_REMOTE_ORIGIN_MAX, "%s://%s:%s", scheme, host, port) : SPL_REMOTE_ORIGIN_MAX;
    curl->curl_free(scheme);
    curl->curl_free(host);
    curl->curl_free(port);
    if (length < 0 || length >= SPL_REMOTE_ORIGIN_MAX)
        *out = '\0';
    return *out;
}

bool spl_curl_origin_of(const struct spl_curl *curl, const char *url, char out[SPL_REMOTE_ORIGIN_MAX])
{
    CURLU *parsed = curl->curl_url();
    *out = '\0';
    const bool known =
        parsed && !curl->curl_url_set(parsed, CURLUPART_URL, url, 0) && get_origin(curl, parsed, out);
    curl->curl_url_cleanup(parsed);
    return known;
}

bool spl_curl_may_go_on(const struct spl_curl *curl, CURLU *at, const char *location, size_t bytes, const char *own,
                        const char *landed)
{
    char text[4096], origin[SPL_REMOTE_ORIGIN_MAX];
    if (bytes >= sizeof text)
        return false;
    snprintf(text, sizeof text, "%.*s", (int)bytes, location);
    return !curl->curl_url_set(at, CURLUPART_URL, text, 0) && get_origin(curl, at, origin) &&
           (!strcmp(origin, own) || (*landed && !strcmp(origin, landed)));
}
