/* What to write instead of terms that cannot be read, or name nothing that a dataset has. Pure; any thread. */
#ifndef SPL_RENDER_TERMS_HINTS_H
#define SPL_RENDER_TERMS_HINTS_H

#include <splatd/dataset.h>
#include <splatd/soft.h>

enum { SPL_TERMS_HINT_MAX = 224 };

/* Behind the name of an attribute stands `at` where a comparison is needed: "write class:5" of "=5". False where it is
 * nothing that people mean otherwise. */
bool spl_terms_hint_sign(const char *name, const char *at, char hint[SPL_TERMS_HINT_MAX]);

/* The same of a list, behind ':': which numbers classes have. */
bool spl_terms_hint_list(const char *name, const char *at, char hint[SPL_TERMS_HINT_MAX]);

/* Of a term of an attribute that the dataset does not have: the one that may be meant, or z in place of a height. */
bool spl_terms_hint_name(const struct spl_term *term, const struct spl_dataset_info *info,
                        char hint[SPL_TERMS_HINT_MAX]);

#endif
