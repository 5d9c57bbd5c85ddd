/* Conditions of requests that change something (RFC 9110, 13.1.1 and 13.1.2): who says "only if nothing is there" or
 * "only while it is what I have seen" must not overwrite what another has put there meanwhile. And a part of a whole,
 * which is none here (14.5). Owned by the loop's thread. */
#include <string.h>

#include "service/exchange.h"
#include "service/reply.h"
#include "service/view/key.h"

static const char *get_header(const struct request *request, const char *name)
{
    return MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, name);
}

/* Weak validators match nothing, nor does a list that has one. */
static bool is_one_of(const char *list, const char *tag)
{
    return tag && spl_etag_matches(list, tag) && !strstr(list, "W/");
}

bool spl_check_conditions(struct request *request, const char *tag)
{
    const char *only = get_header(request, MHD_HTTP_HEADER_IF_MATCH),
               *unless = get_header(request, MHD_HTTP_HEADER_IF_NONE_MATCH);
    if (only && !is_one_of(only, tag))
        spl_reply_problem(request, MHD_HTTP_PRECONDITION_FAILED, "conflict", MHD_HTTP_HEADER_IF_MATCH,
                          tag ? "what is there is another version than the request names"
                              : "nothing is there, and the request is for what is");
    else if (unless && tag && spl_etag_matches(unless, tag))
        spl_reply_problem(request, MHD_HTTP_PRECONDITION_FAILED, "conflict", MHD_HTTP_HEADER_IF_NONE_MATCH,
                          "there is one already, and the request is to replace none");
    else if (get_header(request, MHD_HTTP_HEADER_CONTENT_RANGE))
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", MHD_HTTP_HEADER_CONTENT_RANGE,
                          "a body is all of what is put, not a part of it");
    else
        return true;
    return false;
}
