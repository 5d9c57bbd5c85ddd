/* The temporary files of what a command makes: gone too where a signal ends it. */
#ifndef SPL_CMD_UNFINISHED_H
#define SPL_CMD_UNFINISHED_H

/* Has the file at `path` removed where SIGINT, SIGTERM, SIGHUP or SIGPIPE ends the command; the signal still ends it.
 * Of at most 5 files, named before the work begins; one with a name too long for a path is left out. Copies `path`.
 * Call from the main thread alone. */
void spl_cmd_remove_unfinished(const char *path);

#endif
