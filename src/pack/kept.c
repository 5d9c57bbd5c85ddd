/* Which fields are kept; see kept.h. Names go into the dataset as a user writes them. The packer's thread. */
#include "pack/kept.h"

#include <jansson.h>
#include <string.h>
#include <strings.h>

#include "cloud/rows.h"
#include "dataset/streams.h"
#include "pack/job/rules.h"

int spl_kept_read(struct spl_keep *keep, const char *list, struct spl_error *err)
{
    int rc = spl_keep_parse(keep, list, err);
    for (unsigned i = 0; !rc && i < keep->count; i++) {
        const char *name = keep->names[i];
        json_t *text = json_string(name);
        bool taken = spl_stream_name_is_taken(name);
        for (int k = 0; k < SPL_STREAM_KNOWN_COUNT; k++)
            taken |= !strcmp(name, spl_streams_known[k].name);
        if (!text)
            rc = spl_fail_field(err, SPL_E_USAGE, "keep", "keep: name %u is no UTF-8, which names in a dataset are",
                                i + 1);
        else if (taken)
            rc = spl_fail_field(err, SPL_E_USAGE, "keep",
                                "keep: \"%s\" is the name of something else in every dataset; a field of this name "
                                "cannot be kept",
                                name);
        json_decref(text);
    }
    return rc;
}

int spl_kept_check(const struct spl_scans *scans, struct spl_error *err)
{
    uint32_t columns = 0;
    for (size_t i = 0; i < scans->count; i++)
        columns |= scans->list[i].columns;
    const char *missing = spl_keep_find_missing(scans->how.keep, columns);
    if (!missing)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_USAGE, "keep", "keep: no field \"%s\" in %s%s%s%s", missing, scans->list[0].name,
                          scans->count > 1 ? " and the other scans" : "",
                          scans->fields[0] ? (scans->count > 1 ? "; the first one has: " : ", which has: ")
                                           : "; nothing names its columns: do it with --columns",
                          scans->fields);
}

const char *spl_kept_name(const struct spl_keep *keep, int scalar)
{
    if (scalar == SPL_SCALAR_SCAN)
        return "scan";
    return scalar < SPL_SCALAR_KEPT ? spl_column_name(SPL_COLUMN_INTENSITY + scalar)
                                    : keep->names[scalar - SPL_SCALAR_KEPT];
}

const char *spl_kept_unit(const char *name)
{
    return !strcasecmp(name, "gps_time") ? "s" : !strcasecmp(name, "scan_angle") ? "degrees" : "";
}

bool spl_kept_is_named(const struct spl_keep *keep, int scalar)
{
    if (scalar == SPL_SCALAR_SCAN)
        return keep->scan;
    return scalar >= SPL_SCALAR_KEPT || keep->named >> (SPL_COLUMN_INTENSITY + scalar) & 1;
}

bool spl_kept_has_scan(const struct spl_scans *scans, bool *stations)
{
    *stations = false;
    if (scans->rules) {
        *stations = scans->rules->stations;
        return scans->rules->has_scan;
    }
    for (size_t i = 0; i < scans->count; i++)
        *stations |= scans->list[i].attributes & SPL_CLOUD_STATION;
    return scans->how.keep->scan || (!scans->how.keep->none && (*stations || scans->count > 1));
}
