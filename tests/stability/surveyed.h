/* A yard that scanners and panoramic cameras on tripods have seen: stations whose panoramas are exact, or were taken
 * elsewhere than they say, in another light, at another exposure, or while somebody stood there. Anything that goes
 * wrong ends the program. */
#ifndef STABILITY_SURVEYED_H
#define STABILITY_SURVEYED_H

#include "world.h"

enum { SURVEY_STATIONS_MAX = 100 };

struct survey_station {
    const struct spl_scene *scene; /* what stood there; borrowed */
    double position[3];            /* scene coordinates, as all of them */
    double off[3];                 /* of the panorama's pose from where it was taken */
    const double *sun;             /* unit, towards it: what it shines on is brighter; NULL: no shading, as the truth */
    struct spl_image panorama;     /* RGBA8, as spl_lens_of_panorama() has it */
};

struct survey { /* the caller's; zeroed is none; survey_finish() it */
    struct survey_station station[SURVEY_STATIONS_MAX];
    size_t count;
    double step; /* of the scanners, degrees */
    bool blind;  /* pack is not given the panoramas: maps come from the scans alone */
};

/* The scene, without a dataset: spl_scene_destroy() it. A wall in the plane y = 1 from x = -2.4 m (text) over 0
 * (masonry) to 2.4 m, 2.2 m high, on paving; before it a post of 0.16 m at (0.1, 0.2), 1.8 m high; two wires of 6 mm
 * along x at y = 0.6 m, 2.5 and 2.7 m high, before the sky; a board of text 2.8 m above (-0.8, -1.5). `somebody` stands
 * at (0.9, 0.1) or (-1.4, 0.2), or nowhere. */
extern const double survey_places[2][3]; /* where tripods stand */
enum somebody { NOBODY, SOMEBODY_RIGHT, SOMEBODY_LEFT };
struct spl_scene *yard_create(enum somebody somebody);

/* Adds a station whose panorama is `width` pixels wide. */
void survey_add(struct survey *survey, const struct spl_scene *scene, const double position[3], const double *sun,
                uint32_t width);
/* A copy of `from` at the end of `survey`. */
void survey_copy(struct survey *survey, const struct survey *from, size_t index);
void survey_finish(struct survey *survey);

/* The yard with nobody in it, seen from two stations by exact panoramas; its cameras are places to look from. */
void world_init_yard(struct world *world);

/* Scans from each station, with the exact colours of what was lit so, packed as one PTX with maps. `truth` is the
 * world's from then on. */
void world_init_surveyed(struct world *world, struct spl_scene *truth, const struct survey *survey);

#endif
