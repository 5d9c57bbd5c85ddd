/* E57: scans of one file in turn, each in the frame of its scanner and brought to the world by its pose. A scan whose
 * viewpoint is known (it has a pose, spherical coordinates, or rows and columns) is a station.
 *
 * Invariant: `points` stands at point `taken` of scan `scan`. Owned by the cloud's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/text.h"
#include "cloud/crs.h"
#include "cloud/e57_reader.h"
#include "cloud/fields.h"
#include "geom/quaternion.h"
#include "geom/unit.h"

_Static_assert(SPL_E57_ROLES - SPL_E57_CLASS == SPL_COLUMN_COUNT - SPL_COLUMN_CLASS, "roles follow the columns");

/* The scanner's frame in the world's: the quaternion is not always a unit. */
static int set_pose(const struct spl_cloud *cloud, const struct spl_e57_scan *from, struct spl_e57_frame *scan,
                    struct spl_error *err)
{
    const double *q = from->pose.rotation, *t = from->pose.translation;
    double r[9], length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 1e-6 && length < 1e6))
        return spl_e57_fail_scan(cloud, from, "rotation", err, "the quaternion of its pose is no rotation");
    if (!isfinite(t[0]) || !isfinite(t[1]) || !isfinite(t[2]))
        return spl_e57_fail_scan(cloud, from, "translation", err, "its pose is not finite");
    spl_quaternion_to_matrix(q, r);
    for (int row = 0; row < 3; row++) {
        memcpy(scan->pose + 4 * row, r + 3 * row, 3 * sizeof *r);
        scan->pose[4 * row + 3] = t[row];
    }
    scan->pose[15] = 1;
    scan->posed = from->pose.given;
    return SPL_OK;
}

static bool has_field(const struct spl_e57_document *document, const struct spl_e57_scan *scan, const char *name)
{
    for (size_t i = 0; i < scan->fields; i++)
        if (!strcmp(document->fields[scan->first_field + i].name, name))
            return true;
    return false;
}

/* Which fields fill the columns from CLASS on: those that E57 itself has, then others by their names, with the prefix
 * of their extension or without. */
static void find_columns(struct spl_cloud *cloud, struct spl_e57_scan *scan)
{
    struct spl_e57 *e57 = cloud->state;
    const struct spl_e57_scan *first = e57->named;
    uint32_t taken = (1u << SPL_COLUMN_CLASS) - 1; /* no other field is a position or a colour */
    for (int column = SPL_COLUMN_CLASS; column < SPL_COLUMN_KEPT; column++)
        if (scan->field[SPL_E57_CLASS + column - SPL_COLUMN_CLASS] >= 0)
            taken |= 1u << column;
    for (size_t i = 0; i < scan->fields; i++) {
        const struct spl_e57_field *field = &e57->document.fields[scan->first_field + i];
        const char *name = field->name, *colon = strchr(name, ':');
        if (!cloud->fields_cut && (!first || !has_field(&e57->document, first, name)))
            spl_cloud_name_field(cloud, name, strlen(name));
        bool free = field->role == SPL_E57_OTHER || field->role == SPL_E57_ROW || field->role == SPL_E57_COLUMN;
        if (!free || field->type == SPL_E57_STRING)
            continue;
        int column = spl_keep_find_column(&cloud->keep, taken, name, strlen(name));
        if (column < 0 && colon)
            column = spl_keep_find_column(&cloud->keep, taken, colon + 1, strlen(colon + 1));
        if (column < 0)
            continue;
        taken |= 1u << column;
        scan->field[SPL_E57_CLASS + column - SPL_COLUMN_CLASS] = (int)i;
    }
    cloud->columns |= taken >> SPL_COLUMN_CLASS << SPL_COLUMN_CLASS;
    e57->named = first ? first : scan;
}

