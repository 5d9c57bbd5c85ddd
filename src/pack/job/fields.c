/* Members of job.json; see fields.h. */
#include "pack/job/fields.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pack/points.h"

enum { text_most = 8 << 20 };

int spl_job_fail(const struct spl_job_reader *r, const char *field, const char *format, ...)
{
    char why[300];
    va_list list;
    va_start(list, format);
    vsnprintf(why, sizeof why, format, list);
    va_end(list);
    return spl_fail_field(r->err, SPL_E_INPUT, field, "%.300s: %s\"%s\" %s; make the plan anew", r->name, r->where,
                          field, why);
}

int spl_job_get_bool(const struct spl_job_reader *r, const json_t *of, const char *field, bool *out)
{
    const json_t *v = json_object_get(of, field);
    if (!json_is_boolean(v))
        return spl_job_fail(r, field, "must be true or false");
    *out = json_is_true(v);
    return SPL_OK;
}

int spl_job_get_number(const struct spl_job_reader *r, const json_t *of, const char *field, double least, double most,
                       double *out)
{
    const json_t *v = json_object_get(of, field);
    double number = json_number_value(v);
    if (!json_is_number(v) || !(number >= least && number <= most))
        return spl_job_fail(r, field, "must be a number from %g to %g", least, most);
    *out = number;
    return SPL_OK;
}

int spl_job_get_count(const struct spl_job_reader *r, const json_t *of, const char *field, double most, uint64_t *out)
{
    const json_t *v = json_object_get(of, field);
    if (!json_is_integer(v) || json_integer_value(v) < 0 || json_integer_value(v) > (json_int_t)most)
        return spl_job_fail(r, field, "must be a whole number from 0 to %.0f", most);
    *out = (uint64_t)json_integer_value(v);
    return SPL_OK;
}

int spl_job_get_text(const struct spl_job_reader *r, const json_t *of, const char *field, bool needed, const char **out)
{
    const json_t *v = json_object_get(of, field);
    bool text = json_is_string(v) && json_string_length(v) <= text_most;
    if (!text && (needed || !json_is_null(v)))
        return spl_job_fail(r, field, needed ? "must be a text" : "must be a text or null");
    *out = text ? json_string_value(v) : NULL;
    return SPL_OK;
}

int spl_job_get_place(const struct spl_job_reader *r, const json_t *of, const char *field, double open, double out[3])
{
    const json_t *list = json_object_get(of, field);
    if (json_array_size(list) != 3)
        return spl_job_fail(r, field, "must be an array of three numbers");
    for (size_t c = 0; c < 3; c++) {
        const json_t *v = json_array_get(list, c);
        out[c] = json_is_null(v) ? open : json_number_value(v);
        bool good = json_is_null(v) ? !isnan(open) : json_is_number(v) && fabs(out[c]) <= SPL_COORDINATE_MAX;
        if (!good)
            return spl_job_fail(r, field, "must be an array of three numbers from %g to %g%s", -SPL_COORDINATE_MAX,
                                SPL_COORDINATE_MAX, isnan(open) ? "" : ", or null");
    }
    return SPL_OK;
}

int spl_job_get_hash(const struct spl_job_reader *r, const json_t *of, const char *field, uint64_t *out)
{
    const char *text = "";
    int rc = spl_job_get_text(r, of, field, true, &text);
    if (rc)
        return rc;
    if (strlen(text) != 16 || strspn(text, "0123456789abcdef") != 16)
        return spl_job_fail(r, field, "must be 16 digits and letters a to f");
    *out = strtoull(text, NULL, 16);
    return SPL_OK;
}
