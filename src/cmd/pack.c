/* splatd pack: scans in, a dataset out. On SIGINT and SIGTERM the temporary file is removed in the handler; the target
 * is never touched before the library's last rename. */
#include "cmd/pack.h"

#include <stdio.h>
#include <unistd.h>

#include "base/file.h"
#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/pack_job.h"
#include "cmd/table.h"
#include "cmd/unfinished.h"
#include "service/datasets/catalog.h"

/* The dataset's temporary file; the scan's while photographs or maps are put onto it, and its points' where it has
 * panels; and the parts of these two. */
static void clean_up_on_signals(const char *output)
{
    static const char *const of[2] = {"scan", "points"};
    long pid = (long)getpid();
    char path[4096];
    int length = snprintf(path, sizeof path, "%s" SPL_UNFINISHED "-points" SPL_UNFINISHED, output, pid,
                          pid); /* the longest */
    if (length < 0 || (size_t)length >= sizeof path)
        return;
    snprintf(path, sizeof path, "%s" SPL_UNFINISHED, output, pid);
    spl_cmd_remove_unfinished(path);
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s" SPL_UNFINISHED "-%s", output, pid, of[i]);
        spl_cmd_remove_unfinished(path);
        snprintf(path, sizeof path, "%s" SPL_UNFINISHED "-%s" SPL_UNFINISHED, output, pid, of[i], pid);
        spl_cmd_remove_unfinished(path);
    }
}

/* A file may have any name, a dataset that is opened may not. */
static void warn_of_name(const char *path)
{
    size_t length;
    if (spl_catalog_id_of(path, &length))
        return;
    fputs("splatd: warning: '", stderr);
    spl_cmd_put_text(stderr, path, 0);
    fputs("' is opened by no command under this name; rename it: an id has at most " SPL_CATALOG_ID_RULE "\n", stderr);
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
    if (spl_cmd_pack_is_job(&a)) {
        rc = spl_cmd_pack_run_job(&a, &listener, &err);
        spl_cmd_pack_finish_left_out(&listener, !rc);
        return rc ? spl_cmd_fail(&err) : 0;
    }
    warn_of_name(a.pack.output);
    if (a.parts) {
        spl_cmd_pack_clean_up_on_signals(a.pack.output);
        rc = spl_cmd_pack_run_parts(&a, &listener, &err);
        spl_cmd_pack_finish_left_out(&listener, !rc);
        return rc ? spl_cmd_fail(&err) : 0;
    }
    clean_up_on_signals(a.pack.output);
    rc = spl_pack(&a.pack, &report, &err);
    spl_cmd_progress_finish(&listener.progress);
    if (!rc)
        spl_cmd_pack_print(a.pack.output, a.pack.export_primitives, &report);
    spl_cmd_pack_finish_left_out(&listener, !rc);
    return rc ? spl_cmd_fail(&err) : 0;
}
