/* Atoms side by side, a black line between them. 65536 of them, the most that a file may have, are a picture of 70
 * million pixels at most, so no limit is needed. One thread. */
#include "cmd/dictionary.h"

#include <stdlib.h>

#include <splatd/image.h>

#include "base/memory.h"
#include "cmd/output.h"

enum { line = 1 };

/* Atom `a` at the corner (left, top) of the image. */
static void draw_atom(const struct spl_dictionary *dictionary, uint32_t a, struct spl_image *image, uint32_t left,
                      uint32_t top)
{
    uint32_t size = dictionary->size, plane = size * size;
    const int8_t *texels = dictionary->texels + (size_t)a * 3 * plane;
    for (uint32_t i = 0; i < plane; i++) {
        uint8_t *to = (uint8_t *)image->pixels + 4 * ((size_t)(top + i / size) * image->width + left + i % size);
        for (uint32_t c = 0; c < 3; c++)
            to[c] = (uint8_t)(texels[c * plane + i] + 128);
    }
}

int spl_cmd_write_dictionary(const struct spl_dataset *dataset, const char *path, struct spl_error *err)
{
    const struct spl_dictionary *dictionary = spl_dataset_get_dictionary(dataset);
    if (!dictionary->count)
        return spl_fail(err, SPL_E_INPUT, "%s has no textures, so no dictionary", spl_dataset_get_info(dataset)->id);
    uint32_t columns = 1, pitch = dictionary->size + line;
    while (columns * columns < dictionary->count)
        columns++;
    uint32_t rows = (dictionary->count + columns - 1) / columns;
    struct spl_image image = {.layer = SPL_LAYER_COLOR,
                              .type = SPL_PIXEL_RGBA8,
                              .width = columns * pitch + line,
                              .height = rows * pitch + line};
    struct spl_encoded encoded = {0};
    uint8_t *pixels = image.pixels = spl_alloc((size_t)image.width * image.height, 4, err);
    if (!pixels)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < (size_t)image.width * image.height; i++)
        pixels[4 * i + 3] = 255;
    for (uint32_t a = 0; a < dictionary->count; a++)
        draw_atom(dictionary, a, &image, line + a % columns * pitch, line + a / columns * pitch);
    int rc = spl_image_encode(&image, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(path, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    spl_image_finish(&image);
    return rc;
}
