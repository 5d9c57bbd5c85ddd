/* What a job's files share. Pure but for memory. */
#include "pack/job/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool spl_job_reads(const struct spl_job *job, uint32_t part, const struct spl_job_input *input)
{
    const struct spl_job_box *box = &job->parts[part];
    bool reaches = input->points > 0;
    for (int c = 0; c < 3; c++)
        reaches &=
            input->box[0][c] <= box->max[c] + job->rules.halo && input->box[1][c] >= box->min[c] - job->rules.halo;
    return reaches;
}

uint64_t spl_job_rows(const struct spl_job *job, uint32_t part, const struct spl_job_input *input)
{
    struct spl_part_rules rules = job->rules;
    const struct spl_part_blocks blocks = {(const double(*)[6])input->blocks, input->block_count, input->block_rows,
                                           input->points};
    uint64_t row = 0, begin, end, rows = 0;
    if (!spl_job_reads(job, part, input) || !input->blocks)
        return spl_job_reads(job, part, input) ? input->points : 0;
    memcpy(rules.min, job->parts[part].min, sizeof rules.min);
    memcpy(rules.max, job->parts[part].max, sizeof rules.max);
    for (; spl_part_next_rows(&rules, &blocks, row, &begin, &end); row = end)
        rows += end - begin;
    return rows;
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
        free(job->inputs[i].blocks);
    }
    free(job->inputs);
    free(job->parts);
    free(job->poses);
    free(job->folder);
    json_decref(job->document);
    *job = (struct spl_job){0};
}
