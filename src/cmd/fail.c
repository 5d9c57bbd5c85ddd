/* How every subcommand ends when a library call fails. */
#include "cmd/cmd.h"

#include <stdio.h>
#include <string.h>

int spl_cmd_fail(const struct spl_error *err)
{
    if (err->field[0] && !strstr(err->message, err->field))
        fprintf(stderr, "splatd: %s: %s\n", err->field, err->message);
    else
        fprintf(stderr, "splatd: %s\n", err->message);
    return spl_code_get_info(err->code)->exit_code;
}
