/* Colours: those of the layered items, and the items RGB12 of versions 1 and 2.
 *
 * Invariant: a state's `rgb` is the colour that was given last. One thread. */
#include "cloud/laz/color.h"

#include "cloud/laz/items.h"

enum { grey = 64 }; /* the bit of `changed` that is clear where green and blue equal red */

size_t spl_laz_color_bytes(void)
{
    return spl_laz_model_bytes(128) + 6 * spl_laz_model_bytes(256);
}

size_t spl_laz_infrared_bytes(void)
{
    return spl_laz_model_bytes(4) + 2 * spl_laz_model_bytes(256);
}

static int clamp(int v)
{
    return v < 0 ? 0 : v > 255 ? 255 : v;
}

/* A byte that differs from `expected`, if bit `k` of `changed` is set, else from before it does not. */
static int read_byte(struct spl_laz_model **models, unsigned k, unsigned changed, struct spl_laz_coder *coder,
                     struct spl_laz_arena *arena, int before, int expected)
{
    if (!(changed >> k & 1))
        return before;
    return (expected + (int)spl_laz_symbol(coder, spl_laz_model_get(arena, &models[k], 256))) & 255;
}

SPL_LAZ_HOT void spl_laz_color_read(struct spl_laz_color *c, struct spl_laz_coder *shared, struct spl_laz_arena *arena,
                                    uint16_t rgb[3])
{
    struct spl_laz_coder local = *shared, *coder = &local;
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &c->changed, 128));
    int before[6], now[6];
    for (int k = 0; k < 6; k++)
        before[k] = now[k] = rgb[k / 2] >> 8 * (k & 1) & 255;
    for (unsigned k = 0; k < 2; k++)
        now[k] = read_byte(c->byte, k, changed, coder, arena, before[k], before[k]);
    for (unsigned k = 0; k < 2; k++) { /* low bytes, then high ones */
        if (!(changed & grey)) {
            now[2 + k] = now[4 + k] = now[k];
            continue;
        }
        int went = now[k] - before[k];
        now[2 + k] = read_byte(c->byte, 2 + k, changed, coder, arena, before[2 + k], clamp(before[2 + k] + went));
        went = (went + now[2 + k] - before[2 + k]) / 2;
        now[4 + k] = read_byte(c->byte, 4 + k, changed, coder, arena, before[4 + k], clamp(before[4 + k] + went));
    }
    for (int k = 0; k < 3; k++)
        rgb[k] = (uint16_t)(now[2 * k] | now[2 * k + 1] << 8);
    *shared = local;
}

void spl_laz_infrared_read(struct spl_laz_infrared *c, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                           uint16_t *value)
{
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &c->changed, 4));
    int low = read_byte(c->byte, 0, changed, coder, arena, *value & 255, *value & 255);
    int high = read_byte(c->byte, 1, changed, coder, arena, *value >> 8, *value >> 8);
    *value = (uint16_t)(low | high << 8);
}

struct rgb_v2 {
    uint16_t rgb[3];
    struct spl_laz_color color;
};

struct rgb_v1 {
    uint16_t rgb[3];
    struct spl_laz_model *changed;
    struct spl_laz_integer byte; /* a context each */
};

static size_t v1_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct rgb_v1);
}

static size_t v1_model_bytes(unsigned bytes)
{
    (void)bytes;
    return spl_laz_model_bytes(64) + spl_laz_integer_bytes(8, 6);
}

static void v1_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct rgb_v1 *s = state;
    for (unsigned k = 0; k < bytes / 2; k++)
        s->rgb[k] = spl_laz_get16(first + 2 * k);
    spl_laz_integer_init(&s->byte, 8);
}

static void v1_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct rgb_v1 *s = state;
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &s->changed, 64));
    for (unsigned k = 0; k < 6; k++) {
        unsigned shift = 8 * (k & 1), before = s->rgb[k / 2] >> shift & 255u;
        if (changed >> k & 1) {
            unsigned now = spl_laz_integer_read(&s->byte, coder, arena, before, k);
            s->rgb[k / 2] = (uint16_t)((s->rgb[k / 2] & 0xff00u >> shift) | now << shift);
        }
    }
    for (unsigned k = 0; k < 3; k++)
        spl_laz_put16(item + 2 * k, s->rgb[k]);
}

static size_t v2_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct rgb_v2);
}

static size_t v2_model_bytes(unsigned bytes)
{
    (void)bytes;
    return spl_laz_color_bytes();
}

static void v2_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct rgb_v2 *s = state;
    for (unsigned k = 0; k < bytes / 2; k++)
        s->rgb[k] = spl_laz_get16(first + 2 * k);
}

static void v2_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct rgb_v2 *s = state;
    spl_laz_color_read(&s->color, coder, arena, s->rgb);
    for (unsigned k = 0; k < 3; k++)
        spl_laz_put16(item + 2 * k, s->rgb[k]);
}

const struct spl_laz_codec spl_laz_rgb_v1 = {v1_state_bytes, v1_model_bytes, v1_begin, v1_read};
const struct spl_laz_codec spl_laz_rgb_v2 = {v2_state_bytes, v2_model_bytes, v2_begin, v2_read};
