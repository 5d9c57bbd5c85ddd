/* splatd info of scans: each is opened as a pack would open it, read to its end unless that is not wanted, and
 * described before the next one, so that thousands of tiles take the memory of one. Owned by the command's thread. */
#include "cmd/info_scan_parts.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/exit.h"
#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "dataset/remote_url.h"
#include "pack/look.h"

enum { batch_points = 65536 };

struct session {
    const struct spl_info_scan_options *options;
    struct spl_cmd_progress progress;
    int worst; /* exit code */
};

bool spl_info_is_scan(const char *path)
{
    char first[6] = "";
    struct stat status;
    if (path[0] == '@' || (!stat(path, &status) && S_ISDIR(status.st_mode)))
        return true;
    if (spl_remote_is_url(path) || !strcasecmp(spl_cmd_ending(path), "spld")) // scans are read from files alone
        return false;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    ssize_t got = fd < 0 ? -1 : read(fd, first, sizeof first);
    if (fd >= 0)
        close(fd);
    return got != sizeof first || memcmp(first, "SPLD\r\n", sizeof first);
}

static void say_left_out(void *context, const struct spl_error *why)
{
    struct session *s = context;
    spl_cmd_progress_finish(&s->progress);
    int code = spl_cmd_fail(why);
    s->worst = code > s->worst ? code : s->worst;
}

static void say_warning(void *context, const char *text)
{
    struct session *s = context;
    spl_cmd_progress_finish(&s->progress);
    fprintf(stderr, "splatd: ");
    spl_cmd_put_text(stderr, text, 0);
    fputc('\n', stderr);
}

static void say_progress(void *context, const struct spl_progress *progress)
{
    spl_cmd_progress(&((struct session *)context)->progress, progress);
}

static int print_json(json_t *json, struct spl_error *err)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of a scan");
    puts(text);
    free(text);
    return SPL_OK;
}

static int tell(struct session *s, const struct spl_scans *scans, struct spl_scan *scan,
                const struct spl_cloud_info *info, const char *strays, struct spl_error *err)
{
    json_t *json = spl_info_describe_scan(scans, scan, info, s->options);
    if (strays[0])
        json_array_append_new(json_object_get(json_object_get(json, "pack"), "warnings"), spl_info_text(strays));
    spl_cmd_progress_finish(&s->progress);
    if (s->options->json)
        return print_json(json, err);
    spl_info_print_scan(json, scan, info, s->options->read);
    json_decref(json);
    return SPL_OK;
}

static int tell_together(struct session *s, const struct spl_scans *scans, struct spl_error *err)
{
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    uint64_t points = 0;
    char text[32];
    for (size_t i = 0; i < scans->count; i++) {
        points += spl_info_count_points(&scans->list[i]);
        for (int c = 0; c < 3; c++) {
            min[c] = fmin(min[c], scans->list[i].min[c]);
            max[c] = fmax(max[c], scans->list[i].max[c]);
        }
    }
    json_t *pack = spl_info_describe_pack(scans, scans->list, scans->count);
    bool boxed = min[0] <= max[0];
    if (s->options->json)
        return print_json(json_pack("{s:I, s:I, s:o, s:o}", "scans", (json_int_t)scans->count, "points",
                                    (json_int_t)points, "bounds", boxed ? spl_info_bounds(min, max) : json_null(),
                                    "pack", pack),
                          err);
    printf("%zu scans together\n  points        %s\n", scans->count, spl_cmd_group(points, text));
    if (boxed)
        printf("  bounds        %.10g %.10g %.10g to\n                %.10g %.10g %.10g\n", min[0], min[1], min[2],
               max[0], max[1], max[2]);
    spl_info_print_pack(pack);
    json_decref(pack);
    return SPL_OK;
}

static int tell_all(struct session *s, struct spl_scans *scans, struct spl_stage *stage, struct spl_error *err)
{
    struct spl_point_batch batch;
    char strays[SPL_STRAYS_TEXT_MAX];
    int rc = spl_point_batch_init(&batch, batch_points, err);
    for (size_t i = 0; !rc && i < scans->count;) {
        struct spl_cloud *cloud = NULL;
        struct spl_error why = {0};
        rc = spl_scan_look(scans, &scans->list[i], s->options->read, &batch, stage, strays, &cloud, &why);
        if (rc && !(rc = spl_inputs_leave_out(scans->inputs, scans->list[i].path, rc, &why, err))) {
            spl_scans_remove(scans, i);
            continue;
        }
        if (!rc)
            rc = tell(s, scans, &scans->list[i++], spl_cloud_get_info(cloud), strays, err);
        spl_cloud_destroy(cloud);
    }
    spl_point_batch_finish(&batch);
    return !rc && scans->count > 1 ? tell_together(s, scans, err) : rc;
}

int spl_info_print_scans(const char *const *given, size_t count, const struct spl_info_scan_options *options)
{
    struct session s = {.options = options};
    const struct spl_inputs_listener listener = {say_warning, say_left_out, &s};
    struct spl_stage stage = {.callback = isatty(STDERR_FILENO) ? say_progress : NULL, .context = &s, .threads = 1};
    const struct spl_keep keep = {0};
    const struct spl_cloud_options how = {.columns = options->columns, .keep = &keep};
    struct spl_scans scans = {0};
    struct spl_inputs inputs = {0};
    struct spl_error err = {0};
    int rc = spl_inputs_find(&inputs, given, count, &listener, &err);
    if (!rc)
        rc = spl_scans_init(&scans, &inputs, &how, &stage, &err);
    if (!rc)
        rc = tell_all(&s, &scans, &stage, &err);
    spl_cmd_progress_finish(&s.progress);
    if (rc && strcmp(err.field, "inputs")) /* that there is nothing left has been said one by one */
        s.worst = spl_cmd_fail(&err);
    spl_scans_finish(&scans);
    spl_inputs_finish(&inputs);
    return s.worst;
}
