/* The public face of the flag that long work polls (base/work.h). Any thread. */
#include "base/work.h"

_Static_assert(sizeof(atomic_bool) == sizeof(bool) && _Alignof(atomic_bool) == _Alignof(bool),
               "struct spl_cancel is an atomic_bool that C++ can name");

void spl_cancel_set(struct spl_cancel *cancel)
{
    atomic_store((atomic_bool *)&cancel->cancelled, true);
}

void spl_cancel_clear(struct spl_cancel *cancel)
{
    atomic_store((atomic_bool *)&cancel->cancelled, false);
}

bool spl_cancel_is_set(const struct spl_cancel *cancel)
{
    return spl_is_cancelled(spl_cancel_get_flag(cancel));
}
