/* Layers as JSON: floats by the fewest digits that give them back, nothing as null. Any thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "image/rows.h"
#include "image/vectors.h"

static void put_float(FILE *stream, float value)
{
    char text[32];
    for (int digits = 6; digits <= 9; digits++) { /* of which 9 always do */
        snprintf(text, sizeof text, "%.*g", digits, (double)value);
        if (strtof(text, NULL) == value)
            break;
    }
    fputs(text, stream);
}

static void put_pixel(FILE *stream, const struct spl_image *image, const void *pixel)
{
    const uint8_t *bytes = pixel;
    const float *floats = pixel;
    const uint32_t word = image->type == SPL_PIXEL_U32 ? *(const uint32_t *)pixel : 0;
    const bool vector = image->type == SPL_PIXEL_F32X3;
    if (image->type == SPL_PIXEL_RGBA8)
        fprintf(stream, "[%u,%u,%u,%u]", bytes[0], bytes[1], bytes[2], bytes[3]);
    else if (image->type == SPL_PIXEL_U32 && image->layer == SPL_LAYER_ID && word == UINT32_MAX)
        fputs("null", stream);
    else if (image->type == SPL_PIXEL_U32)
        fprintf(stream, "%u", word);
    else if (!isfinite(floats[0]) || (vector && !(floats[0] != 0 || floats[1] != 0 || floats[2] != 0)))
        fputs("null", stream);
    else
        for (int i = 0; i < (vector ? 3 : 1); i++) {
            fputs(!vector ? "" : i ? "," : "[", stream);
            put_float(stream, floats[i]);
            fputs(vector && i == 2 ? "]" : "", stream);
        }
}

int spl_image_list_json(const struct spl_image *image, struct spl_encoded *out, struct spl_error *err)
{
    char *text = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    *out = (struct spl_encoded){.media_type = "application/json"};
    for (uint32_t y = 0; stream && y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++) {
            fputs(x || y ? ",\n" : "[", stream);
            put_pixel(stream, image, (const char *)spl_image_row(image, y) + (size_t)x * spl_pixel_bytes(image->type));
        }
    bool failed = !stream || fputs("]\n", stream) < 0 || ferror(stream);
    if (stream && fclose(stream))
        failed = true;
    if (failed) {
        free(text);
        *out = (struct spl_encoded){0};
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a list of %u numbers", image->height);
    }
    out->bytes = (uint8_t *)text;
    out->length = length;
    return SPL_OK;
}
