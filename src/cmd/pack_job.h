/* splatd pack --plan, --part and --join: one dataset by many processes; --parts: the same by one (pack_parts.c). */
#ifndef SPL_CMD_PACK_JOB_H
#define SPL_CMD_PACK_JOB_H

#include "cmd/pack.h"

/* Whether one of the three is asked for. */
bool spl_cmd_pack_is_job(const struct spl_cmd_pack *arguments);

/* What contradicts itself then; `words` are the options as they were given, `operands` how many there are beside. */
int spl_cmd_pack_check_job(const struct spl_cmd_pack *arguments, char *const *words, int word_count, int operands,
                           struct spl_error *err);

struct spl_job;

/* Makes the collection `output` of the job's parts, and one file of that, a->pack.output. */
int spl_cmd_pack_join(const struct spl_cmd_pack *arguments, const struct spl_job *job, const char *output,
                      struct spl_error *err);
int spl_cmd_pack_merge(const struct spl_cmd_pack *arguments, const struct spl_job *job, const char *collection,
                       struct spl_error *err);

/* --parts: plans, packs each part that is not there, joins and merges them. */
int spl_cmd_pack_run_parts(struct spl_cmd_pack *arguments, struct spl_cmd_pack_listener *listener,
                           struct spl_error *err);

/* Does it; what pack's options say is in *arguments. */
int spl_cmd_pack_run_job(struct spl_cmd_pack *arguments, struct spl_cmd_pack_listener *listener, struct spl_error *err);

#endif
