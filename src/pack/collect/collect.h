/* A collection while it is made: its tiles, what all of them must have alike, and their roots' splats as points. */
#ifndef SPL_PACK_COLLECT_COLLECT_H
#define SPL_PACK_COLLECT_COLLECT_H

#include <math.h>

#include <jansson.h>

#include <splatd/collect.h>

#include "cloud/keep.h"
#include "dataset/dataset.h"
#include "dataset/values.h"
#include "pack/points.h"
#include "pack/stage.h"
#include "pack/tree.h"
#include "pack/wires/wires.h"

struct spl_collect_tile {
    char *path;       // owned
    const char *name; /* of `path`: the file's, in its folder */
    bool in_folder;   /* it was not named itself, so it may be left out */
    uint64_t version, leaf_splats;
    struct spl_node root; /* as it has it */
    size_t begin, end; /* its root's splats among the points */
    size_t first_vertex, end_vertex; /* its root's lines among those of the wires */
    json_t *entry;     // owned; its object in META, but for "node"
};

/* An attribute as the tiles have it, and where struct spl_points keeps it. */
struct spl_collect_stream {
    char name[SPL_STREAM_TEXT_MAX], type[SPL_STREAM_TEXT_MAX], unit[SPL_STREAM_TEXT_MAX];
    double first, steps_a_unit; /* of type steps, else 0 */
    int scalar;                 /* of struct spl_points; negative: -1 - SPL_STREAM_CLASS, … */
};

enum { SPL_COLLECT_JOB_MAX = 32 };

struct spl_collect {
    const struct spl_collect_options *options;
    bool apart; /* it is written elsewhere, for spl_merge_of(): tiles lie in one folder, not the output's */
    struct spl_stage *stage;
    struct spl_collect_tile *tiles; /* by name; by place once they are grouped */
    size_t count, capacity;

    /* As the first tile has it, by name, and therefore all. */
    char *first; // owned: its name
    char unit[SPL_STREAM_TEXT_MAX];
    json_t *crs, *up; // owned; may be NULL
    double up_vector[3];
    bool has_surface;
    struct spl_collect_stream streams[SPL_STREAMS_MAX];
    struct spl_values values[SPL_STREAMS_MAX], heights; /* of all tiles' leaves, by stream */
    uint32_t stream_count;
    struct spl_keep keep;

    bool has_sides; /* of every tile */
    char job[SPL_COLLECT_JOB_MAX]; /* of all tiles, where they are parts of one; else "" */
    double bounds[2][3];
    struct spl_points points;
    struct spl_wires wires;
};

/* spl_collect() of a file that lies apart from its tiles, and is known where these are. */
int spl_collect_apart(const struct spl_collect_options *options, struct spl_error *err);

/* Fills the tiles' names from the options, sorted by name, none twice, all in the output's folder (find.c). */
int spl_collect_find(struct spl_collect *c, struct spl_error *err);

/* Takes the attributes of the first tile, or holds those of another against them (streams.c). Only names that the
 * packer writes, in its order, can be written again. */
int spl_collect_take_streams(struct spl_collect *c, const struct spl_dataset *dataset, const char *name,
                             struct spl_error *err);

/* Opens the tile, holds it against the first, and adds its root's splats to the points (read.c). 1: it is a collection
 * in a folder, and no tile; that is told. */
int spl_collect_read(struct spl_collect *c, struct spl_collect_tile *tile, struct spl_error *err);

#define SPL_COLLECT_MOST 1e15 /* of coordinates and lengths, as of a node's */

static inline bool spl_collect_is_place(const double v[3])
{
    return fabs(v[0]) <= SPL_COLLECT_MOST && fabs(v[1]) <= SPL_COLLECT_MOST && fabs(v[2]) <= SPL_COLLECT_MOST;
}

/* Adds what the tile says of its values, which c->streams are those of (values.c). */
int spl_collect_add_values(struct spl_collect *c, const struct spl_dataset_info *info, struct spl_error *err);

/* META's "tile_values"; NULL: no memory. */
json_t *spl_collect_describe_values(struct spl_collect *c);
void spl_collect_finish_values(struct spl_collect *c);

/* The part of it that reads splats (splats.c). */
int spl_collect_take_root(struct spl_collect *c, struct spl_collect_tile *tile, const struct spl_dataset *dataset,
                          struct spl_error *err);

/* Of the tile's leaves each step-th splat to the points, from number *next on, which then is that of the next tile. */
int spl_collect_take_leaves(struct spl_collect *c, const struct spl_collect_tile *tile,
                            const struct spl_dataset *dataset, uint64_t step, uint64_t *next, struct spl_error *err);

/* The view that a pack of the tiles' points finds, from an even part of their leaves' splats (sight.c). */
struct spl_default_view;
int spl_collect_find_view(const struct spl_collect *c, struct spl_default_view *view, struct spl_error *err);

/* Adds a chunk of lines of a tile whose root lies at `origin` to the wires (lines.c). */
int spl_collect_take_lines(struct spl_collect *c, const struct spl_chunk *chunk, const double origin[3],
                           const uint32_t *page, struct spl_error *err);

/* Says which of them each node has; once levels are built, which need the nodes' points (lines.c). */
int spl_collect_place_lines(struct spl_collect *c, struct spl_tree *tree, uint32_t first, uint32_t inner,
                            struct spl_error *err);

/* Sorts the tiles by place, and makes the tree: of each tile a leaf with its points below a node of its own, which lie
 * in the order of the tiles; *first is the number of the first of these nodes, *inner of the first leaf (group.c). */
int spl_collect_group(struct spl_collect *c, struct spl_tree *tree, uint32_t *first, uint32_t *inner,
                      struct spl_error *err);

/* META, once the tree has its levels; NULL: no memory (describe.c). */
json_t *spl_collect_describe(const struct spl_collect *c, const struct spl_tree *tree, uint32_t first,
                             const struct spl_default_view *view);

#endif
