/* A piece with relief as triangles: the squares of its own grid that have points enough, each cut in two from its least
 * to its greatest corner, as meshes of a dataset are. Its own points alone, in their order. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/export/shapes.h"
#include "pack/planes/heights.h"

enum { least = 3 }; /* points of a square, of some nine: a third of it is covered */

/* The vertex that a point's square begins with; UINT32_MAX: its corners are not all there. */
static uint32_t square_of(const struct spl_heights *h, const double at[2], uint32_t corner[4])
{
    for (int k = 0; k < 4; k++) {
        const double near[2] = {at[0] + ((k & 1) - 0.5) * h->edge, at[1] + ((k >> 1) - 0.5) * h->edge};
        corner[k] = spl_heights_vertex_at(h, near);
        if (corner[k] == UINT32_MAX)
            return UINT32_MAX;
    }
    return corner[0];
}

static void put_vertex(struct spl_shape_mesh *mesh, uint32_t vertex, uint32_t *place)
{
    const struct spl_heights *h = mesh->plane->heights;
    const struct spl_heights_vertex *v = &h->vertices[vertex];
    if (place[vertex] != UINT32_MAX)
        return;
    for (int c = 0; c < 3; c++)
        mesh->vertices[mesh->vertex_count][c] =
            h->origin[c] + h->edge * (v->column * h->u[c] + v->row * h->v[c] + v->q[0] * h->normal[c]);
    place[vertex] = (uint32_t)mesh->vertex_count++;
}

double spl_shape_triangle(const struct spl_shape_mesh *mesh, size_t triangle, double normal[3])
{
    double side[2][3], length = 0;
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++)
            side[k][c] =
                mesh->vertices[mesh->triangles[triangle][k + 1]][c] - mesh->vertices[mesh->triangles[triangle][0]][c];
    for (int c = 0; c < 3; c++) {
        normal[c] = side[0][(c + 1) % 3] * side[1][(c + 2) % 3] - side[0][(c + 2) % 3] * side[1][(c + 1) % 3];
        length += normal[c] * normal[c];
    }
    length = sqrt(length);
    for (int c = 0; c < 3; c++)
        normal[c] /= length;
    return length / 2;
}

int spl_shape_mesh_init(struct spl_shape_mesh *mesh, const struct spl_points *points, const uint32_t *member,
                        size_t count)
{
    const struct spl_heights *h = mesh->plane->heights;
    double normal[3];
    uint32_t *in = spl_alloc(h->count, sizeof *in, NULL), *place = spl_alloc_raw(h->count, sizeof *place, NULL);
    mesh->vertices = spl_alloc_raw(h->count, sizeof *mesh->vertices, NULL);
    mesh->triangles = spl_alloc_raw(2 * (size_t)h->count, sizeof *mesh->triangles, NULL);
    bool ok = in && place && mesh->vertices && mesh->triangles;
    for (uint32_t v = 0; ok && v < h->count; v++)
        place[v] = UINT32_MAX;
    for (size_t k = 0; ok && k < count; k++) {
        double at[3];
        uint32_t corner[4];
        spl_heights_place(h, points, member[k], at);
        uint32_t square = square_of(h, at, corner);
        if (square == UINT32_MAX || ++in[square] != least)
            continue;
        for (int c = 0; c < 4; c++)
            put_vertex(mesh, corner[c], place);
        for (int t = 0; t < 2; t++) {
            uint32_t *triangle = mesh->triangles[mesh->triangle_count++];
            triangle[0] = place[corner[0]];
            triangle[1] = place[corner[t ? 3 : 1]];
            triangle[2] = place[corner[t ? 2 : 3]];
            mesh->area += spl_shape_triangle(mesh, mesh->triangle_count - 1, normal);
        }
    }
    free(in);
    free(place);
    return ok ? SPL_OK : SPL_E_NOMEM;
}

void spl_shape_mesh_finish(struct spl_shape_mesh *mesh)
{
    free(mesh->vertices);
    free(mesh->triangles);
    *mesh = (struct spl_shape_mesh){0};
}
