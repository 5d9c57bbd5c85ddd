/* Headers of views: written once when a view is ready (or asked for by HEAD), copied into each reply that carries it.
 */
#include "service/headers.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "base/decimal.h"
#include "service/view/bundle.h"

void spl_headers_open(struct spl_headers *headers)
{
    *headers = (struct spl_headers){0};
    headers->stream = open_memstream(&headers->text, &headers->length);
}

void spl_headers_add(struct spl_headers *headers, const char *name, const char *format, ...)
{
    char text[SPL_TERMS_TEXT_MAX + 1024];
    if (!headers->stream)
        return;
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    for (char *c = text; *c; c++)
        if (*c < 0x20 || *c > 0x7e)
            *c = '?'; // names of devices come from drivers
    fprintf(headers->stream, "%s%c%s%c", name, 0, text, 0);
}

bool spl_headers_close(struct spl_headers *headers)
{
    bool failed = !headers->stream || fputc(0, headers->stream) == EOF;
    if (headers->stream && fclose(headers->stream))
        failed = true;
    headers->stream = NULL;
    if (failed) {
        free(headers->text);
        headers->text = NULL;
    }
    return !failed;
}

void spl_headers_add_layer(struct spl_headers *headers, const struct spl_view_request *request, enum spl_layer layer,
                           const struct spl_encoded *encoded)
{
    enum spl_format format = spl_view_get_encoding(request, layer).format;
    spl_headers_add(headers, "Content-Type", "%s",
                    request->listed ? "application/json" : spl_format_media_type(format));
    if (layer != SPL_LAYER_DEPTH && layer != SPL_LAYER_RANGE)
        return;
    if (format == SPL_FORMAT_TIFF) { // heights
        spl_headers_add(headers, "Splatd-Height-Unit", "%s", request->encode.unit);
        return;
    }
    spl_headers_add(headers, "Splatd-Depth-Unit", "%s", request->encode.unit);
    switch (format) {
    case SPL_FORMAT_PNG:
        spl_headers_add(headers, "Splatd-Depth-Scale", "%s",
                        spl_decimal_print(request->encode.depth_scale, (char[SPL_DECIMAL_MAX]){0}));
        spl_headers_add(headers, "Splatd-Depth-Invalid", "0");
        if (encoded)
            spl_headers_add(headers, "Splatd-Depth-Saturated", "%llu", (unsigned long long)encoded->saturated);
        break;
    case SPL_FORMAT_JPEG:
        if (!encoded)
            break;
        spl_headers_add(headers, "Splatd-Depth-Near", "%.9g", (double)encoded->near);
        spl_headers_add(headers, "Splatd-Depth-Far", "%.9g", (double)encoded->far);
        break;
    default:
        spl_headers_add(headers, "Splatd-Depth-Scale", "1");
        spl_headers_add(headers, "Splatd-Depth-Invalid", "%s", request->listed ? "null" : "NaN");
        break;
    }
}

/* What is said of a camera that is no plain pinhole, as a request would say it again. */
static void write_lens(const struct spl_camera *camera, char *out, size_t bytes)
{
    const struct spl_distortion *lens = &camera->lens;
    const double *k = lens->k, *p = lens->p;
    const bool fisheye = lens->kind == SPL_DISTORTION_FISHEYE;
    const bool straight = fisheye && k[0] == 0 && k[1] == 0 && k[2] == 0 && k[3] == 0;
    *out = '\0';
    if (camera->projection != SPL_PERSPECTIVE)
        out += snprintf(out, bytes, ",\"projection\":\"%s\"", spl_projection_name(camera->projection));
    if (straight && lens->reach < M_PI)
        snprintf(out, bytes / 2, ",\"fov\":%.17g", lens->reach * 360 / M_PI);
    else if (fisheye && !straight)
        snprintf(out, bytes / 2,
                 ",\"model\":\"OPENCV_FISHEYE\",\"params\":[%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g]",
                 camera->fx, camera->fy, camera->cx, camera->cy, k[0], k[1], k[2], k[3]);
    else if (lens->kind == SPL_DISTORTION_RADIAL)
        snprintf(out, bytes / 2,
                 ",\"model\":\"FULL_OPENCV\",\"params\":[%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%."
                 "17g,%.17g]",
                 camera->fx, camera->fy, camera->cx, camera->cy, k[0], k[1], p[0], p[1], k[2], k[3], k[4], k[5]);
}

