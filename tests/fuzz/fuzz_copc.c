/* Hierarchies of COPC of any bytes: the first 16 say where the root page lies in them and how long it is. The table of
 * chunks is always the same one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "cloud/copc.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

enum { chunks = 6, root_at = 40 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static int file = -1;
    struct spl_laz_chunk list[chunks];
    const struct spl_laz_table table = {.chunks = list, .count = chunks};
    struct spl_copc_levels levels;
    struct spl_laz_fault fault = {0};
    struct spl_source source;
    uint8_t info[SPL_COPC_INFO_BYTES] = {0};
    uint64_t points = 0, sum = 0;
    char path[64];
    if (size < 16)
        return 0;
    for (uint32_t i = 0; i < chunks; i++) {
        list[i] = (struct spl_laz_chunk){.at = 1000 + 10 * i, .first = points, .bytes = 10, .points = i + 1};
        points += i + 1;
    }
    if (file < 0)
        file = memfd_create("fuzz", MFD_CLOEXEC);
    require(ftruncate(file, 0) == 0 && pwrite(file, data, size, 0) == (ssize_t)size);
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    require(spl_source_open(&source, path, NULL) == 0);
    memcpy(info + root_at, data, 16);
    int code = spl_copc_read_levels(&levels, &source, info, 0, &table, &fault, NULL);
    require(code == 0 || (code == SPL_E_INPUT && fault.field && fault.reason[0] && !levels.level));
    for (unsigned level = 0; level < SPL_COPC_LEVELS; level++)
        sum += levels.points[level];
    require(sum == (code == 0 ? points : 0));
    for (size_t i = 0; code == 0 && i < chunks; i++)
        require(levels.level[i] < SPL_COPC_LEVELS);
    spl_copc_levels_finish(&levels);
    spl_source_close(&source);
    return 0;
}
