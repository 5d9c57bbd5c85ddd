#include "support/reference_soft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/soft/models.h"

enum { wide = SPL_SOFT_TILE, high = SPL_SOFT_TILE_ROWS, span = SPL_SOFT_SPAN_MAX };

/* The samples along an axis that a sphere may reach: the tangents to its circle in that plane. */
static void extent(double p, double z, double radius, double f, double c, uint32_t size, int *first, int *last)
{
    double a = z * z - radius * radius, low = 0, top = size - 1;
    if (a > 0) {
        double root = radius * sqrt(fmax(p * p + z * z - radius * radius, 0));
        low = fmax(floor(f * (p * z - root) / a + c - 1), 0);
        top = fmin(ceil(f * (p * z + root) / a + c + 1), size - 1);
    }
    *first = (int)fmin(low, size);
    *last = (int)fmax(top, -1);
}

static float drawn_radius(const struct spl_frame_params *params, const struct soft_item *item)
{
    return fmaxf(item->radius, params->low_pass * item->z * params->inverse_fx);
}

uint32_t soft_rectangles(const struct spl_frame_params *params, const struct soft_item *item, uint32_t *rects)
{
    int x0, x1, y0, y1;
    uint32_t count = 0, columns = (params->width + wide - 1) / wide;
    const float radius = drawn_radius(params, item);
    extent(item->x, item->z, radius, params->fx, params->cx, params->width, &x0, &x1);
    extent(item->y, item->z, radius, params->fy, params->cy, params->height, &y0, &y1);
    if (x0 > x1 || y0 > y1)
        return 0;
    for (int row = y0 / high; row <= y1 / high; row += span)
        for (int column = x0 / wide; column <= x1 / wide; column += span, count++) {
            int more = x1 / wide - column, down = y1 / high - row;
            more = more < span ? more : span - 1;
            down = down < span ? down : span - 1;
            if (rects)
                rects[count] = ((uint32_t)row * columns + (uint32_t)column) | (uint32_t)more << SPL_SOFT_RECT_COLUMNS |
                               (uint32_t)down << SPL_SOFT_RECT_ROWS;
        }
    return count;
}

uint32_t soft_express(const struct spl_frame_params *params, const struct soft_item *item, int x, int y, double opacity,
                      bool border)
{
    float rx = ((float)(x + (int)params->tile_x) + (0.5f - params->cx)) * params->inverse_fx;
    float ry = ((float)(y + (int)params->tile_y) + (0.5f - params->cy)) * params->inverse_fy;
    float own = item->radius, radius = drawn_radius(params, item);
    float inverse = 1 / (1 + rx * rx + ry * ry), closer = 1 / (radius * radius);
    float ox = item->x - rx * item->z, oy = item->y - ry * item->z, along = ox * rx + oy * ry;
    float share = (ox * ox + oy * oy - along * along * inverse) * closer, m = fmaxf(1 - share, 0);
    static double known = -1; /* a fit takes long */
    static float f[SPL_SOFT_FALLOFF];
    if (known != opacity) {
        spl_soft_falloff(opacity, f);
        for (int i = 0; i < SPL_SOFT_FALLOFF; i++)
            f[i] *= 65536;
        known = opacity;
    }
    float fall = m * (f[0] + m * (f[1] + m * (f[2] + m * (f[3] + m * f[4]))));
    if (border) {
        float soft = ((float)item->mark - 1) * (1.0f / 254);
        fall = (1 - sqrtf(1 - m)) * 65536 * (1 - soft) + fall * soft;
    }
    float rounding = 0.5f;
    if (own < radius) {
        uint32_t bits[2];
        memcpy(bits, &item->x, sizeof bits);
        rounding = (float)((bits[0] * 2654435761u ^ bits[1] * 2246822519u) >> 8) / 16777216;
        fall *= own * own * closer;
    }
    return (uint32_t)fminf(fmaxf(fall + rounding, 0), 65536);
}

struct sorted {
    uint32_t key, item;
};

static int by_key(const void *a, const void *b)
{
    const struct sorted *x = a, *y = b;
    return x->key != y->key ? (x->key < y->key ? -1 : 1) : x->item < y->item ? -1 : x->item > y->item;
}

void soft_reference(const struct spl_frame_params *params, const struct soft_item *items, uint32_t count,
                    const uint32_t *solid, double opacity, bool border, uint32_t *state)
{
    struct sorted *order = malloc((count + 1) * sizeof *order);
    for (uint32_t i = 0; order && i < count; i++) {
        order[i].item = i;
        memcpy(&order[i].key, &items[i].z, 4);
    }
    qsort(order, order ? count : 0, sizeof *order, by_key);
    for (uint32_t i = 0; order && i < count; i++) {
        const struct soft_item *item = &items[order[i].item];
        int x0, x1, y0, y1;
        const float radius = drawn_radius(params, item);
        extent(item->x, item->z, radius, params->fx, params->cx, params->width, &x0, &x1);
        extent(item->y, item->z, radius, params->fy, params->cy, params->height, &y0, &y1);
        for (int y = y0; y <= y1; y++)
            for (int x = x0; x <= x1; x++) {
                size_t at = (size_t)y * params->width + (size_t)x;
                uint32_t *own = state + SPL_SOFT_STATE_WORDS * at, clear = SPL_SOFT_CLEAR - own[3];
                if (order[i].key > solid[at] || clear < SPL_SOFT_CLEAR_LEAST)
                    continue;
                uint32_t weight = ((clear >> 8) * soft_express(params, item, x, y, opacity, border)) >> 8;
                for (int k = 0; k < 3; k++)
                    own[k] += weight * item->color[k];
                own[3] += weight;
            }
    }
    free(order);
}
