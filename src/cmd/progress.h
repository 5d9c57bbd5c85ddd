/* How long-running commands show their progress on stderr: one line that is rewritten on a terminal, one line when a
 * stage starts, one every ten seconds and one when it ends otherwise. Owned by the command's thread. */
#ifndef SPL_CMD_PROGRESS_H
#define SPL_CMD_PROGRESS_H

#include <splatd/pack.h>

struct spl_cmd_progress { /* zero before use */
    char stage[128];      /* "" before the first report */
    const char *unit;     /* of done; NULL: it is not shown */
    uint64_t done;
    uint64_t start_ns, said_ns;
};

/* A progress callback; `context` is a struct spl_cmd_progress. */
void spl_cmd_progress(void *context, const struct spl_progress *progress);

/* Makes room on a terminal for a line that is printed while a stage goes on. */
void spl_cmd_progress_clear(void);

/* Ends the last stage's line; call it once the work is over, before anything else is printed. */
void spl_cmd_progress_finish(struct spl_cmd_progress *state);

#endif
