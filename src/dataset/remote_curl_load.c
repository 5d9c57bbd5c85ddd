/* Loading libcurl; see remote_curl.h. It is of the version whose header this was compiled with, or a later one of the
 * same binary interface. */
#include "dataset/remote_curl.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

static struct spl_curl curl;
static const char *missing; /* NULL = all is there */

/* dlsym() gives a data pointer, which ISO C does not convert to one of a function. */
static void find(void *library, const char *name, void *function)
{
    void *symbol = library ? dlsym(library, name) : NULL;
    memcpy(function, &symbol, sizeof symbol);
    if (!symbol && !missing)
        missing = library ? name : "libcurl.so.4";
}

static void load(void)
{
    void *library = dlopen("libcurl.so.4", RTLD_NOW | RTLD_LOCAL);
#define FIND(name) find(library, #name, &curl.name);
    SPL_CURL(FIND)
#undef FIND
    if (!missing && curl.curl_global_init(CURL_GLOBAL_DEFAULT))
        missing = "what it needs to begin";
}

const struct spl_curl *spl_curl_open(struct spl_error *err)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, load);
    if (!missing)
        return &curl;
    spl_fail(err, SPL_E_UNSUPPORTED, "reading from servers needs libcurl, of which %s is missing; install libcurl4",
             missing);
    return NULL;
}
