/* Subcommands: arguments in, one library call, exit code out (0 done, 1 failed, 2 bad input or usage). Data goes to
 * stdout, messages to stderr. */
#ifndef SPL_CMD_CMD_H
#define SPL_CMD_CMD_H

#include "base/error.h"

#define COMMAND(name, help) int spl_cmd_##name(int argc, char **argv);
#include "cmd/commands.def"
#undef COMMAND

/* Prints the error to stderr and returns its exit code. */
int spl_cmd_fail(const struct spl_error *err);

/* Say on stderr what a collection that was written holds, or the one file of it (collect.c). */
int spl_cmd_print_collection(const char *output, struct spl_error *err);
int spl_cmd_print_merged(const char *output, struct spl_error *err);

#endif
