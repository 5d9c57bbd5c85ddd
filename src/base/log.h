/* Leveled messages to a program's callback, or to stderr as text or JSON: one line each, one write, so that lines of
 * several threads never mix. Any thread. Never blocks on who reads: a line that stderr does not take at once is dropped
 * and counted, and the next line that gets through says how many were. What came from outside cannot break a line:
 * control characters become '?'. */
#ifndef SPL_BASE_LOG_H
#define SPL_BASE_LOG_H

#include <stdbool.h>
#include <stddef.h>

#include <splatd/log.h>

enum spl_log_format {
    SPL_LOG_TEXT, /* TIME splatd: LEVEL: MESSAGE name=value…, without TIME on a terminal */
    SPL_LOG_JSON, /* {"time", "level", "message", name: value…} */
};

bool spl_log_is_on(enum spl_log_level level);

/* SPL_LOG_TEXT at start. */
void spl_log_set_format(enum spl_log_format format);
enum spl_log_format spl_log_get_format(void);

void spl_log(enum spl_log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));

struct spl_log_field {
    const char *name; /* a plain word */
    const char *text; // may be NULL: the value is `number`
    double number;
};

/* A message with named values. A line is at most 2 KiB; values beyond are cut, later fields left out. */
void spl_log_fields(enum spl_log_level level, const char *message, const struct spl_log_field *fields, size_t count);

#define spl_log_error(...) spl_log(SPL_LOG_ERROR, __VA_ARGS__)
#define spl_log_warn(...) spl_log(SPL_LOG_WARN, __VA_ARGS__)
#define spl_log_info(...) spl_log(SPL_LOG_INFO, __VA_ARGS__)
#define spl_log_debug(...) spl_log(SPL_LOG_DEBUG, __VA_ARGS__)

#endif
