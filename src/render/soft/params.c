/* What a view says of soft transparency: names of its choices, and checks of what is no term. Pure; any thread. */
#include <math.h>
#include <string.h>

#include <splatd/soft.h>

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

int spl_soft_check(const struct spl_soft_params *soft, struct spl_error *err)
{
    char number[SPL_DECIMAL_MAX];
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
    return spl_terms_check(&soft->what, "soft", err);
}

int spl_soft_parse(const char *text, struct spl_soft_params *out, struct spl_error *err)
{
    return spl_terms_parse(text, "soft", &out->what, err);
}

int spl_soft_print(const struct spl_soft_params *soft, char *text, size_t bytes)
{
    return spl_terms_print(&soft->what, text, bytes);
}