/* The camera that was used, as JSON. */
static void add_camera(struct spl_headers *headers, const struct spl_camera *camera)
{
    const double *r = camera->rotation, *eye = camera->eye;
    char far[32] = "null", lens[1024], text[2048]; // JSON has no infinity
    write_lens(camera, lens, sizeof lens);
    if (isfinite(camera->far))
        snprintf(far, sizeof far, "%.9g", camera->far);
    snprintf(
        text, sizeof text,
        "{\"eye\":[%.17g,%.17g,%.17g],\"rotation\":[%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g],"
        "\"fx\":%.17g,\"fy\":%.17g,\"cx\":%.17g,\"cy\":%.17g,\"width\":%u,\"height\":%u,\"near\":%.9g,\"far\":%s%s}",
        eye[0], eye[1], eye[2], r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], camera->fx, camera->fy,
        camera->cx, camera->cy, camera->width, camera->height, camera->near, far,
        lens);
    spl_headers_add(headers, "Splatd-Camera", "%s", spl_decimal_shorten(text));
}

/* Of a header that repeats terms; longer ones are left out, for headers have to fit into a connection's pool. */
enum { terms_most = 1500 };

/* Terms as an array, condition by condition or term by term; their texts have nothing that JSON would escape. */
static void write_terms(const struct spl_terms *terms, bool conditions, char *out, size_t bytes)
{
    struct spl_terms one = *terms;
    size_t used = 0;
    for (uint32_t i = 0, next; i < one.count && used < bytes; i = next) {
        char text[SPL_TERMS_TEXT_MAX + 1];
        for (uint32_t t = i + 1; t < one.count && !conditions; t++) /* what is outside a list stays one */
            if (one.terms[t].joint == SPL_TERM_OR)
                one.terms[t].joint = SPL_TERM_AND;
        spl_terms_print_condition(&one, i, &next, text, sizeof text);
        used += (size_t)snprintf(out + used, bytes - used, "%s\"%s\"", i ? "," : "", text);
    }
}

/* What is drawn, as a body says it. */
static void add_clip(struct spl_headers *headers, const struct spl_terms *clip)
{
    char terms[SPL_TERMS_TEXT_MAX + 3 * SPL_TERMS_MAX] = "";
    write_terms(clip, true, terms, sizeof terms);
    if (strlen(terms) <= terms_most)
        spl_headers_add(headers, "Splatd-Clip", "{\"clip\":[%s]}", terms);
}

/* What is soft, the same. */
static void add_soft(struct spl_headers *headers, const struct spl_soft_params *soft)
{
    char terms[SPL_TERMS_TEXT_MAX + 3 * SPL_TERMS_MAX] = "";
    char opacity[SPL_DECIMAL_MAX], cover[SPL_DECIMAL_MAX], blend[SPL_DECIMAL_MAX];
    write_terms(&soft->what, false, terms, sizeof terms);
    if (strlen(terms) > terms_most)
        return;
    spl_headers_add(headers, "Splatd-Soft",
                    "{\"soft\":[%s],\"soft_model\":\"%s\",\"soft_opacity\":%s,\"soft_cover\":%s,"
                    "\"soft_blend\":%s,\"of\":\"%s\"}",
                    terms, spl_soft_model_name(soft->model), spl_decimal_print(soft->opacity, opacity),
                    spl_decimal_print(soft->cover, cover), spl_decimal_print(soft->blend, blend),
                    spl_soft_of_name(soft->of));
}

void spl_headers_add_view(struct spl_headers *headers, const struct spl_view_request *request,
                          const struct spl_encoded *encoded)
{
    if (request->picks)
        spl_headers_add(headers, "Content-Type", "application/json");
    else if (request->container)
        spl_headers_add(headers, "Content-Type", "%s", spl_container_media_type(request->container));
    else
        spl_headers_add_layer(headers, request, request->layer, encoded);
    spl_headers_add(headers, "Splatd-Unit", "%s", request->encode.unit);
    add_camera(headers, request->picks ? &request->pick.camera : &request->view.camera);
    if (request->view.soft.what.count)
        add_soft(headers, &request->view.soft);
    if (request->view.clip.count)
        add_clip(headers, &request->view.clip);
}
