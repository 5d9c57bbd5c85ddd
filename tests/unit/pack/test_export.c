/* Exported primitives: outlines of sheets whose size is known, and files of all formats, read back by small readers
 * that know no more than the formats. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "clouds.h"
#include "pack/export/export.h"
#include "support/sanitised.h"

enum { most = 80000, read_most = 4096 };

/* ---- what is exported ---- */

struct scan {
    double (*position)[3];
    uint16_t *station;
    size_t count;
    uint64_t random;
    bool relief; /* meshes are searched for */
    struct spl_points points;
    struct spl_planes planes;
    struct spl_wires wires;
};

static struct scan *new_scan(void)
{
    struct scan *s = calloc(1, sizeof *s);
    s->position = calloc(most, sizeof *s->position);
    s->station = calloc(most, sizeof *s->station);
    s->random = 11;
    return s;
}

/* A grid of points `spacing` apart on origin + [0, 1] u + [0, 1] v, each off by up to a fifth of that, but where
 * `window` (shares of u and v) is. */
static void add_sheet(struct scan *s, uint16_t station, double spacing, const double origin[3], const double u[3],
                      const double v[3], const double *window)
{
    long across = lrint(sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) / spacing);
    long up = lrint(sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / spacing);
    for (long y = 0; y < up; y++)
        for (long x = 0; x < across; x++) {
            double a = ((double)x + 0.3 + 0.4 * uniform(&s->random)) / (double)across;
            double b = ((double)y + 0.3 + 0.4 * uniform(&s->random)) / (double)up;
            if (window && a > window[0] && a < window[1] && b > window[2] && b < window[3])
                continue;
            assert_true(s->count < most);
            for (int c = 0; c < 3; c++)
                s->position[s->count][c] = origin[c] + a * u[c] + b * v[c];
            s->station[s->count++] = station;
        }
}

static void find(struct scan *s, const double offset[3], unsigned threads)
{
    static const double stations[2][3] = {{4, 5, 6}, {-4, -5, 6}};
    struct spl_stage stage = quiet_stage(threads);
    for (size_t i = 0; i < s->count; i++)
        for (int c = 0; c < 3; c++)
            s->position[i][c] += offset[c];
    s->points = cloud_of((const double(*)[3])s->position, s->count);
    s->points.station = malloc((s->count + SPL_POINTS_PAD) * sizeof *s->points.station);
    memcpy(s->points.station, s->station, s->count * sizeof *s->station);
    s->points.stations = calloc(2, sizeof *s->points.stations);
    s->points.station_count = 2;
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++)
            s->points.stations[k][4 * c + 3] = stations[k][c] + offset[c];
    assert_int_equal(spl_points_order(&s->points, &stage, NULL), 0);
    assert_int_equal(spl_surface(&s->points, 12, true, &stage, NULL), 0);
    const struct spl_planes_options options = {.error = s->relief ? 0.002 : 0.005, .relief = s->relief};
    assert_int_equal(spl_planes_find(&s->planes, &s->points, &options, &stage, NULL), 0);
}

/* The five faces of a cube that stands somewhere; one of them has a window of 0.5 x 0.4. */
static struct scan *box(const double offset[3], unsigned threads)
{
    static const double window[4] = {0.2, 0.7, 0.3, 0.7};
    struct scan *s = new_scan();
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    add_sheet(s, 0, 0.01, z, x, y, NULL);
    add_sheet(s, 0, 0.01, x, y, z, window);
    add_sheet(s, 0, 0.01, y, x, z, NULL);
    add_sheet(s, 1, 0.01, (const double[3]){0}, y, z, NULL);
    add_sheet(s, 1, 0.01, (const double[3]){0}, x, z, NULL);
    find(s, offset, threads);
    return s;
}

static void add_vertex(struct scan *s, double x, double y, double z, bool last)
{
    s->wires.vertices = realloc(s->wires.vertices, (s->wires.count + 1) * sizeof *s->wires.vertices);
    s->wires.vertices[s->wires.count++] =
        (struct spl_wire_vertex){.position = {x, y, z}, .point = last ? SPL_WIRE_END : 0};
}

