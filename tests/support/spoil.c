/* See spoil.h. */
#include "support/spoil.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/error.h"
#include "dataset/dataset.h"

struct spoil spoil_load(const char *path)
{
    FILE *from = fopen(path, "rb");
    struct spoil f = {0};
    spl_assert(from && !fseek(from, 0, SEEK_END));
    f.size = (size_t)ftell(from);
    rewind(from);
    f.bytes = malloc(f.size);
    spl_assert(f.bytes && fread(f.bytes, 1, f.size, from) == f.size);
    fclose(from);
    f.header = (struct spl_file_header *)(void *)f.bytes;
    f.table = (struct spl_section *)(void *)(f.bytes + f.header->table_offset);
    return f;
}

struct spl_section *spoil_find(const struct spoil *file, uint32_t type)
{
    uint32_t i = 0;
    while (i < file->header->section_count && file->table[i].type != type)
        i++;
    spl_assert(i < file->header->section_count);
    return &file->table[i];
}

void *spoil_at(const struct spoil *file, uint32_t type)
{
    return file->bytes + spoil_find(file, type)->offset;
}

void spoil_store(const struct spoil *file, const char *path, bool rehash)
{
    for (uint32_t i = 0; rehash && i < file->header->section_count; i++)
        file->table[i].hash = XXH3_64bits(file->bytes + file->table[i].offset, file->table[i].bytes);
    if (rehash) {
        file->header->table_hash = XXH3_64bits(file->table, file->header->section_count * sizeof *file->table);
        file->header->header_hash = XXH3_64bits(file->header, offsetof(struct spl_file_header, header_hash));
    }
    FILE *to = fopen(path, "wb");
    spl_assert(to && fwrite(file->bytes, 1, file->size, to) == file->size && !fclose(to));
}

void spoil_expect(const char *path, const char *part)
{
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    int rc = spl_dataset_open(path, true, &dataset, &err);
    spl_dataset_close(dataset);
    if (rc == SPL_E_CORRUPT && strstr(err.message, part))
        return;
    fprintf(stderr, "expected '%s', got %d '%s'\n", part, rc, err.message);
    abort();
}
