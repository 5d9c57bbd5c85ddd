/* Panels in plain C; see reference_panels.h. A sample shows the cell that its ray meets; of panels that are less than a
 * sample thick, and of those that reach the near plane, each cell also shows on the sample that its middle falls on.
 * Floats are used where the GPU uses floats, in the same order of operations. */
#include "support/reference_panels.h"

#include <math.h>
#include <string.h>

#include "dataset/dataset.h"
#include "dataset/panel_texels.h"

enum { side = SPL_PANEL_SIDE };
static const float hair = 1 / 64.0f; /* of a cell, beyond the edge of a panel or triangle */

static void to_view(const struct spl_camera *camera, const float v[3], float out[3])
{
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i;
        out[i] = (float)r[0] * v[0] + (float)r[1] * v[1] + (float)r[2] * v[2];
    }
}

struct reference_plane reference_plane(const struct spl_camera *camera, const struct spl_node *node,
                                       const struct spl_chunk *chunk, const uint32_t *page)
{
    struct reference_plane plane = {.camera = camera, .chunk = chunk, .page = page, .panel_number = UINT32_MAX};
    spl_panels_get_frame(chunk, &plane.world);
    to_view(camera, plane.world.u, plane.u);
    to_view(camera, plane.world.v, plane.v);
    to_view(camera, plane.world.normal, plane.n);
    for (int i = 0; i < 3; i++) {
        double origin = 0;
        for (int a = 0; a < 3; a++)
            origin += camera->rotation[3 * i + a] * (node->origin[a] - camera->eye[a] + chunk->origin[a]);
        plane.o[i] = (float)origin;
    }
    return plane;
}

enum spl_shape reference_shape(const struct spl_dataset *dataset, uint32_t id)
{
    static const enum spl_shape shapes[SPL_CHUNK_KINDS] = {
        [SPL_CHUNK_DISCS] = SPL_SHAPE_SPLAT, [SPL_CHUNK_LINES] = SPL_SHAPE_LINE, [SPL_CHUNK_PANELS] = SPL_SHAPE_PANEL,
        [SPL_CHUNK_MESHES] = SPL_SHAPE_MESH};
    uint64_t low = 0, high;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &high);
    if (id == UINT32_MAX)
        return SPL_SHAPE_NONE;
    while (high - low > 1) {
        uint64_t middle = low + (high - low) / 2;
        if (chunks[middle].first_id <= id)
            low = middle;
        else
            high = middle;
    }
    return shapes[spl_chunk_kind(&chunks[low])];
}

static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void place(const struct reference_plane *plane, float x, float y, float p[3])
{
    float along[2] = {x * plane->world.cell, y * plane->world.cell};
    for (int i = 0; i < 3; i++)
        p[i] = plane->o[i] + along[0] * plane->u[i] + along[1] * plane->v[i];
}

static bool is_parallel(const struct reference_plane *plane)
{
    return plane->camera->projection == SPL_ORTHOGRAPHIC;
}

static void project(const struct reference_plane *plane, const float p[3], float at[2])
{
    float scale = is_parallel(plane) ? 1 : p[2];
    at[0] = (float)plane->camera->fx * (p[0] / scale) + (float)plane->camera->cx;
    at[1] = (float)plane->camera->fy * (p[1] / scale) + (float)plane->camera->cy;
}

/* Panel `i`; false where it lies off the chunk's grid. */
static bool load(const struct reference_plane *plane, uint32_t i, struct spl_panel *panel,
                 struct spl_panel_texels *texels)
{
    uint32_t columns, rows;
    spl_panels_decode_texels(plane->chunk, plane->page, i, panel, texels);
    spl_panels_get_extent(plane->chunk, &columns, &rows);
    bool any = false;
    for (int y = 0; y < side; y++)
        any |= panel->cells[y] != 0;
    return any && panel->column < columns && panel->row < rows;
}

static void middle_of(const struct reference_plane *plane, const struct spl_panel *panel, int x, int y, float p[3])
{
    place(plane, (float)(side * panel->column + x) + 0.5f, (float)(side * panel->row + y) + 0.5f, p);
}

