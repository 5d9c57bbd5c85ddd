/* Discs of a plane into cells. The panels that discs reach into are found first (a hash), then put in Morton order, so
 * that runs of them are compact chunks, then filled one by one from the discs that reach into each (fill.c): so no more
 * than one panel's sums are held at a time, however the points lie. Of a group all panels are held, since slits are
 * closed by what lies around them (slits.c).
 *
 * Cells are counted from the plane's own origin: those of one plane and one size lie on one grid in all nodes, though
 * panels, the squares of 16, begin where a node's cells do.
 * One worker's, in the order of the points: the same for any number of threads. */
#include "geom/vector.h"
#include "pack/panels/raster_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"

enum { side = SPL_PANEL_SIDE, no_level = 255 };

/* What is known of a chunk's points. */
struct distances {
    double squared, most;
    uint32_t points;
};

void spl_node_panels_finish(struct spl_node_panels *panels)
{
    spl_spill_give(panels->spill, panels->chunks);
    spl_spill_give(panels->spill, panels->cells);
    spl_spill_give(panels->spill, panels->words);
    spl_spill_give(panels->spill, panels->values);
    spl_spill_give(panels->spill, panels->numbers);
    *panels = (struct spl_node_panels){0};
}

static void *settle(struct spl_spill *spill, const void *array, size_t count, size_t size, bool *all)
{
    void *settled = array ? spl_spill_take(spill, count, size, NULL) : NULL;
    if (settled)
        memcpy(settled, array, count * size);
    *all &= settled || !array;
    return settled;
}

bool spl_node_panels_settle(struct spl_node_panels *panels, struct spl_spill *spill)
{
    struct spl_node_panels settled = *panels;
    size_t numbers = panels->panel_count ? panels->number_capacity : 0;
    bool all = true;
    if (!spill)
        return true;
    settled.spill = spill;
    settled.chunks = settle(spill, panels->chunks, panels->chunk_count, sizeof *panels->chunks, &all);
    settled.cells = settle(spill, panels->cells, panels->chunk_count, sizeof *panels->cells, &all);
    settled.words = settle(spill, panels->words, panels->word_count, sizeof *panels->words, &all);
    settled.values = settle(spill, panels->values, panels->panel_count, sizeof *panels->values, &all);
    settled.numbers = settle(spill, panels->numbers, numbers, sizeof *panels->numbers, &all);
    if (!all)
        return false;
    spl_node_panels_finish(panels);
    *panels = settled;
    return true;
}

/* A chunk while it is made. */
struct making {
    const struct spl_panel_raster *raster;
    const struct spl_panel_grid *grid;
    const uint32_t *order; /* its places */
    size_t count;
    int32_t column, row; /* of its first panel */
    unsigned step;       /* of its heights */
    float worth, base;   /* of a step; height of its plane over the piece's */
    struct spl_panel panels[SPL_PANELS_MAX];
    struct spl_relief reliefs[SPL_PANELS_MAX];
};

/* The chunk's plane: cell (0, 0) of the panel (column, row). */
static void plane_of(const struct making *m, struct spl_panel_plane *plane)
{
    const struct spl_panel_grid *g = m->grid;
    const struct spl_panel_group *group = g->group;
    *plane = (struct spl_panel_plane){.cell = (float)group->cell};
    memcpy(plane->normal, g->normal_f, sizeof plane->normal);
    for (int c = 0; c < 3; c++)
        plane->origin[c] =
            group->plane->origin[c] - group->node_origin[c] + (double)m->base * g->normal[c] +
            group->cell * ((g->first[0] + side * m->column) * g->u[c] + (g->first[1] + side * m->row) * g->v[c]);
}

/* Distances of the points whose cells the places have, to the surface as it decodes. */
static struct distances measure(const struct making *m, const struct spl_panel_plane *plane)
{
    const struct spl_panel_grid *g = m->grid;
    const struct spl_panel_group *group = g->group;
    struct distances sum = {0};
    for (size_t k = 0; k < m->count; k++)
        for (uint32_t t = spl_panel_first_touch(m->raster, m->order[k]); t < m->raster->places[m->order[k]].touches;
             t++) {
            const struct spl_panel_touch *touch = &m->raster->sorted[t];
            double off[3];
            if (!touch->own)
                continue;
            for (int c = 0; c < 3; c++)
                off[c] = spl_points_at(group->points, c, group->first + touch->member) - group->node_origin[c] -
                         (double)(float)plane->origin[c];
            double height = 0;
            if (group->plane->heights) {
                double at[2];
                spl_panel_grid_middle(g, group->first + touch->member, at);
                double x = at[0] - g->first[0] - side * m->raster->places[m->order[k]].column;
                double y = at[1] - g->first[1] - side * m->raster->places[m->order[k]].row;
                height = (double)spl_relief_height(&m->reliefs[k], (float)x, (float)y, NULL);
            }
            double distance = fabs(dot3(off, g->normal) - height);
            sum.squared += distance * distance;
            sum.most = fmax(sum.most, distance);
            sum.points++;
        }
    return sum;
}

