/* splatd info: what a dataset holds. */
#include "cmd/cmd.h"

int spl_cmd_info(int argc, char **argv)
{
    (void)argc;
    (void)argv;
    return 2;
}
