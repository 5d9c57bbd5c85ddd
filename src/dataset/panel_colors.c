/* Colours of panels; see panel_colors.h. Levels are tried from the coarsest on, and judged by the worst block of cells
 * of what they decode to. Pure; any thread. */
#include "dataset/panel_colors.h"

#include <math.h>
#include <string.h>

#include "dataset/block.h"
#include "dataset/panel_texels.h"

enum { side = SPL_PANEL_SIDE, blocks = 16, levels = SPL_PANEL_EVEN + 1 };
/* Texels whose cells are off by so many times the error are not coded: they would be no nearer. */
static const double far_off = 2;

bool spl_panel_mean_color(const struct spl_panel *panel, unsigned x0, unsigned y0, unsigned wide, float color[3])
{
    float sum[3] = {0}, count = 0;
    for (unsigned y = y0; y < y0 + wide; y++)
        for (unsigned x = x0; x < x0 + wide; x++) {
            for (int c = 0; spl_panel_has(panel, x, y) && c < 3; c++)
                sum[c] += panel->color[y][x][c];
            count += spl_panel_has(panel, x, y);
        }
    for (int c = 0; c < 3; c++)
        color[c] = count > 0 ? sum[c] / count : 0;
    return count > 0;
}

/* The block of 4 x 4 texels from (x0, y0) on; of level 0 those without cells take the mean of the others. */
static void encode_block(const struct spl_panel *panel, const struct spl_panel_texels *t, unsigned x0, unsigned y0,
                         uint32_t words[2])
{
    float texels[16][3], mean[3];
    if (!t->level)
        spl_panel_mean_color(panel, x0, y0, 4, mean);
    for (unsigned i = 0; i < 16; i++) {
        bool own = t->level || spl_panel_has(panel, x0 + i % 4, y0 + i / 4);
        for (int c = 0; c < 3; c++)
            texels[i][c] = own ? t->color[y0 + i / 4][x0 + i % 4][c] : mean[c];
    }
    spl_block_encode((const float(*)[3])texels, words);
}

static uint8_t to_byte(float value)
{
    return (uint8_t)(value + 0.5f);
}

/* Mean squared difference of the colours of a block's cells to what texels, not of level 0, show of them; 0: it has no
 * cells. */
static double measure_block(const struct spl_panel *panel, const struct spl_panel_texels *texels,
                            const struct spl_panel_between between[side], unsigned b)
{
    unsigned sum = 0, count = 0, left = b % 4 * 4;
    for (unsigned y = b / 4 * 4; y < b / 4 * 4 + 4; y++)
        for (unsigned cells = panel->cells[y] >> left & 15; cells; cells &= cells - 1) {
            unsigned x = left + (unsigned)__builtin_ctz(cells);
            spl_panel_texel color = spl_panel_texels_at(texels, &between[x], &between[y]);
            for (int c = 0; c < 3; c++) {
                int d = to_byte(color[c]) - panel->color[y][x][c];
                sum += (unsigned)(d * d);
            }
            count++;
        }
    return count ? (double)sum / (3 * count) : 0;
}

/* Whether the cells' colours are as near to the texels', not of level 0, in the worst block too, in which a letter or a
 * joint of mortar is as large as it is small in its panel. */
static bool is_within(const struct spl_panel *panel, const struct spl_panel_texels *texels, double error)
{
    struct spl_panel_between between[side];
    spl_panel_texels_place(texels->level, between);
    for (unsigned b = 0; b < blocks; b++)
        if (measure_block(panel, texels, between, b) > error * error)
            return false;
    return true;
}

/* Writes the panel's colours at `level`; returns the words, or 0 where they would not come near `color_error`. */
static uint32_t encode(const struct spl_panel *panel, unsigned level, uint32_t there, double color_error,
                       uint32_t *words)
{
    uint32_t used = 0;
    if (level == SPL_PANEL_EVEN) {
        float mean[3];
        spl_panel_mean_color(panel, 0, 0, side, mean);
        words[0] = to_byte(mean[0]) | (uint32_t)to_byte(mean[1]) << 8 | (uint32_t)to_byte(mean[2]) << 16;
        return 1;
    }
    struct spl_panel_texels texels = {.level = level};
    unsigned across = 4u >> level;
    spl_panel_texels_fit(panel, &texels);
    if (level && !is_within(panel, &texels, far_off * color_error))
        return 0;
    for (unsigned b = 0; b < across * across; b++)
        if (level || there >> b & 1) {
            encode_block(panel, &texels, b % across * 4, b / across * 4, words + used);
            used += 2;
        }
    return used;
}

/* The texels whose words begin at `at`; of level 0 those of blocks that are there. */
static void read_texels(const struct spl_panel_words *r, uint32_t at, unsigned level, uint32_t there,
                        struct spl_panel_texels *t)
{
    unsigned count = (unsigned)side >> level, across = 4u >> level;
    t->level = level;
    if (level >= SPL_PANEL_EVEN) { /* any level shows it */
        uint32_t even = spl_panel_word(r, at);
        t->level = SPL_PANEL_EVEN - 1;
        for (unsigned i = 0; i < side * side; i++)
            for (int c = 0; c < 3; c++)
                t->color[i / side][i % side][c] = (float)(even >> 8 * c & 255);
        return;
    }
    for (unsigned i = 0; i < count * count; i++) {
        unsigned x = i % count, y = i / count, b = y / 4 * across + x / 4;
        uint32_t first = at + 2 * (level ? b : (unsigned)__builtin_popcount(there & ((1u << b) - 1)));
        const uint32_t words[2] = {spl_panel_word(r, first), spl_panel_word(r, first + 1)};
        float color[3];
        spl_block_get_color(words, y % 4 * 4 + x % 4, color);
        t->color[y][x] = (spl_panel_texel){color[0], color[1], color[2], 0};
    }
}

void spl_panel_colors_decode(const struct spl_panel_words *words, uint32_t at, unsigned level, uint32_t there,
                             struct spl_panel *panel, struct spl_panel_texels *texels)
{
    read_texels(words, at, level, there, texels);
    for (unsigned y = 0; y < side; y++)
        for (unsigned x = 0; x < side; x++) {
            float color[3];
            if (!spl_panel_has(panel, x, y))
                continue;
            spl_panel_texels_get(panel, texels, (const float[]){(float)x + 0.5f, (float)y + 0.5f}, color);
            for (int c = 0; c < 3; c++)
                panel->color[y][x][c] = to_byte(color[c]);
        }
}

uint32_t spl_panel_colors_encode(const struct spl_panel *panel, uint32_t there, double color_error, uint32_t *words,
                                 unsigned *level)
{
    struct spl_panel_texels texels;
    for (*level = levels - 1; *level; --*level) {
        uint32_t used = encode(panel, *level, there, color_error, words);
        if (!used)
            continue;
        read_texels(&(struct spl_panel_words){words, used - 1}, 0, *level, there, &texels);
        if (is_within(panel, &texels, color_error))
            return used;
    }
    return encode(panel, 0, there, color_error, words);
}
