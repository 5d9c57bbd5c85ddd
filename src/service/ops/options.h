/* The parameters of the service (params.def): defaults, then a config file, then flags, the later wins. */
#ifndef SPL_SERVICE_OPTIONS_H
#define SPL_SERVICE_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <jansson.h>

#include "base/error.h"

enum { SPL_SERVICE_SIDE_MAX = 8192 }; /* pixels per side of an image */
#define SPL_SERVICE_PIXELS_MAX ((uint64_t)SPL_SERVICE_SIDE_MAX * SPL_SERVICE_SIDE_MAX)

enum spl_parameter_type {
    SPL_PARAMETER_TEXT,
    SPL_PARAMETER_LIST,
    SPL_PARAMETER_FLAG,
    SPL_PARAMETER_COUNT,
    SPL_PARAMETER_BYTES,
    SPL_PARAMETER_CHOICE,
};

/* Who has set a value; a weaker source never replaces a stronger one's. */
enum spl_origin { SPL_FROM_DEFAULT, SPL_FROM_FILE, SPL_FROM_FLAG };

enum { SPL_MISTAKES_MAX = 16 }; /* of a file, beside the first, that are kept */

struct spl_text_list {
    char **items;
    size_t count, capacity;
};

/* The members' C types by the table's column. */
#define SPL_PARAMETER_C_TEXT char *
#define SPL_PARAMETER_C_LIST struct spl_text_list
#define SPL_PARAMETER_C_FLAG bool
#define SPL_PARAMETER_C_COUNT uint64_t
#define SPL_PARAMETER_C_BYTES uint64_t
#define SPL_PARAMETER_C_CHOICE uint64_t

enum spl_parameter_index {
#define PARAMETER(field, name, type, fallback, least, most, unit, text) SPL_PARAMETER_##field,
#include "service/ops/params.def"
#undef PARAMETER
    SPL_PARAMETERS
};

struct spl_service_options {
#define PARAMETER(field, name, type, fallback, least, most, unit, text) SPL_PARAMETER_C_##type field;
#include "service/ops/params.def"
#undef PARAMETER
    enum spl_origin origin[SPL_PARAMETERS];
    char *where[SPL_PARAMETERS]; // may be NULL; "FILE, line 3: " of what a file has set last
    struct spl_error mistake[SPL_MISTAKES_MAX]; // what a file has wrong behind its first error, in its order
    size_t mistakes;
};

struct spl_parameter {
    const char *name;
    enum spl_parameter_type type;
    const char *fallback;
    uint64_t least, most;
    const char *unit, *text;
    size_t offset; /* in struct spl_service_options */
};
extern const struct spl_parameter spl_parameters[SPL_PARAMETERS];

/* The table's defaults. On failure (no memory) nothing is left to finish. */
int spl_service_options_init(struct spl_service_options *options, struct spl_error *err);

/* Releases every value and leaves zeros. */
void spl_service_options_finish(struct spl_service_options *options);

/* The index of `name`; SPL_PARAMETERS for an unknown one. */
size_t spl_parameter_find(const char *name);

/* Sets parameter `index` from `text`, unless a stronger origin has set it. The values of a LIST add up within one
 * origin; a stronger origin's replace them. `where` begins the message of an error: "--", or "FILE, line 3: ".
 * SPL_E_USAGE with the name, the value and the range. */
int spl_service_options_set(struct spl_service_options *options, size_t index, const char *text, enum spl_origin origin,
                            const char *where, struct spl_error *err);

/* What no value alone can say: those that contradict each other. SPL_E_USAGE with the field. Opens nothing. */
int spl_service_options_check(const struct spl_service_options *options, struct spl_error *err);

/* "FILE, line 3: " where a file has set parameter `name`, else "". */
void spl_service_options_locate(const struct spl_service_options *options, const char *name, char *out,
                                size_t capacity);

/* Reads a config file: lines `name = value`, blank lines, and lines whose first character is '#'. Space around name and
 * value is dropped, everything else of the value is kept as it stands. A name may be given once, a LIST several times.
 * Line ends may be CRLF, a byte order mark may come first. A regular file of at most 1 MiB.
 * SPL_E_USAGE with file, line, name and value of the first mistake; `options` holds those behind it, so that one start
 * tells all of them. Blocks on disk. */
int spl_service_options_read(struct spl_service_options *options, const char *path, struct spl_error *err);

/* The same from memory; `path` is for messages. */
int spl_service_options_parse(struct spl_service_options *options, const char *path, const char *data, size_t length,
                              struct spl_error *err);

/* The table as the flags of --help, as the manual page splatd.conf(5), and as the values in use but for paths; the
 * last is a new reference, NULL without memory. */
void spl_parameters_print_help(FILE *out);
void spl_parameters_print_manual(FILE *out);
json_t *spl_service_options_describe(const struct spl_service_options *options);

#endif
