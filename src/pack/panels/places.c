/* Which panels a group's discs reach into: found in a hash, then sorted. One worker's; in the order of the points. */
#include "pack/panels/raster_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/hash.h"
#include "base/memory.h"

void spl_panel_raster_finish(struct spl_panel_raster *r)
{
    free(r->places);
    free(r->slots);
    free(r->touches);
    free(r->sorted);
    free(r->order);
    free(r->filled);
    *r = (struct spl_panel_raster){0};
}

static bool grow_slots(struct spl_panel_raster *r)
{
    size_t count = r->slot_count ? 2 * r->slot_count : 256;
    uint32_t *slots = spl_alloc(count, sizeof *slots, NULL);
    if (!slots)
        return false;
    for (size_t i = 0; i < r->place_count; i++) {
        size_t at = spl_hash_slot(spl_hash_pair(r->places[i].column, r->places[i].row), count - 1);
        while (slots[at])
            at = (at + 1) & (count - 1);
        slots[at] = (uint32_t)i + 1;
    }
    free(r->slots);
    r->slots = slots;
    r->slot_count = count;
    return true;
}

/* The index of the place (column, row), a new one where there is none yet; UINT32_MAX: no memory. */
static uint32_t place_of(struct spl_panel_raster *r, int32_t column, int32_t row)
{
    if (2 * (r->place_count + 1) > r->slot_count && !grow_slots(r))
        return UINT32_MAX;
    size_t at = spl_hash_slot(spl_hash_pair(column, row), r->slot_count - 1);
    while (r->slots[at] && (r->places[r->slots[at] - 1].column != column || r->places[r->slots[at] - 1].row != row))
        at = (at + 1) & (r->slot_count - 1);
    if (!r->slots[at]) {
        if (spl_array_reserve(r->places, r->place_capacity, r->place_count + 1, NULL))
            return UINT32_MAX;
        r->places[r->place_count] = (struct spl_panel_place){.column = column, .row = row};
        r->slots[at] = (uint32_t)++r->place_count;
    }
    return r->slots[at] - 1;
}

static bool find_places(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    uint32_t last = UINT32_MAX; /* most discs reach into the panel that the one before them does, and no other */
    r->place_count = r->touch_count = 0;
    if (r->slot_count)
        memset(r->slots, 0, r->slot_count * sizeof *r->slots);
    for (size_t m = 0; m < g->group->count; m++) {
        struct spl_panel_disc d = spl_panel_grid_disc(g, g->group->members[m]);
        int32_t low[2], high[2], from[2], to[2], own[2];
        spl_panel_disc_range(&d, low, high);
        for (int a = 0; a < 2; a++) {
            from[a] = spl_panel_of_cell(g, a, low[a]);
            to[a] = spl_panel_of_cell(g, a, high[a]);
            own[a] = spl_panel_of_cell(g, a, spl_panel_floor(a ? d.y : d.x));
        }
        for (int32_t row = from[1]; row <= to[1]; row++)
            for (int32_t column = from[0]; column <= to[0]; column++) {
                if (last == UINT32_MAX || r->places[last].column != column || r->places[last].row != row)
                    last = place_of(r, column, row);
                if (last == UINT32_MAX || (r->touch_count == r->touch_capacity &&
                                           spl_array_reserve(r->touches, r->touch_capacity, r->touch_count + 1, NULL)))
                    return false;
                r->places[last].touches++;
                r->touches[r->touch_count++] = (struct spl_panel_touch){
                    .place = last, .own = column == own[0] && row == own[1], .member = g->group->members[m]};
            }
    }
    return true;
}

static uint64_t spread(uint32_t bits)
{
    uint64_t x = bits;
    x = (x | x << 16) & 0x0000ffff0000ffffull;
    x = (x | x << 8) & 0x00ff00ff00ff00ffull;
    x = (x | x << 4) & 0x0f0f0f0f0f0f0f0full;
    x = (x | x << 2) & 0x3333333333333333ull;
    return (x | x << 1) & 0x5555555555555555ull;
}

static int compare_places(const void *a, const void *b)
{
    const struct spl_panel_place *x = a, *y = b;
    return (x->order > y->order) - (x->order < y->order);
}

/* Places in Morton order, and touches by place, in their order. */
static bool sort_touches(struct spl_panel_raster *r)
{
    uint32_t at = 0;
    if (spl_array_reserve(r->sorted, r->sorted_capacity, r->touch_count, NULL))
        return false;
    for (size_t i = 0; i < r->place_count; i++) {
        struct spl_panel_place *p = &r->places[i];
        p->order = spread((uint32_t)p->column) | spread((uint32_t)p->row) << 1;
        p->was = (uint32_t)i;
    }
    qsort(r->places, r->place_count, sizeof *r->places, compare_places);
    for (size_t i = 0; i < r->place_count; i++) {
        r->slots[r->places[i].was] = (uint32_t)i; /* they have done their work */
        uint32_t count = r->places[i].touches;
        r->places[i].touches = at;
        at += count;
    }
    for (size_t i = 0; i < r->touch_count; i++) {
        uint32_t place = r->slots[r->touches[i].place];
        r->sorted[r->places[place].touches] = r->touches[i];
        r->sorted[r->places[place].touches++].place = place;
    }
    return true;
}

bool spl_panel_places_find(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    return find_places(r, g) && sort_touches(r);
}

size_t spl_panel_place_find(const struct spl_panel_raster *r, int32_t column, int32_t row)
{
    uint64_t order = spread((uint32_t)column) | spread((uint32_t)row) << 1;
    size_t low = 0, high = r->place_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (r->places[middle].order < order)
            low = middle + 1;
        else
            high = middle;
    }
    return low < r->place_count && r->places[low].order == order ? low : SIZE_MAX;
}
