/* Wavefront OBJ: a group a plane, a mesh and a line, with their numbers in a comment before each. Faces are polygons
 * whose holes are joined to their border by cuts. */
#include "pack/export/export.h"

static void put_vertex(const struct spl_shapes *s, const double at[3], FILE *out)
{
    int places = (int)s->decimals;
    fprintf(out, "v %.*f %.*f %.*f\n", places, at[0], places, at[1], places, at[2]);
}

void spl_shapes_write_obj(const struct spl_shapes *s, const char *unit, FILE *out)
{
    size_t base = 1;
    int places = (int)s->decimals;
    fprintf(out, "# " SPL_DRAWING_MARK "%s\n", unit);
    for (uint32_t k = 0; k < s->plane_count; k++) {
        const struct spl_shape_plane *p = &s->planes[k];
        fprintf(out,
                "# plane_%u: area %.*f, inclination %.4f degrees, error %.*f rms, %.*f at most, %llu points\n"
                "g plane_%u\n",
                k, places, p->area, p->inclination, places, p->plane->error_rms, places, p->plane->error_max,
                (unsigned long long)p->plane->points, k);
        for (size_t i = 0; i < p->outline.vertex_count; i++) {
            double at[3];
            spl_shape_place(p, p->outline.vertices[i], at);
            put_vertex(s, at, out);
        }
        for (size_t f = 0; f < p->outline.polygon_count; f++) {
            const struct spl_polygon *polygon = &p->outline.polygons[f];
            fputc('f', out);
            for (uint32_t i = 0; i < polygon->loops; i++)
                fprintf(out, " %zu", base + p->outline.loop[polygon->loop + i]);
            fputc('\n', out);
        }
        base += p->outline.vertex_count;
    }
    for (uint32_t k = 0; k < s->mesh_count; k++) {
        const struct spl_shape_mesh *m = &s->meshes[k];
        fprintf(out, "# mesh_%u: area %.*f, error %.*f rms, %.*f at most, %llu points\ng mesh_%u\n", k, places, m->area,
                places, m->plane->error_rms, places, m->plane->error_max, (unsigned long long)m->plane->points, k);
        for (size_t i = 0; i < m->vertex_count; i++)
            put_vertex(s, m->vertices[i], out);
        for (size_t t = 0; t < m->triangle_count; t++)
            fprintf(out, "f %zu %zu %zu\n", base + m->triangles[t][0], base + m->triangles[t][1],
                    base + m->triangles[t][2]);
        base += m->vertex_count;
    }
    for (size_t k = 0; k < s->line_count; k++) {
        const struct spl_shape_line *line = &s->lines[k];
        fprintf(out, "# line_%zu: length %.*f", k, places, line->length);
        if (line->sag >= 0)
            fprintf(out, ", sag %.*f", places, line->sag);
        fprintf(out, "\ng line_%zu\n", k);
        for (size_t i = 0; i < line->count; i++)
            put_vertex(s, s->vertices[line->first + i], out);
        fputc('l', out);
        for (size_t i = 0; i < line->count; i++)
            fprintf(out, " %zu", base++);
        fputc('\n', out);
    }
}
