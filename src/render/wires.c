/* Wires as a camera sees them. Each tile takes the pieces that it may see, block by block, relative to the eye in
 * doubles. */
#include "render/wires.h"

#include <math.h>

#include "geom/octahedral.h"
#include "render/frustum.h"

static void to_view(const struct spl_camera *camera, const double at[3], double out[3])
{
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i;
        out[i] = 0;
        for (int c = 0; c < 3; c++)
            out[i] += r[c] * (at[c] - camera->eye[c]);
    }
}

/* Moves the end `at` of a line, the other being `other`, to the plane at depth `z`. */
static void cut(double at[3], const double other[3], double z)
{
    double t = (z - at[2]) / (other[2] - at[2]);
    for (int c = 0; c < 2; c++)
        at[c] += t * (other[c] - at[c]);
    at[2] = z;
}

static uint32_t pack_normal(const struct spl_camera *camera, const float normal[3])
{
    float view[3], e[2];
    uint32_t code = 0;
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i;
        view[i] = (float)(r[0] * normal[0] + r[1] * normal[1] + r[2] * normal[2]);
    }
    spl_octahedral_encode(view, &e[0], &e[1]);
    for (int i = 0; i < 2; i++)
        code |= (uint32_t)fminf((e[i] + 1) * 32767 + 0.5f, 65534) << 16 * i;
    return code;
}

static void draw_piece(const struct spl_wire_piece *piece, const struct spl_camera *camera, struct spl_draw_list *list)
{
    struct spl_draw_line line = {.color = piece->look.color, .id = piece->look.id};
    double ends[2][3];
    to_view(camera, piece->from, ends[0]);
    to_view(camera, piece->to, ends[1]);
    if (fmax(ends[0][2], ends[1][2]) <= camera->near || fmin(ends[0][2], ends[1][2]) >= camera->far)
        return;
    for (int k = 0; k < 2; k++) {
        if (ends[k][2] < camera->near)
            cut(ends[k], ends[1 - k], camera->near);
        if (ends[k][2] > camera->far)
            cut(ends[k], ends[1 - k], camera->far);
    }
    float *from[3] = {&line.from_x, &line.from_y, &line.from_z}, *to[3] = {&line.to_x, &line.to_y, &line.to_z};
    for (int c = 0; c < 3; c++) {
        *from[c] = (float)ends[0][c];
        *to[c] = (float)ends[1][c];
    }
    line.normal = pack_normal(camera, piece->look.normal);
    list->lines[list->line_count++] = line;
}

int spl_wires_draw(const struct spl_wires *wires, const struct spl_camera *camera, struct spl_draw_list *list,
                   struct spl_error *err)
{
    for (size_t first = 0; first < wires->count; first += SPL_WIRES_BLOCK) {
        const struct spl_wire_block *block = &wires->blocks[first / SPL_WIRES_BLOCK];
        double least[3], size[3];
        for (int c = 0; c < 3; c++) {
            least[c] = block->low[c] - camera->eye[c];
            size[c] = block->high[c] - block->low[c];
        }
        struct spl_view_box box = spl_view_box(camera, least, size);
        if (!spl_view_box_visible(camera, &box, 1))
            continue;
        int rc = spl_draw_list_reserve_lines(list, SPL_WIRES_BLOCK, err);
        if (rc)
            return rc;
        for (size_t i = first; i < wires->count && i < first + SPL_WIRES_BLOCK; i++)
            draw_piece(&wires->pieces[i], camera, list);
    }
    return SPL_OK;
}
