/* What a job's files share. Pure but for memory. */
#include "pack/job/job.h"

#include <stdio.h>
#include <stdlib.h>

bool spl_job_reads(const struct spl_job *job, uint32_t part, const struct spl_job_input *input)
{
    const struct spl_job_box *box = &job->parts[part];
    bool reaches = input->points > 0;
    for (int c = 0; c < 3; c++)
        reaches &=
            input->box[0][c] <= box->max[c] + job->rules.halo && input->box[1][c] >= box->min[c] - job->rules.halo;
    return reaches;
}

char *spl_job_part_path(const struct spl_job *job, uint32_t part, bool mark)
{
    char *path;
    return asprintf(&path, "%s/part-%u.%s", job->folder, part, mark ? "empty" : "spld") < 0 ? NULL : path;
}

void spl_job_finish(struct spl_job *job)
{
    for (size_t i = 0; i < job->input_count; i++) {
        free(job->inputs[i].path);
        free(job->inputs[i].file);
    }
    free(job->inputs);
    free(job->parts);
    free(job->folder);
    json_decref(job->document);
    *job = (struct spl_job){0};
}
