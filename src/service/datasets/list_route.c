/* GET /v1/datasets: what there is, and what it is doing. Of a thousand datasets that is megabytes and tenths of a
 * second, for which many may ask at once and then read slowly. So it is made once for all who see the same and had
 * asked before, and whoever is sent the same text shares it. Owned by the loop's thread. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "geom/json.h"
#include "service/access/access.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"
#include "service/state.h"

struct spl_listed {
    char *text; // owned
    size_t length;
    unsigned references;
};

static void let_go(void *context)
{
    struct spl_listed *listed = context;
    if (!listed || --listed->references)
        return;
    free(listed->text);
    free(listed);
}

static char *print(struct request *request)
{
    const struct spl_catalog *catalog = &request->service->library->catalog;
    json_t *list = json_array();
    for (size_t i = 0; i < catalog->count; i++)
        if (spl_access_may_see(request, catalog->slots[i].id))
            json_array_append_new(list, spl_describe_slot(&catalog->slots[i]));
    json_t *json = json_pack("{s:o}", "datasets", list);
    if (catalog->left_out)
        json_object_set_new(json, "left_out", json_integer((json_int_t)catalog->left_out));
    return spl_json_print(json);
}

/* The text in place of the last one, or that where it says the same. Takes `text`, malloc'd or NULL. */
static struct spl_listed *keep(struct spl_listing *listing, char *text)
{
    const size_t length = text ? strlen(text) : 0;
    if (text && listing->last && listing->last->length == length && !memcmp(listing->last->text, text, length)) {
        free(text);
        return listing->last;
    }
    struct spl_listed *listed = text ? spl_alloc(1, sizeof *listed, NULL) : NULL;
    if (!listed) {
        free(text);
        return NULL;
    }
    *listed = (struct spl_listed){text, length, 1};
    let_go(listing->last);
    return listing->last = listed;
}

void spl_list_datasets(struct request *request, const struct spl_call *call)
{
    (void)call;
    struct spl_listing *listing = &request->service->library->listing;
    const uint64_t now_ns = spl_now_ns();
    const bool again =
        listing->last && request->began_ns <= listing->made_ns && listing->seen_by == request->token;
    struct spl_listed *listed = again ? listing->last : keep(listing, print(request));
    if (!listed)
        return;
    if (!again)
        listing->made_ns = now_ns;
    listing->seen_by = request->token;
    listed->references++;
    spl_reply_bytes(request, listed->text, listed->length, let_go, listed);
    if (request->response)
        spl_reply_add_header(request, MHD_HTTP_HEADER_CONTENT_TYPE, "application/json");
    else
        let_go(listed);
}

void spl_listing_forget(struct spl_listing *listing)
{
    let_go(listing->last);
    listing->last = NULL;
}
