/* Lines are put together in a buffer of their own thread's stack and written with one write(2) of less than PIPE_BUF
 * bytes, when poll(2) says that it will not block. The mutex keeps a second thread from taking the room that poll has
 * promised the first; it is held for one write that does not block, or one call of a program's callback, which may
 * not log: so the callback is gone once another has been set. */
#include "base/log.h"

#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/text.h"

enum { line_max = 2048, end_room = 8 }; /* what closes a string, an object and the line always fits */

static _Atomic(int) log_level = SPL_LOG_INFO, log_format = SPL_LOG_TEXT;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static uint64_t dropped; // guarded by: mutex
static void (*callback)(void *context, enum spl_log_level level, const char *message); // guarded by: mutex; may be NULL
static void *callback_context;                                                         // guarded by: mutex

static const char *const level_names[] = {"error", "warning", "info", "debug"};

struct line {
    char text[line_max];
    size_t used;
};

void spl_log_set_level(enum spl_log_level level)
{
    atomic_store(&log_level, (int)level);
}

void spl_log_set_callback(void (*log)(void *context, enum spl_log_level level, const char *message), void *context)
{
    pthread_mutex_lock(&mutex);
    callback = log;
    callback_context = context;
    pthread_mutex_unlock(&mutex);
}

bool spl_log_is_on(enum spl_log_level level)
{
    return (int)level <= atomic_load(&log_level);
}

void spl_log_set_format(enum spl_log_format format)
{
    atomic_store(&log_format, (int)format);
}

enum spl_log_format spl_log_get_format(void)
{
    return (enum spl_log_format)atomic_load(&log_format);
}

static void add_char(struct line *line, char c)
{
    if (line->used < line_max - end_room)
        line->text[line->used++] = c;
}

static void add_plain(struct line *line, const char *text)
{
    for (; *text; text++)
        add_char(line, *text);
}

/* Text from anywhere: one line that a terminal shows and does not act on; in JSON ASCII only. */
static void add_outside(struct line *line, const char *text, bool json)
{
    size_t length;
    bool printable;
    for (; (length = spl_text_next(text, &printable)); text += length) {
        bool plain = printable && (!json || length == 1), escape = json && (*text == '"' || *text == '\\');
        size_t bytes = plain ? length : json ? length : 1;
        if (line->used + escape + bytes >= line_max - end_room)
            return; // an escape stays in one piece, and a character
        if (escape)
            add_char(line, '\\');
        for (size_t i = 0; i < bytes; i++)
            add_char(line, plain ? text[i] : '?');
    }
}

/* Ends a string even where the line is full. */
static void close_with(struct line *line, const char *end)
{
    size_t length = strlen(end);
    if (line->used + length < line_max) {
        memcpy(line->text + line->used, end, length);
        line->used += length;
    }
}

static void add_string(struct line *line, const char *text)
{
    add_char(line, '"');
    add_outside(line, text, true);
    close_with(line, "\"");
}

static void add_number(struct line *line, double number)
{
    char text[40];
    if (!isfinite(number))
        number = 0;
    snprintf(text, sizeof text, floor(number) == number && fabs(number) < 1e15 ? "%.0f" : "%.3f", number);
    add_plain(line, text);
}

static void add_time(struct line *line)
{
    char text[64];
    struct timespec now;
    struct tm utc;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    size_t used = strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
    snprintf(text + used, sizeof text - used, ".%03ldZ", now.tv_nsec / 1000000);
    add_plain(line, text);
}

static void make_json(struct line *line, enum spl_log_level level, const char *message,
                      const struct spl_log_field *fields, size_t count)
{
    add_plain(line, "{\"time\":\"");
    add_time(line);
    add_plain(line, "\",\"level\":\"");
    add_plain(line, level_names[level]);
    add_plain(line, "\",\"message\":");
    add_string(line, message);
    for (size_t i = 0; i < count; i++) {
        if (line->used + strlen(fields[i].name) + 48 > line_max - end_room)
            break; // no room for a name and a number
        add_plain(line, ",\"");
        add_plain(line, fields[i].name);
        add_plain(line, "\":");
        if (fields[i].text)
            add_string(line, fields[i].text);
        else
            add_number(line, fields[i].number);
    }
    close_with(line, "}");
}

/* The message and name=value… */
static void add_message(struct line *line, const char *message, const struct spl_log_field *fields, size_t count)
{
    add_outside(line, message, false);
    for (size_t i = 0; i < count; i++) {
        add_char(line, ' ');
        add_plain(line, fields[i].name);
        add_char(line, '=');
        if (!fields[i].text)
            add_number(line, fields[i].number);
        else if (!*fields[i].text || strpbrk(fields[i].text, " \"=\\"))
            add_string(line, fields[i].text);
        else
            add_outside(line, fields[i].text, false);
    }
}

static void make_text(struct line *line, enum spl_log_level level, const char *message,
                      const struct spl_log_field *fields, size_t count)
{
    if (!isatty(STDERR_FILENO)) {
        add_time(line);
        add_char(line, ' ');
    }
    add_plain(line, "splatd: ");
    add_plain(line, level_names[level]);
    add_plain(line, ": ");
    add_message(line, message, fields, count);
}

static void make(struct line *line, enum spl_log_level level, const char *message, const struct spl_log_field *fields,
                 size_t count)
{
    line->used = 0;
    (atomic_load(&log_format) == SPL_LOG_JSON ? make_json : make_text)(line, level, message, fields, count);
    close_with(line, "\n");
}

/* False when it would block or fails. */
static bool put(const struct line *line)
{
    struct pollfd fd = {.fd = STDERR_FILENO, .events = POLLOUT};
    return poll(&fd, 1, 0) == 1 && fd.revents & POLLOUT &&
           write(STDERR_FILENO, line->text, line->used) == (ssize_t)line->used;
}

void spl_log_fields(enum spl_log_level level, const char *message, const struct spl_log_field *fields, size_t count)
{
    struct line line;
    if (!spl_log_is_on(level))
        return;
    pthread_mutex_lock(&mutex);
    if (callback) {
        line.used = 0;
        add_message(&line, message, fields, count);
        line.text[line.used] = '\0';
        callback(callback_context, level, line.text);
        pthread_mutex_unlock(&mutex);
        return;
    }
    if (dropped) {
        struct spl_log_field lines = {"lines", NULL, (double)dropped};
        make(&line, SPL_LOG_WARN, "stderr did not take log lines, they are lost", &lines, 1);
        if (put(&line))
            dropped = 0;
    }
    make(&line, level, message, fields, count);
    if (dropped || !put(&line))
        dropped++;
    pthread_mutex_unlock(&mutex);
}

void spl_log(enum spl_log_level level, const char *format, ...)
{
    char message[1024];
    if (!spl_log_is_on(level))
        return;
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    spl_log_fields(level, message, NULL, 0);
}
