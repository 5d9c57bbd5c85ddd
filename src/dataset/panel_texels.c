/* Texels of panels; see panel_texels.h. */
#include "dataset/panel_texels.h"

#include <math.h>
#include <string.h>

enum { side = SPL_PANEL_SIDE, rounds = 2 };

/* Where a place, in cells, lies between texels. */
static unsigned place(float at, unsigned level, float *along)
{
    unsigned count = (unsigned)side >> level;
    float slope = level ? 0.5f : 0;
    at = at * ((float)count / side) - 0.5f;
    at = fminf(fmaxf(at, -slope), (float)count - 1 + slope);
    unsigned first = at > 0 ? (unsigned)at : 0;
    first = first < count - 2 ? first : count - 2;
    *along = at - (float)first;
    return first;
}

void spl_panel_texels_place(unsigned level, struct spl_panel_between between[SPL_PANEL_SIDE])
{
    for (int i = 0; i < side; i++)
        between[i].first = (uint8_t)place((float)i + 0.5f, level, &between[i].along);
}

void spl_panel_texels_get(const struct spl_panel *panel, const struct spl_panel_texels *t, const float at[2],
                          float color[3])
{
    float along[2], weights = 0;
    unsigned first[2] = {place(at[0], t->level, &along[0]), place(at[1], t->level, &along[1])};
    memset(color, 0, 3 * sizeof *color);
    for (unsigned i = 0; i < 4; i++) {
        unsigned x = first[0] + (i & 1), y = first[1] + (i >> 1);
        float weight = (i & 1 ? along[0] : 1 - along[0]) * (i >> 1 ? along[1] : 1 - along[1]);
        if (!t->level && !spl_panel_has(panel, x, y))
            continue;
        for (int c = 0; c < 3; c++)
            color[c] += weight * t->color[y][x][c];
        weights += weight;
    }
    for (int c = 0; c < 3; c++)
        color[c] = fminf(fmaxf(color[c] / weights, 0), 255);
}

static spl_panel_texel color_of(const struct spl_panel *panel, unsigned x, unsigned y)
{
    const uint8_t *c = panel->color[y][x];
    return (spl_panel_texel){c[0], c[1], c[2], 0};
}

/* Adds the panel's cells, less what `less` shows of them (NULL: nothing), to their texels; counts them. */
static void add_cells(const struct spl_panel *panel, const struct spl_panel_texels *less, unsigned level,
                      spl_panel_texel sum[side][side], float count[side][side])
{
    struct spl_panel_between between[side];
    if (less)
        spl_panel_texels_place(level, between);
    for (unsigned y = 0; y < side; y++)
        for (unsigned cells = panel->cells[y]; cells; cells &= cells - 1) {
            unsigned x = (unsigned)__builtin_ctz(cells);
            spl_panel_texel color = color_of(panel, x, y);
            sum[y >> level][x >> level] += less ? color - spl_panel_texels_at(less, &between[x], &between[y]) : color;
            count[y >> level][x >> level]++;
        }
}

/* Each texel without a colour that has some beside it takes their mean; returns whether any is left. */
static bool spread(struct spl_panel_texels *t, float has[side][side], unsigned count)
{
    float had[side][side];
    bool left = false;
    memcpy(had, has, sizeof had);
    for (unsigned i = 0; i < count * count; i++) {
        unsigned x = i % count, y = i / count;
        float around = 0;
        spl_panel_texel sum = {0};
        for (unsigned k = 0; !(had[y][x] > 0) && k < 9; k++) {
            unsigned nx = x + k % 3 - 1, ny = y + k / 3 - 1; /* what is below 0 is beyond all */
            if (nx >= count || ny >= count || !(had[ny][nx] > 0))
                continue;
            sum += t->color[ny][nx];
            around++;
        }
        if (around > 0)
            t->color[y][x] = sum / around;
        has[y][x] += around;
        left |= !(has[y][x] > 0);
    }
    return left;
}

void spl_panel_texels_fit(const struct spl_panel *panel, struct spl_panel_texels *t)
{
    unsigned count = (unsigned)side >> t->level;
    float cells[side][side] = {{0}}, has[side][side];
    memset(t->color, 0, sizeof t->color);
    add_cells(panel, NULL, t->level, t->color, cells);
    for (unsigned i = 0; i < count * count; i++)
        if (cells[i / count][i % count] > 0)
            t->color[i / count][i % count] /= cells[i / count][i % count];
    if (!t->level)
        return;
    memcpy(has, cells, sizeof has);
    for (unsigned k = 0; k < count && spread(t, has, count); k++)
        ;
    for (int round = 0; round < rounds; round++) {
        spl_panel_texel move[side][side] = {{{0}}};
        float of[side][side] = {{0}};
        add_cells(panel, t, t->level, move, of);
        for (unsigned i = 0; i < count * count; i++)
            for (int c = 0; c < 3 && of[i / count][i % count] > 0; c++) {
                float value =
                    t->color[i / count][i % count][c] + move[i / count][i % count][c] / of[i / count][i % count];
                value = value > 0 ? value : 0;
                t->color[i / count][i % count][c] = value < 255 ? value : 255;
            }
    }
}
