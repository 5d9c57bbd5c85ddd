/* Where a request ends. A proxy in front and libmicrohttpd 0.9.75 behind it must not see two ends, or the rest of one
 * client's request becomes the beginning of another's (RFC 9112, 5.2, 6.3 and 11.2). libmicrohttpd takes the first of
 * several lengths and a coding before a length, takes a name with a space in it for one it has never heard of, makes
 * one name of a name and the line that is folded behind it, cuts a value and each part of the first line at a NUL, and
 * takes a line that begins with a colon for the end of the headers. Such a request is refused once its headers are
 * there, and the connection ends, so that nothing behind them is read.
 *
 * What cannot be done here, since libmicrohttpd acts before it asks: a single length that is no number (malformed.c); a
 * bare LF ends a line, also one that is a colon alone. Owned by the loop's thread.
 */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"

enum { line_end = 2 }; /* bytes at most, which libmicrohttpd has made NULs of */

struct framing {
    const char *begin, *end; /* of the request, as libmicrohttpd has cut it into strings; NULL: it is not known to */
    const char *at;          /* end of the last value */
    unsigned lengths, codings;
    const char *coding;
    char fault[160]; /* "" while there is none */
    const char *field;
};

static bool is_token(const char *text, size_t length)
{
    static const char others[] = "!#$%&'*+-.^_`|~";
    for (size_t i = 0; i < length; i++) {
        char c = text[i], letter = (char)(c | 0x20);
        if (!((c >= '0' && c <= '9') || (letter >= 'a' && letter <= 'z') || (c && strchr(others, c))))
            return false;
    }
    return length > 0;
}

/* "Content-Length26" is what libmicrohttpd makes of a name whose value stands folded on the next line. */
static bool begins_longer(const char *name, size_t length, const char *framing)
{
    return length > strlen(framing) && !strncasecmp(name, framing, strlen(framing));
}

static bool is_blank(const char *from, const char *to, const char *allowed)
{
    for (; from < to; from++)
        if (*from && !strchr(allowed, *from))
            return false;
    return true;
}

/* Does nothing but line ends lie between the last value and this header, and blanks between its name and its value?
 * Versions of libmicrohttpd whose strings lie elsewhere are not looked at. */
static bool follows(struct framing *framing, const char *name, size_t name_length, const char *value,
                    size_t value_length)
{
    if (!framing->begin)
        return true;
    if (name < framing->begin || !value || value < name + name_length || value + value_length > framing->end)
        return false; // folded: it was put together elsewhere
    bool plain =
        (!framing->at || (name > framing->at && name <= framing->at + line_end && is_blank(framing->at, name, ""))) &&
        is_blank(name + name_length, value, " \t");
    framing->at = value + value_length;
    return plain;
}

static enum MHD_Result look(void *context, enum MHD_ValueKind kind, const char *name, size_t name_length,
                            const char *value, size_t value_length)
{
    (void)kind;
    struct framing *framing = context;
    if (!follows(framing, name, name_length, value, value_length)) {
        framing->field = "headers";
        snprintf(framing->fault, sizeof framing->fault,
                 "a header is folded, holds a NUL, or stands behind a line that has no name or a NUL");
    } else if (!is_token(name, name_length)) {
        framing->field = "headers";
        snprintf(framing->fault, sizeof framing->fault,
                 "a header's name holds a space or another character that none has");
    } else if (begins_longer(name, name_length, MHD_HTTP_HEADER_CONTENT_LENGTH) ||
               begins_longer(name, name_length, MHD_HTTP_HEADER_TRANSFER_ENCODING)) {
        framing->field = "headers";
        snprintf(framing->fault, sizeof framing->fault, "the header %.40s is none, nor may one be folded", name);
    } else if (!strcasecmp(name, MHD_HTTP_HEADER_CONTENT_LENGTH)) {
        framing->lengths++;
    } else if (!strcasecmp(name, MHD_HTTP_HEADER_TRANSFER_ENCODING)) {
        framing->codings++;
        framing->coding = value;
    }
    return framing->fault[0] ? MHD_NO : MHD_YES;
}

/* The first line lies in the buffer as method, target and version, a NUL behind each: what stands between the end of
 * one and the next, and is no blank, is what a NUL of the client's has cut off. The target's end was seen before it was
 * decoded in place. What stands behind the version is found before the first header. */
static bool is_cut(struct framing *framing, const struct request *request, const char *version)
{
    const char *behind = framing->begin + strlen(framing->begin) + 1;
    if (version < framing->begin || version >= framing->end)
        return false; // none was there: HTTP/0.9
    framing->at = version + strlen(version);
    while (behind < request->target_begin && *behind == ' ')
        behind++;
    return behind != request->target_begin || request->target_end + 1 != version;
}

static void judge(struct framing *framing, const char *version)
{
    const char *why = NULL;
    framing->field = MHD_HTTP_HEADER_CONTENT_LENGTH;
    if (framing->lengths > 1)
        why = "the request has several Content-Length headers";
    else if (framing->lengths && framing->codings)
        why = "the request has both Content-Length and Transfer-Encoding";
    else if (framing->codings)
        framing->field = MHD_HTTP_HEADER_TRANSFER_ENCODING;
    if (framing->codings > 1)
        why = "the request has several Transfer-Encoding headers";
    else if (!why && framing->codings && (!framing->coding || strcasecmp(framing->coding, "chunked")))
        why = "the body's coding can only be 'chunked'";
    else if (!why && framing->codings && strcmp(version, MHD_HTTP_VERSION_1_1))
        why = "a body in chunks needs HTTP/1.1";
    if (why)
        snprintf(framing->fault, sizeof framing->fault, "%s", why);
}

bool spl_check_framing(struct request *request, const char *line, const char *version)
{
    static const char cut_in_place[] = "0.9.75"; // the version whose way with the buffer was read
    struct framing framing = {0};
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(request->handle, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    if (info && !strcmp(MHD_get_version(), cut_in_place)) {
        framing.begin = line;
        framing.end = line + info->header_size;
    }
    if (framing.begin && is_cut(&framing, request, version)) {
        framing.field = "request";
        snprintf(framing.fault, sizeof framing.fault, "the first line of the request holds a NUL");
    }
    if (!framing.fault[0])
        MHD_get_connection_values_n(request->handle, MHD_HEADER_KIND, look, &framing);
    // behind the last value: its line's end and an empty line; with another character a name of none was there
    if (!framing.fault[0] && framing.at && (framing.end > framing.at + 4 || !is_blank(framing.at, framing.end, ""))) {
        framing.field = "headers";
        snprintf(framing.fault, sizeof framing.fault,
                 "a line of the headers has no name, or the first one holds a NUL");
    }
    if (!framing.fault[0])
        judge(&framing, version);
    if (!framing.fault[0] && framing.codings)
        request->chunks = framing.end;
    if (!framing.fault[0])
        return true;
    request->closes = true;
    spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", framing.field, framing.fault);
    return false;
}
