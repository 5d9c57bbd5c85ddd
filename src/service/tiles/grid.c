/* Tiles as views; see grid.h. Coordinates are doubles: at level 30 a pixel of Web Mercator is 0.15 mm. */
#include "service/tiles/grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "service/datasets/entry.h"
#include "service/place/places.h"

static const double earth_m = 6378137; /* Web Mercator's sphere */

int spl_tile_grid_find(const struct spl_catalog_entry *entry, struct spl_tile_grid *grid, struct spl_error *err)
{
    const struct spl_dataset_info *info = entry->info;
    double world[2][3], box[2][3];
    struct spl_error why = {0};
    memcpy(world[0], info->bounds_min, sizeof world[0]);
    memcpy(world[1], info->bounds_max, sizeof world[1]);
    *grid = (struct spl_tile_grid){.world_units = 1};
    int rc = spl_places_bounds(entry->places, SPL_WEB_MERCATOR, world, box, &why);
    if (rc == SPL_E_BUSY)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    grid->mercator = !rc;
    memcpy(grid->low, rc ? world[0] : box[0], sizeof grid->low);
    memcpy(grid->high, rc ? world[1] : box[1], sizeof grid->high);
    if (grid->mercator) {
        grid->side = 2 * M_PI * earth_m;
        grid->corner[0] = -grid->side / 2;
        grid->corner[1] = grid->side / 2;
        double own = fmax(world[1][0] - world[0][0], world[1][1] - world[0][1]);
        double there = fmax(grid->high[0] - grid->low[0], grid->high[1] - grid->low[1]);
        grid->world_units = own > 0 && there > 0 ? own / there : 1;
        return SPL_OK;
    }
    grid->side = fmax(world[1][0] - world[0][0], world[1][1] - world[0][1]);
    if (!(grid->side > 0)) /* a single point */
        grid->side = 1;
    grid->corner[0] = (world[0][0] + world[1][0] - grid->side) / 2;
    grid->corner[1] = (world[0][1] + world[1][1] + grid->side) / 2;
    return SPL_OK;
}

/* Digits without sign and leading zeros; -1 for anything else. */
static int64_t read_count(const char **text)
{
    size_t digits = strspn(*text, "0123456789");
    if (!digits || digits > 10 || (**text == '0' && digits > 1))
        return -1;
    int64_t value = strtoll(*text, NULL, 10);
    *text += digits;
    return value;
}

int spl_tile_name_parse(const char *text, struct spl_tile_name *name, struct spl_error *err)
{
    const char *at = text;
    int64_t z = read_count(&at), x = z >= 0 && *at++ == '/' ? read_count(&at) : -1,
            y = x >= 0 && *at++ == '/' ? read_count(&at) : -1;
    *name = (struct spl_tile_name){.scale = 1};
    if (y >= 0 && !strncmp(at, "@2x", 3)) {
        name->scale = 2;
        at += 3;
    }
    int format = y >= 0 && *at == '.' ? spl_format_from_name(at + 1) : -1;
    if (format != SPL_FORMAT_PNG && format != SPL_FORMAT_WEBP)
        return spl_fail_field(err, SPL_E_NOT_FOUND, "tile", "'%.64s' is no tile; write z/x/y.png, .webp or @2x.png",
                              text);
    if (!spl_format_is_built((enum spl_format)format))
        return spl_fail_field(err, SPL_E_NOT_FOUND, "tile", "this build makes no %s tiles; ask for png", at + 1);
    if (z >= SPL_TILE_LEVELS || x >> z || y >> z)
        return spl_fail_field(err, SPL_E_NOT_FOUND, "tile", "there is no tile '%.64s': z ends at %d, x and y below 2^z",
                              text, SPL_TILE_LEVELS - 1);
    name->z = (uint32_t)z;
    name->x = (uint32_t)x;
    name->y = (uint32_t)y;
    name->format = (enum spl_format)format;
    return SPL_OK;
}