/* low_height, high_height: how far above its plane the panel lies. */
static void grow_box(const struct spl_chunk *chunk, const struct spl_panel *panel, float low_height, float high_height,
                     struct spl_node_panels *out)
{
    struct spl_panel_frame frame;
    uint32_t columns = 0, low[2] = {side, side}, high[2] = {0, 0};
    spl_panels_get_frame(chunk, &frame);
    for (uint32_t y = 0; y < side; y++) {
        columns |= panel->cells[y];
        low[1] = panel->cells[y] && y < low[1] ? y : low[1];
        high[1] = panel->cells[y] ? y : high[1];
    }
    low[0] = (uint32_t)__builtin_ctz(columns);
    high[0] = 31 - (uint32_t)__builtin_clz(columns);
    for (int corner = 0; corner < 8; corner++) {
        float x = frame.cell * (0.5f + (float)(side * panel->column + (corner & 1 ? high[0] : low[0])));
        float y = frame.cell * (0.5f + (float)(side * panel->row + (corner & 2 ? high[1] : low[1])));
        float z = corner & 4 ? high_height : low_height;
        for (int c = 0; c < 3; c++) {
            float at = frame.origin[c] + x * frame.u[c] + y * frame.v[c] + z * frame.normal[c];
            float reach = 1.001f * chunk->radius_mean + 1e-6f * (fabsf(at) + fabsf(x) + fabsf(y));
            out->box_min[c] = fminf(out->box_min[c], at - reach);
            out->box_max[c] = fmaxf(out->box_max[c], at + reach);
        }
    }
}

static uint32_t count_cells(const struct spl_panel *panel)
{
    uint32_t cells = 0;
    for (int y = 0; y < side; y++)
        cells += (uint32_t)__builtin_popcount(panel->cells[y]);
    return cells;
}

/* The panels of the chunk's places, and their meshes. False: no memory. */
static bool fill_panels(struct making *m, struct spl_node_panels *out)
{
    const struct spl_panel_raster *r = m->raster;
    const struct spl_panel_grid *g = m->grid;
    float low = INFINITY, high = -INFINITY;
    m->column = r->places[m->order[0]].column;
    m->row = r->places[m->order[0]].row;
    for (size_t k = 0; k < m->count; k++) {
        const struct spl_panel_place *p = &r->places[m->order[k]];
        m->column = p->column < m->column ? p->column : m->column;
        m->row = p->row < m->row ? p->row : m->row;
        low = fminf(low, p->low);
        high = fmaxf(high, p->high);
    }
    if (g->group->plane->heights) {
        float cell = (float)g->group->cell;
        m->step = spl_panel_relief_step(g->group, high - low);
        m->worth = spl_relief_worth(cell, m->step);
        m->base = m->worth * floorf((low + high) / 2 / m->worth + 0.5f);
    }
    for (size_t k = 0; k < m->count; k++) {
        const struct spl_panel_place *p = &r->places[m->order[k]];
        struct spl_panel_relief made;
        m->panels[k] = r->filled[m->order[k]].panel;
        m->panels[k].column = (uint8_t)(p->column - m->column);
        m->panels[k].row = (uint8_t)(p->row - m->row);
        if (g->group->plane->heights) {
            spl_panel_relief_make(g, &m->panels[k], g->first[0] + side * p->column, g->first[1] + side * p->row,
                                  m->step, p->level, &made);
            m->reliefs[k] = made.relief;
            for (int i = 0; i < SPL_RELIEF_POINTS(made.relief.level); i++)
                m->reliefs[k].height[i] -= m->base;
        }
        if (!spl_panel_values_add(r, g, m->order[k], out))
            return false;
    }
    return true;
}

static uint32_t encode(struct making *m, const struct spl_panel_plane *plane, struct spl_chunk *chunk, uint32_t *words)
{
    spl_panels_begin(plane, chunk);
    if (m->grid->group->plane->heights)
        return spl_meshes_encode(m->panels, m->reliefs, (uint32_t)m->count, m->step, SPL_PANEL_COLOR_ERROR, chunk,
                                 words);
    return spl_panels_encode(m->panels, (uint32_t)m->count, SPL_PANEL_COLOR_ERROR, chunk, words);
}

/* Encodes the places of order[], which lie within a chunk's grid and have cells. */
static bool add_chunk(const struct spl_panel_raster *r, const struct spl_panel_grid *g, const uint32_t *order,
                      size_t count, struct spl_node_panels *out)
{
    struct making m = {.raster = r, .grid = g, .order = order, .count = count};
    if (spl_array_reserve(out->chunks, out->chunk_capacity, (size_t)out->chunk_count + 1, NULL) ||
        spl_array_reserve(out->cells, out->cells_capacity, (size_t)out->chunk_count + 1, NULL) ||
        spl_array_reserve(out->words, out->word_capacity, out->word_count + SPL_MESH_CHUNK_WORDS_MAX, NULL) ||
        !fill_panels(&m, out))
        return false;
    struct spl_panel_plane plane;
    struct spl_chunk *chunk = &out->chunks[out->chunk_count];
    plane_of(&m, &plane);
    struct distances d = measure(&m, &plane);
    plane.error_mean = d.points ? (float)sqrt(d.squared / d.points) : 0;
    plane.error_most = (float)d.most;
    plane.points = d.points;
    uint32_t words = encode(&m, &plane, chunk, out->words + out->word_count);
    chunk->geometry_word = (uint32_t)out->word_count;
    out->word_count += words;
    out->cells[out->chunk_count] = 0;
    for (size_t k = 0; k < count; k++) {
        out->cells[out->chunk_count] += count_cells(&m.panels[k]);
        const struct spl_panel_place *p = &r->places[order[k]];
        grow_box(chunk, &m.panels[k], p->low - m.base - m.worth, p->high - m.base + m.worth, out);
    }
    out->chunk_count++;
    return true;
}