/* Onto the surface at (x, y), cells of the panel. */
static void rise(const struct reference_plane *plane, uint32_t panel, float x, float y, struct reference_cell *cell)
{
    struct spl_relief relief;
    float slope[2], height, scale;
    spl_panels_get_relief(plane->chunk, plane->page, panel, &relief);
    height = spl_relief_height(&relief, x, y, slope);
    for (int a = 0; a < 2; a++)
        slope[a] /= plane->world.cell;
    scale = 1.0f / sqrtf(1.0f + slope[0] * slope[0] + slope[1] * slope[1]);
    for (int i = 0; i < 3; i++) {
        cell->p[i] += height * plane->n[i];
        cell->n[i] = (plane->n[i] - slope[0] * plane->u[i] - slope[1] * plane->v[i]) * scale;
    }
}

bool reference_panel_cell(struct reference_plane *plane, uint32_t index, struct reference_cell *cell)
{
    struct spl_panel_texels texels;
    const struct spl_panel *panel = &plane->panel;
    uint32_t i = index / (side * side), x = index % side, y = index / side % side;
    if (i != plane->panel_number)
        plane->panel_is_there = load(plane, i, &plane->panel, &texels);
    plane->panel_number = i;
    if (!plane->panel_is_there || !(panel->cells[y] >> x & 1))
        return false;
    cell->id = (uint32_t)plane->chunk->first_id + i;
    memcpy(cell->color, panel->color[y][x], sizeof cell->color);
    middle_of(plane, panel, (int)x, (int)y, cell->p);
    memcpy(cell->n, plane->n, sizeof cell->n);
    if (spl_chunk_kind(plane->chunk) == SPL_CHUNK_MESHES)
        rise(plane, i, (float)x + 0.5f, (float)y + 0.5f, cell);
    return true;
}

/* What the fragments of a panel share; of one with relief each triangle is drawn in turn. */
struct drawn {
    const struct reference_plane *plane;
    struct spl_panel panel;
    struct spl_panel_texels texels;
    uint32_t id;
    float eye[2], u[3], v[3]; /* along the ray of a sample */
    /* Of what lies in one plane: the panel, or a triangle of its mesh. */
    float offset, normal[3], n[3], nearest, farthest, low[2], high[2];
    float square[2], side; /* of which the triangle is half; else the panel, 0 and 16 */
    int half;              /* 1 on the side of (1, 0), -1 on that of (0, 1), 0: both */
    bool thin;
};

static float slant_of(float tilt)
{
    return fminf(fmaxf(fabsf(tilt), 1), SPL_MARGIN_SLANT);
}

static float clamped(float value, float low, float high)
{
    return value < low ? low : value > high ? high : value;
}

/* Between the middles of texels, at `at` in cells of the panel. */
static void smooth(const struct drawn *d, const float at[2], uint8_t color[3])
{
    float between[3];
    spl_panel_texels_get(&d->panel, &d->texels, at, between);
    for (int c = 0; c < 3; c++)
        color[c] = (uint8_t)(between[c] + 0.5f);
}

static void put(const struct drawn *d, int64_t x, int64_t y, float z, float tilt, const float *middle,
                const float at[2], void (*each)(void *, const struct reference_fragment *), void *context)
{
    const struct spl_camera *camera = d->plane->camera;
    const int cell[2] = {(int)clamped(at[0], 0, side - 0.5f), (int)clamped(at[1], 0, side - 0.5f)};
    struct reference_fragment f = {
        .x = x, .y = y, .z = z, .slant = slant_of(tilt), .light = middle, .middle = middle, .id = d->id};
    f.behind = is_parallel(d->plane) ? d->normal[2] > 0 : d->offset > 0;
    memcpy(f.normal, d->normal, sizeof f.normal);
    if (x < 0 || y < 0 || x >= camera->width || y >= camera->height || !(d->panel.cells[cell[1]] >> cell[0] & 1) ||
        !(z >= (float)camera->near && z <= (float)camera->far))
        return;
    memcpy(f.color, d->panel.color[cell[1]][cell[0]], sizeof f.color);
    smooth(d, at, f.smooth);
    each(context, &f);
}

/* The depth at which the ray through r (sample - principal point) meets the plane; *tilt: one over its normal along
 * it. */
