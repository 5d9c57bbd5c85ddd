/* Who may do what: bearer tokens, signed URLs, how often; door.h has names and pages. Owned by the loop's thread. */
#ifndef SPL_SERVICE_ACCESS_H
#define SPL_SERVICE_ACCESS_H

#include "base/error.h"
#include "service/access/tokens.h"

struct spl_service;
struct request;
struct spl_call;
struct spl_access;

/* Reads what the options name: tokens, the key of URLs, rates. Refuses an address that others can reach where anybody
 * might do anything and nobody has said so; it is called before that is opened, or with the socket that was passed.
 * service->access stays NULL where there is nothing to check. */
int spl_access_init(struct spl_service *service, struct spl_error *err);
void spl_access_finish(struct spl_service *service); /* idempotent */

/* Reads tokens and key again; what cannot be used is logged and the old ones stay. */
void spl_access_reload(struct spl_service *service);

/* Each is true to go on; else the request has its reply. admit() is asked once a request, before anything is looked at;
 * check() before the dataset that call->id names is looked for. A signed query loses exp and sig. */
bool spl_access_admit(struct request *request, const char *method);
bool spl_access_check(struct request *request, enum spl_scope scope, const struct spl_call *call);

/* Counts an admitted request as `count` more of its address, for what it wants costs as much; false, and it has its
 * reply, where others of that address came in between. Of what all may do together each takes one with take_one(), when
 * it is its turn: false, later. */
bool spl_access_charge(struct request *request, unsigned count);
bool spl_access_take_one(struct spl_service *service);

/* May listings that answer `request` show dataset `id`? */
bool spl_access_may_see(struct request *request, const char *id);
#endif
