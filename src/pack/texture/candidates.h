/* For each splat the photographs that show it best, and the colour that it has in each. */
#ifndef SPL_PACK_TEXTURE_CANDIDATES_H
#define SPL_PACK_TEXTURE_CANDIDATES_H

#include "pack/texture/photo.h"
#include "pack/texture/splats.h"
#include "sparse/texture_file.h"

#define SPL_NO_PHOTO SPL_TEXTURE_NO_PHOTO
enum { SPL_CANDIDATES_MAX = 4, SPL_PHOTOS_TAKEN_MAX = 65000 };

struct spl_candidate {
    uint16_t photo; /* SPL_NO_PHOTO: none, and none behind it */
    uint16_t score; /* spl_candidate_weight() */
    uint8_t color[3];
    uint8_t place[2]; /* in the photograph: 0..255 across and down */
};

/* `depth` candidates a splat, best first; entry [splat * depth + i]. */
struct spl_candidates {
    struct spl_candidate *list; // owned
    uint32_t depth;
    uint64_t splats;
};

/* What a score stands for: pixels a metre, less what speaks against the photograph. */
double spl_candidate_weight(uint16_t score);
uint16_t spl_candidate_score(double weight);

/* All empty; `depth` 1..SPL_CANDIDATES_MAX. */
int spl_candidates_init(struct spl_candidates *candidates, uint64_t splats, uint32_t depth, struct spl_error *err);
void spl_candidates_finish(struct spl_candidates *candidates);

/* Keeps `candidate` when it is among the splat's best; the order of calls does not matter. */
void spl_candidates_add(struct spl_candidates *candidates, uint64_t splat, const struct spl_candidate *candidate);

/* Adds photograph `index` for all splats that it shows; returns how many those are. Parallel; the stage counts chunks.
 */
uint64_t spl_candidates_look(struct spl_candidates *candidates, const struct spl_splats *splats,
                             const struct spl_photo *photo, uint16_t index, struct spl_stage *stage);

/* How one photograph shows one splat: the score's weight, 0 = not at all; and the colour of its disc and its place. */
double spl_candidate_judge(const struct spl_photo *photo, const struct spl_world_splat *splat,
                           struct spl_candidate *candidate);

/* Metres in front of the splat that count as its own surface there: its radius, and what a sample of the depth map
 * spans on its slant. */
double spl_candidate_slack(const struct spl_photo *photo, const struct spl_world_splat *splat);

#endif