static float meet(const struct drawn *d, const float r[2], float *tilt)
{
    bool parallel = is_parallel(d->plane);
    float across = d->n[0] * r[0] + d->n[1] * r[1];
    *tilt = 1.0f / (parallel ? d->n[2] : across + d->n[2]);
    return (parallel ? d->offset - d->n[0] * r[0] - d->n[1] * r[1] : d->offset) * *tilt;
}

static void show_sample(const struct drawn *d, int64_t x, int64_t y,
                        void (*each)(void *, const struct reference_fragment *), void *context)
{
    const struct spl_camera *camera = d->plane->camera;
    float r[2] = {(float)x + 0.5f - (float)camera->cx, (float)y + 0.5f - (float)camera->cy};
    float tilt, z = meet(d, r, &tilt), scale = is_parallel(d->plane) ? 1 : z, deep = z / scale;
    float at[2] = {(d->u[0] * r[0] + d->u[1] * r[1] + d->u[2] * deep) * scale - d->eye[0],
                   (d->v[0] * r[0] + d->v[1] * r[1] + d->v[2] * deep) * scale - d->eye[1]};
    if (!(z > 0))
        return;
    for (int i = 0; i < 2; i++)
        if (!(at[i] - d->square[i] > -hair && at[i] - d->square[i] < d->side + hair))
            return;
    if ((float)d->half * (at[0] - d->square[0] - at[1] + d->square[1]) <= -hair)
        return;
    put(d, x, y, clamped(z, d->nearest, d->farthest), tilt, NULL, at, each, context);
}

/* The corners of the least rectangle of whole blocks of 4 x 4 cells that holds the panel's. */
static void find_rectangle(const struct spl_panel *panel, float corners[2][2])
{
    int least[2] = {side, side}, most[2] = {-1, -1};
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++)
            if (panel->cells[y] >> x & 1) {
                int at[2] = {x, y};
                for (int a = 0; a < 2; a++) {
                    least[a] = at[a] < least[a] ? at[a] : least[a];
                    most[a] = at[a] > most[a] ? at[a] : most[a];
                }
            }
    for (int a = 0; a < 2; a++) {
        float first = (float)(side * (a ? panel->row : panel->column));
        corners[0][a] = first + (float)(least[a] / 4 * 4);
        corners[1][a] = first + (float)(most[a] / 4 * 4 + 4);
    }
}

static void begin(const struct reference_plane *plane, uint32_t i, struct drawn *d)
{
    const struct spl_camera *camera = plane->camera;
    float cell = 1.0f / plane->world.cell, ray[3] = {1 / (float)camera->fx, 1 / (float)camera->fy, 1};
    d->plane = plane;
    d->id = (uint32_t)plane->chunk->first_id + i;
    d->eye[0] = dot(plane->u, plane->o) * cell + (float)(side * d->panel.column);
    d->eye[1] = dot(plane->v, plane->o) * cell + (float)(side * d->panel.row);
    for (int k = 0; k < 3; k++) {
        d->u[k] = plane->u[k] * cell * ray[k];
        d->v[k] = plane->v[k] * cell * ray[k];
    }
}

static void widen(struct drawn *d, const float at[2])
{
    for (int a = 0; a < 2; a++) {
        d->low[a] = fminf(d->low[a], at[a]);
        d->high[a] = fmaxf(d->high[a], at[a]);
    }
}

/* What lies between `corners`, in order around it, in the plane of `normal` through `on`. `pieces` of it side by side
 * are what is seen, if it is thick enough. */
