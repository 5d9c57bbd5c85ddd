/* Wave packets: packets mostly follow each other in the file, so an offset is the last one's, the end of the last
 * one's, a step further, or 64 raw bits.
 *
 * Floats are predicted by the bits of the last one. One thread. */
#include "cloud/laz/wavepacket.h"

#include "cloud/laz/items.h"

enum { at_offset = 1, at_size = 9, at_place = 13, at_direction = 17 };
enum { way_same, way_next, way_step, way_raw };

size_t spl_laz_wavepacket_bytes(void)
{
    return spl_laz_model_bytes(256) + 4 * spl_laz_model_bytes(4) + 3 * spl_laz_integer_bytes(32, 1) +
           spl_laz_integer_bytes(32, 3);
}

void spl_laz_wavepacket_begin(struct spl_laz_wavepacket *w)
{
    spl_laz_integer_init(&w->difference, 32);
    spl_laz_integer_init(&w->size, 32);
    spl_laz_integer_init(&w->place, 32);
    spl_laz_integer_init(&w->direction, 32);
}

void spl_laz_wavepacket_read(struct spl_laz_wavepacket *w, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                             uint8_t packet[SPL_LAZ_WAVEPACKET_BYTES])
{
    uint64_t offset = spl_le_get64(packet + at_offset);
    uint32_t size = spl_le_get32(packet + at_size);
    packet[0] = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &w->index, 256));
    w->way = spl_laz_symbol(coder, spl_laz_model_get(arena, &w->ways[w->way], 4));
    if (w->way == way_next) {
        offset += size;
    } else if (w->way == way_step) {
        w->step = spl_laz_integer_read(&w->difference, coder, arena, w->step, 0);
        offset += (uint64_t)(int64_t)(int32_t)w->step;
    } else if (w->way == way_raw) {
        offset = spl_laz_raw64(coder);
    }
    spl_laz_put64(packet + at_offset, offset);
    spl_laz_put32(packet + at_size, spl_laz_integer_read(&w->size, coder, arena, size, 0));
    spl_laz_put32(packet + at_place,
                  spl_laz_integer_read(&w->place, coder, arena, spl_le_get32(packet + at_place), 0));
    for (unsigned k = 0; k < 3; k++) {
        uint8_t *p = packet + at_direction + 4 * k;
        spl_laz_put32(p, spl_laz_integer_read(&w->direction, coder, arena, spl_le_get32(p), k));
    }
}

struct v1 {
    uint8_t last[SPL_LAZ_WAVEPACKET_BYTES];
    struct spl_laz_wavepacket packet;
};

static size_t v1_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct v1);
}

static size_t v1_model_bytes(unsigned bytes)
{
    (void)bytes;
    return spl_laz_wavepacket_bytes();
}

static void v1_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct v1 *s = state;
    memcpy(s->last, first, bytes);
    spl_laz_wavepacket_begin(&s->packet);
}

static void v1_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct v1 *s = state;
    spl_laz_wavepacket_read(&s->packet, coder, arena, s->last);
    memcpy(item, s->last, sizeof s->last);
}

const struct spl_laz_codec spl_laz_wavepacket_v1 = {v1_state_bytes, v1_model_bytes, v1_begin, v1_read};