/* A wire of 20 m that hangs 0.5 m below a chord which rises by 2 m, and a pole of 6 m that leans a little. */
static void add_wires(struct scan *s, const double offset[3])
{
    for (int i = 0; i <= 200; i++) {
        double t = i / 200.0;
        add_vertex(s, offset[0] + 20 * t, offset[1] + 3, offset[2] + 5 + 2 * t - 4 * 0.5 * t * (1 - t), i == 200);
    }
    for (int i = 0; i <= 60; i++)
        add_vertex(s, offset[0] + 0.01 * i, offset[1] - 3, offset[2] + 0.1 * i, i == 60);
}

static void finish(struct scan *s)
{
    free(s->wires.vertices);
    spl_planes_finish(&s->planes);
    spl_points_finish(&s->points);
    free(s->position);
    free(s->station);
    free(s);
}

/* ---- readers ---- */

struct drawing {
    double vertex[4 * read_most][3];
    size_t vertices;
    size_t face[read_most][read_most / 16], face_count[read_most], faces; /* numbers of vertices; DXF: rings */
    size_t line[read_most], line_count[read_most], lines;                 /* first vertex of each, and how many */
    double area[64], inclination[64], length[16], sag[16];                /* as the file says; by plane, by line */
    size_t planes, measured;
};

static FILE *open_read(const char *path)
{
    FILE *in = fopen(path, "r");
    assert_non_null(in);
    return in;
}

static void take_vertex(struct drawing *d, const char *text)
{
    double *v = d->vertex[d->vertices++];
    assert_true(d->vertices < 4 * read_most);
    assert_int_equal(sscanf(text, "%lf %lf %lf", &v[0], &v[1], &v[2]), 3);
}

static void take_face(struct drawing *d, const char *text, size_t base)
{
    int used;
    size_t vertex;
    for (; sscanf(text, "%zu%n", &vertex, &used) == 1; text += used) {
        assert_true(vertex >= base && vertex - base < d->vertices);
        assert_true(d->face_count[d->faces] < read_most / 16);
        d->face[d->faces][d->face_count[d->faces]++] = vertex - base;
    }
    assert_true(d->face_count[d->faces] >= 3);
    d->faces++;
}

static struct drawing *read_obj(const char *path)
{
    struct drawing *d = calloc(1, sizeof *d);
    char row[65536], sag[16];
    size_t number;
    FILE *in = open_read(path);
    while (fgets(row, sizeof row, in)) {
        if (!strncmp(row, "v ", 2))
            take_vertex(d, row + 2);
        else if (!strncmp(row, "f ", 2))
            take_face(d, row + 2, 1);
        else if (!strncmp(row, "l ", 2)) {
            char *at = row + 2;
            d->line[d->lines] = strtoul(at, &at, 10) - 1;
            d->line_count[d->lines] = 1;
            while (strtoul(at, &at, 10))
                d->line_count[d->lines]++;
            d->lines++;
        } else if (sscanf(row, "# plane_%zu:", &number) == 1) {
            assert_int_equal(number, d->planes);
            assert_int_equal(sscanf(row, "# plane_%*u: area %lf, inclination %lf degrees", &d->area[number],
                                    &d->inclination[number]),
                             2);
            d->planes++;
        } else if (sscanf(row, "# line_%zu:", &number) == 1) {
            int found = sscanf(row, "# line_%*u: length %lf, %3s %lf", &d->length[number], sag, &d->sag[number]);
            d->sag[number] = found == 3 ? d->sag[number] : -1;
            d->measured++;
        } else {
            assert_true(row[0] == '#' || !strncmp(row, "g plane_", 8) || !strncmp(row, "g line_", 7) ||
                        !strncmp(row, "g mesh_", 7));
        }
    }
    fclose(in);
    return d;
}