static void set_piece(struct drawn *d, const float normal[3], const float on[3], float corners[4][3], float pieces)
{
    const struct spl_camera *camera = d->plane->camera;
    float ray[3] = {1 / (float)camera->fx, 1 / (float)camera->fy, 1}, places[4][2];
    d->offset = dot(normal, on);
    for (int k = 0; k < 3; k++) {
        d->normal[k] = normal[k];
        d->n[k] = normal[k] * ray[k];
    }
    d->nearest = d->low[0] = d->low[1] = INFINITY;
    d->farthest = d->high[0] = d->high[1] = -INFINITY;
    for (int k = 0; k < 4; k++) {
        const float near = (float)camera->near, *p = corners[k], *q = corners[(k + 1) % 4];
        project(d->plane, p, places[k]);
        d->nearest = fminf(d->nearest, p[2]);
        d->farthest = fmaxf(d->farthest, p[2]);
        if (p[2] >= near)
            widen(d, places[k]);
        if ((p[2] < near) != (q[2] < near)) { /* there the edge comes into sight */
            float t = (near - p[2]) / (q[2] - p[2]), at[2];
            project(d->plane, (float[]){p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), near}, at);
            widen(d, at);
        }
    }
    /* Half the product of the diagonals; of a triangle, whose fourth corner is the first again, of two sides. */
    float area = fabsf((places[2][0] - places[0][0]) * (places[3][1] - places[1][1]) -
                       (places[2][1] - places[0][1]) * (places[3][0] - places[1][0])) / 2;
    bool reaches_near = d->nearest < (float)camera->near;
    d->thin = reaches_near || pieces * area < fmaxf(d->high[0] - d->low[0], d->high[1] - d->low[1]);
    for (int a = 0; a < 2; a++) {
        d->low[a] -= reaches_near ? 2 : 0.02f;
        d->high[a] += reaches_near ? 2 : 0.02f;
    }
}

/* Of a cell's middle at `p`, whose image is `at`: the plane's on the sample that it falls on. */
static float middle_depth(const struct drawn *d, const float p[3], const float at[2])
{
    const struct spl_camera *camera = d->plane->camera;
    float r[2] = {floorf(at[0]) + 0.5f - (float)camera->cx, floorf(at[1]) + 0.5f - (float)camera->cy};
    float tilt, there = meet(d, r, &tilt), reach = SPL_CELL_REACH * (1 / (float)camera->fx);
    there = is_parallel(d->plane) ? there : d->offset / (d->n[0] * r[0] + d->n[1] * r[1] + d->n[2]); /* rounded once */
    float farthest = fmaxf(d->farthest, is_parallel(d->plane) ? p[2] + reach : p[2] * (1 + reach));
    return clamped(there > 0 ? there : p[2], d->nearest, farthest);
}

/* Every sample of the box, and the middles of cells where it is thin. `rise`: of a triangle, metres a cell along u and
 * v from `corner` on, the height of the corner of its square. */
static void show_piece(const struct drawn *d, float corner, const float rise[2],
                       void (*each)(void *, const struct reference_fragment *), void *context)
{
    const struct spl_camera *camera = d->plane->camera;
    if (d->farthest < (float)camera->near || d->nearest > (float)camera->far)
        return;
    const int64_t first[2] = {(int64_t)ceilf(clamped(d->low[0] - 0.5f, 0, 1e6f)),
                              (int64_t)ceilf(clamped(d->low[1] - 0.5f, 0, 1e6f))};
    for (int64_t y = first[1]; y < camera->height && (float)y <= d->high[1] - 0.5f; y++)
        for (int64_t x = first[0]; x < camera->width && (float)x <= d->high[0] - 0.5f; x++)
            show_sample(d, x, y, each, context);
    for (int cell = 0; d->thin && cell < side * side; cell++) {
        float p[3], place[2], at[2] = {(float)(cell % side) + 0.5f, (float)(cell / side) + 0.5f};
        float within[2] = {at[0] - d->square[0], at[1] - d->square[1]}, height = corner;
        bool own = within[0] > 0 && within[1] > 0 && within[0] < d->side && within[1] < d->side;
        if (!own || (d->half && (within[0] >= within[1]) != (d->half > 0)))
            continue;
        height = height + within[0] * rise[0] + within[1] * rise[1];
        middle_of(d->plane, &d->panel, cell % side, cell / side, p);
        for (int i = 0; i < 3; i++)
            p[i] += height * d->plane->n[i];
        project(d->plane, p, place);
        float z = middle_depth(d, p, place),
              tilt = is_parallel(d->plane) ? 1 / d->normal[2] : z / fmaxf(fabsf(d->offset), 1e-30f);
        if (p[2] > 0 && place[0] >= 0 && place[1] >= 0)
            put(d, (int64_t)place[0], (int64_t)place[1], z, tilt, p, at, each, context);
    }
}

