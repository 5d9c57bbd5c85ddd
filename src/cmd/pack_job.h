/* splatd pack --plan, --part and --join: one dataset by many processes; --parts: the same by one (pack_parts.c). */
#ifndef SPL_CMD_PACK_JOB_H
#define SPL_CMD_PACK_JOB_H

#include "cmd/pack.h"

/* Whether one of the three is asked for. */
bool spl_cmd_pack_is_job(const struct spl_cmd_pack *arguments);

/* What contradicts itself then; `words` are the options as they were given, `operands` how many there are beside. */
int spl_cmd_pack_check_job(const struct spl_cmd_pack *arguments, char *const *words, int word_count, int operands,
                           struct spl_error *err);

/* Has temporary files removed where a signal ends the command: the output's own, and the collection's that it is merged
 * from. */
void spl_cmd_pack_clean_up_on_signals(const char *output);

/* What the options say of the dataset that parts become. */
struct spl_collect_options spl_cmd_pack_joined(const struct spl_cmd_pack *arguments, const char *output);

/* --parts: plans, packs each part that is not there, joins and merges them. */
int spl_cmd_pack_run_parts(struct spl_cmd_pack *arguments, struct spl_cmd_pack_listener *listener,
                           struct spl_error *err);

/* Does it; what pack's options say is in *arguments. */
int spl_cmd_pack_run_job(struct spl_cmd_pack *arguments, struct spl_cmd_pack_listener *listener, struct spl_error *err);

#endif
