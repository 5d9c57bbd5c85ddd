/* Ownership of a dictionary's arrays. */
#include "sparse/dictionary.h"

#include <stdlib.h>

void spl_dictionary_finish(struct spl_dictionary *dictionary)
{
    free(dictionary->scale);
    free(dictionary->texels);
    *dictionary = (struct spl_dictionary){0};
}