static struct drawing *read_ply(const char *path)
{
    struct drawing *d = calloc(1, sizeof *d);
    char row[65536];
    size_t vertices = 0, faces = 0, edges = 0, lists = 0;
    FILE *in = open_read(path);
    assert_string_equal(fgets(row, sizeof row, in), "ply\n");
    while (strcmp(fgets(row, sizeof row, in), "end_header\n")) {
        sscanf(row, "element vertex %zu", &vertices);
        sscanf(row, "element face %zu", &faces);
        sscanf(row, "element edge %zu", &edges);
        lists += !strcmp(row, "property list int int vertex_indices\n");
    }
    assert_int_equal(lists, 1);
    for (size_t i = 0; i < vertices; i++)
        take_vertex(d, fgets(row, sizeof row, in));
    for (size_t i = 0; i < faces; i++) {
        double area, inclination;
        unsigned plane;
        char *at = fgets(row, sizeof row, in);
        size_t count = strtoul(at, &at, 10);
        assert_true(count >= 3 && count < read_most / 16);
        for (size_t k = 0; k < count; k++)
            d->face[i][k] = strtoul(at, &at, 10);
        assert_int_equal(sscanf(at, "%u %lf %lf", &plane, &area, &inclination), 3);
        d->face_count[i] = count;
        d->area[plane] += area;
        d->inclination[plane] = inclination;
        d->planes = plane + 1;
    }
    d->faces = faces;
    for (size_t i = 0; i < edges; i++) {
        size_t a, b, line;
        double length, sag;
        assert_int_equal(sscanf(fgets(row, sizeof row, in), "%zu %zu %zu %lf %lf", &a, &b, &line, &length, &sag), 5);
        assert_true(b == a + 1 && b < vertices);
        if (line == d->lines) {
            d->line[line] = a;
            d->line_count[line] = 1;
            d->lines = d->measured = line + 1;
        }
        assert_int_equal(a, d->line[line] + d->line_count[line]++ - 1);
        d->length[line] = length;
        d->sag[line] = sag;
    }
    assert_null(fgets(row, sizeof row, in));
    fclose(in);
    return d;
}

/* All that a reader of Release 12 needs to know of polylines and texts. */
static struct drawing *read_dxf(const char *path)
{
    struct drawing *d = calloc(1, sizeof *d);
    char code[64], value[512], entity[64] = "", layer[64] = "";
    int sections = 0, open = 0;
    bool is_vertex = false, ended = false;
    FILE *in = open_read(path);
    while (fgets(code, sizeof code, in)) {
        assert_false(ended);
        assert_non_null(fgets(value, sizeof value, in));
        value[strcspn(value, "\n")] = 0;
        int group = atoi(code);
        if (group == 0) {
            sections += !strcmp(value, "SECTION") - !strcmp(value, "ENDSEC");
            open += !strcmp(value, "POLYLINE") - !strcmp(value, "SEQEND");
            assert_true(open == 0 || open == 1);
            is_vertex = !strcmp(value, "VERTEX");
            assert_true(!is_vertex || open);
            ended = !strcmp(value, "EOF");
            snprintf(entity, sizeof entity, "%.60s", value);
        } else if (group == 8) {
            snprintf(layer, sizeof layer, "%.60s", value);
        } else if (group == 70 && !strcmp(entity, "POLYLINE")) {
            assert_int_equal(atoi(value), strcmp(layer, "LINES") ? 9 : 8);
            if (atoi(value) == 9)
                d->faces++;
            else
                d->line[d->lines++] = d->vertices;
        } else if (is_vertex && group % 10 == 0 && group >= 10 && group <= 30) {
            d->vertex[d->vertices][group / 10 - 1] = strtod(value, NULL);
            if (group == 30 && !strcmp(layer, "PLANES"))
                d->face[d->faces - 1][d->face_count[d->faces - 1]++] = d->vertices;
            if (group == 30 && !strcmp(layer, "LINES"))
                d->line_count[d->lines - 1]++;
            d->vertices += group == 30;
        } else if (group == 1 && !strcmp(layer, "PLANES_TEXT")) {
            assert_int_equal(
                sscanf(value, "plane_%*u area %lf inclination %lf", &d->area[d->planes], &d->inclination[d->planes]),
                2);
            d->planes++;
        } else if (group == 1 && !strcmp(layer, "LINES_TEXT")) {
            int found = sscanf(value, "line_%*u length %lf sag %lf", &d->length[d->measured], &d->sag[d->measured]);
            assert_true(found >= 1);
            d->sag[d->measured] = found == 2 ? d->sag[d->measured] : -1;
            d->measured++;
        }
    }
    assert_true(ended && sections == 0 && open == 0);
    fclose(in);
    return d;
}

