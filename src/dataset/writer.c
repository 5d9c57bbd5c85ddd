/* Writing a .spld file: pages go out as they fill, everything that describes them follows (a directory, and a head of
 * each page), the header comes last, over the zeroes at the file's start. Until the rename all of it lies in
 * PATH.splatd-PID; the header is missing there until everything else is written, so that even a stray part file never
 * opens as a dataset. One page is held in memory. Owned by one thread at a time. */
#include "dataset/writer_parts.h"

#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/array.h"
#include "base/memory.h"
#include "dataset/dictionary.h"
#include "dataset/head.h"

int spl_writer_add_section(struct spl_dataset_writer *writer, uint32_t type, uint32_t index, const void *data,
                           size_t bytes, struct spl_error *err)
{
    if (spl_array_reserve(writer->sections, writer->section_capacity, writer->section_count + 1, err))
        return SPL_E_NOMEM;
    struct spl_section section = {
        .type = type,
        .index = index,
        .offset = spl_align(writer->offset, type == SPL_SECTION_PAGE ? SPL_FILE_ALIGNMENT : SPL_SECTION_ALIGNMENT),
        .bytes = bytes,
        .hash = XXH3_64bits(data, bytes),
    };
    int rc = spl_part_file_write(&writer->file, section.offset, data, bytes, err);
    if (rc)
        return rc;
    writer->sections[writer->section_count++] = section;
    writer->offset = section.offset + bytes;
    return SPL_OK;
}

static size_t page_bytes(size_t used_words, size_t tail_words)
{
    return spl_align((used_words + tail_words) * sizeof(uint32_t), SPL_SECTION_ALIGNMENT);
}

static int flush_words(struct spl_dataset_writer *writer, uint32_t type, struct spl_words *words, struct spl_error *err)
{
    size_t tail = type == SPL_SECTION_TEXTURES ? SPL_TEXTURE_TAIL_WORDS : SPL_PAGE_TAIL_WORDS;
    size_t bytes = page_bytes(words->used, tail), used = words->used * sizeof(uint32_t);
    memset((char *)words->at + used, 0, bytes - used);
    words->used = 0;
    return spl_writer_add_section(writer, type, writer->page_count, words->at, bytes, err);
}

int spl_writer_flush_page(struct spl_dataset_writer *writer, struct spl_error *err)
{
    if (!writer->page_nodes)
        return SPL_OK;
    int rc = flush_words(writer, SPL_SECTION_PAGE, &writer->page, err);
    if (!rc && writer->dictionary)
        rc = flush_words(writer, SPL_SECTION_TEXTURES, &writer->textures, err);
    writer->page_count++;
    writer->page_nodes = writer->page_chunks = 0;
    return rc;
}

/* Makes room for `count` more words and the longer tail. */
static int reserve(struct spl_words *words, size_t count, struct spl_error *err)
{
    size_t wanted = page_bytes(words->used + count, SPL_TEXTURE_TAIL_WORDS) / sizeof *words->at;
    return spl_array_reserve(words->at, words->capacity, wanted, err);
}

int spl_dataset_writer_create(const char *path, struct spl_dataset_writer **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_dataset_writer *writer = spl_alloc(1, sizeof *writer, err);
    if (!writer)
        return SPL_E_NOMEM;
    writer->offset = sizeof(struct spl_file_header);
    writer->page_limit = SPL_PAGE_BYTES;
    writer->threads = 1;
    int rc = reserve(&writer->page, SPL_PAGE_BYTES / sizeof(uint32_t) - SPL_PAGE_TAIL_WORDS, err);
    if (!rc)
        rc = spl_part_file_init(&writer->file, path, err);
    if (rc)
        spl_dataset_writer_destroy(writer);
    else
        *out = writer;
    return rc;
}

void spl_dataset_writer_set_page_bytes(struct spl_dataset_writer *writer, size_t bytes)
{
    spl_assert(bytes <= SPL_PAGE_BYTES_MAX);
    writer->page_limit = bytes;
}

void spl_dataset_writer_set_threads(struct spl_dataset_writer *writer, unsigned threads)
{
    writer->threads = threads;
}

int spl_dataset_writer_set_dictionary(struct spl_dataset_writer *writer, const struct spl_dictionary *dictionary,
                                      struct spl_error *err)
{
    spl_assert(!writer->page_count && !writer->page.used && dictionary->count);
    uint64_t bytes = spl_dictionary_expanded_bytes(dictionary->count, dictionary->size);
    if (bytes > SPL_DICTIONARY_BYTES_MAX)
        return spl_fail(err, SPL_E_LIMIT,
                        "%s: a dictionary of %u atoms of %u x %u takes %llu MiB on a device, more than its %u; "
                        "take fewer or smaller atoms",
                        writer->file.path, dictionary->count, dictionary->size, dictionary->size,
                        (unsigned long long)(bytes >> 20), SPL_DICTIONARY_BYTES_MAX >> 20);
    writer->dictionary = dictionary;
    return reserve(&writer->textures, 0, err);
}

