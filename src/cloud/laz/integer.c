/* How much room the models of an integer can take. Pure. */
#include "cloud/laz/integer.h"

size_t spl_laz_integer_bytes(unsigned bits, unsigned contexts)
{
    size_t bytes = contexts * spl_laz_model_bytes(bits + 1);
    for (unsigned k = 1; k <= bits; k++)
        bytes += spl_laz_model_bytes(1u << (k < SPL_LAZ_HIGH_BITS ? k : SPL_LAZ_HIGH_BITS));
    return bytes;
}