/* Has any of the blocks of 4 x 4 cells, `wide` a side from (x, y) on, a cell? */
static bool has_cells(const struct spl_panel *panel, int x, int y, int wide)
{
    bool any = false;
    for (int row = 4 * y; row < 4 * (y + wide); row++)
        any |= panel->cells[row] >> 4 * x & ((1 << 4 * wide) - 1);
    return any;
}

static void show_panel(struct drawn *d, void (*each)(void *, const struct reference_fragment *), void *context)
{
    float rectangle[2][2], corners[4][3];
    find_rectangle(&d->panel, rectangle);
    for (int k = 0; k < 4; k++)
        place(d->plane, rectangle[k % 3 != 0][0], rectangle[k > 1][1], corners[k]);
    d->side = side;
    set_piece(d, d->plane->n, d->plane->o, corners, 1);
    show_piece(d, 0, (float[2]){0}, each, context);
}

/* The half of the square of the lattice at (i, j) on the side of (1, 0), and that of (0, 1). */
static void show_triangle(struct drawn *d, const struct spl_relief *relief, int i, int j, bool low, float pieces,
                          void (*each)(void *, const struct reference_fragment *), void *context)
{
    const struct reference_plane *plane = d->plane;
    const int squares = 1 << relief->level, ends[3][2] = {{i, j}, {i + low, j + !low}, {i + 1, j + 1}};
    float corners[4][3], heights[3], rise[2], normal[3];
    d->side = (float)side / (float)squares;
    d->square[0] = d->side * (float)i;
    d->square[1] = d->side * (float)j;
    d->half = low ? 1 : -1;
    for (int k = 0; k < 4; k++) {
        const int *at = ends[k % 3];
        float height = relief->height[at[1] * (squares + 1) + at[0]];
        heights[k % 3] = height;
        place(plane, (float)(side * d->panel.column) + d->side * (float)at[0],
              (float)(side * d->panel.row) + d->side * (float)at[1], corners[k]);
        for (int a = 0; a < 3; a++)
            corners[k][a] += height * plane->n[a];
    }
    rise[!low] = (heights[1] - heights[0]) / d->side;
    rise[low] = (heights[2] - heights[1]) / d->side;
    float slope[2] = {rise[0] / plane->world.cell, rise[1] / plane->world.cell};
    float scale = 1.0f / sqrtf(1.0f + slope[0] * slope[0] + slope[1] * slope[1]);
    for (int a = 0; a < 3; a++)
        normal[a] = (plane->n[a] - slope[0] * plane->u[a] - slope[1] * plane->v[a]) * scale;
    set_piece(d, normal, corners[0], corners, pieces);
    show_piece(d, heights[0], rise, each, context);
}

void reference_panel_fragments(const struct reference_plane *plane,
                               void (*each)(void *, const struct reference_fragment *), void *context)
{
    for (uint32_t i = 0; i < plane->chunk->count; i++) {
        struct drawn d = {0};
        struct spl_relief relief;
        float rectangle[2][2];
        if (!load(plane, i, &d.panel, &d.texels))
            continue;
        begin(plane, i, &d);
        if (spl_chunk_kind(plane->chunk) != SPL_CHUNK_MESHES) {
            show_panel(&d, each, context);
            continue;
        }
        spl_panels_get_relief(plane->chunk, plane->page, i, &relief);
        find_rectangle(&d.panel, rectangle);
        /* As thick as what has cells would be, if all of it were as one triangle is. */
        const int squares = 1 << relief.level, wide = side / squares;
        float cells = fminf(rectangle[1][0] - rectangle[0][0], rectangle[1][1] - rectangle[0][1]);
        for (int k = 0; k < 2 * squares * squares; k++)
            if (has_cells(&d.panel, k / 2 % squares * wide / 4, k / 2 / squares * wide / 4, wide > 4 ? wide / 4 : 1))
                show_triangle(&d, &relief, k / 2 % squares, k / 2 / squares, k % 2 == 0,
                              2 * cells / (float)side * (float)squares, each, context);
    }
}
