/* What the files of the text reader share: its state, and the lines that count. Owned by the cloud's thread. */
#ifndef SPL_CLOUD_TEXT_READER_H
#define SPL_CLOUD_TEXT_READER_H

#include <string.h>
#include <strings.h>

#include "cloud/text.h"

struct spl_text {
    struct spl_layout layout;
    uint64_t start, start_line; /* of the first line of numbers */
    bool counted;               /* PTS */
    uint64_t count;             /* the first block's */
    uint64_t left;              /* of the current block; UINT64_MAX where nothing is counted */
    uint64_t end;               /* where lines of words begin that end the file; UINT64_MAX: it has none */
};

/* Of a line that is no data: "#", "//", "%", "!", the ";" of a line that has no other, what tells a spreadsheet its
 * separator, and the end of file of old systems. */
static inline bool spl_text_is_comment(const char *line, size_t length)
{
    while (length > 0 && (*line == ' ' || *line == '\t'))
        line++, length--;
    if (length == 0 || *line == 0 || (*line >= '+' && *line <= '9' && *line != '/')) /* numbers, nearly always */
        return false;
    if (*line == ';')
        return length > 1 && !strchr("+-.0123456789;", line[1]) && !memchr(line + 1, ';', length - 1);
    return strchr("#%!\x1a", *line) || (length > 1 && line[0] == '/' && line[1] == '/') ||
           (length > 3 && strncasecmp(line, "sep=", 4) == 0);
}

/* The next line that is neither blank nor a comment: as spl_source_line(). */
static inline int spl_text_next_line(struct spl_source *source, const char **line, size_t *length,
                                     struct spl_error *err)
{
    int code;
    do {
        code = spl_source_line(source, line, length, err);
    } while (code > 0 && (spl_fields_blank(*line, *length) || spl_text_is_comment(*line, *length)));
    return code;
}

/* A number alone in its line. */
bool spl_text_is_count(const char *line, size_t length, uint64_t *count);

/* Refuses one that the rest of the file has no room for. */
int spl_text_check_count(const struct spl_source *source, uint64_t count, struct spl_error *err);

/* Everything before the numbers: comments, titles, names, a count. On success `line` is the first line of numbers, and
 * *named whether the layout has columns. */
int spl_text_take_preamble(struct spl_cloud *cloud, bool *named, const char **line, size_t *length,
                           struct spl_error *err);

/* From the lines that follow: what separates columns, how numbers are written, and which columns there are; `line` is
 * the first of them. */
int spl_text_find_columns(struct spl_cloud *cloud, bool named, const char *line, size_t length, struct spl_error *err);

/* Finds text->end, once the columns are known, and tells of it in info.footer. The source's place is kept. */
int spl_text_find_end(struct spl_cloud *cloud, struct spl_error *err);

/* Lines of old systems are in Latin-1, and shown in UTF-8: returns `line`, or `out` and its length. */
enum { SPL_TEXT_SHOWN = 4096 };
const char *spl_text_show_latin(const char *line, size_t *length, char out[SPL_TEXT_SHOWN]);

#endif
