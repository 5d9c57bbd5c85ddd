/* The state file. Appending is what makes it cheap (a result is a few hundred bytes) and safe: whatever a kill cuts off
 * is the last line, which has no newline yet. The plan, its first line, is there as a whole or not at all: what begins
 * otherwise is somebody else's, and stays. Numbers have 17 digits, so what is read back is what was measured. Owned by
 * one thread. */
#include "measure/state.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"

enum { FLAGS = JSON_COMPACT | JSON_REAL_PRECISION(17), file_most = 1 << 30 };

struct spl_state {
    FILE *file;
    char path[4096];
};

/* The first key whose value differs between the objects; NULL when they are equal. */
static const char *first_difference(const json_t *a, const json_t *b)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)a, key, value)
    {
        const json_t *other = json_object_get(b, key);
        if (!other || !json_equal(value, other))
            return key;
    }
    return json_equal(a, b) ? NULL : "plan";
}

/* The plan as it reads after a trip through the file: the shortest way to compare like with like. */
static int check_plan(const struct spl_state *s, const json_t *stored, const json_t *plan, struct spl_error *err)
{
    char *text = json_dumps(plan, FLAGS);
    json_t *mine = text ? json_loads(text, 0, NULL) : NULL;
    free(text);
    if (!mine)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the plan could not be compared");
    const char *key = first_difference(mine, stored);
    int rc = SPL_OK;
    if (key)
        rc = spl_fail_field(err, SPL_E_USAGE, key,
                            "%s belongs to a measurement with another '%s'; name another folder, or begin anew with "
                            "--restart",
                            s->path, key);
    json_decref(mine);
    return rc;
}

static int take_line(struct spl_state *s, char *line, size_t number, const json_t *plan,
                     bool (*take)(void *, const json_t *), void *context, struct spl_error *err)
{
    json_error_t wrong;
    json_t *record = json_loads(line, JSON_REJECT_DUPLICATES, &wrong);
    int rc = SPL_OK;
    if (!json_is_object(record))
        rc = spl_fail(err, SPL_E_INPUT, "%s: line %zu: %s; begin anew with --restart", s->path, number,
                      record ? "not an object" : wrong.text);
    else if (number == 1)
        rc = check_plan(s, record, plan, err);
    else if (!take(context, record))
        rc = spl_fail(err, SPL_E_INPUT, "%s: line %zu does not fit the plan in line 1; begin anew with --restart",
                      s->path, number);
    json_decref(record);
    return rc;
}

/* Reads every whole line; *end is where the last of them ends. */
static int read_lines(struct spl_state *s, const json_t *plan, bool (*take)(void *, const json_t *), void *context,
                      size_t *lines, off_t *end, struct spl_error *err)
{
    char *line = NULL;
    size_t room = 0;
    ssize_t length;
    int rc = SPL_OK;
    errno = 0;
    while (!rc && (length = getline(&line, &room, s->file)) > 0 && line[length - 1] == '\n') {
        *end += length;
        rc = take_line(s, line, ++*lines, plan, take, context, err);
    }
    if (!rc && ferror(s->file))
        rc = spl_fail_errno(err, errno, "cannot read %s", s->path);
    free(line);
    return rc;
}

static int put(struct spl_state *s, const json_t *record, struct spl_error *err)
{
    if (json_dumpf(record, s->file, FLAGS) || fputc('\n', s->file) == EOF || fflush(s->file))
        return spl_fail_errno(err, errno, "cannot write %s", s->path);
    return SPL_OK;
}

static int begin(const char *path, const json_t *plan, struct spl_error *err)
{
    char *text = json_dumps(plan, FLAGS), *line = NULL;
    const int length = text ? asprintf(&line, "%s\n", text) : -1;
    int rc = length < 0 ? spl_fail(err, SPL_E_NOMEM, "out of memory: the plan could not be stored")
                        : spl_file_replace(path, line, (size_t)length, err);
    free(text);
    free(line);
    return rc;
}

/* No link is followed and no pipe waited for: in a folder that another made they may lead anywhere. */
static int open_file(struct spl_state *s, struct spl_error *err)
{
    struct stat status;
    int fd = open(s->path, O_RDWR | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0 && errno != ELOOP)
        return spl_fail_errno(err, errno, "cannot open %s", s->path);
    if (fd < 0 || fstat(fd, &status) || !S_ISREG(status.st_mode) || status.st_size > file_most) {
        if (fd >= 0)
            close(fd);
        return spl_fail(err, SPL_E_INPUT,
                        "%s: no file of at most %d MiB, which the state of a measurement is; name "
                        "another folder, or begin anew with --restart",
                        s->path, file_most >> 20);
    }
    if (!(s->file = fdopen(fd, "a+"))) {
        close(fd);
        return spl_fail(err, SPL_E_NOMEM, "out of memory for %s", s->path);
    }
    return SPL_OK;
}

int spl_state_open(const char *path, const json_t *plan, bool restart, bool (*take)(void *, const json_t *),
                   void *context, struct spl_state **out, size_t *resumed, struct spl_error *err)
{
    *out = NULL;
    *resumed = 0;
    struct spl_state *s = spl_alloc(1, sizeof *s, err);
    if (!s)
        return SPL_E_NOMEM;
    int rc = SPL_OK;
    size_t lines = 0;
    off_t end = 0;
    if ((size_t)snprintf(s->path, sizeof s->path, "%s", path) >= sizeof s->path)
        rc = spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", path);
    if (!rc && (restart || (faccessat(AT_FDCWD, path, F_OK, AT_SYMLINK_NOFOLLOW) && errno == ENOENT)))
        rc = begin(path, plan, err);
    if (!rc)
        rc = open_file(s, err);
    if (!rc) {
        rewind(s->file);
        rc = read_lines(s, plan, take, context, &lines, &end, err);
    }
    if (!rc && !lines)
        rc = spl_fail(err, SPL_E_INPUT,
                      "%s: it does not begin with the plan of a measurement; name another folder, or "
                      "begin anew with --restart",
                      path);
    if (!rc && (fseeko(s->file, end, SEEK_SET) || ftruncate(fileno(s->file), end)))
        rc = spl_fail_errno(err, errno, "cannot write %s", path);
    if (rc) {
        spl_state_close(s);
        return rc;
    }
    *resumed = lines - 1;
    *out = s;
    return SPL_OK;
}

int spl_state_add(struct spl_state *s, json_t *record, struct spl_error *err)
{
    int rc = record ? put(s, record, err) : spl_fail(err, SPL_E_NOMEM, "out of memory: a result could not be stored");
    json_decref(record);
    return rc;
}

void spl_state_close(struct spl_state *s)
{
    if (!s)
        return;
    if (s->file)
        fclose(s->file);
    free(s);
}
