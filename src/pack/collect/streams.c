/* Attributes of tiles, which all of them must have alike: codes of one stream mean the same in every tile. Those of a
 * collection's own splats are written by the packer's rules again, so they must be what it writes. Pure but for what is
 * filled. */
#include <stdio.h>
#include <string.h>

#include "pack/collect/collect.h"
#include "pack/emit_streams.h"
#include "pack/kept.h"

/* Where struct spl_points keeps a stream of this name; a name that it does not know is one of `keep`. */
static int find_scalar(struct spl_keep *keep, const char *name)
{
    for (int a = 0; a < SPL_STREAM_KNOWN_COUNT; a++)
        if (!strcmp(spl_streams_known[a].name, name))
            return -1 - a;
    static const int known[] = {SPL_SCALAR_INTENSITY, SPL_SCALAR_RETURN, SPL_SCALAR_RETURNS, SPL_SCALAR_SCAN};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (!strcmp(spl_kept_name(keep, known[i]), name))
            return known[i];
    if (keep->count == SPL_KEPT_MAX)
        return SPL_POINT_SCALARS;
    snprintf(keep->names[keep->count], sizeof keep->names[0], "%s", name);
    return SPL_SCALAR_KEPT + (int)keep->count++;
}

static bool is_same(const struct spl_collect_stream *a, const struct spl_stream *b)
{
    bool steps = spl_stream_type_from_name(b->type) == SPL_STREAM_STEPS;
    return !strcmp(a->name, b->name) && !strcmp(a->type, b->type) && !strcmp(a->unit, b->unit) &&
           (!steps || (a->first == b->first && a->steps_a_unit == b->steps_a_unit));
}

/* How the packer makes tiles whose attribute `name` is alike. */
static void advise(const char *name, bool lacks, char *out, size_t size)
{
    if (!strcmp(name, spl_streams_known[SPL_STREAM_CLASS].name))
        snprintf(out, size, "--keep none without class leaves classes out; tiles whose scans have none are collected "
                            "apart");
    else if (lacks)
        snprintf(out, size, "pack the one without it again with --keep %s, which keeps it where all points have the "
                            "same too, or all of them without it: --keep none and the names of the others", name);
    else
        snprintf(out, size, "pack all tiles without it: --keep none and the names of the others");
}

static int refuse(const struct spl_collect *c, const char *name, const char *stream, const char *what, bool lacks,
                  struct spl_error *err)
{
    char advice[240];
    advise(stream, lacks, advice, sizeof advice);
    return spl_fail_field(err, SPL_E_INPUT, "inputs", "%.120s: attribute \"%s\" %s %.120s; %s", name, stream, what,
                          c->first, advice);
}

/* Of another tile. */
static int compare(const struct spl_collect *c, const struct spl_stream *streams, uint32_t count, const char *name,
                   struct spl_error *err)
{
    for (uint32_t s = 0; s < c->stream_count; s++) {
        uint32_t other = 0;
        while (other < count && strcmp(c->streams[s].name, streams[other].name))
            other++;
        if (other == count)
            return refuse(c, name, c->streams[s].name, "is missing, unlike in", true, err);
        if (is_same(&c->streams[s], &streams[other]))
            continue;
        char text[256];
        snprintf(text, sizeof text, "(%.12s from %.17g in %.17g a unit) is coded in another way than (%.12s from %.17g "
                                    "in %.17g) in",
                 streams[other].type, streams[other].first, streams[other].steps_a_unit, c->streams[s].type,
                 c->streams[s].first, c->streams[s].steps_a_unit);
        return refuse(c, name, c->streams[s].name, text, false, err);
    }
    for (uint32_t s = 0; s < count; s++) {
        uint32_t other = 0;
        while (other < c->stream_count && strcmp(c->streams[other].name, streams[s].name))
            other++;
        if (other == c->stream_count)
            return refuse(c, name, streams[s].name, "is there, but not in", true, err);
    }
    for (uint32_t s = 0; s < count; s++)
        if (strcmp(c->streams[s].name, streams[s].name))
            return refuse(c, name, streams[s].name, "stands in another place among the others than in", false, err);
    return SPL_OK;
}

int spl_collect_take_streams(struct spl_collect *c, const struct spl_dataset *dataset, const char *name,
                             struct spl_error *err)
{
    uint32_t count;
    const struct spl_stream *streams = spl_dataset_get_streams(dataset, &count);
    struct spl_points *p = &c->points, probe = {.keep = &c->keep, .no_surface = !c->has_surface};
    struct spl_emitted_streams written;
    if (c->first)
        return compare(c, streams, count, name, err);
    for (uint32_t s = 0; s < count; s++) {
        struct spl_collect_stream *to = &c->streams[s];
        bool steps = spl_stream_type_from_name(streams[s].type) == SPL_STREAM_STEPS;
        *to = (struct spl_collect_stream){.first = steps ? streams[s].first : 0,
                                          .steps_a_unit = steps ? streams[s].steps_a_unit : 0,
                                          .scalar = find_scalar(&c->keep, streams[s].name)};
        snprintf(to->name, sizeof to->name, "%s", streams[s].name);
        snprintf(to->type, sizeof to->type, "%s", streams[s].type);
        snprintf(to->unit, sizeof to->unit, "%s", streams[s].unit);
        probe.has_class |= to->scalar == -1 - SPL_STREAM_CLASS;
        if (to->scalar < 0 || to->scalar >= SPL_POINT_SCALARS)
            continue;
        struct spl_scalar_values *scalar = &p->scalar[to->scalar];
        *scalar = (struct spl_scalar_values){.storage = SPL_STORE_F64,
                                             .votes = to->scalar == SPL_SCALAR_RETURN ||
                                                      to->scalar == SPL_SCALAR_RETURNS || to->scalar == SPL_SCALAR_SCAN,
                                             .plain = !steps,
                                             .first = to->first,
                                             .steps_a_unit = steps ? to->steps_a_unit : 1};
        probe.scalar[to->scalar] = *scalar;
        probe.scalar[to->scalar].values = &probe; /* there are some */
    }
    c->stream_count = count;
    p->keep = &c->keep;
    p->has_class = probe.has_class;
    spl_emitted_streams_init(&written, &probe);
    bool same = written.count == count;
    for (uint32_t s = 0; same && s < count; s++)
        same = is_same(&c->streams[s], &written.list[s]);
    spl_emitted_streams_finish(&written);
    return same ? SPL_OK
                : spl_fail_field(err, SPL_E_INPUT, "inputs",
                                 "%.200s: its attributes are not as this version writes them; pack the tiles again",
                                 name);
}
