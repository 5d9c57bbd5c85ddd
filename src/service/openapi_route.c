/* The interface's own document, /v1/openapi.yaml as it lies in api/, and the same as JSON; both are made part of the
 * program at build time, so that they speak of this version. Owned by the loop's thread. */
#include <string.h>

#include "openapi_json.h"
#include "openapi_yaml.h"
#include "service/pages.h"
#include "service/reply.h"

void spl_show_openapi_yaml(struct request *request, const struct spl_call *call)
{
    (void)call;
    spl_reply_text(request, "application/yaml", strdup((const char *)openapi_yaml));
}

void spl_show_openapi_json(struct request *request, const struct spl_call *call)
{
    (void)call;
    spl_reply_text(request, "application/json", strdup((const char *)openapi_json));
}
