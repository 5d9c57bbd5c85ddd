/* Runs a fuzz target without libFuzzer: each file named, each file of each folder named, then deterministic mutations
 * of every one of them (bits, bytes, interesting numbers, cuts, repeats, splices). The file at work is named when a
 * target aborts, and the input lies in $FUZZ_KEEP when that is set.
 *
 * usage: fuzz-TARGET [--mutations N] FILE|DIR… */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { files_max = 4096, size_max = 1 << 20 };

struct input {
    char *path;
    uint8_t *bytes;
    size_t size;
};

static struct input inputs[files_max];
static size_t input_count;
static uint64_t random_state;

static uint64_t next_random(void) /* xorshift64* */
{
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return random_state * 0x2545f4914f6cdd1dull;
}

static size_t below(size_t n)
{
    return n ? next_random() % n : 0;
}

static void add_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    struct input *input = &inputs[input_count];
    if (!file || input_count == files_max) {
        fprintf(stderr, "cannot take %s\n", path);
        exit(2);
    }
    input->path = strdup(path);
    input->bytes = malloc(size_max);
    input->size = fread(input->bytes, 1, size_max, file);
    input->bytes = realloc(input->bytes, input->size ? input->size : 1);
    input_count++;
    fclose(file);
}

static int by_name(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*a)->d_name, (*b)->d_name); // the same order on every machine
}

static void add_path(const char *path)
{
    struct stat status;
    struct dirent **names;
    if (stat(path, &status) || !S_ISDIR(status.st_mode)) {
        add_file(path);
        return;
    }
    int count = scandir(path, &names, NULL, by_name);
    for (int i = 0; i < count; i++) {
        char child[4096];
        snprintf(child, sizeof child, "%s/%s", path, names[i]->d_name);
        if (names[i]->d_name[0] != '.')
            add_file(child);
        free(names[i]);
    }
    free(names);
}

/* The copy lies in a block of its exact size, so that a sanitiser sees one byte too many. */
static void run(const uint8_t *bytes, size_t size)
{
    uint8_t *exact = malloc(size ? size : 1);
    memcpy(exact, bytes, size);
    const char *keep = getenv("FUZZ_KEEP");
    FILE *file = keep ? fopen(keep, "wb") : NULL;
    if (file) {
        fwrite(exact, 1, size, file);
        fclose(file);
    }
    LLVMFuzzerTestOneInput(exact, size);
    free(exact);
}

static size_t mutate(uint8_t *out, size_t size)
{
    static const uint64_t numbers[] = {0,
                                       1,
                                       0x7f,
                                       0xff,
                                       0x7fff,
                                       0xffff,
                                       0x7fffffff,
                                       0xffffffff,
                                       0x7ff0000000000000,
                                       0x7fffffffffffffff,
                                       0xffffffffffffffff,
                                       0x8000000000000000};
    size_t at = below(size), length = 1 + below(size - at < 64 ? size - at : 64);
    const struct input *other = &inputs[below(input_count)];
    switch (below(8)) {
    case 0:
        if (size)
            out[at] ^= (uint8_t)(1u << below(8));
        return size;
    case 1:
        if (size)
            out[at] = (uint8_t)next_random();
        return size;
    case 2: { // a number that readers trip over
        size_t width = (size_t)1 << below(4);
        if (at + width <= size)
            memcpy(out + at, &numbers[below(sizeof numbers / sizeof *numbers)], width);
        return size;
    }
    case 3: // cut
        return at;
    case 4: // drop a piece
        if (at + length > size)
            return size;
        memmove(out + at, out + at + length, size - at - length);
        return size - length;
    case 5: // repeat a piece
        if (at + length > size || size + length > size_max)
            return size;
        memmove(out + at + length, out + at, size - at);
        return size + length;
    case 6: { // a digit where there was one
        if (size && out[at] >= '0' && out[at] <= '9')
            out[at] = (uint8_t)("0123456789-.eE+"[below(15)]);
        return size;
    }
    default: // the other's tail
        if (other->size <= at)
            return size;
        memcpy(out + at, other->bytes + at, other->size - at);
        return other->size;
    }
}

int main(int argc, char **argv)
{
    long mutations = 2000;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--mutations") && i + 1 < argc)
            mutations = strtol(argv[++i], NULL, 10);
        else
            add_path(argv[i]);
    }
    if (!input_count) {
        fprintf(stderr, "usage: %s [--mutations N] FILE|DIR…\n", argv[0]);
        return 2;
    }
    uint8_t *work = malloc(size_max);
    for (size_t i = 0; i < input_count; i++) {
        fprintf(stderr, "%s\n", inputs[i].path);
        run(inputs[i].bytes, inputs[i].size);
        random_state = 0x9e3779b97f4a7c15ull + i;
        for (long n = 0; n < mutations; n++) {
            size_t size = inputs[i].size;
            memcpy(work, inputs[i].bytes, size);
            for (size_t steps = 1 + below(6); steps; steps--)
                size = mutate(work, size);
            run(work, size);
        }
    }
    free(work);
    for (size_t i = 0; i < input_count; i++) {
        free(inputs[i].path);
        free(inputs[i].bytes);
    }
    return 0;
}
