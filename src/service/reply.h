/* Replies: each sets request->response and status; without memory the response stays NULL and the connection closes.
 * Those of views are view/reply.h's. Owned by the loop's thread. */
#ifndef SPL_SERVICE_REPLY_H
#define SPL_SERVICE_REPLY_H

#include <jansson.h>
#include <microhttpd.h>

#include "base/error.h"

struct request;

void spl_reply_problem(struct request *request, unsigned status, const char *type, const char *field,
                       const char *detail);
void spl_reply_error(struct request *request, const struct spl_error *err); /* status and Retry-After by its code */
void spl_reply_json(struct request *request, json_t *json);                 /* takes the reference */
void spl_reply_empty(struct request *request); /* 204 */
void spl_reply_text(struct request *request, const char *type, char *body); /* 200; takes `body`, malloc'd or NULL */
/* 200; `release` gets `context` once `bytes` have been sent, not after failure. What is long is handed on in pieces:
 * the kernel takes all it is given and carries it to a near client at once, 16 MB in 18 ms of the loop. */
void spl_reply_bytes(struct request *request, const void *bytes, size_t length, void (*release)(void *), void *context);
/* 200, of a length that nobody knows when it begins; `destroy` gets `context` with the last of the reply, not after
 * failure. The only way to such a reply, HEAD included. */
void spl_reply_stream(struct request *request, size_t block, MHD_ContentReaderCallback read, void *context,
                      MHD_ContentReaderFreeCallback destroy);

/* conditions.c: may the request change what is there, whose strong validator is `tag`: NULL where nothing is, "" if it
 * has none? False: it has its reply, 412, or 400 where it would put a part. */
bool spl_check_conditions(struct request *request, const char *tag);
/* The same of what only reads: may it have what is there? False: it has its reply, 412. It comes before the next. */
bool spl_check_match(struct request *request, const char *tag);
/* Does its If-None-Match name `tag`, which may be NULL: none? */
bool spl_client_has(const struct request *request, const char *tag);

/* Adds a header to a response that there is; bytes that no header may hold become '?'. */
void spl_reply_add_header(struct request *request, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The body of a problem, malloc'd; NULL without memory. */
char *spl_problem_print(const struct request *request, unsigned status, const char *type, const char *field,
                        const char *detail);
char *spl_problem_text(const struct request *request, const struct spl_error *err);

#endif
