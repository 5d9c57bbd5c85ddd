/* splatd pack --parts N: a plan, its parts one after the other, and one file of them, as on many machines, but by one
 * process, which needs memory for one part at a time. The plan and the parts that are whole lie in NAME.spld.parts
 * until the file is there: whoever was killed goes on. The command's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"
#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/pack_job.h"
#include "cmd/unfinished.h"
#include "dataset/writer.h"
#include "pack/check.h"
#include "pack/job/job.h"
#include "pack/said.h"

/* What the callbacks of a part get: the listener that they know, and how much work follows the part. */
struct parts_listener {
    struct spl_cmd_pack_listener listener; /* first */
    uint64_t begin_ns;    /* of the first part that was not there */
    double done, rest;    /* points, with those of halos: until the part's end, and behind it */
};

static void say_progress(void *context, const struct spl_progress *progress)
{
    const struct parts_listener *p = context;
    struct spl_progress said = *progress;
    const double passed_s = (double)(spl_now_ns() - p->begin_ns) / 1e9;
    if (p->done > 0 && said.left_s > 0)
        said.left_s += p->rest / p->done * (passed_s + said.left_s);
    spl_cmd_progress(&((struct parts_listener *)context)->listener.progress, &said);
}

static double count_points(const struct spl_job *job, uint32_t part)
{
    return (double)job->parts[part].points + (double)job->parts[part].halo_points;
}

/* Of parts and of the file that they are merged to, by what points usually take. */
static void say_room(const struct spl_job *job, const char *output)
{
    static const double bytes_a_point = 12;
    double points = 0;
    for (uint32_t k = 0; k < job->part_count; k++)
        points += (double)job->parts[k].points;
    spl_cmd_put_text(stderr, output, 0);
    fprintf(stderr, " and its parts will take about %.0f MB until all is done; %.0f MB are free there\n",
            2 * bytes_a_point * points / 1e6, (double)spl_file_get_free(output) / 1e6);
}

/* A part that is older than a scan that it reads was packed of what the scan was then, as far as anybody can tell. */
static void forget_if_outdated(const struct spl_job *job, uint32_t part)
{
    struct stat own, scan;
    char *path = spl_job_part_path(job, part, false);
    bool outdated = false;
    for (size_t i = 0; path && !stat(path, &own) && i < job->input_count && !outdated; i++)
        outdated = spl_job_reads(job, part, &job->inputs[i]) && !stat(job->inputs[i].file, &scan) &&
                   (scan.st_mtim.tv_sec > own.st_mtim.tv_sec || (scan.st_mtim.tv_sec == own.st_mtim.tv_sec &&
                                                                 scan.st_mtim.tv_nsec > own.st_mtim.tv_nsec));
    if (outdated && !unlink(path))
        fprintf(stderr, "a scan of it was written since it was packed: it is packed anew\n");
    free(path);
}

static int pack_parts(const struct spl_job *job, const struct spl_cmd_pack *a, struct parts_listener *listener,
                      struct spl_error *err)
{
    struct spl_pack_options options = a->pack;
    int rc = SPL_OK;
    options.progress = say_progress;
    options.progress_context = listener;
    listener->begin_ns = spl_now_ns();
    listener->rest = 0;
    for (uint32_t k = 0; k < job->part_count; k++)
        listener->rest += count_points(job, k);
    for (uint32_t k = 0; k < job->part_count && !rc; k++) {
        enum spl_part_outcome outcome;
        struct spl_pack_report report = {0};
        listener->done += count_points(job, k);
        listener->rest -= count_points(job, k);
        fprintf(stderr, "part %u of %u (part-%u.spld), about %llu points\n", k + 1, job->part_count, k,
                (unsigned long long)job->parts[k].points);
        forget_if_outdated(job, k);
        rc = spl_job_pack(job, k, &options, &report, &outcome, err);
        spl_cmd_progress_finish(&listener->listener.progress);
        if (rc || outcome == SPL_PART_MADE)
            continue;
        fprintf(stderr, outcome == SPL_PART_EMPTY ? "no point lies in it\n" : "it is there already\n");
        if (outcome == SPL_PART_WAS_THERE) { /* says nothing of how long the others take */
            listener->done -= count_points(job, k);
            listener->begin_ns = listener->done > 0 ? listener->begin_ns : spl_now_ns();
        }
    }
    return rc;
}

static int plan(const struct spl_cmd_pack *a, const char *folder, struct spl_job *job, struct spl_error *err)
{
    struct spl_plan_options options = {.pack = a->pack, .parts = a->parts, .halo = a->halo};
    bool unchanged = false;
    options.pack.output = folder;
    options.pack.default_view = NULL; /* they are of what parts become */
    options.pack.views = NULL;
    options.pack.view_count = 0;
    int rc = spl_job_plan(&options, job, &unchanged, err);
    if (!rc && unchanged) {
        spl_cmd_put_text(stderr, folder, 0);
        fprintf(stderr, ": the plan of these parts is there; those that are whole are not packed again\n");
    }
    return rc;
}

static int run(struct spl_cmd_pack *a, const char *folder, struct parts_listener *listener, struct spl_error *err)
{
    struct spl_job job;
    int rc = plan(a, folder, &job, err);
    spl_cmd_progress_finish(&listener->listener.progress);
    if (rc) {
        rmdir(folder); /* where it is empty */
        return rc;
    }
    const struct spl_collect_options options = spl_cmd_pack_joined(a, a->pack.output);
    say_room(&job, a->pack.output);
    rc = pack_parts(&job, a, listener, err);
    if (!rc)
        rc = spl_job_merge(&job, &options, err);
    spl_cmd_progress_finish(&listener->listener.progress);
    const bool left = rc || !spl_job_remove(folder);
    if (left) {
        spl_cmd_put_text(stderr, folder, 0);
        fprintf(stderr, rc ? ": parts that are whole are kept here; the same command goes on with them\n"
                           : ": something else than parts lies in this folder, or cannot be removed: it is left\n");
    }
    spl_job_finish(&job);
    return rc ? rc : spl_cmd_print_merged(a->pack.output, err);
}

/* What would be found wrong only once the parts are packed. */
static int check(const struct spl_cmd_pack *a, struct spl_error *err)
{
    struct spl_dataset_writer *writer = NULL;
    struct spl_chunk_options chunk;
    unsigned neighbours;
    int rc = spl_pack_check(&a->pack, &neighbours, &chunk, err);
    if (!rc)
        rc = spl_said_check(&a->pack, err);
    if (!rc)
        rc = spl_dataset_writer_create(a->pack.output, &writer, err); /* can it be written at all? */
    spl_dataset_writer_destroy(writer);
    return rc;
}

int spl_cmd_pack_run_parts(struct spl_cmd_pack *a, struct spl_cmd_pack_listener *listener, struct spl_error *err)
{
    struct parts_listener parts = {.listener = *listener};
    char *folder = NULL;
    int lock = -1;
    int rc = check(a, err);
    if (!rc && asprintf(&folder, "%s.parts", a->pack.output) < 0)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names of the parts");
    if (!rc)
        rc = spl_job_lock(folder, &lock, err);
    a->pack.progress_context = &parts;
    if (!rc) {
        rc = run(a, folder, &parts, err);
        close(lock);
    }
    a->pack.progress_context = listener;
    *listener = parts.listener;
    free(folder);
    return rc;
}