/* Fills the panels of all places. False: no memory. */
static bool fill_places(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    if (spl_array_reserve(r->filled, r->filled_capacity, r->place_count, NULL))
        return false;
    for (size_t i = 0; i < r->place_count; i++) {
        struct spl_panel_filled *f = &r->filled[i];
        spl_panel_fill(r, g, i, &f->panel);
        memcpy(f->covered, f->panel.cells, sizeof f->covered);
        memset(f->claimed, 0, sizeof f->claimed);
    }
    if (!g->group->plane->heights)
        spl_panel_slits_close(r, g);
    return true;
}

/* Lists the places that have cells; those with relief by their levels, which takes their meshes. False: no memory. */
static bool list_places(struct spl_panel_raster *r, const struct spl_panel_grid *g, size_t *count)
{
    const bool relief = g->group->plane->heights;
    *count = 0;
    if (spl_array_reserve(r->order, r->order_capacity, r->place_count, NULL))
        return false;
    for (size_t i = 0; i < r->place_count; i++) {
        struct spl_panel_place *p = &r->places[i];
        const struct spl_panel *panel = &r->filled[i].panel;
        struct spl_panel_relief made;
        bool any = count_cells(panel);
        p->level = any ? 0 : no_level;
        p->low = p->high = 0;
        if (!relief || !any)
            continue;
        spl_panel_relief_choose(g, panel, g->first[0] + side * p->column, g->first[1] + side * p->row, &made);
        p->level = (uint8_t)made.relief.level;
        p->low = made.low;
        p->high = made.high;
    }
    for (unsigned level = 0; level <= (relief ? SPL_RELIEF_LEVEL_MAX : 0); level++)
        for (size_t i = 0; i < r->place_count; i++)
            if (r->places[i].level == level)
                r->order[(*count)++] = (uint32_t)i;
    return true;
}

/* Where a chunk of at most `most` places ends that begins with order[begin]: its grid has 256 x 256 panels at most, its
 * meshes are of one level, and their heights are said in steps as fine as they should be. */
static size_t cut(const struct spl_panel_raster *r, const struct spl_panel_grid *g, size_t begin, size_t count,
                  size_t most)
{
    int32_t low[2] = {INT32_MAX, INT32_MAX}, high[2] = {INT32_MIN, INT32_MIN};
    float least = INFINITY, greatest = -INFINITY;
    size_t end = begin;
    for (; end < count && end < begin + most; end++) {
        const struct spl_panel_place *p = &r->places[r->order[end]];
        const int32_t at[2] = {p->column, p->row};
        for (int a = 0; a < 2; a++) {
            low[a] = at[a] < low[a] ? at[a] : low[a];
            high[a] = at[a] > high[a] ? at[a] : high[a];
        }
        least = fminf(least, p->low);
        greatest = fmaxf(greatest, p->high);
        if (high[0] - low[0] > 255 || high[1] - low[1] > 255 || p->level != r->places[r->order[begin]].level ||
            (end > begin && g->group->plane->heights &&
             spl_panel_relief_step(g->group, greatest - least) != spl_panel_relief_step(g->group, 0)))
            break;
    }
    return end;
}

int spl_panel_raster_add(struct spl_panel_raster *r, const struct spl_panel_group *group, struct spl_node_panels *out)
{
    struct spl_panel_grid g;
    size_t count;
    if (!spl_panel_grid_init(&g, group))
        return SPL_E_LIMIT;
    if (!spl_panel_places_find(r, &g) || !fill_places(r, &g) || !list_places(r, &g, &count))
        return SPL_E_NOMEM;
    if (!out->chunk_count)
        for (int c = 0; c < 3; c++) {
            out->box_min[c] = INFINITY;
            out->box_max[c] = -INFINITY;
        }
    size_t chunks = (count + SPL_PANELS_MAX - 1) / SPL_PANELS_MAX;
    size_t most = group->plane->heights ? SPL_PANELS_MAX : (count + chunks - 1) / chunks;
    for (size_t begin = 0, end; begin < count; begin = end) {
        end = cut(r, &g, begin, count, most);
        if (!add_chunk(r, &g, r->order + begin, end - begin, out))
            return SPL_E_NOMEM;
    }
    return SPL_OK;
}
