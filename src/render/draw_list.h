/* What one tile of a frame draws: chunks, and their splats in runs of SPL_RUN_SPLATS, and panels of
 * SPL_RUN_PANELS, as the kernels take them. Owned by the renderer; its arrays are reused from tile to tile. */
#ifndef SPL_RENDER_DRAW_LIST_H
#define SPL_RENDER_DRAW_LIST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "dataset/format.h"
#include "shared.h"

/* For the halves of what is drawn a panel is so many splats: about as much work. */
enum { SPL_PANEL_WORTH = 32 };

/* Work is counted in samples that are looked at in a pass, at most. A batch has so much, or a single chunk. */
#define SPL_BATCH_WORK ((uint64_t)1 << 25)
/* What a step of a frame has at most, whoever draws it: far fewer batches than there are parameters for. */
#define SPL_STEP_WORK_MOST (128 * SPL_BATCH_WORK)

/* What a chunk is listed for. A chunk of which some splats are soft is listed for all three. */
enum spl_draw_role {
    SPL_ROLE_SOLID, /* what the method draws */
    SPL_ROLE_SOFT,  /* what is soft, for whoever draws that: splats, or the cells of panels and meshes */
    SPL_ROLE_MARK,  /* once for all windows: its marks are made; `texture` is where its tests begin (marks.h) */
};

/* What one kernel works off. The front phase is the nearer half of the splats, whose depth occludes chunks of the back
 * phase. */
struct spl_draw_key {
    uint32_t page;
    uint8_t kind;   /* enum spl_chunk_kind */
    uint8_t planes; /* of atoms; 0 = no textures */
    bool smooth;    /* texels are interpolated, of sums */
    bool apart;     /* chunks with clip lines, or linear splats that are not drawn */
    bool back;
    bool marked;    /* some are soft, as the marks say: solid ones skip them, soft ones draw them */
    bool cells;     /* panels and meshes whose cells are drawn, whatever the view says */
    uint8_t role;   /* enum spl_draw_role */
    uint16_t trims; /* the station whose map trims them, plus 1; 0 = none does */
    uint16_t cut;   /* bit per term of the view's clip whose shape cuts them; solid ones alone */
};

/* Draw-list entries of one key: all of them where they are not too much work. */
struct spl_draw_batch {
    struct spl_draw_key key;
    uint64_t work; /* at most, of a pass */
    uint32_t first_entry, entries;
    uint32_t first_round, round_entries; /* a round draws so many entries, the last the rest */
};

/* Cells of the image that take colours from the map of a station. */
struct spl_draw_map {
    uint32_t station, first_entry, cells;
};

/* What samples of chunks that shapes cut are asked of: the terms' bits, and where it is among the tests. */
struct spl_draw_cut {
    uint32_t cut, word, words; /* how many */
};

struct spl_draw_list {
    struct spl_draw_chunk *chunks;   /* visible chunks: solid ones roughly front to back, then soft ones by first_id, so
                                        that what is counted along them keeps the order of ids, then those to mark */
    struct spl_chunk_bounds *bounds; /* parallel to chunks */
    uint32_t *entries;               /* chunk index << SPL_RUN_BITS | run, batch after batch; then column | row << 16
                                        of cells, map after map */
    struct spl_draw_batch *batches;  /* in the order in which their pages were first met */
    struct spl_draw_map *maps;       /* by rising station */
    size_t first_back_chunk;         /* chunks from here on are of the back phase */
    size_t first_soft_chunk;         /* and from here on of SPL_ROLE_SOFT */
    size_t first_mark_chunk;         /* and from here on of SPL_ROLE_MARK */
    size_t chunk_count, entry_count, batch_count, map_count;
    size_t chunk_capacity, entry_capacity, batch_capacity, map_capacity;
    struct spl_draw_key *key_of_chunk; /* chunk_count, scratch */
    uint64_t *work_of_chunk;           /* the same */
    uint64_t drawn[SPL_CHUNK_KINDS];   /* splats, pieces of lines, panels, meshes; of the latter two those whose cells
                                          are drawn one by one, too */
    uint64_t listed_splats;            /* solid splats and panels, once for every window that they are drawn
                                          in; a panel counts as SPL_PANEL_WORTH */
    uint32_t nodes;                    /* that the chunks came from */
    uint64_t sample_splats;            /* upper bound of the splats that reach any one sample */
    uint64_t sample_panels;            /* the same of panels that are drawn as such */
    uint64_t mark_words;               /* of the buffer of marks, whose first SPL_MARKS_NONE are nobody's */
    uint32_t *tests;                   /* what marks are made of, see marks.h: words */
    size_t test_count, test_capacity;
    uint32_t test_kinds;               /* bit per SPL_TEST_NUMBERS … and SPL_TESTS_HAVE_CLIP …: what is among them */
    struct spl_draw_cut *cuts;         /* each set of terms that cuts any chunk */
    size_t cut_count, cut_capacity;
    uint32_t cut_kinds;                /* SPL_CUT_* of all of them */
    bool complete;                     /* false: a coarser node stood in for pages that are not resident */
};

