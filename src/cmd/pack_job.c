/* What the three say: the plan's table goes to stdout, with the ways to run its parts. On SIGINT and SIGTERM temporary
 * files are removed in a handler, as by pack. The command's thread. */
#include "cmd/pack_job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/unfinished.h"
#include "pack/job/job.h"

enum { rows_most = 64 };

bool spl_cmd_pack_is_job(const struct spl_cmd_pack *a)
{
    return a->plan || a->part != SPL_CMD_PACK_NO_PART || a->join;
}

/* Options may be cut short on the command line. */
static bool is_among(const char *word, const char *const *names)
{
    size_t length = strcspn(word + 2, "=");
    bool is = false;
    for (size_t i = 0; names[i]; i++)
        is |= !strncmp(word + 2, names[i], length);
    return is;
}

int spl_cmd_pack_check_job(const struct spl_cmd_pack *a, char *const *words, int word_count, int operands,
                           struct spl_error *err)
{
    static const char *const of_part[] = {"part", "memory", "threads", NULL};
    static const char *const of_join[] = {"join", "output",       "title", "description", "threads",
                                          "view", "default-view", "merge", NULL};
    const bool part = a->part != SPL_CMD_PACK_NO_PART;
    if ((a->plan > 0) + part + a->join > 1)
        return spl_fail(err, SPL_E_USAGE, "--plan, --part and --join are three steps: name one of them at a time");
    if (a->parts)
        return spl_fail(err, SPL_E_USAGE, "--parts N does what --plan, --part and --join do, in one go: name one way");
    if (a->plan && !a->pack.output)
        return spl_fail(err, SPL_E_USAGE, "--plan needs a folder for the job: splatd pack --plan %u scans -o job",
                        a->plan);
    if (a->plan)
        return operands ? SPL_OK
                        : spl_fail(err, SPL_E_USAGE,
                                   "--plan needs at least one scan: splatd pack --plan %u scans -o job", a->plan);
    const char *step = part ? "--part" : "--join";
    if (operands != 1)
        return spl_fail(err, SPL_E_USAGE, "%s takes one folder, that of the job: splatd pack %s job", step,
                        part ? "--part 0" : "--join");
    for (int i = 0; i < word_count; i++)
        if (!strncmp(words[i], "--", 2) && words[i][2] && !is_among(words[i], part ? of_part : of_join))
            return spl_fail(
                err, SPL_E_USAGE, "%.40s is decided by the plan: %s takes %s alone beside the job; name it to --plan",
                words[i], step, part ? "--memory and --threads"
                     : "-o, --merge, --title, --description, --default-view, --view and --threads");
    if (a->join && a->merge && !a->pack.output)
        return spl_fail(err, SPL_E_USAGE,
                        "--merge needs a dataset to write: splatd pack --join %.200s --merge -o NAME.spld",
                        a->pack.inputs[0]);
    if (part && a->pack.output)
        return spl_fail(err, SPL_E_USAGE, "--part writes part-%llu.spld in the job's folder: leave out -o",
                        (unsigned long long)a->part);
    return SPL_OK;
}

/* Of a file whose rows can be gone to, those of the part. */
static uint64_t bytes_read(const struct spl_job *job, uint32_t part, const struct spl_job_input *input)
{
    double share = (double)spl_job_rows(job, part, input) / (double)(input->points ? input->points : 1);
    return (uint64_t)(share * (double)input->bytes);
}

static void print_plan(const struct spl_job *job, bool unchanged)
{
    uint64_t points = 0, halo = 0, most = 0, read = 0, bytes = 0;
    const unsigned last = job->part_count - 1;
    printf("%6s %15s %15s %8s %10s\n", "part", "points", "in its halo", "scans", "MB read");
    for (uint32_t k = 0; k < job->part_count; k++) {
        const struct spl_job_box *part = &job->parts[k];
        uint64_t own = 0, scans = 0;
        for (size_t i = 0; i < job->input_count; i++)
            if (spl_job_reads(job, k, &job->inputs[i])) {
                own += bytes_read(job, k, &job->inputs[i]);
                scans++;
            }
        halo += part->halo_points;
        most = part->points > most ? part->points : most;
        read += own;
        if (k < rows_most)
            printf("%6u %15llu %15llu %8llu %10.1f\n", k, (unsigned long long)part->points,
                   (unsigned long long)part->halo_points, (unsigned long long)scans, (double)own / 1e6);
        else if (k == rows_most)
            printf("   ... and %u more\n", job->part_count - k);
    }
    for (size_t i = 0; i < job->input_count; i++) {
        bytes += job->inputs[i].bytes;
        points += job->inputs[i].points;
    }
    printf("%u parts of %llu points, the largest %.2f times the mean; %.1f %% of the points lie in a neighbour's halo "
           "too, "
           "%.3g wide; the scans' bytes are read %.1f times.\n",
           job->part_count, (unsigned long long)points, (double)most * job->part_count / (double)(points ? points : 1),
           100 * (double)halo / (double)(points ? points : 1), job->rules.halo,
           (double)read / (double)(bytes ? bytes : 1));
    spl_cmd_put_text(stdout, job->folder, 0);
    printf(": %s %s. Pack its parts, in any order, on any machine that sees it and the scans at the same distance:\n",
           unchanged ? "the same plan as before, job" : "job", job->id);
    printf("  make -f deploy/pack/Makefile -j2 JOB=%s                     all of it here, joined too\n", job->folder);
    printf("  sbatch --array=0-%u deploy/pack/slurm.sbatch %s             a Slurm array\n", last, job->folder);
    printf("  kubectl apply -f deploy/pack/job.yaml                        an Indexed Job, completions: %u\n",
           job->part_count);
    printf("  splatd pack --part K %s                                    each by itself, K from 0 to %u\n", job->folder,
           last);
    printf("and then make one dataset of them: splatd pack --join %s (one file: with --merge -o NAME.spld)\n",
           job->folder);
}

