/* What holds for every header of libsplatd, and its version. api/library.md is the guide.
 *
 * Growth: a struct that callers fill begins with `size_t size`, which spl_X_init() sets to the size that the caller was
 * compiled with. The library reads no further than that, and what a smaller struct lacks has its default, so members
 * are added at the end. Zero is the default of every member, but where spl_X_init() says otherwise. A size of 0 is
 * SPL_E_USAGE; a larger struct than the library knows is read as far as it knows, if the rest is zero, else
 * SPL_E_UNSUPPORTED. Structs that the library lends may grow at their end; all others, those inside another among them,
 * stay what they are for as long as the soname does. */
#ifndef SPLATD_API_H
#define SPLATD_API_H

#include <stddef.h>

#ifdef __GNUC__
#define SPL_API __attribute__((visibility("default")))
#else
#define SPL_API
#endif

#ifdef __cplusplus
#define SPL_BEGIN_DECLARATIONS extern "C" {
#define SPL_END_DECLARATIONS }
#else
#define SPL_BEGIN_DECLARATIONS
#define SPL_END_DECLARATIONS
#endif

#define SPL_VERSION_MAJOR 0
#define SPL_VERSION_MINOR 1
#define SPL_VERSION_PATCH 0
#define SPL_VERSION_NUMBER (SPL_VERSION_MAJOR * 10000 + SPL_VERSION_MINOR * 100 + SPL_VERSION_PATCH)

SPL_BEGIN_DECLARATIONS

/* Of the library that runs, as SPL_VERSION_NUMBER and "0.1.0"; the macros are those of the headers. Any thread. */
SPL_API int spl_version_number(void);
SPL_API const char *spl_version(void);

/* What every spl_X_init() does: zeroes a struct of `size` bytes that begins with its size, and sets that. For languages
 * that cannot call an inline function. */
SPL_API void spl_sized_init(void *sized, size_t size);

SPL_END_DECLARATIONS

/* The same as a value, in C: SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG). */
#ifndef __cplusplus
#define SPL_SIZED(name, ...) ((struct name){.size = sizeof(struct name), __VA_ARGS__})
#endif

#endif
