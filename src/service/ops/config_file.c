/* A config file: lines `name = value`, '#' begins a comment line. Plain on purpose: no sections, no quotes, no escapes,
 * so that a value is what stands there. Errors name the file, the line, the parameter and the value.
 *
 * The file is read whole (at most config_max) before anything is set. Any thread, at start. */
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/near_name.h"
#include "service/ops/options.h"

enum { config_max = 1 << 20 };

/* The part of [begin, end) without blanks around it, as a string in place; the caller owns the byte at `end`. */
static char *trim(char *begin, char *end)
{
    while (begin < end && isspace((unsigned char)*begin))
        begin++;
    while (end > begin && isspace((unsigned char)end[-1]))
        end--;
    *end = '\0';
    return begin;
}

/* `given` holds the line that has each name, 0 for none. */
static int parse_line(struct spl_service_options *options, const char *path, unsigned number, char *line, char *end,
                      unsigned given[SPL_PARAMETERS], struct spl_error *err)
{
    char where[256], *text = trim(line, end), *equals = strchr(text, '=');
    if (!*text || (*text == '#' && !strchr(text, '\r')))
        return 0;
    snprintf(where, sizeof where, "%.200s, line %u: ", path, number);
    if (strchr(text, '\r'))
        return spl_fail(err, SPL_E_USAGE, "%sa carriage return in its middle; lines end in newline or CRLF", where);
    if (!equals)
        return spl_fail(err, SPL_E_USAGE, "%s'%.80s' is no 'name = value'", where, text);
    char *value = trim(equals + 1, equals + strlen(equals)), *name = trim(text, equals);
    size_t index = spl_parameter_find(name);
    if (index == SPL_PARAMETERS) {
        struct spl_near_name near = spl_near_name_of(name);
        char meant[SPL_NEAR_NAME_TEXT_MAX];
        for (size_t i = 0; i < SPL_PARAMETERS; i++)
            spl_near_name_offer(&near, spl_parameters[i].name);
        return spl_fail(err, SPL_E_USAGE, "%sthere is no parameter '%.80s'; %s'splatd serve --help' lists them", where,
                        name, spl_near_name_say(&near, meant));
    }
    if (given[index] && spl_parameters[index].type != SPL_PARAMETER_LIST)
        return spl_fail_field(err, SPL_E_USAGE, name, "%s%s is given a second time, as '%.80s'; line %u has it already",
                              where, name, value, given[index]);
    given[index] = number;
    return spl_service_options_set(options, index, value, SPL_FROM_FILE, where, err);
}

int spl_service_options_parse(struct spl_service_options *options, const char *path, const char *data, size_t length,
                              struct spl_error *err)
{
    static const char mark[] = "\xef\xbb\xbf"; // what editors for Windows put first
    unsigned given[SPL_PARAMETERS] = {0};
    unsigned number = 1;
    const char *zero = memchr(data, '\0', length);
    for (const char *c = data; zero && c < zero; c++)
        number += *c == '\n';
    if (zero)
        return spl_fail(err, SPL_E_USAGE, "%.200s, line %u: a zero byte; this is no text file", path, number);
    char *copy = spl_alloc_raw(length + 1, 1, err);
    if (!copy)
        return SPL_E_NOMEM;
    memcpy(copy, data, length);
    copy[length] = '\0';
    int rc = 0;
    char *first = copy + (strncmp(copy, mark, sizeof mark - 1) ? 0 : sizeof mark - 1);
    for (char *line = first, *next; rc != SPL_E_NOMEM && line < copy + length; line = next, number++) {
        char *end = strchrnul(line, '\n');
        struct spl_error why = {0};
        next = end + 1;
        int code = parse_line(options, path, number, line, end, given, &why);
        if (code && rc && options->mistakes < SPL_MISTAKES_MAX)
            options->mistake[options->mistakes++] = why;
        if (code && (!rc || code == SPL_E_NOMEM))
            rc = spl_fail_field(err, code, why.field, "%s", why.message);
    }
    free(copy);
    return rc;
}

int spl_service_options_read(struct spl_service_options *options, const char *path, struct spl_error *err)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // a FIFO would wait for a writer
    struct stat status;
    size_t length = 0;
    int rc = 0;
    if (fd < 0 || fstat(fd, &status)) {
        rc = spl_fail(err, SPL_E_USAGE, "cannot open the config file '%.200s': %s", path, strerror(errno));
        if (fd >= 0)
            close(fd);
        return rc;
    }
    if (!S_ISREG(status.st_mode))
        rc = spl_fail(err, SPL_E_USAGE, "the config file '%.200s' is no regular file", path);
    char *data = rc ? NULL : spl_alloc_raw(config_max + 1, 1, err);
    if (!rc && !data)
        rc = SPL_E_NOMEM;
    for (ssize_t got = 1; !rc && got > 0 && length <= config_max; length += got > 0 ? (size_t)got : 0) {
        got = read(fd, data + length, config_max + 1 - length);
        if (got < 0)
            rc = spl_fail(err, SPL_E_USAGE, "cannot read the config file '%.200s': %s", path, strerror(errno));
    }
    if (!rc && length > config_max)
        rc = spl_fail(err, SPL_E_USAGE, "the config file '%.200s' is larger than %d bytes", path, (int)config_max);
    if (!rc)
        rc = spl_service_options_parse(options, path, data, length, err);
    free(data);
    close(fd);
    return rc;
}
