/* The version that this library was built as. Pure; any thread. */
#include <splatd/api.h>

int spl_version_number(void)
{
    return SPL_VERSION_NUMBER;
}

const char *spl_version(void)
{
    return SPLATD_VERSION;
}
