/* PCD of any bytes. */
#include "fuzz_cloud.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_cloud(data, size, "# .PCD v", NULL);
    return 0;
}
