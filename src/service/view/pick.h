/* What lies under one pixel. Pure, any thread. */
#ifndef SPL_SERVICE_PICK_H
#define SPL_SERVICE_PICK_H

#include "service/place/places.h"
#include "service/request/request.h"

/* Describes the one pixel of `frame`, all layers of it, as JSON: api/openapi.yaml, Pick. `dataset` may be NULL where
 * classes do not matter, `places` where request->pick.crs is 0. May block for tens of milliseconds. The caller owns
 * out->bytes. */
int spl_pick_encode(const struct spl_view_request *request, const struct spl_frame *frame,
                    const struct spl_dataset *dataset, struct spl_places *places, struct spl_encoded *out,
                    struct spl_error *err);

#endif
