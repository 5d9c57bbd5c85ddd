/* DXF of AutoCAD Release 12, the version that everything reads: each ring of a plane is a closed 3D polyline on the
 * layer PLANES, each line an open one on LINES, each triangle of a mesh a 3D face on MESHES, and the numbers stand
 * beside them as texts on PLANES_TEXT, LINES_TEXT and MESHES_TEXT. Group codes and values take a line each. */
#include <math.h>

#include "pack/export/export.h"

enum { polyline_closed = 1, polyline_3d = 8, vertex_3d = 32, white = 7 };

static void put_pair(FILE *out, int code, const char *value)
{
    fprintf(out, "%3d\n%s\n", code, value);
}

static void put_place(const struct spl_shapes *s, const double at[3], FILE *out)
{
    for (int c = 0; c < 3; c++)
        fprintf(out, "%3d\n%.*f\n", 10 * (c + 1), (int)s->decimals, at[c]);
}

static void begin_polyline(const char *layer, int flags, FILE *out)
{
    put_pair(out, 0, "POLYLINE");
    put_pair(out, 8, layer);
    fprintf(out, " 66\n1\n 10\n0.0\n 20\n0.0\n 30\n0.0\n 70\n%d\n", flags);
}

static void put_vertex(const struct spl_shapes *s, const char *layer, const double at[3], FILE *out)
{
    put_pair(out, 0, "VERTEX");
    put_pair(out, 8, layer);
    put_place(s, at, out);
    fprintf(out, " 70\n%d\n", vertex_3d);
}

static void end_polyline(const char *layer, FILE *out)
{
    put_pair(out, 0, "SEQEND");
    put_pair(out, 8, layer);
}

static void put_text(const struct spl_shapes *s, const char *layer, const double at[3], const char *text,
                     FILE *out)
{
    put_pair(out, 0, "TEXT");
    put_pair(out, 8, layer);
    put_place(s, at, out);
    fprintf(out, " 40\n%.*f\n", (int)s->decimals, s->text_height);
    put_pair(out, 1, text);
}

static void put_layers(FILE *out)
{
    static const char *const names[] = {"PLANES", "PLANES_TEXT", "LINES", "LINES_TEXT", "MESHES", "MESHES_TEXT"};
    put_pair(out, 0, "SECTION");
    put_pair(out, 2, "TABLES");
    put_pair(out, 0, "TABLE");
    put_pair(out, 2, "LAYER");
    fprintf(out, " 70\n%d\n", (int)(sizeof names / sizeof *names));
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        put_pair(out, 0, "LAYER");
        put_pair(out, 2, names[k]);
        fprintf(out, " 70\n0\n 62\n%d\n", white - (int)k);
        put_pair(out, 6, "CONTINUOUS");
    }
    put_pair(out, 0, "ENDTAB");
    put_pair(out, 0, "ENDSEC");
}

static void put_plane(const struct spl_shapes *s, uint32_t k, FILE *out)
{
    const struct spl_shape_plane *p = &s->planes[k];
    char text[200];
    for (size_t r = 0; r < p->outline.ring_count; r++) {
        const struct spl_ring *ring = &p->outline.rings[r];
        begin_polyline("PLANES", polyline_closed | polyline_3d, out);
        for (uint32_t i = 0; i < ring->count; i++) {
            double at[3];
            spl_shape_place(p, p->outline.vertices[ring->first + i], at);
            put_vertex(s, "PLANES", at, out);
        }
        end_polyline("PLANES", out);
    }
    snprintf(text, sizeof text, "plane_%u area %.*f inclination %.4f error %.*f max %.*f", k, (int)s->decimals, p->area,
             p->inclination, (int)s->decimals, p->plane->error_rms, (int)s->decimals, p->plane->error_max);
    put_text(s, "PLANES_TEXT", p->plane->origin, text, out);
}

static void put_line(const struct spl_shapes *s, size_t k, FILE *out)
{
    const struct spl_shape_line *line = &s->lines[k];
    char text[120];
    begin_polyline("LINES", polyline_3d, out);
    for (size_t i = 0; i < line->count; i++)
        put_vertex(s, "LINES", s->vertices[line->first + i], out);
    end_polyline("LINES", out);
    int length = snprintf(text, sizeof text, "line_%zu length %.*f", k, (int)s->decimals, line->length);
    if (line->sag >= 0)
        snprintf(text + length, sizeof text - (size_t)length, " sag %.*f", (int)s->decimals, line->sag);
    put_text(s, "LINES_TEXT", s->vertices[line->first + line->count / 2], text, out);
}

static void put_mesh(const struct spl_shapes *s, uint32_t k, FILE *out)
{
    const struct spl_shape_mesh *m = &s->meshes[k];
    char text[200];
    for (size_t t = 0; t < m->triangle_count; t++) {
        put_pair(out, 0, "3DFACE");
        put_pair(out, 8, "MESHES");
        for (int corner = 0; corner < 4; corner++) /* the fourth is the third */
            for (int c = 0; c < 3; c++)
                fprintf(out, "%3d\n%.*f\n", 10 * (c + 1) + corner, (int)s->decimals,
                        m->vertices[m->triangles[t][corner < 3 ? corner : 2]][c]);
    }
    snprintf(text, sizeof text, "mesh_%u area %.*f error %.*f max %.*f", k, (int)s->decimals, m->area, (int)s->decimals,
             m->plane->error_rms, (int)s->decimals, m->plane->error_max);
    put_text(s, "MESHES_TEXT", m->plane->origin, text, out);
}

void spl_shapes_write_dxf(const struct spl_shapes *s, const char *unit, FILE *out)
{
    fprintf(out, "999\n" SPL_DRAWING_MARK "%s\n", unit);
    put_pair(out, 0, "SECTION");
    put_pair(out, 2, "HEADER");
    put_pair(out, 9, "$ACADVER");
    put_pair(out, 1, "AC1009");
    put_pair(out, 0, "ENDSEC");
    put_layers(out);
    put_pair(out, 0, "SECTION");
    put_pair(out, 2, "ENTITIES");
    for (uint32_t k = 0; k < s->plane_count; k++)
        put_plane(s, k, out);
    for (uint32_t k = 0; k < s->mesh_count; k++)
        put_mesh(s, k, out);
    for (size_t k = 0; k < s->line_count; k++)
        put_line(s, k, out);
    put_pair(out, 0, "ENDSEC");
    put_pair(out, 0, "EOF");
}
