/* A dataset's profile as JSON or as a chart. Owned by the loop's thread. */
#include <string.h>

#include "measure/report.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/reply.h"

/* Names the first parameter that is not "format" with a value we have. */
static void refuse(struct request *request)
{
    char name[64] = "format";
    for (const char *pair = request->query; *pair; pair += strcspn(pair, "&"), pair += *pair == '&') {
        size_t length = strcspn(pair, "=&");
        if (length == 6 && !strncmp(pair, "format", 6))
            continue;
        snprintf(name, sizeof name, "%.*s", (int)length, pair);
        break;
    }
    spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", name, "a profile takes format=json or format=svg only");
}

static void reply_with_chart(struct request *request, const struct spl_profile *profile, uint64_t splats)
{
    struct spl_error err = {0};
    char *svg = NULL;
    size_t length = 0;
    if (spl_report_chart(profile, splats, 0, NULL, &svg, &length, &err))
        spl_reply_error(request, &err);
    else
        spl_reply_text(request, "image/svg+xml", svg);
}

static void reply_with(struct request *request, const struct spl_profile *profile, uint64_t splats)
{
    if (!strcmp(request->query, "") || !strcmp(request->query, "format=json"))
        spl_reply_json(request, spl_profile_to_json(profile));
    else if (!strcmp(request->query, "format=svg"))
        reply_with_chart(request, profile, splats);
    else
        refuse(request);
}

void spl_show_profile(struct request *request, const struct spl_call *call)
{
    const struct spl_catalog_entry *entry = call->entry;
    struct spl_error err = {0};
    struct spl_profile profile;
    if (spl_plan_copy_profile(entry->plan, &profile, &err)) {
        err.code = err.code == SPL_E_NOMEM ? err.code : SPL_E_NOT_FOUND;
        spl_reply_error(request, &err);
        return;
    }
    reply_with(request, &profile, entry->info->leaf_splats);
    spl_profile_finish(&profile);
}
