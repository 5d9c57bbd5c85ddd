/* Peers' CSV. Small files, read line by line; what cannot be drawn (no number, no time above zero, no name) is refused
 * with its line rather than left out silently. Any thread. */
#include "measure/peers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/decimal.h"
#include "base/reading.h"

/* Cuts the last field off `line` and parses it. */
static int take_number(char *line, const char *field, double least, const char *path, size_t number, double *out,
                       struct spl_error *err)
{
    char *comma = strrchr(line, ',');
    if (!comma)
        return spl_fail_field(err, SPL_E_INPUT, field, "%s: line %zu: a row is name,ms,psnr; '%.80s' has fewer fields",
                              path, number, line);
    *comma = 0;
    const char *end = spl_decimal_parse(comma + 1 + strspn(comma + 1, " \t"), out);
    if (!end || end[strspn(end, " \t")] || *out <= least)
        return spl_fail_field(err, SPL_E_INPUT, field, "%s: line %zu: '%.40s' is no %s", path, number, comma + 1,
                              field);
    return SPL_OK;
}

static int take_row(struct spl_peers *peers, char *line, const char *path, size_t number, struct spl_error *err)
{
    struct spl_peer row = {0};
    int rc = take_number(line, "psnr", -INFINITY, path, number, &row.psnr, err);
    if (!rc)
        rc = take_number(line, "ms", 0, path, number, &row.ms, err);
    if (rc)
        return rc;
    if (!*line || strlen(line) >= sizeof row.name)
        return spl_fail_field(err, SPL_E_INPUT, "name", "%s: line %zu: a name has 1 to %zu bytes", path, number,
                              sizeof row.name - 1);
    memcpy(row.name, line, strlen(line));
    if (spl_array_reserve(peers->rows, peers->capacity, peers->count + 1, err))
        return SPL_E_NOMEM;
    peers->rows[peers->count++] = row;
    return SPL_OK;
}

int spl_peers_load(struct spl_peers *peers, const char *path, struct spl_error *err)
{
    memset(peers, 0, sizeof *peers);
    FILE *file;
    int rc = spl_open_for_reading(path, &file, err);
    if (rc)
        return rc;
    char *line = NULL;
    size_t room = 0, number = 0;
    while (!rc && getline(&line, &room, file) > 0) {
        line[strcspn(line, "\r\n")] = 0;
        number++;
        if (*line && *line != '#' && (number > 1 || strcmp(line, "name,ms,psnr")))
            rc = take_row(peers, line, path, number, err);
    }
    if (!rc && ferror(file))
        rc = spl_fail(err, SPL_E_IO, "cannot read %s", path);
    if (!rc && !peers->count)
        rc = spl_fail(err, SPL_E_INPUT, "%s holds no row name,ms,psnr", path);
    free(line);
    fclose(file);
    if (rc)
        spl_peers_finish(peers);
    return rc;
}

void spl_peers_finish(struct spl_peers *peers)
{
    free(peers->rows);
    memset(peers, 0, sizeof *peers);
}