static int set_scan(struct spl_cloud *cloud, size_t index, struct spl_error *err)
{
    struct spl_e57 *e57 = cloud->state;
    const struct spl_e57_document *document = &e57->document;
    struct spl_e57_scan *from = &e57->document.scans[index];
    struct spl_e57_frame *scan = &e57->scans[index];
    bool cartesian = spl_e57_have3(from, SPL_E57_X), colors = spl_e57_have3(from, SPL_E57_RED);
    int code = set_pose(cloud, from, scan, err);
    if (code < 0)
        return code;
    scan->spherical = !cartesian && spl_e57_have3(from, SPL_E57_RANGE);
    if (from->points && !cartesian && !scan->spherical)
        return spl_e57_fail_scan(cloud, from, "prototype", err,
                                 "its points have neither cartesianX, Y, Z nor sphericalRange, Azimuth, Elevation");
    bool cells = from->field[SPL_E57_ROW] >= 0 && from->field[SPL_E57_COLUMN] >= 0;
    scan->misses =
        (cells || scan->spherical) && from->field[scan->spherical ? SPL_E57_SPHERICAL_STATE : SPL_E57_STATE] < 0;
    cloud->info.points_at_most |=
        scan->misses || from->field[scan->spherical ? SPL_E57_SPHERICAL_STATE : SPL_E57_STATE] >= 0;
    scan->station = UINT16_MAX;
    if (scan->posed || scan->spherical || cells) {
        scan->station = (uint16_t)cloud->info.station_count;
        memcpy(cloud->info.stations[cloud->info.station_count++], scan->pose, sizeof scan->pose);
        cloud->info.attributes |= SPL_CLOUD_STATION;
    }
    if (!from->points)
        return SPL_OK;
    if ((code = spl_e57_check_count(&cloud->source, document, from, &e57->room, err)) < 0)
        return code;
    cloud->info.points_expected += from->points;
    for (int k = 0; colors && k < 3; k++)
        scan->color[k] =
            spl_e57_find_range(spl_e57_field(document, from, SPL_E57_RED + k), from->color_limits[k], true);
    if (colors)
        cloud->columns |= 7u << SPL_COLUMN_RED;
    if (spl_e57_have3(from, SPL_E57_NX))
        cloud->info.attributes |= SPL_CLOUD_NORMAL;
    find_columns(cloud, from);
    if (from->field[SPL_E57_CLASS] >= 0)
        cloud->info.attributes |= SPL_CLOUD_CLASS;
    if (from->field[SPL_E57_INTENSITY] >= 0)
        scan->intensity =
            spl_e57_find_range(spl_e57_field(document, from, SPL_E57_INTENSITY), from->intensity_limits, false);
    return SPL_OK;
}

/* E57 is in metres, whatever its system is in: one in other units cannot be that of its coordinates. */
static int read_coordinates(struct spl_cloud *cloud, struct spl_error *err)
{
    const struct spl_e57 *e57 = cloud->state;
    struct spl_cloud_coordinates *crs = &cloud->info.coordinates;
    const char *text = e57->document.coordinates;
    struct spl_error why = {0};
    if (text && !spl_fields_blank(text, strlen(text))) {
        const char *first = text + strspn(text, " \t\r\n");
        static const char urn[] = "urn:ogc:def:crs:EPSG:";
        char number[32] = ""; /* instead of a text */
        if (!strncasecmp(first, urn, sizeof urn - 1))
            snprintf(number, sizeof number, "EPSG:%.20s", strrchr(first, ':') + 1);
        else if (!strncasecmp(first, "EPSG:", 5))
            snprintf(number, sizeof number, "%.30s", first);
        number[strcspn(number, " \t\r\n")] = 0;
        int code = number[0] ? spl_crs_read_option(number, crs, &why) : spl_crs_read_wkt(text, strlen(text), crs, &why);
        if (code == SPL_E_NOMEM)
            return spl_fail(err, code, "%s", why.message);
        if (code < 0)
            spl_text_show(first, crs->name, sizeof crs->name);
        if (code < 0 && !number[0])
            snprintf(crs->lost, sizeof crs->lost, "the WKT of its coordinate system cannot be read (%.90s)",
                     why.message);
        if (crs->angles || (crs->unit_m > 0 && crs->unit_m != 1)) {
            char unit[SPL_UNIT_TEXT_MAX], said[80];
            const char *in = crs->angles ? "degrees" : spl_unit_print(crs->unit_m, unit);
            if (crs->epsg)
                snprintf(said, sizeof said, "EPSG:%u", crs->epsg);
            else
                snprintf(said, sizeof said, "%s", crs->name);
            spl_crs_finish(crs);
            snprintf(crs->lost, sizeof crs->lost,
                     "its coordinate system (%s) is in %s, and E57 always in metres: it is left out", said, in);
        }
    }
    crs->unit_m = crs->height_unit_m = 1;
    spl_crs_keep_name(crs);
    for (size_t i = 0; i < e57->document.scan_count; i++)
        for (int k = 0; k < 3 && e57->document.scans[i].points && !e57->scans[i].posed; k++) {
            const struct spl_e57_field *field = spl_e57_field(&e57->document, &e57->document.scans[i], SPL_E57_X + k);
            crs->floats |= field && field->type == SPL_E57_SINGLE;
        }
    return SPL_OK;
}

