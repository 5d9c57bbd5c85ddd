/* Which splats of a dataset are soft, and which are drawn at all, as a view's terms say: of the whole chunk where its
 * header and its box tell, else as tests that a kernel makes of each splat (shaders/soft_mark.comp), and of what shapes
 * cut also of each sample (shaders/common/cut.glsl). Pure functions; any thread. */
#ifndef SPL_RENDER_MARKS_H
#define SPL_RENDER_MARKS_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/camera.h>
#include <splatd/dataset.h>
#include <splatd/soft.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "render/frustum.h"
#include "shared.h"

/* A term whose ends are values of its dataset. */
struct spl_marks_term {
    enum spl_term_measure measure;
    int stream; /* of attributes; -1 = a shape */
    double least, most;
    bool with_least, with_most;
    bool complete; /* every splat of the dataset has a value: no code says that there is none */
    double blend_least, blend_most; /* values behind the ends on which W of eq. 22 rises to 1; 0 = there is none */
    bool outside;
    enum spl_term_joint joint;
    uint32_t mixed; /* of clips, where its condition has attributes and shapes: which of such it is, from 1 on */
    double shape[9];
    uint32_t first_corner, corners;
    /* Of streams of whole numbers and steps: the numbers (base + code) that are soft. */
    bool any;
    uint32_t low, span;
    float share_low, share_high, share_step; /* W at `low` and at low + span; of a number more; see marks.c */
    float share_step_high;
    uint32_t shift;
};

struct spl_marks {
    uint32_t count;
    struct spl_marks_term terms[SPL_TERMS_MAX];
    double corners[SPL_TERMS_CORNERS_MAX][2];
    const struct spl_stream *streams; /* the dataset's */
    double middle[3], reach;          /* a sphere that holds it; 0, 0 = not known */
};

/* The stream of attribute `name`, of a type that we know; -1 = none. refuse_name() says so, and what there is: `common`
 * is what works with any dataset, `hint` what may be meant, or NULL. */
int spl_marks_find_stream(const struct spl_dataset_info *info, const char *name);
int spl_marks_refuse_name(const struct spl_dataset_info *info, const char *name, const char *field, const char *common,
                          const char *hint, struct spl_error *err);
/* That a share q of the splats are below. */
double spl_marks_value_at(const struct spl_stream_values *values, double q);

/* Ends of a view's terms as values of a dataset: quantiles, and shares of the 99th percentile, are looked up.
 * SPL_E_INPUT (field "soft") where the dataset has no such attribute, or was packed before quantiles were kept. `ends`
 * has room for SPL_TERMS_MAX; may be NULL, to check only. */
int spl_marks_resolve(const struct spl_soft_params *soft, const struct spl_dataset_info *info,
                      struct spl_marks_term *ends, struct spl_error *err);

/* Has the dataset what a view's terms, soft and clip, speak of? SPL_E_INPUT. */
struct spl_view;
int spl_marks_check_view(const struct spl_view *view, const struct spl_dataset_info *info, struct spl_error *err);

/* The terms of a view of a dataset, which is borrowed: what is soft; what is drawn at all. Errors as of resolve, of
 * field "clip" of the second. */
int spl_marks_init(struct spl_marks *marks, const struct spl_soft_params *soft, const struct spl_dataset *dataset,
                   struct spl_error *err);
int spl_marks_init_clip(struct spl_marks *marks, const struct spl_terms *clip, const struct spl_dataset *dataset,
                        struct spl_error *err);

/* Part of it: what terms that were resolved take of the numbers of marks->streams. */
void spl_marks_find_numbers(struct spl_marks *marks);

