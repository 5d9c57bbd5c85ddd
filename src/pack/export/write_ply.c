/* PLY, as text: vertices, faces and edges, and what is known of them as properties of those. A face is a polygon whose
 * holes are joined to its border by cuts, so that it needs no second list; edges are the pieces of lines. */
#include "pack/export/export.h"

static void count_all(const struct spl_shapes *s, size_t *vertices, size_t *faces, size_t *edges)
{
    *vertices = s->vertex_count;
    *faces = *edges = 0;
    for (uint32_t k = 0; k < s->plane_count; k++) {
        *vertices += s->planes[k].outline.vertex_count;
        *faces += s->planes[k].outline.polygon_count;
    }
    for (uint32_t k = 0; k < s->mesh_count; k++) {
        *vertices += s->meshes[k].vertex_count;
        *faces += s->meshes[k].triangle_count;
    }
    for (size_t k = 0; k < s->line_count; k++)
        *edges += s->lines[k].count - 1;
}

static void put_faces(const struct spl_shapes *s, FILE *out)
{
    size_t base = 0;
    for (uint32_t k = 0; k < s->plane_count; k++) {
        const struct spl_shape_plane *p = &s->planes[k];
        for (size_t f = 0; f < p->outline.polygon_count; f++) {
            const struct spl_polygon *polygon = &p->outline.polygons[f];
            fprintf(out, "%u", polygon->loops);
            for (uint32_t i = 0; i < polygon->loops; i++)
                fprintf(out, " %zu", base + p->outline.loop[polygon->loop + i]);
            fprintf(out, " %u %.*f %.4f %.9f %.9f %.9f %.*f %.*f -1\n", k, (int)s->decimals, polygon->area,
                    p->inclination, p->plane->normal[0], p->plane->normal[1], p->plane->normal[2], (int)s->decimals,
                    p->plane->error_rms, (int)s->decimals, p->plane->error_max);
        }
        base += p->outline.vertex_count;
    }
    for (uint32_t k = 0; k < s->mesh_count; k++) {
        const struct spl_shape_mesh *m = &s->meshes[k];
        for (size_t t = 0; t < m->triangle_count; t++) {
            double normal[3], area = spl_shape_triangle(m, t, normal);
            fprintf(out, "3 %zu %zu %zu -1 %.*f %.4f %.9f %.9f %.9f %.*f %.*f %u\n", base + m->triangles[t][0],
                    base + m->triangles[t][1], base + m->triangles[t][2], (int)s->decimals, area,
                    spl_shape_inclination(normal, s->up), normal[0], normal[1], normal[2], (int)s->decimals,
                    m->plane->error_rms, (int)s->decimals, m->plane->error_max, k);
        }
        base += m->vertex_count;
    }
}

void spl_shapes_write_ply(const struct spl_shapes *s, const char *unit, FILE *out)
{
    size_t vertices, faces, edges;
    int places = (int)s->decimals;
    count_all(s, &vertices, &faces, &edges);
    fprintf(
        out,
        "ply\nformat ascii 1.0\ncomment " SPL_DRAWING_MARK "%s\n"
        "comment inclination: degrees between a plane's normal and up; sag: below the chord, -1 where a line stands\n"
        "element vertex %zu\nproperty double x\nproperty double y\nproperty double z\n"
        "element face %zu\nproperty list int int vertex_indices\nproperty int plane\nproperty double area\n"
        "property double inclination\nproperty double nx\nproperty double ny\nproperty double nz\n"
        "property double error_rms\nproperty double error_max\nproperty int mesh\n"
        "element edge %zu\nproperty int vertex1\nproperty int vertex2\nproperty int line\nproperty double length\n"
        "property double sag\nend_header\n",
        unit, vertices, faces, edges);
    for (uint32_t k = 0; k < s->plane_count; k++)
        for (size_t i = 0; i < s->planes[k].outline.vertex_count; i++) {
            double at[3];
            spl_shape_place(&s->planes[k], s->planes[k].outline.vertices[i], at);
            fprintf(out, "%.*f %.*f %.*f\n", places, at[0], places, at[1], places, at[2]);
        }
    for (uint32_t k = 0; k < s->mesh_count; k++)
        for (size_t i = 0; i < s->meshes[k].vertex_count; i++) {
            const double *at = s->meshes[k].vertices[i];
            fprintf(out, "%.*f %.*f %.*f\n", places, at[0], places, at[1], places, at[2]);
        }
    for (size_t i = 0; i < s->vertex_count; i++)
        fprintf(out, "%.*f %.*f %.*f\n", places, s->vertices[i][0], places, s->vertices[i][1], places,
                s->vertices[i][2]);
    put_faces(s, out);
    for (size_t k = 0, base = vertices - s->vertex_count; k < s->line_count; k++)
        for (size_t i = 0; i + 1 < s->lines[k].count; i++)
            fprintf(out, "%zu %zu %zu %.*f %.*f\n", base + s->lines[k].first + i, base + s->lines[k].first + i + 1, k,
                    places, s->lines[k].length, places, s->lines[k].sag < 0 ? -1 : s->lines[k].sag);
}