static int list_images(struct spl_cloud *cloud, struct spl_error *err)
{
    static const char *const kinds[] = {"", "visual reference", "pinhole", "spherical", "cylindrical"},
                             *const codings[] = {"", "JPEG", "PNG"};
    struct spl_e57 *e57 = cloud->state;
    e57->images = spl_alloc(e57->document.image_count, sizeof *e57->images, err);
    if (!e57->images)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < e57->document.image_count; i++) {
        const struct spl_e57_image *image = &e57->document.images[i];
        if (image->kind != SPL_E57_NO_IMAGE)
            e57->images[cloud->info.image_count++] =
                (struct spl_cloud_image){image->name,   kinds[image->kind], codings[image->coding], image->width,
                                         image->height, image->bytes,       image->pose.given};
    }
    cloud->info.images = e57->images;
    return SPL_OK;
}

static int e57_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_e57 *e57 = cloud->state = spl_alloc(1, sizeof *e57, err);
    if (!e57)
        return SPL_E_NOMEM;
    int code = spl_e57_pages_init(&e57->pages, &cloud->source, err);
    if (code == SPL_OK)
        code = spl_e57_document_read(&e57->document, &e57->pages, err);
    if (code == SPL_OK)
        code = spl_e57_points_init(&e57->points, &e57->pages, &e57->document, err);
    if (code < 0)
        return code;
    size_t count = e57->document.scan_count;
    e57->scans = spl_alloc(count, sizeof *e57->scans, err);
    cloud->info.stations = spl_alloc(count, sizeof *cloud->info.stations, err);
    if (!e57->scans || !cloud->info.stations)
        return SPL_E_NOMEM;
    e57->room = spl_e57_logical_bytes(&e57->pages);
    for (size_t i = 0; i < count; i++)
        if ((code = set_scan(cloud, i, err)) < 0)
            return code;
    spl_e57_agree_on_ranges(cloud);
    cloud->sampling = SPL_SAMPLE_INTENSITY;
    code = list_images(cloud, err);
    return code < 0 ? code : read_coordinates(cloud, err);
}

/* The role's values for the next rows, or `none` where the scan does not have it. */
static int read_column(struct spl_e57 *e57, enum spl_e57_role role, double *out, size_t count, double none,
                       struct spl_error *err)
{
    if (e57->document.scans[e57->scan].field[role] >= 0)
        return spl_e57_points_read(&e57->points, role, out, count, err);
    for (size_t i = 0; i < count; i++)
        out[i] = none;
    return SPL_OK;
}

