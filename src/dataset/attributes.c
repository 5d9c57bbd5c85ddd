/* The optional attributes of a dataset: META's list of streams, and values by splat. A stream of a type that we do not
 * know keeps its place among the others and has no values. Opening on the opener's thread, the rest on any. */
#include "dataset/dataset.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/open.h"
#include "dataset/values.h"

/* `index` and `member` say which stream is at fault, and what of it; `value` may be NULL. */
static int wrong(const struct spl_dataset *dataset, struct spl_error *err, size_t index, const char *member,
                 const char *value, const char *what)
{
    return spl_fail_field(err, SPL_E_CORRUPT, "streams",
                          "%s: section META: \"streams[%zu]%s\" %s%.60s%s %s; pack the dataset again", dataset->name,
                          index, member, value ? "is \"" : "is no text", value ? value : "",
                          value ? "\", and" : ", and", what);
}

/* A text of META for a stream; false where it is none, or too long. NULL or null: optional, and "". */
static bool take_text(const json_t *json, bool optional, char out[SPL_STREAM_TEXT_MAX])
{
    size_t length = json_string_length(json);
    if (optional && (!json || json_is_null(json)))
        return true;
    if (!json_is_string(json) || length >= SPL_STREAM_TEXT_MAX || strlen(json_string_value(json)) < length)
        return false;
    memcpy(out, json_string_value(json), length);
    return length > 0 || optional;
}

static int read_steps(struct spl_dataset *dataset, size_t s, const json_t *row, struct spl_error *err)
{
    const json_t *first = json_object_get(row, "first"), *steps = json_object_get(row, "steps_a_unit");
    struct spl_stream *stream = &dataset->streams[s];
    stream->first = json_is_number(first) ? json_number_value(first) : (double)NAN;
    stream->steps_a_unit = json_number_value(steps);
    const char *what = spl_stream_judge_steps(stream->first, stream->steps_a_unit);
    return what ? spl_fail_field(err, SPL_E_CORRUPT, "streams",
                                 "%s: section META: of \"streams[%zu]\" %s; pack the dataset again", dataset->name, s,
                                 what)
                : SPL_OK;
}

static int read_stream(struct spl_dataset *dataset, size_t s, const json_t *row, struct spl_error *err)
{
    struct spl_stream_info *all = dataset->info.streams, *stream = &all[s];
    const struct {
        const char *key, *member;
        bool optional;
        char *out;
    } texts[] = {{"name", ".name", false, stream->name},
                 {"type", ".type", false, stream->type},
                 {"unit", ".unit", true, stream->unit}};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        const json_t *text = json_object_get(row, texts[i].key);
        if (!take_text(text, texts[i].optional, texts[i].out))
            return wrong(dataset, err, s, texts[i].member, json_string_value(text),
                         texts[i].optional ? "must be a text of at most 31 bytes, or null"
                                           : "must be a text of 1 to 31 bytes");
    }
    if (spl_stream_name_is_taken(stream->name))
        return wrong(dataset, err, s, ".name", stream->name, "must be another: this is what every dataset has");
    for (size_t other = 0; other < s; other++)
        if (!strcmp(all[other].name, stream->name))
            return wrong(dataset, err, s, ".name", stream->name, "must be another: a stream before it has this name");
    dataset->streams[s] = (struct spl_stream){.name = stream->name, .type = stream->type, .unit = stream->unit};
    dataset->stream_types[s] = spl_stream_type_from_name(stream->type);
    return dataset->stream_types[s] == SPL_STREAM_STEPS ? read_steps(dataset, s, row, err) : SPL_OK;
}

int spl_dataset_read_streams(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const json_t *streams = json_object_get(dataset->meta, "streams");
    size_t count = json_array_size(streams);
    if ((streams && !json_is_array(streams)) || count > SPL_STREAMS_MAX)
        return spl_fail_field(err, SPL_E_CORRUPT, "streams",
                              "%s: section META: \"streams\" must be an array of at most %d; pack the dataset again",
                              dataset->name, SPL_STREAMS_MAX);
    for (size_t s = 0; s < count; s++) {
        int rc = read_stream(dataset, s, json_array_get(streams, s), err);
        if (rc)
            return rc;
    }
    info->stream_count = (uint32_t)count;
    info->has_class = spl_dataset_find_stream(dataset, "class") >= 0;
    info->has_uncertainty = spl_dataset_find_stream(dataset, "uncertainty") >= 0;
    return SPL_OK;
}

