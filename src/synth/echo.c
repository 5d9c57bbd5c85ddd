/* What comes back from a pulse: one or several surfaces under its footprint, noise along the ray, and what gets lost.
 * Each random number is keyed by what it is for. Pure functions; any thread. */
#include "synth/scanner.h"

#include <string.h>

#include "synth/footprint.h"
#include "synth/random.h"
#include "geom/vector.h"

static const double separation = 0.5;     /* metres between two returns of a pulse */
static const double brightest_weak = 0.5; /* albedo below which a surface loses more returns */
enum { rays = 7 };                        /* the central one and a ring around it, of equal area each */

enum purpose { for_dropout = 1, for_mixing, for_place, for_return, for_pose };

/* A standard normal deviate for each key (Box-Muller). */
static double gaussian(uint64_t key)
{
    double radius = sqrt(-2 * log(1 - unit_of(hash64(key))));
    return radius * cos(2 * M_PI * unit_of(hash64(key ^ 0x5851f42d4c957f2du)));
}

static double chance(uint64_t key, enum purpose purpose)
{
    return unit_of(hash64(key ^ hash64(0xd1b54a32d192ed03u + (uint64_t)purpose)));
}

void spl_scanner_displacement(const struct spl_scan_faults *faults, size_t pass, double out[3])
{
    uint64_t key = hash64(faults->seed ^ hash64(pass)) ^ hash64(for_pose);
    double height = 2 * unit_of(hash64(key)) - 1, azimuth = 2 * M_PI * unit_of(hash64(hash64(key)));
    double level = sqrt(1 - height * height);
    const double unit[3] = {level * cos(azimuth), level * sin(azimuth), height};
    mad3((double[3]){0}, faults->misregister, unit, out);
}

static double albedo_of(const uint8_t color[3])
{
    return (0.3 * color[0] + 0.6 * color[1] + 0.1 * color[2]) / 255;
}

static bool is_lost(const struct spl_scanner *scanner, const struct spl_scan_faults *faults, const struct spl_hit *hit,
                    const double direction[3], uint64_t key)
{
    if (!(faults->dropout > 0))
        return false;
    double grazing = fmax(fabs(dot3(hit->normal, direction)), 1e-6), far = fmax(1, hit->t / scanner->range);
    double weakness = fmax(1, brightest_weak / fmax(albedo_of(hit->color), 1e-6)) / grazing * far * far;
    return chance(key, for_dropout) < 1 - pow(1 - faults->dropout, weakness);
}

struct place {
    double range;
    uint8_t color[3];
};

/* Rays of one return, sorted by range: whether two surfaces lie more than two footprints apart, and a place between. */
static bool mix(const struct spl_scanner *scanner, const struct spl_hit *hits, unsigned count, uint64_t key,
                struct place *place)
{
    unsigned edge = 0;
    double widest = 0;
    for (unsigned i = 1; i < count; i++) {
        double gap = hits[i].t - hits[i - 1].t;
        if (hits[i].primitive != hits[i - 1].primitive && gap > widest) {
            widest = gap;
            edge = i;
        }
    }
    if (widest <= 2 * (scanner->aperture + scanner->divergence * hits[0].t))
        return false;
    double share = chance(key, for_place);
    place->range = hits[edge - 1].t + share * widest;
    for (int i = 0; i < 3; i++)
        place->color[i] = (uint8_t)lround(hits[edge - 1].color[i] * (1 - share) + hits[edge].color[i] * share);
    return true;
}

/* The hits under the footprint by range; *central is the place of the central ray's, or -1. */
static unsigned cast_footprint(const struct spl_scene *scene, const struct spl_pulse *pulse, struct spl_hit hits[rays],
                               int *central)
{
    const struct spl_scanner *s = &scene->scanner;
    double side[3], other[3];
    unsigned count = 0;
    orthogonal3(pulse->direction, side);
    cross3(pulse->direction, side, other);
    *central = -1;
    for (int i = 0; i < rays; i++) {
        double out = i ? 0.76 / 2 : 0, angle = M_PI / 3 * i, origin[3], direction[3]; /* the ring's mean radius */
        struct spl_hit hit;
        for (int a = 0; a < 3; a++) {
            double way = out * (cos(angle) * side[a] + sin(angle) * other[a]);
            origin[a] = pulse->origin[a] + s->aperture * way;
            direction[a] = pulse->direction[a] + s->divergence * way;
        }
        if (!spl_scene_hit(scene, origin, direction, &hit))
            continue;
        unsigned at = count++;
        for (; at > 0 && hits[at - 1].t > hit.t; at--)
            hits[at] = hits[at - 1];
        hits[at] = hit;
        *central += *central >= (int)at;
        if (!i)
            *central = (int)at;
    }
    return count;
}

unsigned spl_scanner_cast(const struct spl_scene *scene, const struct spl_scan_grid *grid,
                          const struct spl_scan_faults *faults, size_t pass, uint64_t column, uint64_t row,
                          struct spl_return returns[SPL_SCANNER_RETURNS_MAX])
{
    const struct spl_scanner *scanner = &scene->scanner;
    struct spl_pulse pulse;
    struct spl_hit hits[rays];
    uint64_t key = hash64(hash64(faults->seed ^ hash64(pass)) ^ column) ^ row;
    bool mixing = faults->mixed > 0 && chance(key, for_mixing) < faults->mixed;
    int central = 0;
    unsigned count, found = 0;
    spl_scanner_pulse(scene, grid, pass, column, row, &pulse);
    if (mixing || scanner->returns > 1)
        count = cast_footprint(scene, &pulse, hits, &central);
    else
        count = spl_scene_hit(scene, pulse.origin, pulse.direction, &hits[0]);
    if (scanner->returns == 1 && central < 0)
        return 0;

    double moved[3];
    spl_scanner_displacement(faults, pass, moved);
    for (unsigned first = 0, last; first < count && found < scanner->returns; first = last) {
        for (last = first + 1; last < count; last++)
            if (scanner->returns > 1 && hits[last].t - hits[last - 1].t > separation)
                break;
        uint64_t return_key = first ? hash64(key ^ hash64(for_return)) ^ first : key;
        const struct spl_hit *hit = &hits[central >= (int)first && central < (int)last ? (unsigned)central : first];
        struct place place = {.range = hit->t};
        if (is_lost(scanner, faults, hit, pulse.direction, return_key))
            continue;
        if (!returns) {
            found++;
            continue;
        }
        spl_footprint_color(scene, grid, pass, column, row, hit, place.color);
        if (mixing)
            mix(scanner, hits + first, last - first, return_key, &place);
        if (faults->noise > 0)
            place.range += faults->noise * gaussian(return_key);
        struct spl_return *r = &returns[found++];
        *r = (struct spl_return){.hit = true, .pass = (uint16_t)pass, .pulse = column * grid->rows + row};
        mad3((double[3]){0}, place.range, pulse.local, r->local);
        mad3(pulse.origin, place.range, pulse.direction, r->scene);
        mad3(r->scene, 1, moved, r->scene);
        r->intensity = (float)(albedo_of(place.color) * (0.5 - 0.5 * dot3(hit->normal, pulse.direction)));
        memcpy(r->color, place.color, sizeof r->color);
        r->class = scene->classes ? scene->classes[scene->primitives[hit->primitive].object] : 1;
    }
    for (unsigned i = 0; returns && i < found; i++) {
        returns[i].number = (uint8_t)(i + 1);
        returns[i].of = (uint8_t)found;
    }
    return found;
}
