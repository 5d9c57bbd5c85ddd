/* Which panels a group's discs reach into: found in a hash, then sorted. One worker's; in the order of the points. */
#include "pack/panels/raster_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"

void spl_panel_raster_finish(struct spl_panel_raster *r)
{
    free(r->places);
    free(r->slots);
    free(r->touches);
    free(r->sorted);
    free(r->order);
    *r = (struct spl_panel_raster){0};
}

static size_t hash_of(int32_t column, int32_t row)
{
    uint64_t key = (uint64_t)(uint32_t)column << 32 | (uint32_t)row;
    return (size_t)(key * 0x9e3779b97f4a7c15ull >> 24);
}

static bool grow_slots(struct spl_panel_raster *r)
{
    size_t count = r->slot_count ? 2 * r->slot_count : 256;
    uint32_t *slots = spl_alloc(count, sizeof *slots, NULL);
    if (!slots)
        return false;
    for (size_t i = 0; i < r->place_count; i++) {
        size_t at = hash_of(r->places[i].column, r->places[i].row) & (count - 1);
        while (slots[at])
            at = (at + 1) & (count - 1);
        slots[at] = (uint32_t)i + 1;
    }
    free(r->slots);
    r->slots = slots;
    r->slot_count = count;
    return true;
}

/* Notes that `member` reaches into the panel. */
static bool touch(struct spl_panel_raster *r, int32_t column, int32_t row, uint32_t member)
{
    if (2 * (r->place_count + 1) > r->slot_count && !grow_slots(r))
        return false;
    size_t at = hash_of(column, row) & (r->slot_count - 1);
    while (r->slots[at] && (r->places[r->slots[at] - 1].column != column || r->places[r->slots[at] - 1].row != row))
        at = (at + 1) & (r->slot_count - 1);
    if (!r->slots[at]) {
        if (spl_array_reserve(r->places, r->place_capacity, r->place_count + 1, NULL))
            return false;
        r->places[r->place_count] = (struct spl_panel_place){.column = column, .row = row};
        r->slots[at] = (uint32_t)++r->place_count;
    }
    if (spl_array_reserve(r->touches, r->touch_capacity, r->touch_count + 1, NULL))
        return false;
    r->places[r->slots[at] - 1].touches++;
    r->touches[r->touch_count++] = (struct spl_panel_touch){r->slots[at] - 1, member};
    return true;
}

static bool find_places(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    r->place_count = r->touch_count = 0;
    if (r->slot_count)
        memset(r->slots, 0, r->slot_count * sizeof *r->slots);
    for (size_t m = 0; m < g->group->count; m++) {
        struct spl_panel_disc d = spl_panel_grid_disc(g, g->group->members[m]);
        int32_t low[2], high[2];
        spl_panel_disc_range(&d, low, high);
        for (int32_t row = spl_panel_of_cell(g, 1, low[1]); row <= spl_panel_of_cell(g, 1, high[1]); row++)
            for (int32_t column = spl_panel_of_cell(g, 0, low[0]); column <= spl_panel_of_cell(g, 0, high[0]); column++)
                if (!touch(r, column, row, g->group->members[m]))
                    return false;
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
        r->sorted[r->places[place].touches++] = (struct spl_panel_touch){place, r->touches[i].member};
    }
    return true;
}

bool spl_panel_touch_is_own(const struct spl_panel_raster *r, const struct spl_panel_grid *g,
                            const struct spl_panel_touch *touch)
{
    const struct spl_panel_place *p = &r->places[touch->place];
    struct spl_panel_disc d = spl_panel_grid_disc(g, touch->member);
    return spl_panel_of_cell(g, 0, (int32_t)floor(d.x)) == p->column &&
           spl_panel_of_cell(g, 1, (int32_t)floor(d.y)) == p->row;
}

bool spl_panel_places_find(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    return find_places(r, g) && sort_touches(r);
}
