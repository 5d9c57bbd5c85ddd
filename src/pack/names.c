/* Names in a message, which is a line for a person: three of them say what is meant, the rest is a number. The text
 * holds three of the longest and that number. Pure; any thread. */
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
