/* Replies with views, as reply.h says of replies. Owned by the loop's thread. */
#ifndef SPL_SERVICE_VIEW_REPLY_H
#define SPL_SERVICE_VIEW_REPLY_H

#include "service/view/rendering.h"

struct request;

/* `origin`, static, is Splatd-Cache's value, and what the log says of the cache. */
void spl_reply_rendering(struct request *request, struct spl_rendering *rendering, const char *origin);
void spl_reply_not_modified(struct request *request, const struct spl_key *key);
/* A batch; takes *bundle. `failed` parts of it are problems. */
void spl_reply_bundle(struct request *request, struct spl_encoded *bundle, size_t failed);
/* What HEAD says of a view that nobody has rendered. */
void spl_reply_view_head(struct request *request, const struct spl_view_request *view, const struct spl_key *key);

#endif
