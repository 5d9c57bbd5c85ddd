/* The one table of errors, and the record that carries them. Messages quote files and requests, so they are made
 * printable here, where all of them come by: one line of UTF-8. Reentrant; no global state. */
#include "base/error.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/text.h"

static const struct spl_code_info table[] = {
    [-SPL_OK] = {"ok", false},
    [-SPL_E_NOMEM] = {"out-of-memory", true},
    [-SPL_E_IO] = {"io", false},
    [-SPL_E_INPUT] = {"input", false},
    [-SPL_E_USAGE] = {"usage", false},
    [-SPL_E_UNSUPPORTED] = {"unsupported", false},
    [-SPL_E_CORRUPT] = {"corrupt", false},
    [-SPL_E_NOT_FOUND] = {"not-found", false},
    [-SPL_E_LIMIT] = {"limit", false},
    [-SPL_E_BUSY] = {"busy", true},
    [-SPL_E_TIMEOUT] = {"timeout", true},
    [-SPL_E_NO_DEVICE] = {"no-device", false},
    [-SPL_E_DEVICE_LOST] = {"device-lost", true},
    [-SPL_E_CANCELLED] = {"cancelled", true},
    [-SPL_E_INTERNAL] = {"internal", false},
};

const struct spl_code_info *spl_code_get_info(int code)
{
    if (code > 0 || code < SPL_E_INTERNAL)
        code = SPL_E_INTERNAL;
    return &table[-code];
}

/* The last character of a text that filled its room, where only a part of its bytes is left. */
static void drop_cut_character(char *text, size_t size)
{
    size_t used = strlen(text), back = 1;
    if (used + 1 < size)
        return;
    while (back < 4 && back < used && (text[used - back] & 0xc0) == 0x80)
        back++;
    bool printable;
    if ((unsigned char)text[used - back] >= 0xc0 && spl_text_next(text + used - back, &printable) != back)
        text[used - back] = '\0';
}

static int fill(struct spl_error *err, int code, const char *field, const char *format, va_list args)
{
    if (!err || err->code != SPL_OK)
        return code;
    err->code = code;
    spl_text_show(field, err->field, sizeof err->field);
    vsnprintf(err->message, sizeof err->message, format, args);
    drop_cut_character(err->message, sizeof err->message);
    spl_text_clean(err->message);
    return code;
}

int spl_fail(struct spl_error *err, int code, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fill(err, code, "", format, args);
    va_end(args);
    return code;
}

int spl_fail_field(struct spl_error *err, int code, const char *field, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fill(err, code, field, format, args);
    va_end(args);
    return code;
}

int spl_fail_errno(struct spl_error *err, int errno_value, const char *format, ...)
{
    if (err && err->code == SPL_OK) {
        va_list args;
        va_start(args, format);
        fill(err, SPL_E_IO, "", format, args);
        va_end(args);
        size_t used = strlen(err->message);
        snprintf(err->message + used, sizeof err->message - used, ": %s", strerror(errno_value));
    }
    errno = errno_value;
    return SPL_E_IO;
}

void spl_assert_failed(const char *condition, const char *file, int line)
{
    if (spl_log_get_format() == SPL_LOG_JSON)
        spl_log_error("bug: %s does not hold at %s:%d", condition, file, line);
    else
        fprintf(stderr, "splatd: bug: %s does not hold at %s:%d\n", condition, file, line);
    abort();
}
