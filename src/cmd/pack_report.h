/* What splatd pack says: its library's callbacks, whose context is a struct spl_cmd_pack_listener, and the summary.
 * Owned by the command's thread. */
#ifndef SPL_CMD_PACK_REPORT_H
#define SPL_CMD_PACK_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/pack.h>

#include "cmd/progress.h"

/* What was left out is said at once, while a user may still stop, and again when all is done. */
struct spl_cmd_pack_listener {        /* zero before use */
    struct spl_cmd_progress progress; /* first: it is the context of what knows nothing else */
    char **left_out;                  /* why, of each */
    size_t count, capacity;
};

void spl_cmd_pack_say_trained(void *context, uint32_t epoch, double seconds, double psnr, double atoms_per_splat,
                              uint32_t atoms);
void spl_cmd_pack_say_warning(void *context, const char *text);
void spl_cmd_pack_say_note(void *context, const char *text);
void spl_cmd_pack_name_refused(void *context, const struct spl_error *why);
void spl_cmd_pack_say_left_out(void *context, const struct spl_error *why);

/* Says the list again where `say`, and frees it. */
void spl_cmd_pack_finish_left_out(struct spl_cmd_pack_listener *listener, bool say);

/* `drawing`: the file of --export-primitives; may be NULL. */
void spl_cmd_pack_print(const char *output, const char *drawing, const struct spl_pack_report *report);

#endif
