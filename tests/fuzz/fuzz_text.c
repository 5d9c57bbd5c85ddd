/* PTS, XYZ and CSV-like text of any bytes, with recognised and with named columns. */
#include "fuzz_cloud.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_cloud(data, size, "", NULL);
    fuzz_cloud(data, size, "", "x,y,z,-,r,g,b");
    fuzz_cloud(data, size, "", "-,x,y,z");
    return 0;
}