/* Of a loop of vertices in space, whatever its plane. */
static double area_of(const struct drawing *d, size_t face)
{
    double sum[3] = {0};
    const double *o = d->vertex[d->face[face][0]];
    for (size_t i = 0; i < d->face_count[face]; i++) {
        const double *a = d->vertex[d->face[face][i]], *b = d->vertex[d->face[face][(i + 1) % d->face_count[face]]];
        for (int c = 0; c < 3; c++)
            sum[c] += ((a[(c + 1) % 3] - o[(c + 1) % 3]) * (b[(c + 2) % 3] - o[(c + 2) % 3]) -
                       (a[(c + 2) % 3] - o[(c + 2) % 3]) * (b[(c + 1) % 3] - o[(c + 1) % 3])) /
                      2;
    }
    return sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
}

/* ---- tests ---- */

static char folder[] = "/tmp/splatd-export-XXXXXX";

static char *path_of(const char *name)
{
    static char path[2][256];
    static int turn;
    turn ^= 1;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static struct spl_drawing_report report; /* of what was written last */

static void write_to(const char *path, const struct scan *s, unsigned threads)
{
    struct spl_stage stage = quiet_stage(threads);
    struct spl_error err = {0};
    assert_int_equal(spl_export_check(path, NULL, 0, &err), 0);
    char *text;
    size_t length;
    int rc = spl_export_primitives(path, &s->points, &s->planes, &s->wires, 1, &stage, &text, &length, &report, &err);
    assert_int_equal(rc, 0);
    assert_int_equal(spl_file_replace(path, text, length, &err), 0);
    free(text);
}

/* What stays of a sheet with a window and an island in it, and how large it is. */
static void test_outline_keeps_holes_and_islands(void **state)
{
    (void)state;
    const double spacing = 0.01;
    static double at[60000][2];
    static float radius[60000];
    struct spl_outline o;
    size_t count = 0;
    for (double y = spacing / 2; y < 1; y += spacing)
        for (double x = spacing / 2; x < 2; x += spacing) {
            bool window = x > 0.5 && x < 1.5 && y > 0.2 && y<0.8, island = x> 0.8 && x < 1.2 && y > 0.4 && y < 0.6;
            if (window && !island)
                continue;
            at[count][0] = x + 700;
            at[count][1] = y;
            radius[count++] = (float)(1.128 * spacing);
        }
    assert_int_equal(spl_outline_find(&o, (const double(*)[2])at, radius, count, 0.003, NULL), 0);
    assert_int_equal(o.polygon_count, 2);
    assert_int_equal(o.ring_count, 3);
    const struct spl_polygon *large = &o.polygons[o.polygons[1].rings == 2];
    const struct spl_polygon *small = &o.polygons[o.polygons[1].rings != 2];
    assert_int_equal(large->rings, 2);
    assert_int_equal(small->rings, 1);
    assert_true(fabs(large->area - 1.4) < 0.014);
    assert_true(fabs(small->area - 0.08) < 0.004);
    uint32_t border = o.rings[large->ring].count, hole = o.rings[large->ring + 1].count;
    assert_true(border >= 4 && border <= 8 && hole >= 4 && hole <= 8);
    assert_false(o.rings[large->ring].hole);
    assert_true(o.rings[large->ring + 1].hole);
    assert_int_equal(large->loops, border + hole + 3);
    assert_int_equal(small->loops, o.rings[small->ring].count);
    double(*loop)[2] = malloc(large->loops * sizeof *loop);
    for (uint32_t i = 0; i < large->loops; i++)
        memcpy(loop[i], o.vertices[o.loop[large->loop + i]], sizeof *loop);
    assert_true(fabs(spl_outline_area((const double(*)[2])loop, large->loops) - large->area) < 1e-9);
    free(loop);
    spl_outline_finish(&o);
}

/* Twice the area of a triangle, > 0 where it runs counterclockwise. */
static double turn(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Pairs of the loop's pieces that cross each other, not at an end. */
static unsigned count_crossings(const struct spl_outline *o, const struct spl_polygon *p)
{
    unsigned crossings = 0;
    const uint32_t *loop = o->loop + p->loop;
    for (uint32_t i = 0; i < p->loops; i++)
        for (uint32_t k = 0; k < i; k++) {
            const double *a = o->vertices[loop[k]], *b = o->vertices[loop[k + 1]];
            const double *c = o->vertices[loop[i]], *d = o->vertices[loop[(i + 1) % p->loops]];
            crossings += turn(a, b, c) * turn(a, b, d) < -1e-12 && turn(c, d, a) * turn(c, d, b) < -1e-12;
        }
    return crossings;
}

/* Three windows beside each other, in the last an island with a hole of its own, and a stray point in the first. Holes
 * are of the smallest border around them, cuts cross nothing, and what has no size is left out. */
static void test_outline_of_many_holes(void **state)
{
    (void)state;
    static const double windows[3][4] = {{0.3, 0.8, 0.2, 0.8}, {1.2, 1.7, 0.25, 0.75}, {2, 2.8, 0.1, 0.9}};
    const double spacing = 0.01;
    static double at[40000][2];
    static float radius[40000];
    struct spl_outline o;
    size_t count = 0;
    for (double y = spacing / 2; y < 1; y += spacing)
        for (double x = spacing / 2; x < 3; x += spacing) {
            bool open = false;
            for (int w = 0; w < 3; w++)
                open |= x > windows[w][0] && x < windows[w][1] && y > windows[w][2] && y < windows[w][3];
            open &= !(x > 2.2 && x < 2.6 && y > 0.3 && y < 0.7) || (x > 2.33 && x < 2.47 && y > 0.43 && y < 0.57);
            open &= !(x > 0.55 && x < 0.56 && y > 0.5 && y < 0.51);
            if (open)
                continue;
            at[count][0] = x;
            at[count][1] = y;
            radius[count++] = (float)(1.128 * spacing);
        }
    assert_int_equal(spl_outline_find(&o, (const double(*)[2])at, radius, count, 0.003, NULL), 0);
    assert_int_equal(o.polygon_count, 2);
    const struct spl_polygon *large = &o.polygons[o.polygons[1].area > o.polygons[0].area];
    const struct spl_polygon *island = &o.polygons[o.polygons[1].area < o.polygons[0].area];
    assert_int_equal(large->rings, 4);
    assert_int_equal(island->rings, 2);
    assert_true(fabs(large->area - 1.81) < 0.03 && fabs(island->area - 0.1404) < 0.008);
    assert_int_equal(count_crossings(&o, large), 0);
    assert_int_equal(count_crossings(&o, island), 0);
    spl_outline_finish(&o);
    count = 0; /* a strip that is narrower than its border may move */
    for (double y = spacing / 2; y < 0.05; y += spacing)
        for (double x = spacing / 2; x < 1; x += spacing, count++) {
            at[count][0] = x;
            at[count][1] = y;
        }
    assert_int_equal(spl_outline_find(&o, (const double(*)[2])at, radius, count, 0.06, NULL), 0);
    assert_int_equal(o.polygon_count, 1);
    assert_true(fabs(o.polygons[0].area - 0.05) < 0.015);
    spl_outline_finish(&o);
}

/* A single point, points on a line and points at one place have some outline, of next to no size. */
static void test_outline_of_next_to_nothing(void **state)
{
    (void)state;
    double at[50][2] = {{0}};
    float radius[50];
    for (int k = 0; k < 3; k++) {
        struct spl_outline o;
        for (int i = 0; i < 50; i++) {
            at[i][0] = k == 2 ? 0.01 * i : 0;
            radius[i] = 0.01f;
        }
        assert_int_equal(spl_outline_find(&o, (const double(*)[2])at, radius, k ? 50 : 1, 0.001, NULL), 0);
        double area = 0;
        for (size_t p = 0; p < o.polygon_count; p++)
            area += o.polygons[p].area;
        assert_true(area >= 0 && area < 0.02);
        spl_outline_finish(&o);
    }
    for (int i = 0; i < 50; i++) { /* 500 km of points a millimetre wide: cells are as wide as they must be */
        at[i][0] = 1e4 * i;
        radius[i] = 0.001f;
    }
    struct spl_outline o;
    assert_int_equal(spl_outline_find(&o, (const double(*)[2])at, radius, 50, 0.001, NULL), 0);
    spl_outline_finish(&o);
}

/* The areas of each face of the box by the three formats' own vertices, and what they say of them. */
static void check_box(const struct drawing *d, const double offset[3], bool rings)
{
    double sum = 0;
    assert_int_equal(d->planes, 5);
    assert_int_equal(d->faces, rings ? 6 : 5);
    for (size_t f = 0; f < d->faces; f++) {
        double area = area_of(d, f);
        size_t wanted = d->face_count[f];
        bool window = fabs(area - 0.8) < 0.01 || (rings && fabs(area - 0.2) < 0.01);
        assert_true(fabs(area - 1) < 0.01 || window);
        assert_true(wanted >= 4 && wanted <= (window && !rings ? 19 : 8));
        sum += rings && area < 0.5 ? -area : area;
    }
    assert_true(fabs(sum - 4.8) < 0.048);
    int level = 0, upright = 0;
    sum = 0;
    for (size_t k = 0; k < d->planes; k++) {
        level += fabs(d->inclination[k]) < 0.1;
        upright += fabs(d->inclination[k] - 90) < 0.1;
        sum += d->area[k];
    }
    assert_int_equal(level, 1);
    assert_int_equal(upright, 4);
    assert_true(fabs(sum - 4.8) < 0.048);
    for (size_t i = 0; i < d->vertices - d->line_count[0] - d->line_count[1]; i++) {
        double off = 1;
        for (int c = 0; c < 3; c++) {
            double at = d->vertex[i][c] - offset[c];
            assert_true(at > -0.012 && at < 1.012);
            off = fmin(off, fmin(fabs(at), fabs(at - 1)));
        }
        assert_true(off < 1e-4); /* on the cube: no digit was lost */
    }
}

static void check_wires(const struct drawing *d, const double offset[3])
{
    assert_int_equal(d->lines, 2);
    assert_int_equal(d->measured, 2);
    assert_true(fabs(d->sag[0] - 0.5) < 0.005);
    assert_true(fabs(d->length[0] - 20.133) < 0.01);
    assert_true(d->line_count[0] > 4 && d->line_count[0] < 40);
    assert_true(d->sag[1] < 0);
    assert_int_equal(d->line_count[1], 2);
    assert_true(fabs(d->length[1] - hypot(6, 0.6)) < 1e-4);
    const double *end = d->vertex[d->line[0] + d->line_count[0] - 1];
    assert_true(fabs(end[0] - offset[0] - 20) < 1e-6 && fabs(end[1] - offset[1] - 3) < 1e-6 &&
                fabs(end[2] - offset[2] - 7) < 1e-6);
}

static size_t count_lines(const char *path, const char *begin)
{
    char row[65536];
    size_t count = 0;
    FILE *in = open_read(path);
    while (fgets(row, sizeof row, in))
        count += !strncmp(row, begin, strlen(begin));
    fclose(in);
    return count;
}

static void test_formats_agree(void **state)
{
    (void)state;
    static const double offsets[2][3] = {{0, 0, 0}, {456789.125, 5432109.5, 300.25}};
    for (int k = 0; k < 2; k++) {
        struct scan *s = box(offsets[k], 2);
        add_wires(s, offsets[k]);
        write_to(path_of("box.obj"), s, 2);
        write_to(path_of("box.PLY"), s, 2);
        write_to(path_of("box.dxf"), s, 2);
        struct drawing *drawings[3] = {read_obj(path_of("box.obj")), read_ply(path_of("box.PLY")),
                                       read_dxf(path_of("box.dxf"))};
        for (int f = 0; f < 3; f++) {
            check_box(drawings[f], offsets[k], f == 2);
            check_wires(drawings[f], offsets[k]);
            free(drawings[f]);
        }
        assert_int_equal(report.planes, count_lines(path_of("box.obj"), "g plane_"));
        assert_int_equal(report.polygons, count_lines(path_of("box.obj"), "f "));
        assert_int_equal(report.lines, count_lines(path_of("box.obj"), "l "));
        assert_true(report.planes == 5 && report.polygons == 5 && report.lines == 2 && !report.triangles);
        assert_true(fabs(report.polygon_area - 4.8) < 0.048 && fabs(report.line_length - 26.2) < 0.2);
        assert_string_equal(report.unit, "m");
        finish(s);
    }
}

static char *read_all(const char *path, size_t *length)
{
    FILE *in = open_read(path);
    fseek(in, 0, SEEK_END);
    *length = (size_t)ftell(in);
    rewind(in);
    char *text = malloc(*length + 1);
    assert_int_equal(fread(text, 1, *length, in), *length);
    fclose(in);
    return text;
}

static void test_threads_agree(void **state)
{
    (void)state;
    static const double nowhere[3] = {0};
    struct scan *s = box(nowhere, 1);
    size_t lengths[2];
    add_wires(s, nowhere);
    write_to(path_of("one.dxf"), s, 1);
    write_to(path_of("five.dxf"), s, 5);
    char *one = read_all(path_of("one.dxf"), &lengths[0]), *five = read_all(path_of("five.dxf"), &lengths[1]);
    assert_int_equal(lengths[0], lengths[1]);
    assert_memory_equal(one, five, lengths[0]);
    free(one);
    free(five);
    finish(s);
}

/* A ball, but for its underside, is triangles on it, that look outwards and cover it; as many in each format. */
static void test_meshes(void **state)
{
    (void)state;
    static const double offset[3] = {456789.125, 5432109.5, 300.25};
    const double radius = 0.3, least = -0.15;
    struct scan *s = new_scan();
    double covered = 0, sphere = 2 * M_PI * radius * (radius - least);
    size_t faces[2];
    s->relief = true;
    while (s->count < 9000) {
        double z = radius * (2 * uniform(&s->random) - 1), angle = 2 * M_PI * uniform(&s->random);
        double flat = sqrt(radius * radius - z * z), *at = s->position[s->count];
        at[0] = flat * cos(angle), at[1] = flat * sin(angle), at[2] = z;
        s->station[s->count] = 4 * at[0] + 5 * at[1] < 0;
        s->count += z > least && fabs(4 * at[0] + 5 * at[1]) + 6 * z > 0.15; /* its station sees it from outside */
    }
    find(s, offset, 2);
    write_to(path_of("ball.obj"), s, 2);
    write_to(path_of("ball.ply"), s, 2);
    write_to(path_of("ball.dxf"), s, 2);
    char *row, text[256];
    size_t length;
    row = read_all(path_of("ball.ply"), &length);
    assert_int_equal(sscanf(strstr(row, "element face"), "element face %zu", &faces[0]), 1);
    assert_non_null(strstr(row, "property int mesh"));
    free(row);
    assert_int_equal(count_lines(path_of("ball.obj"), "f "), faces[0]);
    faces[1] = count_lines(path_of("ball.dxf"), "3DFACE");
    assert_true(faces[1] > 400);
    static double vertex[1 << 15][3];
    size_t vertices = 0, triangles = 0, corner[3];
    bool mesh = false;
    FILE *in = open_read(path_of("ball.obj"));
    while (fgets(text, sizeof text, in)) {
        double side[2][3], outward = 0, square = 0;
        if (sscanf(text, "v %lf %lf %lf", &vertex[vertices][0], &vertex[vertices][1], &vertex[vertices][2]) == 3) {
            for (int c = 0; c < 3; c++)
                vertex[vertices][c] -= offset[c];
            double off = sqrt(vertex[vertices][0] * vertex[vertices][0] + vertex[vertices][1] * vertex[vertices][1] +
                              vertex[vertices][2] * vertex[vertices][2]) -
                         radius;
            assert_true(fabs(off) < 0.003 && ++vertices < sizeof vertex / sizeof *vertex);
        }
        mesh = text[0] == 'g' ? !strncmp(text, "g mesh_", 7) : mesh;
        if (!mesh || sscanf(text, "f %zu %zu %zu", &corner[0], &corner[1], &corner[2]) != 3)
            continue;
        triangles++;
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++)
                side[k][c] = vertex[corner[k + 1] - 1][c] - vertex[corner[0] - 1][c];
        for (int c = 0; c < 3; c++) {
            double n = side[0][(c + 1) % 3] * side[1][(c + 2) % 3] - side[0][(c + 2) % 3] * side[1][(c + 1) % 3];
            outward += n * vertex[corner[0] - 1][c];
            square += n * n;
        }
        assert_true(outward > 0);
        covered += sqrt(square) / 2;
    }
    fclose(in);
    assert_int_equal(triangles, faces[1]);
    assert_true(covered > 0.75 * sphere && covered < 1.05 * sphere);
    for (size_t i = 0, on = 0; i < s->points.count; i++) /* few points: nothing of them is drawn, nor counted */
        if (s->points.plane[i] != SPL_NO_PLANE && s->planes.list[s->points.plane[i]].heights && on++ % 400) {
            s->planes.list[s->points.plane[i]].points--;
            s->points.plane[i] = SPL_NO_PLANE;
        }
    assert_true(report.meshes > 0);
    write_to(path_of("ball.obj"), s, 2);
    assert_int_equal(report.meshes, 0);
    finish(s);
}

static void test_nothing_is_a_file_too(void **state)
{
    (void)state;
    struct scan *s = new_scan();
    struct drawing *d;
    for (int f = 0; f < 3; f++) {
        const char *path = path_of(f == 0 ? "none.obj" : f == 1 ? "none.ply" : "none.dxf");
        write_to(path, s, 2);
        d = f == 0 ? read_obj(path) : f == 1 ? read_ply(path) : read_dxf(path);
        assert_int_equal(d->faces + d->lines + d->vertices, 0);
        free(d);
    }
    finish(s);
}

static void test_places_that_cannot_be(void **state)
{
    (void)state;
    static const char *const bad[] = {"planes.stl", "planes", "dxf", ".d/planes", "planes.dxf.gz"};
    struct spl_error err;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        err = (struct spl_error){0};
        assert_int_equal(spl_export_check(path_of(bad[k]), NULL, 0, &err), SPL_E_USAGE);
        assert_non_null(strstr(err.message, ".ply, .obj or .dxf"));
        assert_string_equal(err.field, "export-primitives");
    }
    err = (struct spl_error){0};
    assert_int_not_equal(spl_export_check(path_of("no/such/folder/planes.dxf"), NULL, 0, &err), 0);
    assert_non_null(strstr(err.message, "planes.dxf"));
    assert_int_equal(mkdir(path_of("folder.obj"), 0777), 0);
    err = (struct spl_error){0};
    assert_int_equal(spl_export_check(path_of("folder.obj"), NULL, 0, &err), SPL_E_USAGE);
    assert_int_equal(spl_export_check("here.obj", NULL, 0, NULL), 0);
    const char *scans[] = {path_of("none.ply"), path_of("scan.ply")};
    FILE *scan = fopen(scans[1], "w");
    assert_non_null(scan);
    fclose(scan);
    err = (struct spl_error){0};
    assert_int_equal(spl_export_check(scans[1], scans, 2, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "is a scan"));
}

