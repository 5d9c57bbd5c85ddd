/* Leveled messages to stderr: one line each, timestamped only when stderr is no terminal. Any thread; never blocks on a
 * lock of ours (each line is one write). */
#ifndef SPL_BASE_LOG_H
#define SPL_BASE_LOG_H

enum spl_log_level { SPL_LOG_ERROR, SPL_LOG_WARN, SPL_LOG_INFO, SPL_LOG_DEBUG };

/* Messages above `level` are dropped; SPL_LOG_INFO at start. */
void spl_log_set_level(enum spl_log_level level);

void spl_log(enum spl_log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));

#define spl_log_error(...) spl_log(SPL_LOG_ERROR, __VA_ARGS__)
#define spl_log_warn(...) spl_log(SPL_LOG_WARN, __VA_ARGS__)
#define spl_log_info(...) spl_log(SPL_LOG_INFO, __VA_ARGS__)
#define spl_log_debug(...) spl_log(SPL_LOG_DEBUG, __VA_ARGS__)

#endif
