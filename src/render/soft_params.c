/* What a view says of soft transparency: names of models, and checks. Pure; any thread. */
#include <math.h>
#include <string.h>

#include <splatd/soft.h>

#include "base/error.h"

static const char *const model_names[SPL_SOFT_MODEL_COUNT] = {
    [SPL_SOFT_MODEL_EXPRESS] = "express",
    [SPL_SOFT_MODEL_CONCENTRIC] = "concentric",
    [SPL_SOFT_MODEL_BASE] = "base",
    [SPL_SOFT_MODEL_LAYER] = "layer",
};

const char *spl_soft_model_name(enum spl_soft_model model)
{
    return (unsigned)model < SPL_SOFT_MODEL_COUNT ? model_names[model] : "unknown";
}

int spl_soft_model_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_SOFT_MODEL_COUNT; i++)
        if (!strcmp(name, model_names[i]))
            return i;
    return -1;
}

static bool is_shape(enum spl_soft_measure measure)
{
    return measure == SPL_SOFT_AXIS || measure == SPL_SOFT_PLANE || measure == SPL_SOFT_BOX;
}

static int check_shape(const struct spl_soft_term *term, uint32_t number, struct spl_error *err)
{
    const double *s = term->shape, length = hypot(hypot(s[3], s[4]), s[5]);
    for (int i = 0; i < 6; i++)
        if (!isfinite(s[i]))
            return spl_fail_field(err, SPL_E_USAGE, "soft", "term %u of soft has a number that is not finite", number);
    if (term->measure != SPL_SOFT_BOX && !(length > 0 && isfinite(length)))
        return spl_fail_field(err, SPL_E_USAGE, "soft", "term %u of soft has a direction without length", number);
    for (int i = 0; i < 3 && term->measure == SPL_SOFT_BOX; i++)
        if (s[i] > s[i + 3])
            return spl_fail_field(err, SPL_E_USAGE, "soft",
                                  "the box of term %u of soft ends at %g before it begins at %g", number, s[i + 3],
                                  s[i]);
    return SPL_OK;
}

static int check_term(const struct spl_soft_term *term, uint32_t number, struct spl_error *err)
{
    if ((unsigned)term->measure > SPL_SOFT_BOX)
        return spl_fail_field(err, SPL_E_USAGE, "soft", "term %u of soft measures nothing that exists", number);
    if (isnan(term->least) || isnan(term->most) || term->least > term->most)
        return spl_fail_field(err, SPL_E_USAGE, "soft", "term %u of soft is not between %g and %g", number,
                              term->least, term->most);
    if (is_shape(term->measure))
        return check_shape(term, number, err);
    if (!term->name[0] || !memchr(term->name, 0, sizeof term->name))
        return spl_fail_field(err, SPL_E_USAGE, "soft", "term %u of soft names no attribute", number);
    return SPL_OK;
}

int spl_soft_check(const struct spl_soft_params *soft, struct spl_error *err)
{
    int rc = SPL_OK;
    if (soft->count > SPL_SOFT_TERMS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "soft", "%u terms are more than %d", soft->count, SPL_SOFT_TERMS_MAX);
    if ((unsigned)soft->model >= SPL_SOFT_MODEL_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "soft_model", "soft_model %d does not exist", (int)soft->model);
    if (!(soft->opacity >= 0 && soft->opacity <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "soft_opacity", "soft_opacity %g is not within 0 and 1",
                              soft->opacity);
    if (!(soft->blend >= 0 && isfinite(soft->blend)))
        return spl_fail_field(err, SPL_E_USAGE, "soft_blend", "soft_blend %g is not 0 or more", soft->blend);
    for (uint32_t i = 0; i < soft->count && !rc; i++)
        rc = check_term(&soft->terms[i], i + 1, err);
    return rc;
}