/* From this column on. */
static int read_three(struct spl_e57 *e57, enum spl_e57_role role, struct spl_rows *rows, int column,
                      struct spl_error *err)
{
    int code = SPL_OK;
    for (int k = 0; k < 3 && code == SPL_OK; k++)
        code = read_column(e57, role + (unsigned)k, rows->value[column + k], rows->count, 0, err);
    return code;
}

/* Positions in the scanner's frame; what is invalid has no place. */
static int read_positions(struct spl_e57 *e57, struct spl_rows *rows, struct spl_error *err)
{
    const struct spl_e57_frame *scan = &e57->scans[e57->scan];
    double *x = rows->value[SPL_COLUMN_X], *y = rows->value[SPL_COLUMN_Y], *z = rows->value[SPL_COLUMN_Z];
    double *state = e57->state;
    int code = read_three(e57, scan->spherical ? SPL_E57_RANGE : SPL_E57_X, rows, SPL_COLUMN_X, err);
    if (code == SPL_OK)
        code = read_column(e57, scan->spherical ? SPL_E57_SPHERICAL_STATE : SPL_E57_STATE, state, rows->count, 0, err);
    for (size_t r = 0; code == SPL_OK && scan->spherical && r < rows->count; r++) {
        double range = x[r], azimuth = y[r], elevation = z[r], level = range * cos(elevation);
        x[r] = level * cos(azimuth);
        y[r] = level * sin(azimuth);
        z[r] = range * sin(elevation);
    }
    for (size_t r = 0; code == SPL_OK && r < rows->count; r++)
        if (state[r] != 0 || (scan->misses && x[r] == 0 && y[r] == 0 && z[r] == 0))
            x[r] = NAN;
    return code;
}

static void turn(const double pose[16], bool translate, struct spl_rows *rows, int column)
{
    double *x = rows->value[column], *y = rows->value[column + 1], *z = rows->value[column + 2];
    const double *m = pose, t[3] = {translate ? m[3] : 0, translate ? m[7] : 0, translate ? m[11] : 0};
    for (size_t r = 0; r < rows->count; r++) {
        double a = x[r], b = y[r], c = z[r];
        x[r] = m[0] * a + m[1] * b + m[2] * c + t[0];
        y[r] = m[4] * a + m[5] * b + m[6] * c + t[1];
        z[r] = m[8] * a + m[9] * b + m[10] * c + t[2];
    }
}

/* Does a batch show it? Intensity is also what grey is made of. */
static bool is_wanted(const struct spl_cloud *cloud, int column)
{
    if (!(cloud->columns >> column & 1))
        return false;
    if (column == SPL_COLUMN_CLASS)
        return cloud->info.attributes & SPL_CLOUD_CLASS;
    return cloud->info.scalars >> (column - SPL_COLUMN_INTENSITY) & 1 ||
           (column == SPL_COLUMN_INTENSITY && cloud->color.kind != SPL_COLOR_RGB);
}

static int read_scalars(struct spl_e57 *e57, struct spl_rows *rows, int column, struct spl_error *err)
{
    double *value = rows->value[column];
    enum spl_e57_role role = SPL_E57_CLASS + (unsigned)(column - SPL_COLUMN_CLASS);
    int code = read_column(e57, role, value, rows->count, NAN, err);
    for (size_t r = 0; role == SPL_E57_RETURN && r < rows->count; r++)
        value[r] += 1; /* datasets count them from 1 */
    if (code < 0 || role != SPL_E57_INTENSITY)
        return code;
    code = read_column(e57, SPL_E57_INTENSITY_STATE, e57->state, rows->count, 0, err);
    for (size_t r = 0; code == SPL_OK && r < rows->count; r++)
        if (e57->state[r] != 0)
            value[r] = NAN;
    return code;
}

