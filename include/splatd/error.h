/* Error codes and the caller-owned error record that every fallible call of libsplatd fills.
 *
 * Fallible calls return 0 (or a non-negative result) on success and a negative SPL_E_* on failure. `err` may be NULL.
 * The first error wins: filling an already filled record keeps the first message. */
#ifndef SPLATD_ERROR_H
#define SPLATD_ERROR_H

#include <stdbool.h>

#include <splatd/api.h>

SPL_BEGIN_DECLARATIONS

enum spl_code {
    SPL_OK = 0,
    SPL_E_NOMEM = -1,       /* host memory refused */
    SPL_E_IO = -2,          /* the operating system failed a read, write, sync or rename */
    SPL_E_INPUT = -3,       /* a file's or request's content is wrong; message names file, place, field, value */
    SPL_E_USAGE = -4,       /* an argument of a call or a command line is wrong */
    SPL_E_UNSUPPORTED = -5, /* recognised, but not supported (yet, or in this build) */
    SPL_E_CORRUPT = -6,     /* a container's checksum or structure does not hold */
    SPL_E_NOT_FOUND = -7,
    SPL_E_LIMIT = -8,       /* larger than a limit; message has both numbers */
    SPL_E_BUSY = -9,        /* a bounded queue is full; retry helps */
    SPL_E_TIMEOUT = -10,    /* a deadline passed; retry may help */
    SPL_E_NO_DEVICE = -11,  /* no usable GPU; message says why each failed */
    SPL_E_DEVICE_LOST = -12,
    SPL_E_CANCELLED = -13,
    SPL_E_INTERNAL = -14,   /* a bug of ours */
};

struct spl_error {
    int code;           /* enum spl_code; 0 while empty: initialise with {0} */
    char field[64];     /* the parameter or file field at fault, "" when there is none */
    char message[512];  /* one sentence, no newline, says what to do where that is known */
};

/* One row of the table of codes; static. */
struct spl_code_info {
    const char *name; /* "input", "device-lost", … */
    bool retry;       /* the same call may succeed later */
};

/* The row of `code`; never NULL (unknown codes give the row of SPL_E_INTERNAL). Any thread. */
SPL_API const struct spl_code_info *spl_code_get_info(int code);

SPL_END_DECLARATIONS

#endif
