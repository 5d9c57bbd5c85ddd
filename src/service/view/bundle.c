/* Bodies of several files.
 *
 * The boundary of multipart is one random string for ever: 128 bits that no image holds but by design of its owner, and
 * equal requests keep equal bytes. Entries of a ZIP file have no time for the same reason. */
#include "service/view/bundle.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "base/memory.h"
#include "geom/ground.h"
#include "image/vectors.h"
#include "service/headers.h"
#include "service/zip.h"

#define BOUNDARY "splatd-b1f64e2a9c7d4e0583a6d7f25c10e98b"

const char *spl_container_media_type(enum spl_container container)
{
    return container == SPL_CONTAINER_ZIP ? "application/zip" : "multipart/mixed; boundary=" BOUNDARY;
}

const char *spl_format_suffix(enum spl_format format)
{
    static const char *const suffixes[SPL_FORMAT_COUNT] = {".jpg", ".png", ".npy", ".raw", ".webp", ".tif"};
    return suffixes[format];
}

static void write_part(FILE *stream, const struct spl_part *part)
{
    fprintf(stream, "--" BOUNDARY "\r\n");
    for (const char *name = part->headers, *value; (value = spl_headers_value(name)); name = spl_headers_next(value))
        fprintf(stream, "%s: %s\r\n", name, value);
    fprintf(stream, "Content-Disposition: attachment; filename=\"%s\"\r\nContent-Length: %zu\r\n\r\n", part->name,
            part->length);
    fwrite(part->bytes, 1, part->length, stream);
    fprintf(stream, "\r\n");
}

static int write_multipart(FILE *stream, const struct spl_part *parts, size_t count, struct spl_error *err)
{
    (void)err;
    for (size_t i = 0; i < count; i++)
        write_part(stream, &parts[i]);
    fprintf(stream, "--" BOUNDARY "--\r\n");
    return 0;
}

static la_ssize_t on_write(struct archive *archive, void *context, const void *bytes, size_t length)
{
    (void)archive;
    return (la_ssize_t)fwrite(bytes, 1, length, context);
}

static char *make_index(const struct spl_part *parts, size_t count)
{
    json_t *index = json_array();
    for (size_t i = 0; i < count; i++) {
        json_t *headers = json_object();
        for (const char *name = parts[i].headers, *value; (value = spl_headers_value(name));
             name = spl_headers_next(value))
            json_object_set_new(headers, name, json_string(value));
        json_array_append_new(index, json_pack("{s:s, s:o}", "name", parts[i].name, "headers", headers));
    }
    char *text = json_dumps(index, JSON_INDENT(1));
    json_decref(index);
    return text;
}

static int write_zip(FILE *stream, const struct spl_part *parts, size_t count, struct spl_error *err)
{
    struct archive *zip = spl_zip_open(stream, on_write);
    char *index = make_index(parts, count);
    bool good = zip && index;
    for (size_t i = 0; good && i < count; i++)
        good = spl_zip_add(zip, parts[i].name, parts[i].bytes, parts[i].length);
    good = good && spl_zip_add(zip, "index.json", index, strlen(index)) && archive_write_close(zip) == ARCHIVE_OK;
    int rc = good ? 0 : spl_fail(err, SPL_E_NOMEM, "out of memory for a ZIP file of %zu images", count);
    archive_write_free(zip);
    free(index);
    return rc;
}

int spl_bundle(enum spl_container container, const struct spl_part *parts, size_t count, struct spl_encoded *out,
               struct spl_error *err)
{
    char *bytes = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&bytes, &length);
    *out = (struct spl_encoded){0};
    if (!stream)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for %zu images", count);
    int rc = (container == SPL_CONTAINER_ZIP ? write_zip : write_multipart)(stream, parts, count, err);
    bool failed = ferror(stream);
    if ((fclose(stream) || failed) && !rc)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for %zu images", count);
    if (rc)
        free(bytes);
    else
        *out = (struct spl_encoded){
            .bytes = (uint8_t *)bytes, .length = length, .media_type = spl_container_media_type(container)};
    return rc;
}

/* Of a layer of a map, beside its picture. */
static int add_world_file(struct spl_part *part, enum spl_layer layer, const char *ending, const char *text,
                          struct spl_error *err)
{
    struct spl_headers headers;
    spl_headers_open(&headers);
    spl_headers_add(&headers, "Content-Type", "text/plain");
    if (!spl_headers_close(&headers))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the headers of a world file");
    snprintf(part->name, sizeof part->name, "%s%s", spl_layer_name(layer), ending);
    part->headers = headers.text;
    part->bytes = (const uint8_t *)text;
    part->length = strlen(text);
    return 0;
}

int spl_bundle_encode(const struct spl_view_request *request, const struct spl_frame *frame, enum spl_layer layer,
                      struct spl_encoded *out, struct spl_error *err)
{
    const struct spl_encode_options options = spl_view_get_encoding(request, layer);
    return request->listed ? spl_image_list_json(&frame->images[layer], out, err)
                           : spl_image_encode(&frame->images[layer], &options, out, err);
}

int spl_bundle_layers(const struct spl_view_request *request, const struct spl_frame *frame, struct spl_encoded *out,
                      struct spl_error *err)
{
    struct spl_part parts[2 * SPL_LAYER_COUNT] = {0};
    char worlds[SPL_LAYER_COUNT][SPL_WORLD_FILE_BYTES];
    struct spl_encoded encoded[SPL_LAYER_COUNT] = {0};
    size_t count = 0;
    int rc = 0;
    const bool mapped = request->container == SPL_CONTAINER_ZIP && request->encode.ground.placed;
    for (unsigned i = 0; !rc && i < SPL_LAYER_COUNT; i++) {
        if (!(request->view.layers >> i & 1))
            continue;
        enum spl_layer layer = (enum spl_layer)i;
        struct spl_encode_options options = spl_view_get_encoding(request, layer);
        struct spl_part *part = &parts[count];
        struct spl_headers headers;
        if ((rc = spl_bundle_encode(request, frame, layer, &encoded[i], err)))
            break;
        spl_headers_open(&headers);
        spl_headers_add(&headers, "Splatd-Layer", "%s", spl_layer_name(layer));
        spl_headers_add_layer(&headers, request, layer, &encoded[i]);
        if (!spl_headers_close(&headers))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the headers of a layer");
        snprintf(part->name, sizeof part->name, "%s%s", spl_layer_name(layer),
                 request->listed ? ".json" : spl_format_suffix(options.format));
        part->headers = headers.text;
        part->bytes = encoded[i].bytes;
        part->length = encoded[i].length;
        count++;
        const char *ending = spl_format_world_file(options.format);
        if (!rc && mapped && ending)
            rc = add_world_file(&parts[count++], layer, ending,
                                spl_ground_print_world_file(&request->encode.ground, worlds[i]), err);
    }
    if (!rc)
        rc = spl_bundle(request->container, parts, count, out, err);
    for (size_t i = 0; i < SPL_LAYER_COUNT; i++)
        spl_encoded_finish(&encoded[i]);
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        free((char *)parts[i].headers);
    return rc;
}
