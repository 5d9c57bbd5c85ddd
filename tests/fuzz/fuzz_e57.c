/* E57 of any bytes whose pages are right, so that what lies behind their checksums is reached: a whole file, or (its
 * first byte is '<') the XML of one, or (0) pages as they are. Its corpus is made by make_e57.c. */
#include "fuzz_cloud.h"

#include "support/e57_writer.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { page = 1024 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    if (data[0] == 0) {
        fuzz_cloud(data, size, "ASTM-E57", NULL);
        return 0;
    }
    size_t length = (size + page - 1) / page * page;
    uint8_t *file;
    if (data[0] == '<') {
        file = e57_make(data, size, size, &length);
    } else {
        file = calloc(1, length);
        memcpy(file, data, size);
        for (int i = 0; i < 8; i++) {
            file[16 + i] = (uint8_t)((uint64_t)length >> 8 * i);
            file[40 + i] = i == 1 ? page >> 8 : 0;
        }
        e57_seal(file, length);
    }
    fuzz_cloud(file, length, "ASTM-E57", NULL);
    free(file);
    return 0;
}
