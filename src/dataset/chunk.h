/* Quantisation of one chunk, both ways. The shader's decode (shaders/common/splat.glsl) is the third copy of the same
 * arithmetic: tests/gpu compares all of them. Pure functions; any thread. */
#ifndef SPL_DATASET_CHUNK_H
#define SPL_DATASET_CHUNK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/dataset.h>

#include "dataset/format.h"

/* A line that a disc ends at, in its plane. */
struct spl_clip {
    float direction[3]; /* world, across the line and away from the centre, unit; all 0 = no line */
    float offset;       /* of the line from the centre, radii, 0..1 */
};

/* A splat relative to its node's origin. */
struct spl_splat {
    float position[3]; /* metres from the node's origin; the encoder takes them as doubles, see below */
    float normal[3];   /* unit */
    float radius;      /* metres, > 0 */
    uint8_t color[3];  /* sRGB */
    bool linear;       /* lies on a wire, a pole or a cable; a vertex of a line: a piece goes to the next */
    struct spl_clip clip;
};

struct spl_chunk_options {
    double position_error; /* mean error as a share of the splat radius; default 0.016 */
    double normal_error;   /* mean error, radians; default 1 degree */
    double radius_error;   /* largest relative error; default 0.05 */
    uint32_t kind;         /* enum spl_chunk_kind, which has what of these and of a splat's fields it knows */
    double width;          /* of lines: what they are thick, metres; 0 = not known */
};

struct spl_chunk_error { /* what quantisation did to one chunk, sums over its splats */
    double position_over_radius, normal_radians;
};

/* Words that `chunk`'s own streams take, without optional attributes, which follow; the place of one stream is the sum
 * of those before it. Here and below, what a chunk does by its kind is a row of codec.h. */
uint32_t spl_chunk_words(const struct spl_chunk *chunk);
uint32_t spl_chunk_geometry_width(const struct spl_chunk *chunk); /* bits a splat */
uint32_t spl_chunk_color_width(const struct spl_chunk *chunk);
uint32_t spl_chunk_color_word(const struct spl_chunk *chunk); /* offset in the page */
uint32_t spl_chunk_clip_word(const struct spl_chunk *chunk);

/* Straight pieces between the vertices of a chunk of lines, as its header says; 0 of discs. */
uint32_t spl_chunk_count_pieces(const struct spl_chunk *chunk);

/* How thick what the lines of a chunk stand for is, metres, 0 where that is not known, and its code: 1 + 16 log2(width
 * / 0.25 mm), rounded, within 1 and 255 (15 m). */
double spl_chunk_line_width(const struct spl_chunk *chunk);
uint32_t spl_line_width_code(double width);

/* Adds the chunk's bits to each attribute's; header and padding go to SPL_ATTRIBUTE_CHUNK (a dataset adds nodes). */
void spl_chunk_add_bits(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT]);

/* How many splats are linear; `mask` is the chunk's SPL_LINEAR_WORDS words before its colours. Of discs. */
uint32_t spl_chunk_count_linear(const struct spl_chunk *chunk, const uint32_t *mask);

/* Largest number of words a chunk can need. */
enum {
    SPL_CLIP_WORDS_MAX = SPL_LINEAR_WORDS + SPL_CHUNK_SPLATS * SPL_CLIP_BITS / 32,
    SPL_DISC_CHUNK_WORDS_MAX = (128 * (3 * 24 + 3 * 12 + 3 * 9)) / 32 + SPL_LINEAR_WORDS + 4 + SPL_CLIP_WORDS_MAX,
    SPL_PANEL_CHUNK_WORDS_MAX = SPL_PANELS_MAX * SPL_PANEL_WORDS_MAX,
    SPL_MESH_CHUNK_WORDS_MAX = SPL_PANELS_MAX * SPL_MESH_WORDS_MAX, /* more than of any other kind */
    SPL_CHUNK_WORDS_MAX =
        SPL_MESH_CHUNK_WORDS_MAX > SPL_DISC_CHUNK_WORDS_MAX ? SPL_MESH_CHUNK_WORDS_MAX : SPL_DISC_CHUNK_WORDS_MAX
};

/* Chooses widths and codes for `count` splats (1..128; of lines 2..128 vertices, of which the last is joined to none
 * and of two in a row one is) whose order is kept, writes `words` (room for SPL_CHUNK_WORDS_MAX) and everything in
 * *chunk but geometry_word and first_id, which it zeroes. Positions are doubles in `position` (count × 3, relative to
 * the node's origin); splats[].position is not read. `error` may be NULL. Returns the number of words. Every splat must
 * be finite with radius > 0 (an assertion: the packer has cleaned them). The bounds hold for the chunk's means (radius:
 * for each splat) except where 24 bits an axis, 12 bits a normal's coordinate or radius, or the floats that decoding
 * adds up cannot hold them; *error tells. */
uint32_t spl_chunk_encode(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                          const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                          struct spl_chunk_error *error);

/* The same chunk with other colours, `color[i]` for splat i: its geometry and clip lines are copied as they lie in
 * `page`, bit for bit. Writes `words` (room for SPL_CHUNK_WORDS_MAX) and *out, whose geometry_word becomes 0.
 * Returns the number of words. `chunk` must be one that opening has checked. */
uint32_t spl_chunk_recolor(const struct spl_chunk *chunk, const uint32_t *page, const uint8_t (*color)[3],
                           struct spl_chunk *out, uint32_t *words);

/* Decodes splat `i` (< chunk->count) of a chunk whose page starts at `page`. Same arithmetic as the shader, in floats:
 * position = origin + step * code. */
void spl_chunk_decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_splat *splat);

#endif
