/* Heights of meshes; see relief.h. Steps are half octaves of the cell, so that a chunk needs five bits to say them and
 * its codes are never coarser than they must by more than half of that. The surface is worked out in floats, in the
 * order of operations that shaders/common/relief.glsl repeats, so that a cell's middle lies on the same triangle
 * wherever it is drawn. Pure; any thread. */
#include "dataset/relief.h"

#include <math.h>
#include <stdbool.h>

#include "base/error.h"

float spl_relief_worth(float cell, unsigned step)
{
    return ldexpf(step % 2 ? cell * 0.70710678f : cell, -(int)(step / 2));
}

unsigned spl_relief_choose_step(float cell, float most)
{
    unsigned step = SPL_RELIEF_STEP_MAX;
    while (step && !(most <= SPL_RELIEF_MOST * spl_relief_worth(cell, step)))
        step--;
    return step;
}

void spl_relief_encode(const struct spl_relief *relief, float worth, uint32_t *words)
{
    spl_assert(relief->level <= SPL_RELIEF_LEVEL_MAX);
    for (int i = 0; i < SPL_RELIEF_WORDS(relief->level); i++)
        words[i] = 0;
    for (int i = 0; i < SPL_RELIEF_POINTS(relief->level); i++) {
        float code = fminf(fmaxf(rintf(relief->height[i] / worth), -SPL_RELIEF_MOST), SPL_RELIEF_MOST);
        words[i / 4] |= (uint32_t)((int)code + SPL_RELIEF_ZERO) << i % 4 * 8;
    }
}

/* The square that `q` squares from the lattice's edge lies in, and how far. */
static int square_of(float q, int squares, float *within)
{
    int i = q < (float)squares ? (int)fmaxf(q, 0) : squares - 1;
    *within = q - (float)i;
    return i;
}

float spl_relief_height(const struct spl_relief *relief, float x, float y, float slope[2])
{
    const int squares = 1 << relief->level;
    const float scale = (float)squares / SPL_PANEL_SIDE;
    float fx, fy;
    int i = square_of(x * scale, squares, &fx), j = square_of(y * scale, squares, &fy);
    const float *h = relief->height + j * (squares + 1) + i;
    bool low = fx >= fy; /* the triangle of corner (1, 0) */
    float h00 = h[0], h11 = h[squares + 2], middle = low ? h[1] : h[squares + 1];
    float along_x = low ? middle - h00 : h11 - middle, along_y = low ? h11 - middle : middle - h00;
    if (slope) {
        slope[0] = along_x * scale;
        slope[1] = along_y * scale;
    }
    return h00 + fx * along_x + fy * along_y;
}
