/* How every subcommand ends when a library call fails. */
#include "cmd/cmd.h"

#include <stdio.h>
#include <string.h>

#include "base/exit.h"
#include "base/log.h"

int spl_cmd_fail(const struct spl_error *err)
{
    bool named = !err->field[0] || strstr(err->message, err->field);
    const char *field = named ? "" : err->field, *colon = named ? "" : ": ";
    if (spl_log_get_format() == SPL_LOG_JSON)
        spl_log_error("%s%s%s", field, colon, err->message);
    else
        fprintf(stderr, "splatd: %s%s%s\n", field, colon, err->message);
    return spl_exit_code(err->code);
}
