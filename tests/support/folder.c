/* See folder.h. */
#include "support/folder.h"

#include <dirent.h>
#include <ftw.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/error.h"
#include "support/make_dataset.h"

char test_folder[256];

int folder_make(void **state)
{
    (void)state;
    make_folder(test_folder);
    return 0;
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *where)
{
    (void)info, (void)kind, (void)where;
    return remove(path);
}

int folder_remove(void **state)
{
    (void)state;
    return nftw(test_folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}

const char *in_folder(const char *name)
{
    static char paths[8][512];
    static unsigned next;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof *paths, "%s/%s", test_folder, name);
    return path;
}

size_t folder_count(const char *path)
{
    size_t count = 0;
    DIR *dir = opendir(path);
    if (!dir)
        return 0;
    for (struct dirent *entry; (entry = readdir(dir));)
        count += entry->d_name[0] != '.';
    closedir(dir);
    return count;
}

char *folder_get(const char *name, size_t *length)
{
    FILE *file = fopen(in_folder(name), "rb");
    spl_assert(file && !fseek(file, 0, SEEK_END));
    *length = (size_t)ftell(file);
    rewind(file);
    char *bytes = malloc(*length + 1);
    spl_assert(bytes && fread(bytes, 1, *length, file) == *length && !fclose(file));
    return bytes;
}

void folder_assert_same(const char *name, const char *other)
{
    size_t a, b;
    char *one = folder_get(name, &a), *second = folder_get(other, &b);
    const bool same = a == b && !memcmp(one, second, a);
    free(one);
    free(second);
    if (!same)
        fail_msg("%s and %s are not the same", name, other);
}

void folder_put(const char *name, const void *bytes, size_t length)
{
    FILE *file = fopen(in_folder(name), "wb");
    spl_assert(file && fwrite(bytes, 1, length, file) == length && !fclose(file));
}

void folder_put_text(const char *name, const char *text)
{
    folder_put(name, text, strlen(text));
}
