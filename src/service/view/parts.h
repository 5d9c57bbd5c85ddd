/* A view whose frame several devices draw together: its job, the whole, stays with its parts, a job for each of the
 * devices, which take pieces of the frame as they have drawn their last (render/spread.h). The part that drew the last
 * piece is encoded like any job and has the whole's bytes; the others come back with nothing. A part whose device was
 * lost leaves what it had to the others, and only where none is left to a new one, once. The loop's thread. */
#ifndef SPL_SERVICE_PARTS_H
#define SPL_SERVICE_PARTS_H

#include "service/view/pipeline.h"

/* From so many samples on it pays: below, what each device does for itself is more than what it spares. */
#define SPL_PARTS_SAMPLES ((uint64_t)1280 * 720 + 1)

/* Can it be drawn in parts, and is it large enough? */
bool spl_parts_can(const struct spl_job *job);

/* Makes a whole of a job, for so many devices. SPL_E_NOMEM. undo() makes it a job again, where no part is inside. */
int spl_parts_begin(struct spl_job *job, unsigned of, struct spl_error *err);
void spl_parts_undo(struct spl_job *job);

/* Gives its part `number` to a device; false: that has no room, or there is no memory. */
bool spl_parts_submit(struct spl_job *whole, unsigned number, struct spl_pipeline *pipeline);

enum spl_parts_state {
    SPL_PARTS_INSIDE, /* others go on */
    SPL_PARTS_BACK,   /* the whole is the caller's again, with its bytes or `err`; parts may be inside still */
    SPL_PARTS_LEFT,   /* none is inside, and pieces are left that a lost device had: the caller submits `number` again,
                         or gives the whole back itself, by spl_parts_give_back() */
};

/* Takes a part that has come back. *whole: what it was of, which may be gone where others go on. */
enum spl_parts_state spl_parts_take(struct spl_job *part, struct spl_job **whole, unsigned *number);
void spl_parts_give_back(struct spl_job *whole);

#endif
