/* Several files as one body: multipart/mixed (RFC 2046) or a ZIP file. Pure, any thread. The same parts give the same
 * bytes. */
#ifndef SPL_SERVICE_BUNDLE_H
#define SPL_SERVICE_BUNDLE_H

#include "service/request/request.h"

struct spl_part {
    char name[64];       /* of the file: letters, digits, '.', '_' and '-' */
    const char *headers; /* name, NUL, value, NUL, …, NUL */
    const uint8_t *bytes;
    size_t length;
};

const char *spl_container_media_type(enum spl_container container); /* not NONE */

/* In multipart each part carries its headers, Content-Disposition with its name, and Content-Length; in a ZIP file
 * (entries stored, no times) they stand in its last entry, index.json: [{"name": …, "headers": {…}}, …]. The caller
 * owns out->bytes. */
int spl_bundle(enum spl_container container, const struct spl_part *parts, size_t count, struct spl_encoded *out,
               struct spl_error *err);

/* One layer, as it is sent. */
int spl_bundle_encode(const struct spl_view_request *request, const struct spl_frame *frame, enum spl_layer layer,
                      struct spl_encoded *out, struct spl_error *err);

/* All layers of `frame` that were asked for, encoded, as request->container; parts are named color.jpg, depth.png, … */
int spl_bundle_layers(const struct spl_view_request *request, const struct spl_frame *frame, struct spl_encoded *out,
                      struct spl_error *err);

/* ".jpg", …: what the name of a file ends in. */
const char *spl_format_suffix(enum spl_format format);

#endif