/* Notes the words at which the chunks' codes lie in the page, and appends the codes. */
static int add_textures(struct spl_dataset_writer *writer, const struct spl_node_textures *textures, size_t chunk_count,
                        struct spl_error *err)
{
    struct spl_words *to = &writer->textures, *of = &writer->chunk_textures;
    if (reserve(to, textures->word_count, err) || reserve(of, chunk_count, err))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < chunk_count; i++) {
        uint32_t texture = textures->chunk_texture[i];
        of->at[of->used++] = texture ? texture + (uint32_t)to->used : 0;
    }
    memcpy(to->at + to->used, textures->words, textures->word_count * sizeof *to->at);
    to->used += textures->word_count;
    return SPL_OK;
}

int spl_dataset_writer_add_textured_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                         struct spl_chunk *chunks, size_t chunk_count,
                                         const struct spl_node_textures *textures, uint32_t *page,
                                         struct spl_error *err)
{
    struct spl_words *to = &writer->page;
    size_t larger = word_count > textures->word_count ? word_count : textures->word_count;
    if (larger > SPL_PAGE_BYTES_MAX / sizeof(uint32_t) ||
        page_bytes(larger, SPL_TEXTURE_TAIL_WORDS) > SPL_PAGE_BYTES_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%s: a node of %zu bytes is larger than a page can be (%u)",
                        writer->file.path, larger * sizeof(uint32_t), SPL_PAGE_BYTES_MAX);
    spl_assert(!writer->maps_added);
    if (writer->page_nodes &&
        (spl_head_bytes(writer->page_nodes + 1, writer->page_chunks + chunk_count, SPL_STREAMS_MAX, true,
                        writer->maps) > SPL_HEAD_BYTES_MAX ||
         page_bytes(to->used + word_count, SPL_PAGE_TAIL_WORDS) > writer->page_limit ||
         page_bytes(writer->textures.used + textures->word_count, SPL_TEXTURE_TAIL_WORDS) > writer->page_limit)) {
        int rc = spl_writer_flush_page(writer, err);
        if (rc)
            return rc;
    }
    int rc = reserve(to, word_count, err);
    if (!rc && writer->dictionary)
        rc = add_textures(writer, textures, chunk_count, err);
    if (rc)
        return rc;
    memcpy(to->at + to->used, words, word_count * sizeof *words);
    for (size_t i = 0; i < chunk_count; i++)
        chunks[i].geometry_word += (uint32_t)to->used;
    to->used += word_count;
    writer->page_nodes++;
    writer->page_chunks += chunk_count;
    *page = writer->page_count;
    return SPL_OK;
}

int spl_dataset_writer_add_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                struct spl_chunk *chunks, size_t chunk_count, uint32_t *page, struct spl_error *err)
{
    spl_assert(!writer->dictionary);
    return spl_dataset_writer_add_textured_node(writer, words, word_count, chunks, chunk_count,
                                                &(struct spl_node_textures){0}, page, err);
}

int spl_dataset_writer_set_maps(struct spl_dataset_writer *writer, const struct spl_map_row *rows, uint32_t count,
                                const struct spl_chunk_stations *stations, struct spl_error *err)
{
    spl_assert(!writer->page_count && !writer->page_nodes && count);
    if (count > SPL_MAPS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%s: maps of %u stations, and a file has those of %u at most",
                        writer->file.path, count, SPL_MAPS_MAX);
    for (uint32_t i = 0; i < count; i++) {
        const char *what = spl_map_judge(&rows[i]);
        if (what)
            return spl_fail(err, SPL_E_LIMIT, "%s: the map of station %u %s", writer->file.path, i, what);
    }
    writer->maps = rows;
    writer->map_count = count;
    writer->stations = stations;
    return SPL_OK;
}

int spl_dataset_writer_add_map(struct spl_dataset_writer *writer, const uint32_t *words, struct spl_error *err)
{
    spl_assert(writer->maps_added < writer->map_count);
    int rc = spl_writer_flush_page(writer, err);
    if (rc)
        return rc;
    uint32_t index = writer->maps_added++;
    return spl_writer_add_section(writer, SPL_SECTION_MAP, index, words,
                                  spl_map_words(&writer->maps[index]) * sizeof *words, err);
}

void spl_dataset_writer_set_streams(struct spl_dataset_writer *writer, const struct spl_stream *streams, uint32_t count)
{
    spl_assert(count <= SPL_STREAMS_MAX);
    writer->streams = streams;
    writer->stream_count = count;
}

void spl_dataset_writer_check_what_is_written(struct spl_dataset_writer *writer)
{
    writer->checked = true;
}

void spl_dataset_writer_destroy(struct spl_dataset_writer *writer)
{
    if (!writer)
        return;
    spl_part_file_finish(&writer->file);
    free(writer->sections);
    free(writer->page.at);
    free(writer->textures.at);
    free(writer->chunk_textures.at);
    free(writer);
}
