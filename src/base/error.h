/* Filling struct spl_error; see include/splatd/error.h for the codes. */
#ifndef SPL_BASE_ERROR_H
#define SPL_BASE_ERROR_H

#include <splatd/error.h>

/* Fills `err` (may be NULL) unless it already holds an error, and returns `code`. */
int spl_fail(struct spl_error *err, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The same, naming the parameter or field at fault. */
int spl_fail_field(struct spl_error *err, int code, const char *field, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Appends ": " + strerror(errno_value) to the message; code SPL_E_IO, and errno is errno_value. */
int spl_fail_errno(struct spl_error *err, int errno_value, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Our own bugs only; stays on in release builds. Outside input never reaches it. */
#define spl_assert(condition) ((condition) ? (void)0 : spl_assert_failed(#condition, __FILE__, __LINE__))
_Noreturn void spl_assert_failed(const char *condition, const char *file, int line);

#endif