int spl_dataset_read_values(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const json_t *streams = json_object_get(dataset->meta, "streams");
    const json_t *tiles = dataset->tiles ? json_object_get(dataset->meta, "tile_values") : NULL; /* of a collection */
    for (uint32_t s = 0; s < info->stream_count; s++) {
        const json_t *values = tiles ? json_array_get(json_object_get(tiles, "streams"), s)
                                     : json_object_get(json_array_get(streams, s), "values");
        values = json_is_null(values) ? NULL : values;
        const char *what =
            values ? spl_values_from_json(values, info->leaf_splats, &dataset->stream_values[s]) : NULL;
        if (what)
            return spl_fail_field(err, SPL_E_CORRUPT, "streams",
                                  "%s: section META: of \"streams[%u].values\" %s; pack the dataset again",
                                  dataset->name, s, what);
        if (values)
            info->stream_values = dataset->stream_values;
    }
    const json_t *heights = json_object_get(tiles ? tiles : dataset->meta, "heights");
    heights = json_is_null(heights) ? NULL : heights;
    const char *what = heights ? spl_values_from_json(heights, info->leaf_splats, &dataset->heights) : NULL;
    if (what)
        return spl_fail_field(err, SPL_E_CORRUPT, "heights",
                              "%s: section META: of \"heights\" %s; pack the dataset again", dataset->name, what);
    info->heights = heights ? &dataset->heights : NULL;
    return SPL_OK;
}

const struct spl_stream *spl_dataset_get_streams(const struct spl_dataset *dataset, uint32_t *count)
{
    *count = dataset->info.stream_count;
    return dataset->streams;
}

uint32_t spl_dataset_get_stream_words(const struct spl_dataset *dataset, uint32_t streams, uint64_t chunk)
{
    spl_assert(dataset->whole.nodes);
    uint32_t words = 0;
    for (uint32_t s = 0; s < streams; s++)
        words += spl_stream_words(dataset->whole.width[s][chunk], dataset->whole.chunks[chunk].count);
    return words;
}

int spl_dataset_find_stream(const struct spl_dataset *dataset, const char *name)
{
    for (uint32_t s = 0; s < dataset->info.stream_count; s++)
        if (!strcmp(dataset->info.streams[s].name, name))
            return dataset->stream_types[s] < SPL_STREAM_UNKNOWN ? (int)s : -1;
    return -1;
}

static bool read_value(const struct spl_dataset *dataset, const struct spl_place *place, uint32_t stream, uint64_t id,
                       double *value)
{
    uint32_t words[SPL_STREAM_WORDS_MAX + SPL_PAGE_TAIL_WORDS];
    const struct spl_tables *tables = place->tables;
    const struct spl_chunk *chunk = place->chunk;
    uint32_t index = (uint32_t)(chunk - tables->chunks);
    struct spl_stream_code code = {tables->base[stream][index], tables->width[stream][index]};
    uint32_t count = spl_stream_words(code.width, chunk->count) + SPL_PAGE_TAIL_WORDS; // which the page has
    uint64_t word =
        (uint64_t)chunk->geometry_word + spl_chunk_words(chunk) + spl_tables_get_stream_words(tables, stream, index);
    if (spl_dataset_read_words(dataset, tables->page, word, words, count, NULL))
        return false;
    *value = spl_stream_decode(&dataset->streams[stream], code, words, (uint32_t)(id - chunk->first_id));
    return true;
}

bool spl_dataset_find_value(const struct spl_dataset *dataset, int stream, uint64_t id, double *value)
{
    if (stream < 0 || (uint32_t)stream >= dataset->info.stream_count ||
        dataset->stream_types[stream] == SPL_STREAM_UNKNOWN)
        return false;
    struct spl_place place = spl_dataset_find_place(dataset, id);
    bool found = place.tables && spl_chunk_kind(place.chunk) != SPL_CHUNK_LINES && // vertices have no attributes
                 read_value(dataset, &place, (uint32_t)stream, id, value);
    spl_place_finish(&place);
    return found;
}
