/* What the user says about the dataset: title, description, views. */
#ifndef SPL_PACK_SAID_H
#define SPL_PACK_SAID_H

#include <jansson.h>

#include <splatd/pack.h>

#include "base/error.h"
#include "pack/view.h"

/* All but what only up decides. SPL_E_USAGE names the option. */
int spl_said_check(const struct spl_pack_options *options, struct spl_error *err);

/* The views, none of which looks along `up`; NULL: up is not known yet. SPL_E_USAGE. */
int spl_said_check_views(const struct spl_pack_options *options, const double *up, struct spl_error *err);

/* Both of a pack, before anything is read: up is as it is given, or z; photographs may say another, so with them it is
 * left for later. SPL_E_USAGE. */
int spl_said_check_pack(const struct spl_pack_options *options, struct spl_error *err);

/* The default view that the user gives; `up` is the dataset's. */
void spl_said_view(const struct spl_saved_view *given, const double up[3], struct spl_default_view *view);

/* Adds it to META; of a user who says nothing, nothing. SPL_E_USAGE of views that look along `up`; SPL_E_NOMEM. */
int spl_said_add(const struct spl_pack_options *options, const double up[3], json_t *meta, struct spl_error *err);

#endif