static int to_world(const struct spl_catalog_entry *entry, double x, double y, double out[2], struct spl_error *err)
{
    const struct spl_camera_places *places = entry->defaults.places;
    double at[3];
    int rc = places->to_world(places, SPL_WEB_MERCATOR, "tile", (double[]){x, y, 0}, at, err);
    memcpy(out, at, 2 * sizeof *out);
    return rc;
}

/* Around the point of the dataset's box that is next to the tile's middle Mercator is the plane turned and scaled; the
 * differences are central, so that what is left out is of third order. */
static int look_from_mercator(const struct spl_tile_grid *grid, const struct spl_catalog_entry *entry,
                              const double middle[2], double size, struct spl_tile_view *view, struct spl_error *err)
{
    double near[2], at[2], ends[4][2], step = size / 2, widest = 1;
    for (int i = 0; i < 2; i++) {
        near[i] = fmin(fmax(middle[i], grid->low[i]), grid->high[i]);
        widest = fmax(widest, grid->high[i] - grid->low[i]);
    }
    step = fmin(step, widest);
    int rc = to_world(entry, near[0], near[1], at, err);
    for (int i = 0; !rc && i < 4; i++) {
        const double by = i % 2 ? -step : step;
        rc = to_world(entry, near[0] + (i < 2 ? by : 0), near[1] + (i < 2 ? 0 : by), ends[i], err);
    }
    if (rc)
        return rc;
    double east[2], north[2];
    for (int i = 0; i < 2; i++) {
        east[i] = (ends[0][i] - ends[1][i]) / (2 * step);
        north[i] = (ends[2][i] - ends[3][i]) / (2 * step);
        view->eye[i] = at[i] + east[i] * (middle[0] - near[0]) + north[i] * (middle[1] - near[1]);
    }
    double units[2] = {hypot(east[0], east[1]), hypot(north[0], north[1])};
    view->up[0] = north[0] / units[1] - east[1] / units[0];
    view->up[1] = north[1] / units[1] + east[0] / units[0];
    for (int i = 0; i < 2; i++)
        view->scale[i] /= units[i];
    return SPL_OK;
}

int spl_tile_grid_look(const struct spl_tile_grid *grid, const struct spl_catalog_entry *entry,
                       const struct spl_tile_name *name, struct spl_tile_view *view, struct spl_error *err)
{
    const struct spl_dataset_info *info = entry->info;
    const double size = ldexp(grid->side, -(int)name->z), above = info->bounds_max[2] - info->bounds_min[2];
    const double middle[2] = {grid->corner[0] + (name->x + 0.5) * size, grid->corner[1] - (name->y + 0.5) * size};
    *view = (struct spl_tile_view){.side = SPL_TILE_SIDE * name->scale, .format = name->format, .up = {0, 1}};
    view->scale[0] = view->scale[1] = view->side / size;
    view->eye[2] = info->bounds_max[2] + fmax(above, 1); /* what is drawn begins behind it, wherever that is */
    if (grid->mercator)
        return look_from_mercator(grid, entry, middle, size, view, err);
    memcpy(view->eye, middle, sizeof middle);
    return SPL_OK;
}

void spl_tile_grid_get_levels(const struct spl_tile_grid *grid, const struct spl_dataset_info *info, int *least,
                              int *most)
{
    double widest = fmax(grid->high[0] - grid->low[0], grid->high[1] - grid->low[1]);
    double splat = info->splat_radius / grid->world_units;
    double first = widest > 0 ? floor(log2(grid->side / (4 * widest))) : 0;
    double last = splat > 0 ? ceil(log2(grid->side / (SPL_TILE_SIDE * splat))) : 0;
    *least = (int)fmin(fmax(first, 0), SPL_TILE_LEVELS - 1);
    *most = (int)fmin(fmax(last, *least), SPL_TILE_LEVELS - 1);
}

void spl_tile_to_degrees(const double mercator[2], double out[2])
{
    out[0] = mercator[0] / earth_m * (180 / M_PI);
    out[1] = atan(sinh(mercator[1] / earth_m)) * (180 / M_PI);
}
