/* The handler that removes the temporary files: it only unlinks, which a signal's handler may. */
#include "cmd/unfinished.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { most = 5 };
static char paths[most][4096];
static volatile sig_atomic_t count;

static void remove_all(int signal_number)
{
    for (int i = 0; i < count; i++)
        unlink(paths[i]);
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

void spl_cmd_remove_unfinished(const char *path)
{
    size_t length = strlen(path);
    if (count == most || length >= sizeof paths[0])
        return;
    memcpy(paths[count], path, length + 1);
    if (count++)
        return;
    struct sigaction action = {.sa_handler = remove_all, .sa_flags = (int)SA_RESETHAND};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    sigaction(SIGPIPE, &action, NULL); /* of who reads the progress */
}
