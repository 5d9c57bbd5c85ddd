/* Images from files: the first byte chooses the layer, the rest is the file. Whatever is accepted must have as many
 * pixels as it says, all of them readable. */
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include "image/load.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile uint32_t sum; /* keeps the compiler from leaving out the reads */

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static int file = -1;
    struct spl_image image;
    struct spl_error err = {0};
    char path[64];
    if (!size)
        return 0;
    if (file < 0)
        file = memfd_create("fuzz", MFD_CLOEXEC);
    require(file >= 0 && ftruncate(file, 0) == 0 && pwrite(file, data + 1, size - 1, 0) == (ssize_t)size - 1);
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    int rc = spl_image_load(path, (enum spl_layer)(data[0] % SPL_LAYER_COUNT), &image, &err);
    require(rc == err.code && (rc == 0) == (err.message[0] == 0) && (rc == 0) == (image.pixels != NULL));
    uint64_t count = (uint64_t)image.width * image.height;
    require(rc || (count > 0 && count <= SPL_IMAGE_PIXELS_MAX));
    const uint32_t *words = image.pixels;
    if (!rc)
        for (uint64_t i = 0; i < count * spl_pixel_bytes(image.type) / 4; i++)
            sum += words[i];
    spl_image_finish(&image);
    return 0;
}
