/* libcurl behind dlopen: forty libraries come with it, which only who reads from afar has to wait for. A file that
 * includes this calls its functions by their names, after spl_curl_open(). */
#ifndef SPL_DATASET_REMOTE_CURL_H
#define SPL_DATASET_REMOTE_CURL_H

#define CURL_DISABLE_TYPECHECK /* its macros would take a member of that name for the function */
#include <curl/curl.h>

#include "base/error.h"

#define SPL_CURL(F)                                                                                                    \
    F(curl_easy_cleanup)                                                                                               \
    F(curl_easy_getinfo)                                                                                               \
    F(curl_easy_init)                                                                                                  \
    F(curl_easy_perform)                                                                                               \
    F(curl_easy_reset)                                                                                                 \
    F(curl_easy_setopt)                                                                                                \
    F(curl_easy_strerror)                                                                                              \
    F(curl_global_init)                                                                                                \
    F(curl_slist_append)                                                                                               \
    F(curl_slist_free_all)

#define SPL_CURL_FUNCTION(name) __typeof__(name) *name;
struct spl_curl {
    SPL_CURL(SPL_CURL_FUNCTION)
};
#undef SPL_CURL_FUNCTION

/* Loads it the first time, for good. NULL: SPL_E_UNSUPPORTED says what is missing. Any thread. */
const struct spl_curl *spl_curl_open(struct spl_error *err);

#endif