/* Their shapes as a camera sees them, as words for its tests; 0 words where there is none. */
enum {
    SPL_MARKS_SHAPE_WORDS = SPL_SHAPE_WORDS,
    SPL_MARKS_SHAPES_MAX = SPL_MARKS_SHAPE_WORDS * SPL_TERMS_MAX + 2 * SPL_TERMS_CORNERS_MAX
};
struct spl_marks_shape {
    double rows[12]; /* view space -> of the shape: three rows of (x, y, z, 1) */
    double half[3];  /* of a box; of a polygon [0] how far its corners go, [2] its heights */
    double base;     /* of a coordinate: what distances are counted from */
    uint32_t word;   /* where its words are among the tests */
};
struct spl_marks_view {
    struct spl_marks_shape shapes[SPL_TERMS_MAX]; /* by term */
    double corners[SPL_TERMS_CORNERS_MAX][2];     /* from the middle of their polygon */
};
uint32_t spl_marks_see(const struct spl_marks *marks, const struct spl_camera *camera, uint32_t first_word,
                       struct spl_marks_view *view, uint32_t words[SPL_MARKS_SHAPES_MAX]);

/* What of a chunk is soft. Its tests are words: how many there are, and SPL_TEST_WORDS of each (shared.h); 0 where no
 * marks are needed. */
enum { SPL_MARKS_TESTS_MAX = 1 + SPL_TEST_WORDS * SPL_TERMS_MAX };
struct spl_marks_chunk {
    bool solid, soft; /* some may be */
    bool by_cells;    /* of panels: their cells differ */
    uint32_t test_words;
    uint32_t tests[SPL_MARKS_TESTS_MAX];
};

/* Of chunk `index` of `tables`, whose splats lie within `box`, view space. Vertices of lines have no attributes: they
 * are solid. */
void spl_marks_judge(const struct spl_marks *marks, const struct spl_marks_view *view, const struct spl_tables *tables,
                     uint32_t index, const struct spl_view_box *box, struct spl_marks_chunk *out);

/* What one term says of a chunk; blended: all are in it, of different W. Of SOME and BLENDED `test` is filled in. */
enum spl_marks_verdict { SPL_VERDICT_NONE, SPL_VERDICT_SOME, SPL_VERDICT_BLENDED, SPL_VERDICT_ALL };
enum spl_marks_verdict spl_marks_judge_term(const struct spl_marks *marks, uint32_t term,
                                            const struct spl_marks_view *view, const struct spl_tables *tables,
                                            uint32_t index, const struct spl_view_box *box,
                                            uint32_t test[SPL_TEST_WORDS]);
/* The same of shapes alone, without a chunk. */
enum spl_marks_verdict spl_marks_judge_shape(const struct spl_marks *marks, uint32_t term,
                                             const struct spl_marks_view *view, const struct spl_view_box *box,
                                             uint32_t test[SPL_TEST_WORDS]);

/* What a view's clip says of a chunk (marks_clip.c). */
struct spl_clip_chunk {
    bool dropped;     /* nothing of it is drawn */
    bool of_lines;    /* lines may stand for its linear splats: attributes drop none of them */
    uint32_t cut;     /* bit per term: shapes that its samples are asked of, after its attributes */
    uint32_t at_center, by_value; /* how many tests there are of splats by their centres, and by attributes alone */
    uint32_t center_tests[SPL_TEST_WORDS * SPL_TERMS_MAX], value_tests[SPL_TEST_WORDS * SPL_TERMS_MAX];
};

/* Of chunk `index`, all of which lies within `box`, view space: centres, or discs and panels where these are cut.
 * Vertices of lines have no attributes. */
void spl_clip_judge(const struct spl_marks *clip, const struct spl_marks_view *view, const struct spl_tables *tables,
                    uint32_t index, const struct spl_view_box *box, struct spl_clip_chunk *out);

/* Is nothing within `box` drawn, whatever attributes it has? */
bool spl_clip_drops_box(const struct spl_marks *clip, const struct spl_marks_view *view,
                        const struct spl_view_box *box);

/* What samples are asked where the shapes of `cut` are open: words, and how many. */
enum { SPL_CLIP_CUT_WORDS = 1 + 2 * SPL_TERMS_MAX };
uint32_t spl_clip_write_cut(const struct spl_marks *clip, const struct spl_marks_view *view, uint32_t cut,
                            uint32_t words[SPL_CLIP_CUT_WORDS]);
/* Bits of SPL_CUT_* that its kernels need. */
uint32_t spl_clip_get_kinds(const struct spl_marks *clip, uint32_t cut);

#endif