static int read_rows(struct spl_cloud *cloud, struct spl_rows *rows, struct spl_error *err)
{
    struct spl_e57 *e57 = cloud->state;
    const struct spl_e57_scan *from = &e57->document.scans[e57->scan];
    const struct spl_e57_frame *scan = &e57->scans[e57->scan];
    int code = read_positions(e57, rows, err);
    if (code == SPL_OK && cloud->info.attributes & SPL_CLOUD_NORMAL)
        code = read_three(e57, SPL_E57_NX, rows, SPL_COLUMN_NX, err);
    if (code == SPL_OK && cloud->columns >> SPL_COLUMN_RED & 1 && cloud->color.kind != SPL_COLOR_GREY)
        code = read_three(e57, SPL_E57_RED, rows, SPL_COLUMN_RED, err);
    for (int column = SPL_COLUMN_CLASS; column < SPL_COLUMN_COUNT && code == SPL_OK; column++)
        if (is_wanted(cloud, column))
            code = read_scalars(e57, rows, column, err);
    if (code < 0)
        return code;
    if (scan->posed) {
        turn(scan->pose, true, rows, SPL_COLUMN_X);
        turn(scan->pose, false, rows, SPL_COLUMN_NX);
    }
    for (int k = 0;
         e57->scale_colors && spl_e57_have3(from, SPL_E57_RED) && cloud->color.kind != SPL_COLOR_GREY && k < 3; k++)
        if ((code = spl_e57_scale(cloud, rows, SPL_COLUMN_RED + k, &scan->color[k], 255, err)) < 0)
            return code;
    if (e57->scale_intensity && from->field[SPL_E57_INTENSITY] >= 0 && is_wanted(cloud, SPL_COLUMN_INTENSITY))
        code = spl_e57_scale(cloud, rows, SPL_COLUMN_INTENSITY, &scan->intensity, 1, err);
    return code;
}

static int e57_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct spl_e57 *e57 = cloud->state;
    rows->count = 0;
    for (; e57->scan < e57->document.scan_count; e57->scan++, e57->begun = false) {
        const struct spl_e57_scan *from = &e57->document.scans[e57->scan];
        int code = e57->begun ? SPL_OK : spl_e57_points_begin(&e57->points, from, err);
        if (code < 0)
            return code;
        if (!e57->begun)
            spl_e57_set_colors(cloud);
        e57->begun = true;
        uint64_t left = from->points - e57->points.next;
        if (left == 0)
            continue;
        rows->count = left < limit ? (size_t)left : limit;
        rows->station = e57->scans[e57->scan].station;
        code = read_rows(cloud, rows, err);
        if (code < 0)
            return code;
        spl_e57_points_take(&e57->points, rows->count);
        spl_source_seek(&cloud->source, spl_e57_to_physical(e57->points.held)); /* for progress */
        return 1;
    }
    return 0;
}

/* Parts in their order go forward: from one to the next costs the heads of the packets between them. */
static int e57_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct spl_e57 *e57 = cloud->state;
    const struct spl_e57_scan *scans = e57->document.scans;
    uint64_t to = cloud->info.points_expected / parts * part;
    size_t scan = 0;
    int code = SPL_OK;
    e57->base = cloud->info.colors;
    while (scan + 1 < e57->document.scan_count && to >= scans[scan].points)
        to -= scans[scan++].points;
    if (part == 0 || scan != e57->scan || !e57->begun || to < e57->points.next) {
        e57->scan = part ? scan : 0;
        e57->begun = part != 0;
        code = part ? spl_e57_points_begin(&e57->points, &scans[scan], err) : SPL_OK;
    }
    if (code == SPL_OK && part)
        code = spl_e57_points_skip(&e57->points, to, err);
    return code;
}

static void e57_close(struct spl_cloud *cloud)
{
    struct spl_e57 *e57 = cloud->state;
    spl_e57_points_finish(&e57->points);
    spl_e57_document_finish(&e57->document);
    spl_e57_pages_finish(&e57->pages);
    free(e57->scans);
    free(e57->images);
}

const struct spl_cloud_reader spl_e57_reader = {
    .format = "E57", .open = e57_open, .rows = e57_rows, .seek = e57_seek, .close = e57_close};
