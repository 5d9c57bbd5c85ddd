/* The versions are those of the headers that this was compiled with: structs of theirs are read. Stays loaded. */
#include "image/ffmpeg.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

#define NUMBER(n) #n
#define FILE_OF(library, version) "lib" #library ".so." NUMBER(version)

static struct spl_ffmpeg ffmpeg;
static char missing[100]; /* "" = all are there */

static void *open_library(const char *file)
{
    void *library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (!library && !missing[0]) // why may name paths of this machine, and who asks may be far away
        snprintf(missing, sizeof missing, "%s does not load", file);
    return library;
}

/* dlsym() gives a data pointer, which ISO C does not convert to one of a function. */
static void find(void *library, const char *name, void *function)
{
    void *symbol = library ? dlsym(library, name) : NULL;
    memcpy(function, &symbol, sizeof symbol);
    if (!symbol && !missing[0])
        snprintf(missing, sizeof missing, "its libraries have no %s", name);
}

static void load(void)
{
    void *avutil = open_library(FILE_OF(avutil, LIBAVUTIL_VERSION_MAJOR));
    void *avcodec = open_library(FILE_OF(avcodec, LIBAVCODEC_VERSION_MAJOR));
    void *avformat = open_library(FILE_OF(avformat, LIBAVFORMAT_VERSION_MAJOR));
    void *swscale = open_library(FILE_OF(swscale, LIBSWSCALE_VERSION_MAJOR));
#define FIND(library, name) find(library, #name, &ffmpeg.name);
    SPL_FFMPEG(FIND)
#undef FIND
}

const struct spl_ffmpeg *spl_ffmpeg_open(struct spl_error *err)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, load);
    if (!missing[0])
        return &ffmpeg;
    spl_fail_field(err, SPL_E_UNSUPPORTED, "video", "videos need FFmpeg: %s; install libavformat%d and libswscale%d",
                   missing, LIBAVFORMAT_VERSION_MAJOR, LIBSWSCALE_VERSION_MAJOR);
    return NULL;
}
