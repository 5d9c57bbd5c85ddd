/* A problem as a page, for people who have followed a wrong link: programs, and whatever asks for resources of the
 * interface, get JSON. Owned by the loop's thread. */
#include <stdio.h>
#include <string.h>

#include "service/exchange.h"
#include "service/pages.h"
#include "service/reply.h"

/* `text` with what HTML would take for its own as entities. */
static void put(FILE *out, const char *text)
{
    for (; *text; text++)
        if (strchr("<>&\"'", *text))
            fprintf(out, "&#%d;", *text);
        else
            fputc((unsigned char)*text < 0x20 ? '?' : *text, out);
}

bool spl_problem_wants_page(struct request *request)
{
    bool reads = !strcmp(request->method, MHD_HTTP_METHOD_GET) || !strcmp(request->method, MHD_HTTP_METHOD_HEAD);
    return reads && request->uri && strncmp(request->uri, "/v1/", 4) && spl_wants_page(request);
}

char *spl_problem_print_page(const struct request *request, unsigned status, const char *detail)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (!out)
        return NULL;
    const char *title = MHD_get_reason_phrase_for(status);
    fprintf(out,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>%s – splatd</title>\n"
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
            "<meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"/viewer/icon.svg\">\n"
            "<link rel=\"stylesheet\" href=\"/viewer/style.css\">\n</head>\n<body>\n<main class=\"problem\">\n"
            "<h1>%s</h1>\n<p>",
            title, title);
    put(out, detail);
    fputs("</p>\n", out);
    if (!strcmp(request->uri, "/") && *request->query) {
        fputs("<p>Dataset and camera stand behind #, not behind ?: <a href=\"/#", out);
        put(out, request->query);
        fputs("\">/#", out);
        put(out, request->query);
        fputs("</a></p>\n", out);
    }
    fputs("<p><a href=\"/\">To the datasets</a></p>\n</main>\n</body>\n</html>\n", out);
    return fclose(out) ? NULL : text;
}
