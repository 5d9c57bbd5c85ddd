/* Members of each plane are listed by counting, and outlined plane by plane, in parallel: an outline depends on its own
 * members alone, in their order. Wires are few, and walked on the calling thread. */
#include "pack/export/shapes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "geom/vector.h"
#include "pack/export/simplify.h"

static const double noise_sigmas = 4, spacing_share = 0.2; /* that vertices may be off a line, as of planes */
/* How much lower a wire hangs on both sides of a support: tolerances as above, and a share of its length. */
static const double zigzag = 3, dip_share = 0.002;
static const double text_share = 0.002; /* of the scan's diagonal */
static const double stands = 0.5;       /* level part of a chord, of the whole, below which a line stands */

struct outlining {
    struct spl_shapes *shapes;
    const struct spl_points *points;
    const uint32_t *member; /* points, plane after plane */
    const uint64_t *first;  /* of each plane, and one behind the last */
    struct spl_stage *stage;
    atomic_bool failed;
};

void spl_shape_place(const struct spl_shape_plane *plane, const double at[2], double world[3])
{
    for (int c = 0; c < 3; c++)
        world[c] = plane->plane->origin[c] + at[0] * plane->u[c] + at[1] * plane->v[c];
}

double spl_shape_inclination(const double normal[3], const double up[3])
{
    double level[3];
    cross3(up, normal, level);
    return atan2(sqrt(level[0] * level[0] + level[1] * level[1] + level[2] * level[2]),
                 normal[0] * up[0] + normal[1] * up[1] + normal[2] * up[2]) *
           180 / M_PI;
}

static void set_axes(struct spl_shape_plane *shape, const double up[3])
{
    const double *normal = shape->plane->normal, east[3] = {1, 0, 0}, north[3] = {0, 1, 0};
    double length = 0;
    cross3(up, normal, shape->u);
    for (int c = 0; c < 3; c++)
        length += shape->u[c] * shape->u[c];
    shape->inclination = spl_shape_inclination(normal, up);
    if (length < 0.01) { /* level: along x, or along y where that is up */
        double most = fabs(normal[0]) < 0.9 ? normal[0] : normal[1];
        length = 0;
        for (int c = 0; c < 3; c++) {
            shape->u[c] = (fabs(normal[0]) < 0.9 ? east : north)[c] - most * normal[c];
            length += shape->u[c] * shape->u[c];
        }
    }
    for (int c = 0; c < 3; c++)
        shape->u[c] /= sqrt(length);
    cross3(normal, shape->u, shape->v);
}

static int outline(const struct outlining *o, uint32_t k)
{
    struct spl_shape_plane *shape = &o->shapes->planes[k];
    size_t count = (size_t)(o->first[k + 1] - o->first[k]);
    double(*at)[2] = spl_alloc_raw(count, sizeof *at, NULL);
    float *radius = spl_alloc_raw(count, sizeof *radius, NULL);
    for (size_t i = 0; at && radius && i < count; i++) {
        uint32_t point = o->member[o->first[k] + i];
        at[i][0] = at[i][1] = 0;
        for (int c = 0; c < 3; c++) {
            double d = spl_points_at(o->points, c, point) - shape->plane->origin[c];
            at[i][0] += d * shape->u[c];
            at[i][1] += d * shape->v[c];
        }
        radius[i] = o->points->radius[point];
    }
    int rc = SPL_E_NOMEM;
    if (at && radius)
        rc = spl_outline_find(&shape->outline, (const double(*)[2])at, radius, count, shape->plane->error_max, NULL);
    for (size_t p = 0; !rc && p < shape->outline.polygon_count; p++)
        shape->area += shape->outline.polygons[p].area;
    free(at);
    free(radius);
    return rc;
}

static void outline_planes(void *context, size_t begin, size_t end, unsigned worker)
{
    struct outlining *o = context;
    for (size_t k = begin; k < end && !spl_stage_is_cancelled(o->stage); k++) {
        uint32_t flat = o->shapes->plane_count;
        int rc = k < flat ? outline(o, (uint32_t)k)
                          : spl_shape_mesh_init(&o->shapes->meshes[k - flat], o->points, o->member + o->first[k],
                                                (size_t)(o->first[k + 1] - o->first[k]));
        if (rc)
            atomic_store(&o->failed, true);
        spl_stage_add(o->stage, o->first[k + 1] - o->first[k], worker);
    }
}

