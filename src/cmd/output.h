/* What a command makes, in one piece: a file of the whole result or none. */
#ifndef SPL_CMD_OUTPUT_H
#define SPL_CMD_OUTPUT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/error.h"

/* Writes `length` bytes to `path`, "-" being stdout. A file is written beside its place and renamed into it, so that a
 * failure leaves what was there before. Devices and pipes are written to directly. */
int spl_cmd_write_output(const char *path, const void *bytes, size_t length, struct spl_error *err);

/* A text of a file's, as spl_text_show() has it, in at least `width` characters. */
void spl_cmd_put_text(FILE *out, const char *text, int width);

/* A line of a table on stdout: the label, 14 columns wide, and the text likewise. */
void spl_cmd_put_row(const char *label, const char *text);

/* 1234567 as "1,234,567" in `text`, which is returned. */
const char *spl_cmd_group(uint64_t value, char text[32]);

/* What stands behind the last dot of the path's last name, "" where there is none: "mp4" of "a.b/c.mp4", "" of "a.b/c",
 * ".c", "a.b/" and "..". Borrows from `path`. */
const char *spl_cmd_ending(const char *path);

/* The enum spl_format that a file's ending means, in whatever case (".jpg", ".JPEG"); -1: none. */
int spl_cmd_format_of(const char *path);

/* Fails with SPL_E_USAGE, naming `option`, where `path` does not end in ".png", so that what is written is not taken
 * for something else and is not written over something else. "-" and what is no regular file has any name. */
int spl_cmd_check_png(const char *option, const char *path, struct spl_error *err);

/* The same of the dataset that `command` makes, which may not have been named (NULL) and has one ending, of a file. */
int spl_cmd_check_dataset(const char *command, const char *path, struct spl_error *err);

/* The same of -o where it is to be a folder: a name that ends like a file's is refused, unless it is a folder's already
 * or a slash says that it is one; so is "-", and a file. `takes`: what the option takes, "a folder". */
int spl_cmd_check_folder(const char *path, const char *takes, struct spl_error *err);

#endif
