/* A job: scans that are packed in parts, each by a process of its own on any machine, and become one dataset. It is a
 * folder with job.json, which says all that parts must do alike, and in the end the parts and their collection. */
#ifndef SPL_PACK_JOB_JOB_H
#define SPL_PACK_JOB_JOB_H

#include <jansson.h>

#include <splatd/collect.h>
#include <splatd/pack.h>

#include "cloud/cloud.h"
#include "pack/job/rules.h"

enum { SPL_JOB_PARTS_MAX = SPL_COLLECT_TILES_MAX, SPL_JOB_ID_MAX = 17, SPL_JOB_VERSION = 1 };
#define SPL_JOB_FILE "job.json"

struct spl_job_input {
    char *path; // owned: as it is written, relative to the job's folder
    char *file; // owned: the same to open
    uint64_t bytes;
    uint64_t ends;       /* hash of its first and last 64 KiB */
    uint64_t points;     /* that its header says, or that were counted; 0: no part reads it */
    double box[2][3];    /* likewise: least and most of coordinates, finite; a header's may be wrong */
    uint64_t block_rows; /* where the file's rows can be gone to: points of a block, the last of which has the rest */
    double (*blocks)[6]; // owned: least and most of x, y, z of each; NULL: all of the file is read
    size_t block_count;
    struct spl_cloud_colors colors;
    uint32_t first_number; /* its own, or that of its first station */
};

struct spl_job_box {
    double min[3], max[3];        /* half open; outer sides infinite */
    uint64_t points, halo_points; /* that are expected in it and around it */
};

struct spl_job {
    char *folder;            // owned
    json_t *document;        // owned: job.json; may be NULL, while it is planned
    char id[SPL_JOB_ID_MAX]; /* of all that parts depend on */
    /* columns to primitives, which parts depend on; title and description for the collection. Texts are borrowed. */
    struct spl_pack_options options;
    double unit_m;                /* as of struct spl_system */
    const char *crs;              // borrowed; may be NULL
    struct spl_part_rules rules;  /* but for the box */
    double (*poses)[16];          // owned: rules.poses
    struct spl_job_input *inputs; // owned
    size_t input_count;
    struct spl_job_box *parts; // owned
    uint32_t part_count;
};

/* Reads `folder`/job.json; nothing in it is trusted. SPL_E_INPUT names the field, SPL_E_NOT_FOUND where there is none.
 * On failure nothing is held. */
int spl_job_read(struct spl_job *job, const char *folder, struct spl_error *err);

/* The same from its bytes; `name` is for messages. */
int spl_job_parse(struct spl_job *job, const char *bytes, size_t length, const char *folder, const char *name,
                  struct spl_error *err);

/* Gives it its id. SPL_E_NOMEM; SPL_E_USAGE for a path or text that is no UTF-8. */
int spl_job_name(struct spl_job *job, struct spl_error *err);

/* Writes it: whole or not at all. */
int spl_job_write(const struct spl_job *job, struct spl_error *err);

/* Whether the input reaches into the part or its halo. */
bool spl_job_reads(const struct spl_job *job, uint32_t part, const struct spl_job_input *input);

/* Points of it that the part reads then. */
uint64_t spl_job_rows(const struct spl_job *job, uint32_t part, const struct spl_job_input *input);

/* The path of part `part`, or of the mark that it has no point; free(). NULL: no memory. */
char *spl_job_part_path(const struct spl_job *job, uint32_t part, bool mark);

void spl_job_finish(struct spl_job *job);

/* ----------------------------------------------------------------------------------- what splatd pack does with it */

struct spl_plan_options {
    struct spl_pack_options pack; /* `output` is the job's folder, which is made; callbacks and all */
    uint32_t parts;               /* 1..SPL_JOB_PARTS_MAX */
    double halo;                  /* in the scans' unit; < 0: as wide as the points' spacing asks for */
};

/* Decides all and writes it, and leaves it in *job, which the caller finishes. An older plan there is replaced,
 * anything else refused. *unchanged: the same plan was there. SPL_E_USAGE of options that cannot be split. Blocks, as
 * spl_pack(); its errors. */
int spl_job_plan(const struct spl_plan_options *options, struct spl_job *job, bool *unchanged, struct spl_error *err);

enum spl_part_outcome { SPL_PART_MADE, SPL_PART_EMPTY, SPL_PART_WAS_THERE };

/* Packs one part, unless it is there. Of `options` memory, threads and callbacks count. Blocks, as spl_pack(); its
 * errors; SPL_E_INPUT where an input is not the one that was planned with. */
int spl_job_pack(const struct spl_job *job, uint32_t part, const struct spl_pack_options *options,
                 struct spl_pack_report *report, enum spl_part_outcome *outcome, struct spl_error *err);

/* Collects the parts as options->output; of `options` that, threads and callbacks count, and title and description
 * where they are given. SPL_E_INPUT names what is missing or of another job. */
int spl_job_join(const struct spl_job *job, const struct spl_collect_options *options, struct spl_error *err);

/* Joins them and makes options->output one file of that, in any folder; its sources are the scans. Nothing is written
 * to the job's folder; SPL_E_USAGE where the output is one of the scans. */
int spl_job_merge(const struct spl_job *job, const struct spl_collect_options *options, struct spl_error *err);

/* Makes the folder `path` where there is none, and has it for one process until the descriptor *lock is closed:
 * SPL_E_USAGE where another one has it. */
int spl_job_lock(const char *path, int *lock, struct spl_error *err);

/* Removes parts, of older plans too, what killed packs left of them, the plan, and the folder. False: something else
 * lies there, or could not be removed, and so stay folder and plan. */
bool spl_job_remove(const char *folder);

#endif