/* Takes out pieces without a square that has points enough: nothing of them would be drawn. */
static void drop_empty(struct spl_shapes *shapes)
{
    uint32_t kept = 0;
    for (uint32_t k = 0; k < shapes->mesh_count; k++)
        if (shapes->meshes[k].triangle_count)
            shapes->meshes[kept++] = shapes->meshes[k];
        else
            spl_shape_mesh_finish(&shapes->meshes[k]);
    shapes->mesh_count = kept;
}

static int outline_all(struct spl_shapes *shapes, const struct spl_points *points, const struct spl_planes *planes,
                       struct spl_stage *stage, struct spl_error *err)
{
    uint64_t *first = spl_alloc((size_t)planes->count + 2, sizeof *first, err), on = 0;
    uint32_t *member = NULL;
    shapes->planes = spl_alloc(planes->count, sizeof *shapes->planes, err);
    shapes->meshes = spl_alloc(planes->count, sizeof *shapes->meshes, err);
    int rc = first && shapes->planes && shapes->meshes ? 0 : SPL_E_NOMEM;
    for (uint32_t k = 0; !rc && k < planes->count; k++) {
        if (planes->list[k].heights) {
            shapes->meshes[shapes->mesh_count++].plane = &planes->list[k];
        } else {
            shapes->planes[shapes->plane_count].plane = &planes->list[k];
            set_axes(&shapes->planes[shapes->plane_count++], points->up);
        }
        first[k + 1] = on; /* where the next member goes; afterwards where the next plane begins */
        on += planes->list[k].points;
    }
    if (!rc && !(member = spl_alloc_raw(on, sizeof *member, err)))
        rc = SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < points->count && planes->count; i++)
        if (points->plane[i] != SPL_NO_PLANE)
            member[first[points->plane[i] + 1]++] = (uint32_t)i;
    if (!rc) {
        struct outlining o = {shapes, points, member, first, stage, false};
        spl_parallel_for(stage->threads, planes->count, 1, outline_planes, &o);
        rc = spl_stage_check(stage, err);
        if (!rc && atomic_load(&o.failed))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the outlines of %u planes", planes->count);
    }
    if (!rc)
        drop_empty(shapes);
    free(first);
    free(member);
    return rc;
}

static double distance(const double a[3], const double b[3])
{
    return hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
}

static void measure_line(const struct spl_shapes *shapes, struct spl_shape_line *line, const double up[3])
{
    const double(*v)[3] = (const double(*)[3])shapes->vertices + line->first;
    double chord[3], level[3], rise = 0, across = 0, whole = 0;
    for (size_t i = 1; i < line->count; i++)
        line->length += distance(v[i - 1], v[i]);
    for (int c = 0; c < 3; c++) {
        chord[c] = v[line->count - 1][c] - v[0][c];
        rise += chord[c] * up[c];
        whole += chord[c] * chord[c];
    }
    for (int c = 0; c < 3; c++) {
        level[c] = chord[c] - rise * up[c];
        across += level[c] * level[c];
    }
    if (!(across > stands * stands * whole)) {
        line->sag = -1;
        return;
    }
    for (size_t i = 1; i + 1 < line->count; i++) {
        double along = 0, height = 0;
        for (int c = 0; c < 3; c++) {
            along += (v[i][c] - v[0][c]) * level[c] / across;
            height += (v[i][c] - v[0][c]) * up[c];
        }
        line->sag = fmax(line->sag, fmin(1, fmax(0, along)) * rise - height);
    }
}

/* What vertices may be off the line that is drawn instead. */
static double line_tolerance(const double (*v)[3], size_t count, const struct spl_planes *planes)
{
    double length = 0;
    for (size_t i = 1; i < count; i++)
        length += distance(v[i - 1], v[i]);
    double off = fmax(noise_sigmas * planes->noise, count > 1 ? spacing_share * length / (double)(count - 1) : 0);
    return planes->bound > 0 ? fmin(off, planes->bound) : off;
}

static int add_line(struct spl_shapes *shapes, size_t first, size_t last, const double up[3], struct spl_error *err)
{
    struct spl_shape_line line = {.first = first, .count = last - first + 1};
    int rc = spl_array_reserve(shapes->lines, shapes->line_capacity, shapes->line_count + 1, err);
    if (rc)
        return rc;
    measure_line(shapes, &line, up);
    shapes->lines[shapes->line_count++] = line;
    return SPL_OK;
}

static double height_of(const double at[3], const double up[3])
{
    return at[0] * up[0] + at[1] * up[1] + at[2] * up[2];
}

