/* Where each scanner's pulses go. A platform moves on while it scans: the place of a mobile or airborne scanner is that
 * of the pulse, not of its line. Pure functions; any thread. */
#include "synth/scanner.h"

#include "base/error.h"
#include "synth/random.h"
#include "geom/vector.h"

static const double lowest = -60, highest = 90; /* elevations of a tripod, degrees */

static void rotate(const double rotation[9], const double from[3], double to[3])
{
    for (int i = 0; i < 3; i++)
        to[i] = dot3(&rotation[3 * i], from);
}

static void terrestrial(const struct spl_scan_grid *grid, uint64_t column, uint64_t row, double direction[3])
{
    double azimuth = 2 * M_PI * ((double)column + 0.5) / (double)grid->columns;
    double elevation = (lowest + (highest - lowest) * ((double)row + 0.5) / (double)grid->rows) * M_PI / 180;
    direction[0] = cos(elevation) * cos(azimuth);
    direction[1] = cos(elevation) * sin(azimuth);
    direction[2] = sin(elevation);
}

/* The vehicle at `share` of the track's length: its place and its axes as the columns of `axes`. */
static void vehicle_at(const struct spl_scene *scene, double share, double place[3], double axes[9])
{
    const struct spl_track_point *track = scene->track;
    size_t low = 0, high = scene->track_count - 1;
    double at = share * track[high].at;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        *(track[middle].at <= at ? &low : &high) = middle;
    }
    double t = (at - track[low].at) / (track[high].at - track[low].at);
    double x[3], y[3], z[3];
    for (int i = 0; i < 3; i++) {
        place[i] = track[low].position[i] + t * (track[high].position[i] - track[low].position[i]);
        x[i] = track[low].heading[i] + t * (track[high].heading[i] - track[low].heading[i]);
    }
    normalise3(x);
    cross3((double[3]){0, 0, 1}, x, y);
    normalise3(y);
    cross3(x, y, z);
    for (int i = 0; i < 3; i++) {
        axes[3 * i] = x[i];
        axes[3 * i + 1] = y[i];
        axes[3 * i + 2] = z[i];
    }
}

static void mobile(const struct spl_scene *scene, const struct spl_station *head, double share, double turn,
                   struct spl_pulse *pulse)
{
    double axes[9], place[3], mounted[3], lever[3];
    pulse->local[0] = cos(2 * M_PI * turn);
    pulse->local[1] = sin(2 * M_PI * turn);
    pulse->local[2] = 0;
    vehicle_at(scene, share, place, axes);
    rotate(axes, head->position, lever);
    mad3(place, 1, lever, pulse->origin);
    rotate(head->rotation, pulse->local, mounted);
    rotate(axes, mounted, pulse->direction);
}

/* Densities grow exponentially along x; across, steps of the golden ratio keep the points apart at every density. */
static void sweep(const struct spl_scanner *scanner, const struct spl_station *corner, uint64_t index, uint64_t count,
                  struct spl_pulse *pulse)
{
    double share = ((double)index + 0.5) / (double)count, growth = scanner->growth;
    double along = growth > 1 ? log1p(share * (growth - 1)) / log(growth) : share;
    double across = fmod((double)index * 0.6180339887498949, 1);
    double start[3] = {along * scanner->length, across * scanner->width, 0}, moved[3];
    rotate(corner->rotation, start, moved);
    mad3(corner->position, 1, moved, pulse->origin);
    pulse->local[0] = pulse->local[1] = 0;
    pulse->local[2] = -1;
    rotate(corner->rotation, pulse->local, pulse->direction);
}

void spl_scanner_spacing(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t pass, uint64_t column,
                         uint64_t row, double steps[2][3])
{
    const struct spl_scanner *scanner = &scene->scanner;
    double count = (double)grid->columns * (double)grid->rows, growth = scanner->growth;
    double share = ((double)(column * grid->rows + row) + 0.5) / count;
    double stretch = growth > 1 ? (growth - 1) / (log(growth) * (1 + share * (growth - 1))) : 1;
    double side = sqrt(scanner->length * scanner->width * stretch / count);
    rotate(scene->stations[pass].rotation, (double[3]){side, 0, 0}, steps[0]);
    rotate(scene->stations[pass].rotation, (double[3]){0, side, 0}, steps[1]);
}

void spl_scanner_pulse(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t pass, uint64_t column,
                       uint64_t row, struct spl_pulse *pulse)
{
    const struct spl_station *station = &scene->stations[pass];
    const struct spl_scanner *scanner = &scene->scanner;
    double in_line = ((double)row + 0.5) / (double)grid->rows;
    double along = ((double)column + in_line) / (double)grid->columns;
    switch (scanner->kind) {
    case SPL_SCANNER_TERRESTRIAL:
        terrestrial(grid, column, row, pulse->local);
        mad3(station->position, 0, station->position, pulse->origin);
        rotate(station->rotation, pulse->local, pulse->direction);
        return;
    case SPL_SCANNER_MOBILE:
        mobile(scene, station, along, in_line, pulse);
        return;
    case SPL_SCANNER_AIRBORNE: {
        double back = scanner->zigzag && column % 2 ? -1 : 1;
        double angle = back * (2 * in_line - 1) * scanner->half_angle * M_PI / 180;
        double start[3] = {along * scanner->length, 0, 0}, moved[3];
        pulse->local[0] = 0;
        pulse->local[1] = sin(angle);
        pulse->local[2] = -cos(angle);
        rotate(station->rotation, start, moved);
        mad3(station->position, 1, moved, pulse->origin);
        rotate(station->rotation, pulse->local, pulse->direction);
        return;
    }
    case SPL_SCANNER_SWEEP:
        sweep(scanner, station, column * grid->rows + row, grid->columns * grid->rows, pulse);
        return;
    }
    spl_assert(false && "a kind of scanner");
}
