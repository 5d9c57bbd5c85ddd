/* What the parts of the photographs' pass share: pass.c finds what each splat takes its colour from, textured.c makes
 * textures of it. */
#ifndef SPL_PACK_TEXTURE_PASS_PARTS_H
#define SPL_PACK_TEXTURE_PASS_PARTS_H

#include <splatd/render.h>

#include "pack/texture/pass.h"
#include "pack/texture/textures.h"

/* Owned by the thread that owns the renderer. */
struct spl_photo_pass {
    const struct spl_photo_options *options;
    const struct spl_view_list *list;
    struct spl_photo_report *report;
    struct spl_stage *stage;
    struct spl_splats splats;
    struct spl_candidates candidates;
    struct spl_chosen chosen;
    struct spl_gain *gains;
    uint8_t (*own)[3];    /* NULL: the scan has no colours */
    uint8_t (*judged)[3]; /* own, beside which photographs are judged; NULL: all of it is grey, as infrared is */
    struct spl_renderer *renderer;
    bool *dropped;        /* by photograph */
    uint64_t *uses;       /* the same: splats that chose it */
    json_t *color_source; /* for META */
};

/* Resamples, codes and writes `output`. Afterwards the candidates are gone: training may hold as much as they did.
 * Blocks. */
int spl_photo_pass_write_textured(struct spl_photo_pass *pass, const struct spl_dataset *dataset, const char *output,
                                  struct spl_error *err);

#endif
