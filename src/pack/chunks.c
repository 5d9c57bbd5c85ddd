/* Recursive median split along the longest axis (sparse-coding paper, section 3.5.1), at multiples of 128 down to
 * chunks.
 *
 * Inside a chunk the splitting goes on down to single splats, and the two halves of each split are interleaved: so the
 * first 2^k splats of a chunk are one of each of its 2^k parts, and any prefix is as even as the splits are. What order
 * is left to choose, within the runs that are drawn as a whole or nearly so, is that of sizes. */
#include "pack/chunks.h"

#include <string.h>

#include "shared.h"

/* Four floats: an item as a whole, of which the last means nothing. */
typedef float spl_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef int32_t spl_marks __attribute__((vector_size(16)));
_Static_assert(sizeof(struct spl_cut) == sizeof(spl_floats), "an item is three floats and an index");

static unsigned longest_axis(const struct spl_cut *items, size_t count)
{
    spl_floats low = *(const spl_floats *)items, high = low;
    for (size_t i = 1; i < count; i++) {
        spl_floats v = *(const spl_floats *)&items[i];
        spl_marks less = v<low, more = v> high;
        low = (spl_floats)(((spl_marks)v & less) | ((spl_marks)low & ~less));
        high = (spl_floats)(((spl_marks)v & more) | ((spl_marks)high & ~more));
    }
    spl_floats size = high - low;
    unsigned axis = size[1] > size[0];
    return size[2] > size[axis] ? 2 : axis;
}

static void swap(struct spl_cut *a, struct spl_cut *b)
{
    struct spl_cut t = *a;
    *a = *b;
    *b = t;
}

/* What a run of items has on the wrong side of a pivot: where, counted from its end towards the middle. */
enum { run_items = 16 };
struct misplaced {
    uint8_t at[run_items];
    unsigned count, next;
};

/* Swaps what both ends have on the wrong side, pair by pair from outside, until the ends are near each other: as the
 * loops of select_nth() would, but without a branch that depends on values. [begin, *i) and [*j + 1, end) are done. */
static void swap_runs(struct spl_cut *items, size_t *i, size_t *j, unsigned axis, float pivot)
{
    struct misplaced left = {.count = 0}, right = {.count = 0};
    while (*j - *i >= 2 * run_items) {
        if (left.next == left.count) {
            left.next = left.count = 0;
            for (unsigned k = 0; k < run_items; k++) {
                left.at[left.count] = (uint8_t)k;
                left.count += !(items[*i + k].position[axis] < pivot);
            }
        }
        if (right.next == right.count) {
            right.next = right.count = 0;
            for (unsigned k = 0; k < run_items; k++) {
                right.at[right.count] = (uint8_t)k;
                right.count += !(items[*j - k].position[axis] > pivot);
            }
        }
        while (left.next < left.count && right.next < right.count)
            swap(&items[*i + left.at[left.next++]], &items[*j - right.at[right.next++]]);
        *i += left.next == left.count ? run_items : 0;
        *j -= right.next == right.count ? run_items : 0;
    }
    *i += left.next < left.count ? left.at[left.next] : 0;
    *j -= right.next < right.count ? right.at[right.next] : 0;
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
        swap_runs(items, &i, &j, axis, pivot);
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

/* How many of a run are smaller than each, the first of equals before the others: its place among them. Radii above 0
 * are in the order of their bits. */
static void rank(const uint32_t *bits, uint32_t *place)
{
    for (uint32_t i = 0; i < SPL_RUN_SPLATS; i++)
        place[i] = 0;
    for (uint32_t j = 0; j < SPL_RUN_SPLATS; j++)
        for (uint32_t i = 0; i < SPL_RUN_SPLATS; i++)
            place[i] += (bits[j] < bits[i]) | ((bits[j] == bits[i]) & (j < i));
}

void spl_chunk_match_lanes(struct spl_cut *items, const float *radius, size_t count)
{
    for (size_t first = 0; first < count; first += SPL_RUN_SPLATS) {
        size_t used = count - first < SPL_RUN_SPLATS ? count - first : SPL_RUN_SPLATS;
        uint32_t bits[SPL_RUN_SPLATS], place[SPL_RUN_SPLATS];
        struct spl_cut run[SPL_RUN_SPLATS];
        memset(bits, 0xff, sizeof bits); /* what is not there comes last */
        memcpy(bits, radius + first, used * sizeof *bits);
        rank(bits, place);
        /* the smallest go before the largest, behind those between */
        uint32_t groups = (uint32_t)(used + SPL_LANES - 1) / SPL_LANES;
        uint32_t between = groups > 2 ? (groups - 2) * SPL_LANES : 0;
        for (size_t i = 0; i < used; i++) {
            uint32_t to = place[i];
            run[to < SPL_LANES ? to + between : to < SPL_LANES + between ? to - SPL_LANES : to] = items[first + i];
        }
        memcpy(items + first, run, used * sizeof *run);
    }
}
