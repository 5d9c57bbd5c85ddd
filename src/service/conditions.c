/* Conditions of requests (RFC 9110, 13.1.1 and 13.1.2). Who says "only if nothing is there" or "only while it is what I
 * have seen" must not overwrite what another has put there meanwhile; who has what is there need not be sent it again.
 * And a part of a whole, which is none here (14.5).
 *
 * Several lines of one header are one list (5.3), of which it is enough that one names the validator. Owned by the
 * loop's thread. */
#include <strings.h>

#include "service/exchange.h"
#include "service/reply.h"
#include "service/view/key.h"

struct list {
    const char *header, *tag; // tag may be NULL: it names none
    bool strong, given, names_it;
};

static enum MHD_Result look(void *context, enum MHD_ValueKind kind, const char *header, const char *value)
{
    (void)kind;
    struct list *list = context;
    if (!strcasecmp(header, list->header)) {
        list->given = true;
        list->names_it |= value && list->tag && spl_etag_matches(value, list->tag, list->strong);
    }
    return MHD_YES;
}

static struct list read_list(const struct request *request, const char *header, const char *tag, bool strong)
{
    struct list list = {.header = header, .tag = tag, .strong = strong};
    MHD_get_connection_values(request->handle, MHD_HEADER_KIND, look, &list);
    return list;
}

bool spl_client_has(const struct request *request, const char *tag)
{
    return read_list(request, MHD_HTTP_HEADER_IF_NONE_MATCH, tag, false).names_it;
}

bool spl_check_match(struct request *request, const char *tag)
{
    const struct list only = read_list(request, MHD_HTTP_HEADER_IF_MATCH, tag, true);
    if (!only.given || only.names_it)
        return true;
    spl_reply_problem(request, MHD_HTTP_PRECONDITION_FAILED, "conflict", MHD_HTTP_HEADER_IF_MATCH,
                      tag ? "what is there is another version than the request names"
                          : "nothing is there, and the request is for what is");
    return false;
}

bool spl_check_conditions(struct request *request, const char *tag)
{
    if (!spl_check_match(request, tag))
        return false;
    if (spl_client_has(request, tag))
        spl_reply_problem(request, MHD_HTTP_PRECONDITION_FAILED, "conflict", MHD_HTTP_HEADER_IF_NONE_MATCH,
                          "there is one already, and the request is to replace none");
    else if (MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_RANGE))
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", MHD_HTTP_HEADER_CONTENT_RANGE,
                          "a body is all of what is put, not a part of it");
    else
        return true;
    return false;
}
