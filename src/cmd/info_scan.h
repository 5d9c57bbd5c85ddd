/* What splatd info says of scans: what they hold, and what a pack would make of them. */
#ifndef SPL_CMD_INFO_SCAN_H
#define SPL_CMD_INFO_SCAN_H

#include <stdbool.h>
#include <stddef.h>

#include <jansson.h>

struct spl_info_scan_options {
    bool json;
    bool read;           /* all points, not the header alone */
    const char *columns; // of text; may be NULL
};

/* Whether `path` is an argument of this kind: a folder, a list, a file that neither begins nor is called as a dataset.
 */
bool spl_info_is_scan(const char *path);

/* Text of a file's; what is no UTF-8 is shown. */
json_t *spl_info_text(const char *text);

/* Each scan, and, where there are several, all together. What cannot be read is said, and the others are still told of.
 * Returns the exit code. */
int spl_info_print_scans(const char *const *given, size_t count, const struct spl_info_scan_options *options);

#endif
