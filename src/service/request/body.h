/* A body of JSON into a document, within bounds. Pure, any thread. */
#ifndef SPL_SERVICE_BODY_H
#define SPL_SERVICE_BODY_H

#include <jansson.h>

#include "base/error.h"

enum {
    SPL_BODY_VALUES = 1 << 15,     /* numbers, texts, arrays, …: 256 views of a hundred each; the loop parses them */
    SPL_BODY_TEXT = 1 << 16,       /* bytes of its longest text: jansson copies it many times over */
    SPL_BODY_PATH_VALUES = 1 << 18 /* of a tour, which a thread of the pool parses; its path may be one text */
};

/* The document, the caller's; NULL for what is no JSON, has a key twice, has more than `values_max` values, a text of
 * more than `text_max` bytes or a number of more than 2 KiB (SPL_E_INPUT, field "body"). `body` need not end in NUL,
 * and may be NULL where length is 0. */
json_t *spl_body_parse(const char *body, size_t length, size_t values_max, size_t text_max, struct spl_error *err);

#endif
