/* Reading a caller's struct by the size that the caller states. No byte beyond that size is read, and no size is
 * believed that no version of ours can have. Pure; any thread. */
#include "base/sized.h"

#include <string.h>

enum { size_max = 1 << 16 }; /* no struct of options comes near it: more is no size, but memory that nobody has set */

void spl_sized_init(void *sized, size_t size)
{
    memset(sized, 0, size);
    memcpy(sized, &size, sizeof size);
}

int spl_sized_read(const void *given, void *out, size_t bytes, const char *name, struct spl_error *err)
{
    size_t size;
    memcpy(&size, given, sizeof size);
    if (size < sizeof size || size > size_max)
        return spl_fail_field(err, SPL_E_USAGE, "size", "struct %s: size %zu was never set; call %s_init() first", name,
                              size, name);
    for (size_t i = bytes; i < size; i++)
        if (((const unsigned char *)given)[i])
            return spl_fail_field(err, SPL_E_UNSUPPORTED, "size",
                                  "struct %s: byte %zu is set, which libsplatd %s does not know; it is older than the "
                                  "program that calls it",
                                  name, i, spl_version());
    memcpy(out, given, size < bytes ? size : bytes);
    memcpy(out, &bytes, sizeof bytes);
    return SPL_OK;
}
