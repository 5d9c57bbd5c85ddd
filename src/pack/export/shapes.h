/* The primitives of a scan as drawings have them: planes as polygons, wires as polylines. */
#ifndef SPL_PACK_EXPORT_SHAPES_H
#define SPL_PACK_EXPORT_SHAPES_H

#include "pack/export/outline.h"
#include "pack/planes/planes.h"
#include "pack/wires/wires.h"

struct spl_shape_plane {
    const struct spl_plane *plane; /* borrowed; its origin is (0, 0) of the outline, its axes are */
    double u[3], v[3];             /* level, and up in the plane, so far as it is not level itself; u x v = normal */
    double area;                   /* of all polygons */
    double inclination;            /* degrees between its normal and what is up: floor 0, wall 90, ceiling 180 */
    struct spl_outline outline;
};

/* From an end of a wire, or a support, to the next. */
struct spl_shape_line {
    size_t first, count; /* vertices, 2 at least */
    double length;
    double sag; /* how far it hangs below the chord of its ends, at most; < 0: it stands, within 30 degrees of up */
};

/* A piece with relief, triangle by triangle, counterclockwise from where it was seen. */
struct spl_shape_mesh {
    const struct spl_plane *plane; /* borrowed */
    double area;
    double (*vertices)[3];    /* world; owned */
    uint32_t (*triangles)[3]; /* owned */
    size_t vertex_count, triangle_count;
};

/* Lengths in units of the coordinates. */
struct spl_shapes {
    struct spl_shape_plane *planes; /* flat ones */
    struct spl_shape_mesh *meshes;  /* those with relief, in their order */
    uint32_t plane_count, mesh_count;
    struct spl_shape_line *lines;
    size_t line_count, line_capacity;
    double (*vertices)[3]; /* of lines, world */
    size_t vertex_count, vertex_capacity;
    double up[3];
    double text_height; /* of all texts: 2 mm for each metre of the scan's diagonal */
    unsigned decimals;  /* of lengths, that say more than the points do */
};

/* Planes of points->plane with the outlines of their members, simplified by no more than a plane's own points are off
 * it, or their spacing, and wires, by no more than 4 sigma of the noise or a fifth of their spacing. `planes` stays
 * where it is. Parallel, on stage->threads; 4 bytes a point, and for each thread some 60 MB and 20 bytes a point of the
 * plane that it is at. `shapes` is finished by the caller, on failure too. SPL_E_NOMEM, SPL_E_CANCELLED,
 * SPL_E_LIMIT. */
int spl_shapes_init(struct spl_shapes *shapes, const struct spl_points *points, const struct spl_planes *planes,
                    const struct spl_wires *wires, struct spl_stage *stage, struct spl_error *err);

void spl_shapes_finish(struct spl_shapes *shapes);

/* The triangles of `mesh`, whose plane is set, over its points `member[0..count)`. Finished by the caller, on failure
 * too. SPL_E_NOMEM. Any thread (mesh.c). */
int spl_shape_mesh_init(struct spl_shape_mesh *mesh, const struct spl_points *points, const uint32_t *member,
                        size_t count);
void spl_shape_mesh_finish(struct spl_shape_mesh *mesh);

/* A triangle's area, > 0, and its unit normal. */
double spl_shape_triangle(const struct spl_shape_mesh *mesh, size_t triangle, double normal[3]);

/* Degrees between a unit normal and what is up. */
double spl_shape_inclination(const double normal[3], const double up[3]);

/* Where a vertex of a plane's outline lies. */
void spl_shape_place(const struct spl_shape_plane *plane, const double at[2], double world[3]);

#endif
