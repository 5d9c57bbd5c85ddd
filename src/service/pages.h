/* What lies in the program itself: the page, its modules and the clients (page_route.c), the interface's own document
 * (openapi_route.c), the table of methods (methods_route.c). Handlers of routes; owned by the loop's thread. */
#ifndef SPL_SERVICE_PAGES_H
#define SPL_SERVICE_PAGES_H

#include <stdbool.h>

struct request;
struct spl_call;

bool spl_wants_page(struct request *request); /* its Accept names text/html, and nothing of JSON before that */
/* problem_page.c: is it somebody who reads? And what that one gets to read: malloc'd, NULL without memory. */
bool spl_problem_wants_page(struct request *request);
char *spl_problem_print_page(const struct request *request, unsigned status, const char *detail);
extern const char spl_page_policy[]; /* Content-Security-Policy of pages that nobody frames */
void spl_show_page(struct request *request);
void spl_show_viewer_file(struct request *request, const struct spl_call *call);
void spl_show_embed(struct request *request, const struct spl_call *call);
void spl_list_clients(struct request *request, const struct spl_call *call);
void spl_show_client(struct request *request, const struct spl_call *call);
void spl_show_openapi_yaml(struct request *request, const struct spl_call *call);
void spl_show_openapi_json(struct request *request, const struct spl_call *call);
void spl_show_methods(struct request *request, const struct spl_call *call);

#endif