/* Lines from vertex `first` to the last: one for each span. A wire hangs, so it bends upwards nowhere but at supports:
 * it is cut where it is highest above the way from its one end to the other, between places on both sides that lie
 * lower by more than it may zigzag. */
static int add_spans(struct spl_shapes *shapes, size_t first, double tolerance, const double up[3],
                     struct spl_error *err)
{
    const double(*v)[3] = (const double(*)[3])shapes->vertices;
    const size_t last = shapes->vertex_count - 1;
    double length = 0, along = 0, most = -INFINITY, least = INFINITY;
    size_t begin = first, highest = first;
    bool hung = false; /* it has been lower, since the last support */
    for (size_t i = first + 1; i <= last; i++)
        length += distance(v[i - 1], v[i]);
    const double dip = zigzag * tolerance + dip_share * length;
    const double slope = length > 0 ? (height_of(v[last], up) - height_of(v[first], up)) / length : 0;
    for (size_t i = first; i <= last; i++) {
        along += i > first ? distance(v[i - 1], v[i]) : 0;
        double height = height_of(v[i], up) - slope * along;
        if (!hung && height > least + dip) {
            hung = true;
            most = -INFINITY;
        }
        if (hung && height < most - dip) {
            int rc = add_line(shapes, begin, highest, up, err);
            if (rc)
                return rc;
            begin = highest;
            hung = false;
            least = height;
        }
        least = fmin(least, height);
        if (height > most) {
            most = height;
            highest = i;
        }
    }
    return last > begin ? add_line(shapes, begin, last, up, err) : SPL_OK;
}

static int add_lines(struct spl_shapes *shapes, const struct spl_wires *wires, const struct spl_planes *planes,
                     const double up[3], struct spl_error *err)
{
    double(*all)[3] = spl_alloc_raw(wires->count, sizeof *all, err);
    uint8_t *kept = spl_alloc_raw(wires->count, 1, err);
    size_t *stack = spl_alloc_raw(2 * wires->count + 2, sizeof *stack, err), begin = 0;
    int rc = all && kept && stack ? 0 : SPL_E_NOMEM;
    if (!rc)
        rc = spl_array_reserve(shapes->vertices, shapes->vertex_capacity, wires->count, err);
    for (size_t i = 0; !rc && i < wires->count; i++) {
        memcpy(all[i], wires->vertices[i].position, sizeof *all);
        if (wires->vertices[i].point != SPL_WIRE_END)
            continue;
        const double(*own)[3] = (const double(*)[3])all + begin, tolerance = line_tolerance(own, i + 1 - begin, planes);
        size_t first = shapes->vertex_count;
        spl_simplify(own, i + 1 - begin, false, tolerance, kept, stack);
        for (size_t k = 0; k <= i - begin; k++)
            if (kept[k])
                memcpy(shapes->vertices[shapes->vertex_count++], all[begin + k], sizeof *all);
        begin = i + 1;
        rc = add_spans(shapes, first, tolerance, up, err);
    }
    free(all);
    free(kept);
    free(stack);
    return rc;
}

int spl_shapes_init(struct spl_shapes *shapes, const struct spl_points *points, const struct spl_planes *planes,
                    const struct spl_wires *wires, struct spl_stage *stage, struct spl_error *err)
{
    const double fine = 1e-3; /* of the bound */
    double places = planes->bound > 0 ? ceil(-log10(fine * planes->bound)) : 6;
    *shapes = (struct spl_shapes){.decimals = (unsigned)fmin(12, fmax(3, places))};
    memcpy(shapes->up, points->up, sizeof shapes->up);
    double diagonal = 0;
    for (int c = 0; c < 3; c++)
        diagonal = hypot(diagonal, points->bounds_max[c] - points->bounds_min[c]);
    shapes->text_height = fmax(text_share * diagonal, pow(10, -(double)shapes->decimals));
    spl_stage_begin(stage, "outlines", "points", points->count);
    int rc = outline_all(shapes, points, planes, stage, err);
    if (!rc)
        rc = add_lines(shapes, wires, planes, points->up, err);
    if (!rc)
        spl_stage_finish(stage);
    return rc;
}

void spl_shapes_finish(struct spl_shapes *shapes)
{
    for (uint32_t k = 0; k < shapes->plane_count; k++)
        spl_outline_finish(&shapes->planes[k].outline);
    for (uint32_t k = 0; k < shapes->mesh_count; k++)
        spl_shape_mesh_finish(&shapes->meshes[k]);
    free(shapes->planes);
    free(shapes->meshes);
    free(shapes->lines);
    free(shapes->vertices);
    *shapes = (struct spl_shapes){0};
}
