/* BYTE items, the extra bytes behind a record's known fields: each is predicted by the same byte of the record before.
 * Version 1 codes them as integers of 8 bits, version 2 as differences. One thread. */
#include "cloud/laz/items.h"

/* Behind the models of each byte lies the last item. */
struct v1 {
    unsigned bytes;
    struct spl_laz_integer integer; /* its contexts are more than it has itself */
    struct spl_laz_model *sizes[];
};

struct v2 {
    unsigned bytes;
    struct spl_laz_model *differences[];
};

static size_t v1_state_bytes(unsigned bytes)
{
    return sizeof(struct v1) + bytes * (sizeof(struct spl_laz_model *) + 1);
}

static size_t v2_state_bytes(unsigned bytes)
{
    return sizeof(struct v2) + bytes * (sizeof(struct spl_laz_model *) + 1);
}

static size_t v1_model_bytes(unsigned bytes)
{
    return spl_laz_integer_bytes(8, bytes);
}

static size_t v2_model_bytes(unsigned bytes)
{
    return bytes * spl_laz_model_bytes(256);
}

static void v1_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct v1 *s = state;
    s->bytes = bytes;
    spl_laz_integer_init(&s->integer, 8);
    memcpy(s->sizes + bytes, first, bytes);
}

static void v1_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct v1 *s = state;
    uint8_t *last = (uint8_t *)(s->sizes + s->bytes);
    for (unsigned i = 0; i < s->bytes; i++) {
        struct spl_laz_model *sizes = spl_laz_model_get(arena, &s->sizes[i], 9);
        last[i] = (uint8_t)(last[i] + spl_laz_correction(&s->integer, coder, arena, sizes));
    }
    memcpy(item, last, s->bytes);
}

static void v2_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct v2 *s = state;
    s->bytes = bytes;
    memcpy(s->differences + bytes, first, bytes);
}

static void v2_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct v2 *s = state;
    uint8_t *last = (uint8_t *)(s->differences + s->bytes);
    for (unsigned i = 0; i < s->bytes; i++)
        last[i] = (uint8_t)(last[i] + spl_laz_symbol(coder, spl_laz_model_get(arena, &s->differences[i], 256)));
    memcpy(item, last, s->bytes);
}

const struct spl_laz_codec spl_laz_bytes_v1 = {v1_state_bytes, v1_model_bytes, v1_begin, v1_read};
const struct spl_laz_codec spl_laz_bytes_v2 = {v2_state_bytes, v2_model_bytes, v2_begin, v2_read};
