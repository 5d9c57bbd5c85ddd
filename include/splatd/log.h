/* What the library has to say that is no call's error: a driver's complaints, a layer that is missing. One setting for
 * the process. */
#ifndef SPLATD_LOG_H
#define SPLATD_LOG_H

#include <splatd/api.h>

SPL_BEGIN_DECLARATIONS

enum spl_log_level { SPL_LOG_ERROR, SPL_LOG_WARN, SPL_LOG_INFO, SPL_LOG_DEBUG };

/* Messages above `level` are dropped; SPL_LOG_INFO at start. Any thread. */
SPL_API void spl_log_set_level(enum spl_log_level level);

/* Messages go to `log` instead of stderr; NULL = to stderr again. `message` is one line without its end, without
 * control characters, at most 2 KiB, and valid during the call. Calls come from any thread, one at a time, and must not
 * call the library. Once this has returned, no call of the former is under way. Any thread. */
SPL_API void spl_log_set_callback(void (*log)(void *context, enum spl_log_level level, const char *message),
                                  void *context);

SPL_END_DECLARATIONS

#endif
