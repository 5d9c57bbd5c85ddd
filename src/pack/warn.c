/* Warnings as text. Nothing is kept and nothing is allocated, so whoever warns needs not think of failure: a text that
 * is too long is cut. Any thread; what `warn` does is its owner's business. */
#include "pack/warn.h"

#include <stdarg.h>
#include <stdio.h>

void spl_pack_warn(void (*warn)(void *context, const char *text), void *context, const char *format, ...)
{
    char text[1200];
    va_list arguments;
    if (!warn)
        return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    warn(context, text);
}
