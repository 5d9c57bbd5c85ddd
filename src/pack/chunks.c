/* Recursive median split along the longest axis (sparse-coding paper, section 3.5.1), at multiples of 128 down to
 * chunks.
 *
 * Inside a chunk the splitting goes on down to single splats, and the two halves of each split are interleaved: so the
 * first 2^k splats of a chunk are one of each of its 2^k parts, and any prefix is as even as the splits are. */
#include "pack/chunks.h"

#include "shared.h"

static unsigned longest_axis(const struct spl_cut *items, size_t count)
{
    float low[3], high[3];
    for (int c = 0; c < 3; c++)
        low[c] = high[c] = items[0].position[c];
    for (size_t i = 1; i < count; i++)
        for (int c = 0; c < 3; c++) {
            float v = items[i].position[c];
            low[c] = v < low[c] ? v : low[c];
            high[c] = v > high[c] ? v : high[c];
        }
    unsigned axis = high[1] - low[1] > high[0] - low[0];
    return high[2] - low[2] > high[axis] - low[axis] ? 2 : axis;
}

static void swap(struct spl_cut *a, struct spl_cut *b)
{
    struct spl_cut t = *a;
    *a = *b;
    *b = t;
}

/* Puts the `nth` smallest along `axis` in its place, smaller ones before it. Stops at equal values, so runs of them
 * split evenly. */
static void select_nth(struct spl_cut *items, size_t count, size_t nth, unsigned axis)
{
    size_t begin = 0, end = count;
    while (end - begin > 1) {
        float a = items[begin].position[axis], b = items[begin + (end - begin) / 2].position[axis];
        float c = items[end - 1].position[axis];
        float pivot = a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
        size_t i = begin, j = end - 1;
        for (;;) {
            while (items[i].position[axis] < pivot)
                i++;
            while (items[j].position[axis] > pivot)
                j--;
            if (i >= j)
                break;
            swap(&items[i++], &items[j--]);
        }
        /* [begin, i) <= pivot <= [j + 1, end), and i - 1 <= j + 1 */
        size_t split = items[i].position[axis] < pivot ? i + 1 : i;
        if (nth < split && split < end)
            end = split;
        else if (nth >= split && split > begin)
            begin = split;
        else
            break;
    }
}

static unsigned reverse_bits(unsigned v)
{
    unsigned r = 0;
    for (unsigned bit = 1; bit < SPL_CHUNK_SPLATS; bit *= 2, v /= 2)
        r = r * 2 + (v & 1);
    return r;
}

static void split_down(struct spl_cut *items, size_t count)
{
    while (count > 1) {
        size_t half = count / 2;
        select_nth(items, count, half, longest_axis(items, count));
        split_down(items, half);
        items += half;
        count -= half;
    }
}

static void order_chunk(struct spl_cut *items, size_t count)
{
    struct spl_cut at[SPL_CHUNK_SPLATS];
    uint8_t used[SPL_CHUNK_SPLATS] = {0};
    split_down(items, count);
    for (size_t i = 0; i < count; i++) {
        unsigned place = reverse_bits((unsigned)(i * SPL_CHUNK_SPLATS / count));
        at[place] = items[i];
        used[place] = 1;
    }
    size_t next = 0;
    for (unsigned place = 0; place < SPL_CHUNK_SPLATS; place++)
        if (used[place])
            items[next++] = at[place];
}

void spl_chunks_cut(struct spl_cut *items, size_t count)
{
    while (count > SPL_CHUNK_SPLATS) {
        size_t chunks = (count + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
        size_t half = chunks / 2 * SPL_CHUNK_SPLATS;
        select_nth(items, count, half, longest_axis(items, count));
        spl_chunks_cut(items, half);
        items += half;
        count -= half;
    }
    if (count)
        order_chunk(items, count);
}
