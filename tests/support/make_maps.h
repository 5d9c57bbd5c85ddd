/* Maps of stations for tests: rows, words and stations of chunks that are right in form and mean nothing. Anything that
 * goes wrong ends the test program. */
#ifndef TEST_SUPPORT_MAKE_MAPS_H
#define TEST_SUPPORT_MAKE_MAPS_H

#include "dataset/dataset.h"

enum { make_maps_most = 8 };

struct make_maps {
    struct spl_map_row rows[make_maps_most];
    uint32_t *words[make_maps_most], count;
    struct spl_chunk_stations *stations; /* by chunk of the dataset */
    uint32_t asked;                      /* maps that were asked for */
    size_t page_bytes;                   /* of the file that is made; 0 = the writer's */
};

/* `count` (up to make_maps_most) stations over the dataset, which keeps all tables, with maps of different sides. */
struct make_maps make_maps(const struct spl_dataset *dataset, uint32_t count, uint32_t seed);
void free_maps(struct make_maps *maps);

/* For struct spl_rewrite; the context is the struct make_maps. Maps must be asked for in their order. */
int make_maps_get(void *context, uint32_t index, const uint32_t **words, struct spl_error *err);

/* Writes `path`: `from` with these maps. */
void make_mapped_file(const struct spl_dataset *from, struct make_maps *maps, const char *path);

#endif
