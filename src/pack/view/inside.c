/* The scene lies around a place when most rays from it meet something: all around for a place in a room, at least along
 * the ground where a scanner or a camera stood, since a court has no ceiling. Rooms without either are found by their
 * floors: a column of cells with a floor, a ceiling and somebody's height between them is a place to stand, unless it
 * is a thing that shows outwards all around. Where an origin lies on the ground, one may stand above it.
 *
 * Of these places and of all ways to look the one with the longest free way is taken, by the mean of its rays: it
 * stands at one end of the largest room and shows it lengthwise. What is close before the eye, and holes, count against
 * it. One thread; the outcome depends on the points alone. */
#include "pack/view/inside.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/view/cells.h"

enum { across = 64, sphere = 128, azimuths = 36, window = 3, rings = 5, stand_max = 512, seen_max = 3000 };
static const double room_least = 0.85;  /* of all rays meet something */
static const double court_least = 0.8;  /* of those between the ground and 35 degrees above the horizon */
static const double rooms_least = 0.25; /* of the columns that hold something are places in a room */
static const double raised_least = 0.5; /* of the surface is seen from above where an origin is */
static const double away_least = 0.8;   /* of the surface of a thing shows away from its middle */
static const double level = 0.95, upright = 0.1, straight_most = 0.5; /* by how far normals show up; of it are so */
static const double ring_low = -0.25, ring_step = 0.125; /* tangents of the rays of a way to look */
static const double fit[2] = {58, 66};

/* Of the rays from `eye` whose sine of elevation lies in [low, high], how many meet something. Even over the sphere. */
static double enclosed(const struct spl_view_cells *cells, const double eye[3], double low, double high)
{
    int all = 0, met = 0;
    for (int k = 0; k < sphere; k++) {
        double z = low + (high - low) * (k + 0.5) / sphere, r = sqrt(1 - z * z), a = k * M_PI * (3 - sqrt(5));
        bool hit;
        spl_view_cells_look(cells, eye, (double[]){r * cos(a), r * sin(a), z}, &hit);
        all++;
        met += hit;
    }
    return (double)met / all;
}

/* Free ways of a place in all directions, and the best to look. */
struct look {
    double score, distance, azimuth, slope;
};

static struct look look_round(const struct spl_view_sample *s, const struct spl_view_cells *cells, const double eye[3])
{
    double free_way[azimuths], near[azimuths], slope[azimuths], hits[azimuths];
    struct look best = {.score = -1};
    double wanted = s->metre > 0 ? s->metre : 4 * cells->cell;
    for (int a = 0; a < azimuths; a++) {
        free_way[a] = slope[a] = hits[a] = 0;
        near[a] = INFINITY;
        for (int r = 0; r < rings; r++) {
            double t = ring_low + r * ring_step, angle = 2 * M_PI * a / azimuths, length = sqrt(1 + t * t);
            bool hit;
            double way = spl_view_cells_look(
                cells, eye, (double[]){cos(angle) / length, sin(angle) / length, t / length}, &hit);
            free_way[a] += (hit ? way : 0.3 * way) / rings;
            near[a] = fmin(near[a], hit ? way : INFINITY);
            hits[a] += hit;
            slope[a] += hit ? t : 0;
        }
    }
    for (int a = 0; a < azimuths; a++) {
        double mean = 0, nearest = INFINITY, met = 0, tilt = 0;
        for (int k = -window; k <= window; k++) {
            int at = (a + k + azimuths) % azimuths;
            mean += free_way[at] / (2 * window + 1);
            nearest = fmin(nearest, near[at]);
            met += hits[at];
            tilt += slope[at];
        }
        double share = met / (rings * (2 * window + 1));
        double score = mean * share * fmin(1, 0.3 + 0.7 * nearest / wanted);
        if (score <= 1.001 * best.score)
            continue;
        best = (struct look){score, mean, 2 * M_PI * a / azimuths, met > 0 ? tilt / met : 0};
    }
    return best;
}

/* The height of an eye over the floor: somebody's, or half a room's. */
static double eye_height(const struct spl_view_sample *s, double room)
{
    double half = 0.55 * room;
    return s->metre > 0 ? fmin(1.6 * s->metre, half) : half;
}

/* Is it seen from outside, as a thing that was scanned all around: does nearly all of it show away from its middle?
 * Where nobody knows its sides, which pack then tells by floors and ceilings (shell.c), it has neither level nor
 * upright surfaces besides, as rooms do: those in millimetres are told from things by nothing else. */
static bool is_thing(const struct spl_view_sample *s)
{
    double all = 0, away = 0, straight = 0;
    for (size_t i = 0; s->normal && i < s->count; i++) {
        const double area = (double)s->area[i], upward = fabs((double)s->normal[i][2]);
        double along = 0, square = 0;
        for (int c = 0; c < 3; c++) {
            along += (double)s->normal[i][c] * (s->at[i][c] - 0.5 * (s->low[c] + s->high[c]));
            square += (double)s->normal[i][c] * (double)s->normal[i][c];
        }
        all += square > 0 ? area : 0;
        away += along > 0 ? area : 0;
        straight += square > 0 && (upward > level || upward < upright) ? area : 0;
    }
    return away > away_least * all && (s->sides || straight < straight_most * all);
}

