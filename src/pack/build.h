/* Scans into datasets: what spl_pack() does before photographs, maps and pruning. */
#ifndef SPL_PACK_BUILD_H
#define SPL_PACK_BUILD_H

#include <splatd/pack.h>

#include "pack/inputs.h"
#include "pack/passes.h"
#include "pack/stage.h"

struct spl_part;

struct spl_build_outputs {
    const char *dataset; /* path */
    const char *points;  /* path of the same without panels, where there are some; NULL = not wanted */
    bool has_points;     /* that one was written */
    bool empty;          /* of a part: it has no point, and nothing is written */
    char *drawing;       /* of options->export_primitives, owned by the caller, free(); NULL = none */
    size_t drawing_length;
    struct spl_drawing_report drawn; /* what it holds */
};

/* Writes the datasets and makes the drawing, which the caller writes once all is done. `later` (NULL = nothing) is what
 * comes after: where it saw the scan from, how long it will take. `part` (job/part.h; NULL = all of the scans) is what
 * is packed of the inputs, which are its job's then. `report` may be NULL. Nothing of the scan is held
 * afterwards. Blocks, as spl_pack(); its errors. */
int spl_build(const struct spl_pack_options *options, struct spl_inputs *inputs, const struct spl_part *part,
              const struct spl_passes *later, struct spl_build_outputs *out, struct spl_stage *stage,
              struct spl_pack_report *report, struct spl_error *err);

#endif
