/* Which names are answered, and what pages of other origins may do. Owned by the loop's thread. */
#ifndef SPL_SERVICE_DOOR_H
#define SPL_SERVICE_DOOR_H

#include <stdbool.h>

struct request;

/* Each is true to go on; else the request has its reply. The first is for every request; `anonymous` says that no token
 * decides. The second is for those that change something and show no token; the third for browsers' preflights. */
bool spl_door_check_host(struct request *request, bool anonymous);
bool spl_door_check_origin(struct request *request);
bool spl_door_check_preflight(struct request *request, const char *method);

/* Adds what lets pages of listed origins read the reply. */
void spl_door_add_cors(struct request *request);

#endif
