/* Which way normals point, of surfaces whose sides nobody knows: within a block (orient.c), then between blocks, by
 * what points near their borders say of components (orient_join.c), then of what is closed all around (shell.c). */
#include "pack/surface_parts.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/shell.h"

bool spl_surface_knows_sides(const struct spl_points *p)
{
    for (size_t i = 0; i < p->count; i++) {
        bool given = p->normal[i][0] != 0 || p->normal[i][1] != 0 || p->normal[i][2] != 0;
        if (!given && !(p->station && p->station[i] != SPL_NO_STATION))
            return false;
    }
    return true;
}

bool spl_surface_orient_block(struct spl_surfaces *s, struct spl_surface_block *block, struct spl_surface_scratch *w,
                              size_t begin, size_t end)
{
    struct spl_orient *o = &w->orient;
    block->component_count = spl_orient_block(o, s->points, begin, end, w->neighbours, s->k);
    block->components = spl_alloc_raw(block->component_count, sizeof *block->components, NULL);
    if (!block->components)
        return false;
    memcpy(block->components, o->components, block->component_count * sizeof *block->components);
    for (size_t i = begin; i < end; i++) {
        s->label[i] = (uint16_t)o->label[i - begin];
        s->goes_on[i / 8] |= (uint8_t)((o->kind[i - begin] != 0) << i % 8); /* blocks share no byte */
    }
    return true;
}

static bool goes_on(const struct spl_surfaces *s, size_t i)
{
    return s->goes_on[i / 8] >> i % 8 & 1;
}

/* What a point that waits says of its component and those of its neighbours. */
static int add_edges(struct spl_surfaces *s, size_t b, size_t unsettled, struct spl_orient_join *join,
                     struct spl_error *err)
{
    const struct spl_surface_block *block = &s->blocks[b];
    const uint32_t i = block->unsettled.points[unsettled].index, own = block->first_component + s->label[i];
    uint32_t room[SPL_NEIGHBOURS_MAX];
    const uint32_t *list = spl_unsettled_get_neighbours(&block->unsettled, unsettled, room);
    int rc = SPL_OK;
    for (unsigned a = 0; !rc && a < s->k && list[a] != UINT32_MAX; a++) {
        size_t in = list[a] / SPL_SURFACE_BLOCK;
        uint32_t other = s->blocks[in].first_component + s->label[list[a]];
        if (other != own)
            rc = spl_orient_join_add(join, own, other, spl_orient_agreement(s->points, i, list[a]),
                                     in != b && goes_on(s, i) && goes_on(s, list[a]), err);
    }
    return rc;
}

static struct spl_component *component_of(const struct spl_surfaces *s, size_t i)
{
    return &s->components[s->blocks[i / SPL_SURFACE_BLOCK].first_component + s->label[i]];
}

/* What is closed all around has as much above as below, so up says little of it: a room shows in, a thing out. Of large
 * components some points stand for all. */
static int turn_shells(struct spl_surfaces *s, size_t count, struct spl_error *err)
{
    enum { many = 4096, some = 8 };
    const struct spl_points *p = s->points;
    bool any = false;
    for (size_t c = 0; c < count; c++)
        any |= s->components[c].unsure;
    if (!any || p->eye_count)
        return SPL_OK;
    struct spl_shell *shells = spl_alloc(count, sizeof *shells, err); /* of each tree */
    if (!shells)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < p->count; i++) {
        const struct spl_component *c = component_of(s, i);
        const bool sampled = c->count > many;
        double place[3], area = (double)p->radius[i] * p->radius[i] * (sampled ? some : 1);
        if (i % 4096 == 0)
            spl_spill_keep_bound(p->spill);
        if (!c->unsure || (sampled && i % some))
            continue;
        for (int x = 0; x < 3; x++)
            place[x] = spl_points_at(p, x, i) - spl_points_at(p, x, 0);
        spl_shell_add(&shells[c->tree], place, p->normal[i], p->up, area, c->flip);
    }
    for (size_t c = 0; c < count; c++)
        s->components[c].flip ^= spl_shell_is_inside_out(&shells[s->components[c].tree], s->components[c].doubtful);
    free(shells);
    return SPL_OK;
}

static int join_blocks(struct spl_surfaces *s, struct spl_error *err)
{
    size_t components = 0;
    struct spl_orient_join join;
    for (size_t b = 0; b < s->block_count; b++) {
        s->blocks[b].first_component = (uint32_t)components;
        components += s->blocks[b].component_count;
    }
    s->components = spl_alloc_raw(components, sizeof *s->components, err);
    if (!s->components)
        return SPL_E_NOMEM;
    for (size_t b = 0; b < s->block_count; b++)
        memcpy(s->components + s->blocks[b].first_component, s->blocks[b].components,
               s->blocks[b].component_count * sizeof *s->components);
    int rc = spl_orient_join_init(&join, s->components, components, s->points->spill, err);
    for (size_t b = 0; !rc && b < s->block_count; b++)
        for (size_t d = 0; !rc && d < s->blocks[b].unsettled.count; d++) {
            if (d % 256 == 0)
                spl_spill_keep_bound(s->points->spill);
            rc = add_edges(s, b, d, &join, err);
        }
    rc = rc ? rc : spl_orient_join_decide(&join, err);
    spl_orient_join_finish(&join);
    return rc ? rc : turn_shells(s, components, err);
}

static void flip_block(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_surfaces *s = context;
    (void)worker;
    for (size_t i = begin; i < end; i++)
        if (component_of(s, i)->flip)
            for (int c = 0; c < 3; c++)
                s->points->normal[i][c] = -s->points->normal[i][c];
}

int spl_surface_join_blocks(struct spl_surfaces *s, struct spl_error *err)
{
    int rc = join_blocks(s, err);
    if (!rc)
        spl_parallel_for(s->stage->threads, s->points->count, SPL_SURFACE_BLOCK, flip_block, s);
    return rc;
}
