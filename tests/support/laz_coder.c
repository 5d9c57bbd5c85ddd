/* The encoder: base and length of an interval, carries run back into bytes that are written already. */
#include "support/laz_coder.h"

#include <stdlib.h>

void laz_byte(struct laz_out *out, uint8_t byte)
{
    if (out->count == out->capacity) {
        out->capacity = out->capacity ? 2 * out->capacity : 256;
        out->bytes = realloc(out->bytes, out->capacity);
        if (!out->bytes)
            abort();
    }
    out->bytes[out->count++] = byte;
}

/* Narrows the interval to [base + low, base + low + length). */
static void narrow(struct laz_out *out, uint32_t low, uint32_t length)
{
    out->base += low;
    if (out->base < low) /* a carry */
        for (size_t at = out->count; ++out->bytes[--at] == 0;)
            ;
    for (out->length = length; out->length < 1u << 24; out->length <<= 8, out->base <<= 8)
        laz_byte(out, (uint8_t)(out->base >> 24));
}

void laz_end(struct laz_out *out)
{
    narrow(out, out->length / 2, 1u << 24); /* any place inside the interval will do */
    for (int shift = 24; shift >= 0; shift -= 8)
        laz_byte(out, (uint8_t)(out->base >> shift));
}

static void update(struct laz_model *m)
{
    m->total += m->cycle;
    if (m->total > 32768) {
        m->total = 0;
        for (unsigned i = 0; i < m->symbols; i++)
            m->total += m->count[i] = (m->count[i] + 1) / 2;
    }
    uint32_t sum = 0, scale = 0x80000000u / m->total;
    for (unsigned i = 0; i < m->symbols; sum += m->count[i++])
        m->start[i] = scale * sum >> 16;
    uint32_t most = 8 * (m->symbols + 6);
    m->cycle = m->cycle * 5 / 4 < most ? m->cycle * 5 / 4 : most;
    m->left = m->cycle;
}

void laz_symbol(struct laz_out *out, struct laz_model *m, unsigned symbols, unsigned symbol)
{
    if (m->symbols == 0) {
        *m = (struct laz_model){.symbols = symbols, .cycle = symbols};
        for (unsigned i = 0; i < symbols; i++)
            m->count[i] = 1;
        update(m);
        m->left = m->cycle = (symbols + 6) / 2;
    }
    if (symbol >= m->symbols)
        abort();
    uint32_t unit = out->length >> 15, low = m->start[symbol] * unit;
    narrow(out, low, (symbol + 1 < m->symbols ? m->start[symbol + 1] * unit : out->length) - low);
    m->count[symbol]++;
    if (--m->left == 0)
        update(m);
}

void laz_raw(struct laz_out *out, unsigned bits, uint32_t value)
{
    if (bits > 19) {
        laz_raw(out, 16, value & 0xffff);
        value >>= 16;
        bits -= 16;
    }
    narrow(out, value * (out->length >> bits), out->length >> bits);
}

static void write_bit(struct laz_out *out, struct laz_integer *n, unsigned bit)
{
    uint32_t low = n->probability * (out->length >> 13);
    narrow(out, bit ? low : 0, bit ? out->length - low : low);
    n->zeros += !bit;
    if (--n->left > 0)
        return;
    n->all += n->cycle;
    if (n->all > 8192) {
        n->all = (n->all + 1) / 2;
        n->zeros = (n->zeros + 1) / 2;
        if (n->zeros == n->all)
            n->all++;
    }
    n->probability = (0x80000000u / n->all) * n->zeros >> 18;
    n->cycle = n->cycle * 5 / 4 < 64 ? n->cycle * 5 / 4 : 64;
    n->left = n->cycle;
}

void laz_integer(struct laz_out *out, struct laz_integer *n, unsigned bits, unsigned context, uint32_t expected,
                 uint32_t value)
{
    int64_t c = (int64_t)value - expected, range = (int64_t)1 << bits;
    c = c < -range / 2 ? c + range : c >= range / 2 ? c - range : c;
    uint64_t size = (uint64_t)(c <= 0 ? -c : c - 1);
    for (n->k = 0; size; size /= 2)
        n->k++;
    if (n->all == 0) {
        n->zeros = 1;
        n->all = 2;
        n->cycle = n->left = 4;
        n->probability = 4096;
    }
    laz_symbol(out, &n->sizes[context], bits + 1, n->k);
    if (n->k == 0) {
        write_bit(out, n, (unsigned)c);
    } else if (n->k < 32) {
        uint32_t place = (uint32_t)(c < 0 ? c + ((int64_t)1 << n->k) - 1 : c - 1);
        unsigned low = n->k > 8 ? n->k - 8 : 0;
        laz_symbol(out, &n->correctors[n->k], 1u << (n->k - low), place >> low);
        if (low)
            laz_raw(out, low, place & ((1u << low) - 1));
    }
}
