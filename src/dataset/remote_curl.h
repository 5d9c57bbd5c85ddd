/* libcurl behind dlopen: forty libraries come with it, which only who reads from afar has to wait for. A file that
 * includes this calls its functions by their names, after spl_curl_open(). */
#ifndef SPL_DATASET_REMOTE_CURL_H
#define SPL_DATASET_REMOTE_CURL_H

#define CURL_DISABLE_TYPECHECK /* its macros would take a member of that name for the function */
#include <curl/curl.h>

#include <stdbool.h>

#include "base/error.h"
#include "dataset/remote_link.h"

#define SPL_CURL(F)                                                                                                    \
    F(curl_easy_cleanup)                                                                                               \
    F(curl_easy_getinfo)                                                                                               \
    F(curl_easy_init)                                                                                                  \
    F(curl_easy_perform)                                                                                               \
    F(curl_easy_reset)                                                                                                 \
    F(curl_easy_setopt)                                                                                                \
    F(curl_easy_strerror)                                                                                              \
    F(curl_global_init)                                                                                                \
    F(curl_free)                                                                                                       \
    F(curl_slist_append)                                                                                               \
    F(curl_slist_free_all)                                                                                             \
    F(curl_url)                                                                                                        \
    F(curl_url_cleanup)                                                                                                \
    F(curl_url_get)                                                                                                    \
    F(curl_url_set)

#define SPL_CURL_FUNCTION(name) __typeof__(name) *name;
struct spl_curl {
    SPL_CURL(SPL_CURL_FUNCTION)
};
#undef SPL_CURL_FUNCTION

/* Loads it the first time, for good. NULL: SPL_E_UNSUPPORTED says what is missing. Any thread. */
const struct spl_curl *spl_curl_open(struct spl_error *err);

/* Scheme, host and port of a URL; false and "" where it has none. */
bool spl_curl_origin_of(const struct spl_curl *curl, const char *url, char out[SPL_REMOTE_ORIGIN_MAX]);

/* Does what a redirect says lead to origin `own`, or `landed` where that is not ""? It is resolved against *at, which
 * it becomes. */
bool spl_curl_may_go_on(const struct spl_curl *curl, CURLU *at, const char *location, size_t bytes, const char *own,
                        const char *landed);

#endif
