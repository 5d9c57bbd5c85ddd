/* Colours of panels; see panel_colors.h. Levels are tried from the coarsest on, and judged by the worst block of cells
 * of what they decode to. Pure; any thread. */
#include "dataset/panel_colors.h"

#include <math.h>
#include <string.h>

#include "dataset/block.h"
#include "dataset/panel_texels.h"

enum { side = SPL_PANEL_SIDE, blocks = 16, levels = SPL_PANEL_EVEN + 1 };

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
        memcpy(texels[i], own ? t->color[y0 + i / 4][x0 + i % 4] : mean, sizeof mean);
    }
    spl_block_encode((const float(*)[3])texels, words);
}

static uint8_t to_byte(float value)
{
    return (uint8_t)(value + 0.5f);
}

/* Writes the panel's colours at `level`; returns the words. */
static uint32_t encode(const struct spl_panel *panel, unsigned level, uint32_t there, uint32_t *words)
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
        spl_block_get_color(words, y % 4 * 4 + x % 4, t->color[y][x]);
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

/* Mean squared difference of a block's cells' colours; 0: it has none. */
static double measure_block(const struct spl_panel *panel, const struct spl_panel *decoded, unsigned b)
{
    double sum = 0, cells = 0;
    for (unsigned i = 0; i < 16; i++) {
        unsigned x = b % 4 * 4 + i % 4, y = b / 4 * 4 + i / 4;
        for (int c = 0; spl_panel_has(panel, x, y) && c < 3; c++) {
            double d = (double)decoded->color[y][x][c] - panel->color[y][x][c];
            sum += d * d;
        }
        cells += spl_panel_has(panel, x, y);
    }
    return cells > 0 ? sum / (3 * cells) : 0;
}

/* How far the cells' colours are from those of `words`: the worst block's, in which a letter or a joint of mortar is as
 * large as it is small in its panel. */
static double measure(const struct spl_panel *panel, unsigned level, uint32_t there, const uint32_t *words,
                      uint32_t count)
{
    struct spl_panel decoded = *panel;
    struct spl_panel_texels texels;
    double worst = 0;
    spl_panel_colors_decode(&(struct spl_panel_words){words, count - 1}, 0, level, there, &decoded, &texels);
    for (unsigned b = 0; b < blocks; b++)
        worst = fmax(worst, measure_block(panel, &decoded, b));
    return worst;
}

uint32_t spl_panel_colors_encode(const struct spl_panel *panel, uint32_t there, double color_error, uint32_t *words,
                                 unsigned *level)
{
    uint32_t used;
    *level = levels;
    do {
        used = encode(panel, --*level, there, words);
    } while (*level && measure(panel, *level, there, words, used) > color_error * color_error);
    return used;
}
