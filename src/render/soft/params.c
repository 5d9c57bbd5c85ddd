/* What a view says of soft transparency: names of its choices, and checks. Pure; any thread. */
#include "render/soft_params.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"
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

static const char *const of_names[SPL_SOFT_OF_COUNT] = {
    [SPL_SOFT_OF_SOLID] = "solid",
    [SPL_SOFT_OF_FIRST] = "first",
    [SPL_SOFT_OF_MEDIAN] = "median",
};

const char *spl_soft_of_name(enum spl_soft_of of)
{
    return (unsigned)of < SPL_SOFT_OF_COUNT ? of_names[of] : "unknown";
}

int spl_soft_of_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_SOFT_OF_COUNT; i++)
        if (!strcmp(name, of_names[i]))
            return i;
    return -1;
}

static bool check_shape(const struct spl_soft_term *term, char fault[SPL_SOFT_FAULT_MAX])
{
    const double *s = term->shape, length = hypot(hypot(s[3], s[4]), s[5]);
    const char *what = NULL;
    for (int i = 0; i < 6; i++)
        if (!isfinite(s[i]))
            what = "has a number that is not finite";
    if (!what && term->measure != SPL_SOFT_BOX && !(length > 0 && isfinite(length)))
        what = "has a direction without length";
    snprintf(fault, SPL_SOFT_FAULT_MAX, "%s", what ? what : "");
    for (int i = 0; i < 3 && !what && term->measure == SPL_SOFT_BOX; i++)
        if (s[i] > s[i + 3]) {
            snprintf(fault, SPL_SOFT_FAULT_MAX, "has a box that ends at %.9g before it begins at %.9g", s[i + 3], s[i]);
            return false;
        }
    return !what;
}

static bool is_share(double end)
{
    return isinf(end) || (end >= 0 && end <= 1);
}

bool spl_soft_check_term(const struct spl_soft_term *term, char fault[SPL_SOFT_FAULT_MAX])
{
    const char *what = NULL;
    if ((unsigned)term->measure > SPL_SOFT_BOX)
        what = "measures nothing that exists";
    else if (isnan(term->least) || isnan(term->most) || term->least > term->most || term->least == INFINITY ||
             term->most == -INFINITY) {
        snprintf(fault, SPL_SOFT_FAULT_MAX, "ends at %.9g before it begins at %.9g", term->most, term->least);
        return false;
    } else if (term->measure >= SPL_SOFT_AXIS)
        return check_shape(term, fault);
    else if (!term->name[0] || !memchr(term->name, 0, sizeof term->name))
        what = "names no attribute";
    else if (term->measure == SPL_SOFT_QUANTILE && !(is_share(term->least) && is_share(term->most))) {
        snprintf(fault, SPL_SOFT_FAULT_MAX, "has quantile %.9g, which is not within 0 and 1",
                 is_share(term->least) ? term->most : term->least);
        return false;
    }
    snprintf(fault, SPL_SOFT_FAULT_MAX, "%s", what ? what : "");
    return !what;
}

int spl_soft_check(const struct spl_soft_params *soft, struct spl_error *err)
{
    char fault[SPL_SOFT_FAULT_MAX], number[SPL_DECIMAL_MAX];
    if (soft->count > SPL_SOFT_TERMS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "soft", "%u terms are more than %d", soft->count, SPL_SOFT_TERMS_MAX);
    if ((unsigned)soft->model >= SPL_SOFT_MODEL_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "soft_model", "soft_model %d does not exist", (int)soft->model);
    if (!(soft->opacity >= 0 && soft->opacity <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "soft_opacity", "soft_opacity %s is not within 0 and 1",
                              spl_decimal_print(soft->opacity, number));
    if (!(soft->cover >= 0 && soft->cover <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "soft_cover", "soft_cover %s is not within 0 and 1",
                              spl_decimal_print(soft->cover, number));
    if (!(soft->blend >= 0 && isfinite(soft->blend)))
        return spl_fail_field(err, SPL_E_USAGE, "soft_blend", "soft_blend %g is not 0 or more", soft->blend);
    if ((unsigned)soft->of >= SPL_SOFT_OF_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "of", "of %d does not exist", (int)soft->of);
    for (uint32_t i = 0; i < soft->count; i++)
        if (!spl_soft_check_term(&soft->terms[i], fault))
            return spl_fail_field(err, SPL_E_USAGE, "soft", "term %u of soft %s", i + 1, fault);
    return SPL_OK;
}
