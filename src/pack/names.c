/* A message is a line for a person: three names say what is meant, the rest is a number. Its text holds three of the
 * longest and that number. Pure; any thread. */
#include "pack/names.h"

#include <stdio.h>
#include <string.h>

enum { names_listed = 3 };

void spl_names_add(struct spl_names *names, const char *name)
{
    size_t used = strlen(names->text);
    if (names->count++ < names_listed)
        snprintf(names->text + used, sizeof names->text - used, "%s%.60s", used ? ", " : "", name);
}

const char *spl_names_list(struct spl_names *names)
{
    size_t used = strlen(names->text);
    if (names->count > names_listed)
        snprintf(names->text + used, sizeof names->text - used, " and %zu more", names->count - names_listed);
    return names->text;
}

json_t *spl_names_describe(const char *(*get)(const void *context, size_t i), const void *context, size_t count)
{
    json_t *all = json_array();
    for (size_t i = 0; all && i < count && i < SPL_NAMES_KEPT; i++)
        json_array_append_new(all, json_string_nocheck(get(context, i)));
    if (all && count > SPL_NAMES_KEPT)
        json_array_append_new(all, json_sprintf("and %zu more", count - SPL_NAMES_KEPT));
    return all;
}