static int plan(const struct spl_cmd_pack *a, struct spl_cmd_pack_listener *listener, struct spl_error *err)
{
    const struct spl_plan_options options = {.pack = a->pack, .parts = a->plan, .halo = a->halo};
    struct spl_job job;
    bool unchanged = false;
    int rc = spl_job_plan(&options, &job, &unchanged, err);
    spl_cmd_progress_finish(&listener->progress);
    if (rc)
        return rc;
    print_plan(&job, unchanged);
    spl_job_finish(&job);
    return SPL_OK;
}

void spl_cmd_pack_clean_up_on_signals(const char *output)
{
    const long pid = (long)getpid();
    for (int i = 0; i < 3; i++) {
        char path[4096];
        int length = i == 0   ? snprintf(path, sizeof path, "%s" SPL_UNFINISHED, output, pid)
                     : i == 1 ? snprintf(path, sizeof path, "%s" SPL_UNFINISHED "-tiles", output, pid)
                              : snprintf(path, sizeof path, "%s" SPL_UNFINISHED "-tiles" SPL_UNFINISHED, output, pid,
                                         pid);
        if (length >= 0 && (size_t)length < sizeof path)
            spl_cmd_remove_unfinished(path);
    }
}

static int pack_part(const struct spl_cmd_pack *a, struct spl_cmd_pack_listener *listener, struct spl_error *err)
{
    const uint32_t number = (uint32_t)a->part;
    enum spl_part_outcome outcome;
    struct spl_pack_report report = {0};
    struct spl_job job;
    int rc = spl_job_read(&job, a->pack.inputs[0], err);
    if (rc)
        return rc;
    char *path = spl_job_part_path(&job, number, false);
    if (path)
        spl_cmd_pack_clean_up_on_signals(path);
    rc = path ? spl_job_pack(&job, number, &a->pack, &report, &outcome, err)
              : spl_fail(err, SPL_E_NOMEM, "out of memory for the names of parts");
    spl_cmd_progress_finish(&listener->progress);
    if (!rc && outcome == SPL_PART_MADE)
        spl_cmd_pack_print(path, NULL, &report);
    else if (!rc) {
        spl_cmd_put_text(stderr, outcome == SPL_PART_EMPTY ? job.folder : path, 0);
        fprintf(stderr,
                outcome == SPL_PART_EMPTY ? ": no point lies in part %u, which is noted\n"
                                          : ": part %u is there, whole and of this plan\n",
                number);
    }
    free(path);
    spl_job_finish(&job);
    return rc;
}

struct spl_collect_options spl_cmd_pack_joined(const struct spl_cmd_pack *a, const char *output)
{
    return (struct spl_collect_options){.size = sizeof(struct spl_collect_options),
                                        .output = output,
                                        .title = a->pack.title,
                                        .description = a->pack.description,
                                        .default_view = a->pack.default_view,
                                        .views = a->pack.views,
                                        .view_count = a->pack.view_count,
                                        .threads = a->pack.threads,
                                        .progress = a->pack.progress,
                                        .progress_context = a->pack.progress_context};
}

static int join(const struct spl_cmd_pack *a, struct spl_cmd_pack_listener *listener, struct spl_error *err)
{
    struct spl_job job;
    char *all = NULL;
    int rc = a->merge ? spl_cmd_check_dataset("pack --join --merge", a->pack.output, err) : SPL_OK;
    if (!rc)
        rc = spl_job_read(&job, a->pack.inputs[0], err);
    if (rc)
        return rc;
    if (!a->pack.output && asprintf(&all, "%s/all.spld", job.folder) < 0)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of the dataset");
    const struct spl_collect_options options = spl_cmd_pack_joined(a, all ? all : a->pack.output);
    if (!rc) {
        spl_cmd_pack_clean_up_on_signals(options.output);
        rc = a->merge ? spl_job_merge(&job, &options, err) : spl_job_join(&job, &options, err);
    }
    spl_cmd_progress_finish(&listener->progress);
    if (!rc)
        rc = a->merge ? spl_cmd_print_merged(options.output, err) : spl_cmd_print_collection(options.output, err);
    free(all);
    spl_job_finish(&job);
    return rc;
}

int spl_cmd_pack_run_job(struct spl_cmd_pack *a, struct spl_cmd_pack_listener *listener, struct spl_error *err)
{
    return a->plan ? plan(a, listener, err) : a->join ? join(a, listener, err) : pack_part(a, listener, err);
}