/* Cancelled, or out of memory anywhere: an error, and what was there before is still there. */
static void test_failures_give_nothing(void **state)
{
    (void)state;
    static const double nowhere[3] = {0};
    struct scan *s = box(nowhere, 1);
    atomic_bool cancelled = true;
    struct spl_stage stage = quiet_stage(1);
    struct spl_error err = {0};
    size_t length;
    char *text = folder;
    add_wires(s, nowhere);
    stage.cancelled = &cancelled;
    int rc =
        spl_export_primitives("a.ply", &s->points, &s->planes, &s->wires, 1, &stage, &text, &length, &report, &err);
    assert_int_equal(rc, SPL_E_CANCELLED);
    assert_null(text);
    stage.cancelled = NULL;
    int failures = 0;
    for (long n = 1; n < 500 && rc; n++) {
        assert_null(text);
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        rc =
            spl_export_primitives("a.ply", &s->points, &s->planes, &s->wires, 1, &stage, &text, &length, &report, &err);
        spl_memory_fail_after(0);
        assert_true(rc == 0 || (rc == SPL_E_NOMEM && err.message[0]));
        failures += rc != 0;
    }
    assert_int_equal(rc, 0);
    assert_true(failures > 20);
    free(text);
    finish(s);
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *const names[] = {"box.obj",  "box.PLY",  "box.dxf", "one.dxf",  "five.dxf", "none.obj",
                                        "none.ply", "none.dxf", "scan.ply", "ball.obj", "ball.ply", "ball.dxf"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        unlink(path_of(names[k]));
    rmdir(path_of("folder.obj"));
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_outline_keeps_holes_and_islands),
        cmocka_unit_test(test_outline_of_many_holes),
        cmocka_unit_test(test_outline_of_next_to_nothing),
        cmocka_unit_test(test_formats_agree),
        cmocka_unit_test(test_threads_agree),
        cmocka_unit_test(test_meshes),
        cmocka_unit_test(test_nothing_is_a_file_too),
        cmocka_unit_test(test_places_that_cannot_be),
        cmocka_unit_test(test_failures_give_nothing),
    };
    only_threads_under_tsan();
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
