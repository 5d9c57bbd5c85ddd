/* The subcommand table, and that what a command printed is written; nothing else. */
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "base/near_name.h"
#include "cmd/cmd.h"
#include "cmd/options.h"

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
} commands[] = {
#define COMMAND(name, help) {#name, spl_cmd_##name, help},
#include "cmd/commands.def"
#undef COMMAND
};

static const char *const names[] = {
#define COMMAND(name, help) #name,
#include "cmd/commands.def"
#undef COMMAND
    NULL};

static void usage(FILE *out)
{
    fprintf(out, "usage: splatd COMMAND [ARGUMENT…]\n\n");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        fprintf(out, "  %-8s %s\n", commands[i].name, commands[i].help);
    fprintf(out, "\n'splatd COMMAND --help' teaches each by example. A first picture:\n"
                 "  splatd synth courtyard -o scan && splatd pack scan/courtyard.ptx -o courtyard.spld\n"
                 "  splatd render courtyard.spld -o view.jpg\n");
}

static int run(int argc, char **argv)
{
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (!strcmp(argv[1], commands[i].name))
            return commands[i].run(argc - 1, argv + 1);
    if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) {
        usage(stdout);
        return 0;
    }
    if (!strcmp(argv[1], "--version")) {
        puts("splatd " SPLATD_VERSION);
        return 0;
    }
    const char *near = spl_near_name_find(argv[1], names);
    fprintf(stderr, "splatd: unknown command '%s'; %s%s%s'splatd --help' lists them\n", argv[1],
            near ? "did you mean " : "", near ? near : "", near ? "? " : "");
    return 2;
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        usage(stderr);
        return 2;
    }
    signal(SIGXFSZ, SIG_IGN); // a file at its limit is an error like a full disk
    int code = run(argc, argv);
    if ((fflush(stdout) || ferror(stdout)) && !code)
        code = spl_cmd_fail(&(struct spl_error){.code = SPL_E_IO, .message = "cannot write to stdout"});
    return code;
}