/* Places to stand in rooms; none where rooms are a small part of the scene. */
static size_t list_rooms(const struct spl_view_sample *s, const struct spl_view_cells *c, struct spl_view_place *places,
                         size_t most)
{
    size_t columns = 0, count = 0, rooms = 0;
    int step = 1;
    while ((size_t)(c->size[0] / step) * (size_t)(c->size[1] / step) > most)
        step++;
    for (int y = step / 2; y < c->size[1]; y += step)
        for (int x = step / 2; x < c->size[0]; x += step) {
            int from = -1, floor = -1, ceiling = -1;
            for (int z = 0; z < c->size[2]; z++) {
                if (!spl_view_cells_has(c, x, y, z))
                    continue;
                if (from >= 0 && z - from > ceiling - floor) {
                    floor = from;
                    ceiling = z;
                }
                from = z;
            }
            columns += from >= 0;
            if (ceiling - floor < 4 || (s->metre > 0 && (ceiling - floor) * c->cell < 1.8 * s->metre))
                continue;
            double room = (ceiling - floor - 1) * c->cell;
            struct spl_view_place place = {{c->low[0] + (x + 0.5) * c->cell, c->low[1] + (y + 0.5) * c->cell,
                                   c->low[2] + (floor + 1) * c->cell + eye_height(s, room)}};
            if (enclosed(c, place.eye, -1, 1) < room_least)
                continue;
            rooms++;
            if (count < most)
                places[count++] = place;
        }
    return (double)rooms >= rooms_least * (double)columns ? count : 0;
}

/* Of the places where somebody stood those that the scene lies around, or none where it does around fewer than half. */
static size_t list_stood(const struct spl_view_cells *cells, const struct spl_view_stood *stood,
                         struct spl_view_place *places)
{
    size_t inside = 0;
    for (size_t i = 0; i < stood->count; i++)
        inside += enclosed(cells, stood->places[i].eye, -0.1, 0.57) >= court_least;
    memcpy(places, stood->places, stood->count * sizeof *places);
    return 2 * inside >= stood->taken ? stood->count : 0;
}

/* How much of the sample's surface one sees from `eye`, of a part of its points. Along the walls of a corridor rays go
 * through cells of these long before they are there. */
static double seen_from(const struct spl_view_sample *s, const struct spl_view_cells *cells, const double eye[3])
{
    const size_t count = s->count < seen_max ? s->count : seen_max;
    double all = 0, seen = 0;
    for (size_t k = 0; k < count; k++) {
        const size_t i = k * s->count / count;
        double way[3], length = 0;
        bool hit;
        for (int c = 0; c < 3; c++) {
            way[c] = s->at[i][c] - eye[c];
            length += way[c] * way[c];
        }
        length = sqrt(length);
        for (int c = 0; c < 3; c++)
            way[c] /= fmax(length, DBL_MIN);
        all += (double)s->area[i];
        seen += spl_view_cells_look(cells, eye, way, &hit) > 0.5 * length - 2 * cells->cell ? (double)s->area[i] : 0;
    }
    return all > 0 ? seen / all : 0;
}

/* Above the ground where the origin of a scan is: who stands there sees most of it, around himself. */
static size_t list_raised(const struct spl_view_sample *s, const struct spl_view_cells *cells,
                          const struct spl_view_stood *stood, struct spl_view_place *places)
{
    const double high = 1.6 * (s->metre > 0 ? s->metre : 1); /* whose origin is at its foot is in metres */
    size_t count = 0;
    for (size_t i = 0; i < stood->foot_count; i++) {
        double *eye = places[count].eye;
        bool hit;
        memcpy(eye, stood->feet[i].eye, sizeof places->eye);
        eye[2] += fmin(high, 0.55 * spl_view_cells_look(cells, eye, (double[]){0, 0, 1}, &hit));
        count += enclosed(cells, eye, -0.1, 0.57) >= court_least && seen_from(s, cells, eye) >= raised_least;
    }
    return count;
}

int spl_view_from_inside(const struct spl_view_sample *s, const struct spl_view_stood *stood,
                         struct spl_default_view *view, bool *found, struct spl_error *err)
{
    struct spl_view_cells cells;
    struct spl_view_place *places = spl_alloc(stand_max, sizeof *places, err);
    struct look best = {.score = -1};
    double eye[3], target[3], arm[3];
    *found = false;
    int rc = places ? spl_view_cells_init(&cells, s, across, err) : SPL_E_NOMEM;
    if (rc) {
        free(places);
        return rc;
    }
    size_t count = list_stood(&cells, stood, places);
    if (!count && !is_thing(s))
        count = list_rooms(s, &cells, places, stand_max);
    if (!count)
        count = list_raised(s, &cells, stood, places);
    for (size_t i = 0; i < count; i++) {
        struct look look = look_round(s, &cells, places[i].eye);
        if (look.score <= best.score)
            continue;
        best = look;
        memcpy(eye, places[i].eye, sizeof eye);
        *found = true;
    }
    if (*found) {
        double slope = fmax(-0.15, fmin(0.1, best.slope));
        memcpy(arm, (double[]){cos(best.azimuth), sin(best.azimuth), slope}, sizeof arm);
        for (int c = 0; c < 3; c++)
            target[c] = eye[c] + fmax(best.distance, cells.cell) * arm[c];
        spl_view_to_world(s, eye, view->eye);
        spl_view_to_world(s, target, view->target);
        memcpy(view->fit, fit, sizeof fit);
    }
    free(cells.full);
    free(places);
    return 0;
}
