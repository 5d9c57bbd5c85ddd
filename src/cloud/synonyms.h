/* Names of columns beyond those of rows.h: easting, Rechtswert, rouge, reflectivity, … One table for headings of texts
 * and for the fields of PLY and PCD. Pure functions. */
#ifndef SPL_CLOUD_SYNONYMS_H
#define SPL_CLOUD_SYNONYMS_H

#include <string.h>
#include <strings.h>

#include "cloud/reader.h"

static inline bool spl_name_is(const char *name, size_t length, const char *other)
{
    return strlen(other) == length && !strncasecmp(other, name, length);
}

enum spl_synonym_pass { SPL_SYNONYM_AXES, SPL_SYNONYM_WORDS, SPL_SYNONYM_PARTS, SPL_SYNONYM_PASSES };

/* The column that a name without a unit means, SKIP: none in this pass. For columns alone that no field has by its own
 * name, or in an earlier pass. `letters`: e and n are there together, and mean east and north. */
int spl_column_from_synonym(const char *name, size_t length, bool letters, enum spl_synonym_pass pass);

/* For readers whose fields have names, once all that are known by rows.h are taken: the others, whose `column` is SKIP,
 * may get one that the cloud lacks. Of coordinates whose names say a unit ("x_ft") it would be lost: they get none. */
struct spl_field_name {
    const char *name;
    int8_t *column; // enum spl_column
};
void spl_cloud_take_synonyms(struct spl_cloud *cloud, const struct spl_field_name *fields, unsigned count);

#endif
