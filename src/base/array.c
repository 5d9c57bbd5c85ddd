/* Growing arrays: twice the room, or what is wanted where that is more; a product that overflows is refused like memory
 * that there is not. Invariant: `capacity` changes only together with the array. Any thread. */
#include "base/array.h"

#include <stdint.h>

#include "base/memory.h"

void *spl_array_grow(void *array, size_t *capacity, size_t wanted, size_t size, struct spl_error *err)
{
    enum { least = 8 };
    if (array && wanted <= *capacity)
        return array;
    size_t larger = *capacity > SIZE_MAX / 2 ? SIZE_MAX : 2 * *capacity;
    larger = larger < least ? least : larger;
    larger = larger < wanted ? wanted : larger;
    void *grown = spl_realloc(array, larger, size, err);
    if (grown)
        *capacity = larger;
    return grown;
}
