/* Arrays on the heap that grow. Their room doubles, so that adding one by one costs no more than filling at once.
 *
 *     struct row *rows = NULL;
 *     size_t count = 0, capacity = 0;
 *     if (spl_array_reserve(rows, capacity, count + 1, err))
 *         return SPL_E_NOMEM;
 *     rows[count++] = …;
 *     free(rows); */
#ifndef SPL_BASE_ARRAY_H
#define SPL_BASE_ARRAY_H

#include <stddef.h>

#include "base/error.h"

/* Makes room in `array`, a pointer to elements that is NULL at first and released with free(), for `wanted` of them in
 * all; `capacity`, a size_t, says how many there is room for. Both are evaluated several times. What is new is not
 * zeroed. 0, or SPL_E_NOMEM, and array and capacity are as they were. Any thread. */
#define spl_array_reserve(array, capacity, wanted, err)                                                                \
    __extension__({                                                                                                    \
        void *spl_array_ = spl_array_grow((array), &(capacity), (wanted), sizeof *(array), (err));                     \
        if (spl_array_)                                                                                                \
            (array) = spl_array_;                                                                                      \
        spl_array_ ? SPL_OK : SPL_E_NOMEM;                                                                             \
    })

/* What the macro calls: where the elements of `size` bytes lie now, never NULL but without memory. */
void *spl_array_grow(void *array, size_t *capacity, size_t wanted, size_t size, struct spl_error *err);

#endif
