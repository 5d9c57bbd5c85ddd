/* Reply headers as text: name, NUL, value, NUL, …, and a last NUL; and those that say what a view's bytes mean. Pure
 * functions, any thread. */
#ifndef SPL_SERVICE_HEADERS_H
#define SPL_SERVICE_HEADERS_H

#include <stdio.h>

#include "service/request/request.h"

struct spl_headers {
    char *text; /* after close, the caller's to free */
    size_t length;
    FILE *stream; // may be NULL: memory was refused
};

void spl_headers_open(struct spl_headers *headers);

/* Bytes that no header may hold become '?'. Values are cut at 1023 bytes. */
void spl_headers_add(struct spl_headers *headers, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* False without memory; `text` is NULL then. */
bool spl_headers_close(struct spl_headers *headers);

/* for (const char *name = text, *value; (value = spl_headers_value(name)); name = spl_headers_next(value)) */
static inline const char *spl_headers_next(const char *string)
{
    while (*string++)
        ;
    return string;
}

static inline const char *spl_headers_value(const char *name)
{
    return *name ? spl_headers_next(name) : NULL;
}

/* Content-Type of `layer`, and what the values of a distance mean. `encoded` may be NULL where nothing was rendered
 * yet; what is known only of the pixels is left out then. */
void spl_headers_add_layer(struct spl_headers *headers, const struct spl_view_request *request, enum spl_layer layer,
                           const struct spl_encoded *encoded);

/* Of a whole reply: its Content-Type, what its values mean where it is one image, and the camera. */
void spl_headers_add_view(struct spl_headers *headers, const struct spl_view_request *request,
                          const struct spl_encoded *encoded);

#endif
