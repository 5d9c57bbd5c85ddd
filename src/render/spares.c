/* A few blocks of memory; see spares.h. */
#include "render/spares.h"

#include <stdlib.h>

void spl_spares_drop(struct spl_spares *spares)
{
    for (int i = 0; i < SPL_SPARES; i++) {
        free(spares->at[i].data);
        spares->at[i].data = NULL;
    }
}

void *spl_spares_take(struct spl_spares *spares, size_t bytes, size_t *room)
{
    for (int i = 0; i < SPL_SPARES; i++) {
        void *data = spares->at[i].data;
        if (!data || spares->at[i].room < bytes || spares->at[i].room - bytes > bytes / 8)
            continue;
        *room = spares->at[i].room;
        spares->at[i].data = NULL;
        return data;
    }
    spl_spares_drop(spares);
    *room = bytes;
    return NULL;
}

void spl_spares_keep(struct spl_spares *spares, void *data, size_t room, uint64_t most)
{
    uint64_t kept = room;
    int place = -1;
    for (int i = 0; i < SPL_SPARES; i++) {
        place = spares->at[i].data ? place : i;
        kept += spares->at[i].data ? spares->at[i].room : 0;
    }
    if (place < 0 || kept > most) {
        free(data);
        return;
    }
    spares->at[place].data = data;
    spares->at[place].room = room;
}
