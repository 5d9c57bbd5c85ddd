/* splatd pack: scans in, a dataset out. On SIGINT and SIGTERM the temporary file is removed in the handler; the target
 * is never touched before the library's last rename. */
#include "cmd/pack.h"

#include <signal.h>
#include <stdio.h>
#include <unistd.h>

#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/table.h"
#include "service/datasets/catalog.h"

/* Of the dataset; of the scan while photographs or maps are put onto it, and of its points where it has panels; and the
 * parts of these two. */
enum { parts = 5 };
static char part_paths[parts][4096];

static void remove_part(int signal_number)
{
    for (int i = 0; i < parts; i++)
        if (part_paths[i][0])
            unlink(part_paths[i]);
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

static void catch_signals(const char *output)
{
    long pid = (long)getpid();
    static const char *const of[2] = {"scan", "points"};
    int length = snprintf(part_paths[0], sizeof part_paths[0], "%s.part-%ld-points.part-%ld", output, pid, pid);
    if (length < 0 || (size_t)length >= sizeof part_paths[0]) {
        part_paths[0][0] = 0;
        return;
    }
    snprintf(part_paths[0], sizeof part_paths[0], "%s.part-%ld", output, pid);
    for (int i = 0; i < 2; i++) {
        snprintf(part_paths[1 + i], sizeof part_paths[1 + i], "%s.part-%ld-%s", output, pid, of[i]);
        snprintf(part_paths[3 + i], sizeof part_paths[3 + i], "%s.part-%ld-%s.part-%ld", output, pid, of[i], pid);
    }
    struct sigaction action = {.sa_handler = remove_part, .sa_flags = (int)SA_RESETHAND};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    sigaction(SIGPIPE, &action, NULL); /* of who reads the progress */
    signal(SIGXFSZ, SIG_IGN); /* a file at its limit is an error like a full disk */
}

/* A file may have any name, a dataset that is served may not. */
static void warn_of_name(const char *path)
{
    size_t length;
    if (spl_catalog_id_of(path, &length))
        return;
    fputs("splatd: warning: '", stderr);
    spl_cmd_put_text(stderr, path, 0);
    fputs("' cannot be served under this name: an id has at most " SPL_CATALOG_ID_RULE "\n", stderr);
}

int spl_cmd_pack(int argc, char **argv)
{
    struct spl_cmd_pack_listener listener = {0};
    struct spl_cmd_pack a;
    struct spl_pack_report report = {0};
    struct spl_error err = {0};
    int rc = spl_cmd_pack_parse(&a, &listener, argc, argv, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (rc)
        return spl_cmd_fail(&err);
    warn_of_name(a.pack.output);
    catch_signals(a.pack.output);
    rc = spl_pack(&a.pack, &report, &err);
    spl_cmd_progress_finish(&listener.progress);
    if (!rc)
        spl_cmd_pack_print(a.pack.output, a.pack.export_primitives, &report);
    spl_cmd_pack_finish_left_out(&listener, !rc);
    return rc ? spl_cmd_fail(&err) : 0;
}
