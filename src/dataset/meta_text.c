/* Texts of META: titles, names of sources, units, colours' origins. A file is anybody's, and its texts go to terminals,
 * pages and JSON of others; so what cannot be shown in them becomes '?' once, before anybody reads one, and a line of
 * the log says which it was. Texts that have lines (a description, WKT) keep their ends. The opener's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "base/text.h"
#include "dataset/open.h"

enum { path_bytes = 80 };

struct cleaning {
    char path[path_bytes]; /* of the first text that was changed; "" while none was */
    struct spl_error *err;
};

static int clean_text(json_t *json, const char *path, struct cleaning *cleaning)
{
    const char *text = json_string_value(json);
    const bool lines = !strcmp(path, "description") || !strcmp(path, "crs");
    char *copy = spl_alloc_raw(strlen(text) + 1, 1, cleaning->err), *end = copy;
    bool changed = false, printable;
    if (!copy)
        return SPL_E_NOMEM;
    for (size_t length; (length = spl_text_next(text, &printable)); text += length) {
        const bool kept = printable || (lines && strchr("\n\r\t", *text));
        const size_t bytes = kept ? length : 1; // never more
        memcpy(end, kept ? text : "?", bytes);
        end += bytes;
        changed = changed || !kept;
    }
    *end = '\0';
    const bool failed = changed && json_string_set(json, copy);
    free(copy);
    if (changed && !cleaning->path[0])
        snprintf(cleaning->path, sizeof cleaning->path, "%s", path);
    return failed ? spl_fail(cleaning->err, SPL_E_NOMEM, "out of memory") : SPL_OK;
}

/* As deep as the parser lets JSON be. */
static int clean(json_t *json, const char *path, struct cleaning *cleaning)
{
    char below[path_bytes];
    const char *key;
    json_t *value;
    size_t i;
    int rc = json_is_string(json) ? clean_text(json, path, cleaning) : SPL_OK;
    json_object_foreach(json, key, value)
    {
        snprintf(below, sizeof below, "%.38s%s%.38s", path, path[0] ? "." : "", key);
        if (!rc)
            rc = clean(value, below, cleaning);
    }
    json_array_foreach(json, i, value)
    {
        snprintf(below, sizeof below, "%.50s[%zu]", path, i);
        if (!rc)
            rc = clean(value, below, cleaning);
    }
    return rc;
}

int spl_dataset_clean_meta(struct spl_dataset *dataset, struct spl_error *err)
{
    struct cleaning cleaning = {.err = err};
    int rc = clean(dataset->meta, "", &cleaning);
    if (!rc && cleaning.path[0])
        spl_log_warn("%s: section META: \"%s\" holds characters that cannot be shown; they are read as '?'",
                     dataset->name, cleaning.path);
    return rc;
}
