/* Plans of jobs: whatever is accepted is named alike again, and its parts are boxes that a point can be asked of. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "pack/job/job.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Mutations have other ids than they say: the second try has what was found to be right. */
static char *give_id(const char *text, size_t size, const struct spl_error *err)
{
    const char *right = strstr(err->message, "what it says "), *at = memmem(text, size, "\"id\": \"", 7);
    if (strcmp(err->field, "id") != 0 || !right || !at || at + 7 + 16 > text + size)
        return NULL;
    char *copy = malloc(size + 1);
    memcpy(copy, text, size);
    memcpy(copy + (at + 7 - text), right + strlen("what it says "), 16);
    return copy;
}

static int parse(struct spl_job *job, const char *text, size_t size, struct spl_error *err)
{
    int rc = spl_job_parse(job, text, size, "/folder", "file", err);
    if (rc ? err->code != rc || !err->message[0] || job->inputs || job->document : err->code != 0)
        abort();
    return rc;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct spl_job job;
    struct spl_error err = {0}, again = {0};
    int rc = parse(&job, (const char *)data, size, &err);
    char *text = rc ? give_id((const char *)data, size, &err) : NULL;
    if (text)
        rc = parse(&job, text, size, &again);
    free(text);
    if (rc)
        return 0;
    char id[SPL_JOB_ID_MAX];
    memcpy(id, job.id, sizeof id);
    if (spl_job_name(&job, NULL) || strcmp(id, job.id) != 0)
        abort();
    for (uint32_t k = 0; k < job.part_count; k++) {
        struct spl_part_rules rules = job.rules;
        char *path = spl_job_part_path(&job, k, true);
        memcpy(rules.min, job.parts[k].min, sizeof rules.min);
        memcpy(rules.max, job.parts[k].max, sizeof rules.max);
        for (size_t i = 0; i < job.input_count && i < 8; i++) {
            const struct spl_job_input *input = &job.inputs[i];
            if (spl_job_rows(&job, k, input) > input->points)
                abort();
            if (spl_part_find(&rules, input->box[0], input->box[1], input->box[0]) == SPL_PART_INSIDE &&
                input->points && !spl_job_reads(&job, k, input))
                abort();
        }
        free(path);
    }
    spl_job_finish(&job);
    return 0;
}
