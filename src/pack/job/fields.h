/* Members of job.json, each checked and named where it is wrong: SPL_E_INPUT, the field being the member's name. What
 * is not of the kind that is asked for, or missing, is wrong. Any thread. */
#ifndef SPL_PACK_JOB_FIELDS_H
#define SPL_PACK_JOB_FIELDS_H

#include <stdbool.h>
#include <stdint.h>

#include <jansson.h>

#include "base/error.h"

struct spl_job_reader {
    const char *name; /* of the file, of messages */
    char where[64];   /* "", or "inputs[3]: " */
    struct spl_error *err;
};

/* Says what is wrong with a member: `format` follows its name. */
int spl_job_fail(const struct spl_job_reader *r, const char *field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

int spl_job_get_bool(const struct spl_job_reader *r, const json_t *of, const char *field, bool *out);
int spl_job_get_number(const struct spl_job_reader *r, const json_t *of, const char *field, double least, double most,
                       double *out);

/* A whole number from 0 to `most`. */
int spl_job_get_count(const struct spl_job_reader *r, const json_t *of, const char *field, double most, uint64_t *out);

/* Borrowed; NULL stands for null, where it is not `needed`. */
int spl_job_get_text(const struct spl_job_reader *r, const json_t *of, const char *field, bool needed,
                     const char **out);

/* Three coordinates; `open` is what null stands for, NaN: nothing. */
int spl_job_get_place(const struct spl_job_reader *r, const json_t *of, const char *field, double open, double out[3]);

/* 16 digits of base 16. */
int spl_job_get_hash(const struct spl_job_reader *r, const json_t *of, const char *field, uint64_t *out);

#endif