/* Empties the list and keeps its memory. */
void spl_draw_list_clear(struct spl_draw_list *list);

/* Where a chunk comes from. */
struct spl_draw_origin {
    uint32_t page, kind; /* enum spl_chunk_kind; `count` are vertices of lines, panels, and meshes */
    uint16_t trims;      /* as in spl_draw_key */
    bool lined;          /* its linear splats are not drawn: lines stand for them */
    bool cells;          /* as in spl_draw_key */
    uint8_t role;        /* enum spl_draw_role */
    uint16_t cut;        /* as in spl_draw_key */
};

/* Appends a chunk whose kernels look at `looks` samples at most for each of its splats, vertices, panels or meshes.
 * SPL_E_NOMEM; SPL_E_LIMIT above 2^28 entries. */
int spl_draw_list_add(struct spl_draw_list *list, const struct spl_draw_origin *origin,
                      const struct spl_draw_chunk *chunk, const struct spl_chunk_bounds *bounds, uint64_t looks,
                      struct spl_error *err);
/* Appends the chunks of a list that has neither maps nor tests and was not laid out, with what it counted. */
int spl_draw_list_append(struct spl_draw_list *list, const struct spl_draw_list *more, struct spl_error *err);

/* Appends `count` words to the tests; *first is where they begin. SPL_E_NOMEM. */
int spl_draw_list_add_tests(struct spl_draw_list *list, const uint32_t *words, uint32_t count, uint32_t *first,
                            struct spl_error *err);

/* Where it is among the tests what samples that the terms of `cut` cut are asked of; added where it is not there. */
const struct spl_draw_cut *spl_draw_list_find_cut(const struct spl_draw_list *list, uint32_t cut); /* NULL = nowhere */
int spl_draw_list_add_cut(struct spl_draw_list *list, uint32_t cut, const uint32_t *words, uint32_t count,
                          struct spl_error *err);

/* Lays out entries and batches of all chunks added: solid ones in the order in which they were, soft ones by first_id
 * and, of one id, in that order, and those to mark. SPL_E_NOMEM. */
int spl_draw_list_lay_out(struct spl_draw_list *list, struct spl_error *err);

/* Then: appends a station's map, of a higher station than the last, with room for `cells` entries behind the others,
 * which the caller appends. SPL_E_NOMEM, SPL_E_LIMIT. */
int spl_draw_list_add_map(struct spl_draw_list *list, uint32_t station, uint32_t cells, struct spl_error *err);

/* Entries of a round at most, all 1 and more: of splats; where their texels are interpolated; of lines; of panels and
 * meshes. */
struct spl_draw_rounds {
    uint64_t splats, summed, lines, panels;
};

/* Cuts every batch into rounds, each a dispatch with parameters of its own, and returns how many there are. All passes
 * share them, so that a page takes at most one for each of its kinds of chunks, whatever layers a view has. */
uint64_t spl_draw_list_count_rounds(struct spl_draw_list *list, const struct spl_draw_rounds *most);

/* Is any chunk of `kind` (enum spl_chunk_kind) listed for `role`? Of a list that is laid out. */
bool spl_draw_list_has(const struct spl_draw_list *list, uint32_t kind, uint32_t role);

void spl_draw_list_finish(struct spl_draw_list *list);

#endif
