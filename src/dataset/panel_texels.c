/* Texels of panels; see panel_texels.h. */
#include "dataset/panel_texels.h"

#include <math.h>
#include <string.h>

enum { side = SPL_PANEL_SIDE, rounds = 2 };

void spl_panel_texels_get(const struct spl_panel *panel, const struct spl_panel_texels *t, const float place[2],
                          float color[3])
{
    unsigned first[2], count = (unsigned)side >> t->level;
    float along[2], weights = 0, slope = t->level ? 0.5f : 0;
    for (int a = 0; a < 2; a++) {
        float at = place[a] * ((float)count / side) - 0.5f;
        at = fminf(fmaxf(at, -slope), (float)count - 1 + slope);
        first[a] = at > 0 ? (unsigned)at : 0;
        first[a] = first[a] < count - 2 ? first[a] : count - 2;
        along[a] = at - (float)first[a];
    }
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

/* Adds the panel's cells, less what `less` shows of them (NULL: nothing), to their texels; counts them. */
static void add_cells(const struct spl_panel *panel, const struct spl_panel_texels *less, unsigned level,
                      float sum[side][side][3], float count[side][side])
{
    for (unsigned y = 0; y < side; y++)
        for (unsigned x = 0; x < side; x++) {
            float shown[3] = {0};
            if (!spl_panel_has(panel, x, y))
                continue;
            if (less)
                spl_panel_texels_get(panel, less, (const float[]){(float)x + 0.5f, (float)y + 0.5f}, shown);
            for (int c = 0; c < 3; c++)
                sum[y >> level][x >> level][c] += (float)panel->color[y][x][c] - shown[c];
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
        float around = 0, sum[3] = {0};
        for (unsigned k = 0; !(had[y][x] > 0) && k < 9; k++) {
            unsigned nx = x + k % 3 - 1, ny = y + k / 3 - 1; /* what is below 0 is beyond all */
            if (nx >= count || ny >= count || !(had[ny][nx] > 0))
                continue;
            for (int c = 0; c < 3; c++)
                sum[c] += t->color[ny][nx][c];
            around++;
        }
        for (int c = 0; around > 0 && c < 3; c++)
            t->color[y][x][c] = sum[c] / around;
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
        for (int c = 0; c < 3 && cells[i / count][i % count] > 0; c++)
            t->color[i / count][i % count][c] /= cells[i / count][i % count];
    if (!t->level)
        return;
    memcpy(has, cells, sizeof has);
    for (unsigned k = 0; k < count && spread(t, has, count); k++)
        ;
    for (int round = 0; round < rounds; round++) {
        float move[side][side][3] = {{{0}}}, of[side][side] = {{0}};
        add_cells(panel, t, t->level, move, of);
        for (unsigned i = 0; i < count * count; i++)
            for (int c = 0; c < 3 && of[i / count][i % count] > 0; c++) {
                float *value = &t->color[i / count][i % count][c];
                *value = fminf(fmaxf(*value + move[i / count][i % count][c] / of[i / count][i % count], 0), 255);
            }
    }
}
