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

/* The low (shift 0) or high (8) bytes of green and blue, by how far red went. */
SPL_LAZ_INLINE void read_others(struct spl_laz_color *c, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                                unsigned changed, unsigned shift, int went, const uint16_t before[3], unsigned now[3])
{
    int green = before[1] >> shift & 255, blue = before[2] >> shift & 255, was = green;
    green = read_byte(c->byte, 2 + shift / 8, changed, coder, arena, green, clamp(green + went));
    went = (went + green - was) / 2;
    blue = read_byte(c->byte, 4 + shift / 8, changed, coder, arena, blue, clamp(blue + went));
    now[1] |= (unsigned)green << shift;
    now[2] |= (unsigned)blue << shift;
}

SPL_LAZ_HOT void spl_laz_color_read(struct spl_laz_color *c, struct spl_laz_coder *shared, struct spl_laz_arena *arena,
                                    uint16_t rgb[3])
{
    struct spl_laz_coder local = *shared, *coder = &local;
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &c->changed, 128));
    if (changed != grey) { /* else nothing did */
        int low = rgb[0] & 255, high = rgb[0] >> 8;
        int now_low = read_byte(c->byte, 0, changed, coder, arena, low, low);
        int now_high = read_byte(c->byte, 1, changed, coder, arena, high, high);
        unsigned red = (unsigned)(now_low | now_high << 8), now[3] = {red, red, red};
        if (changed & grey) {
            now[1] = now[2] = 0;
            read_others(c, coder, arena, changed, 0, now_low - low, rgb, now);
            read_others(c, coder, arena, changed, 8, now_high - high, rgb, now);
        }
        for (int k = 0; k < 3; k++)
            rgb[k] = (uint16_t)now[k];
    }
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
        s->rgb[k] = spl_le_get16(first + 2 * k);
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
        s->rgb[k] = spl_le_get16(first + 2 * k);
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
