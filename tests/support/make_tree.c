/* The packer's own tree, written anew with small pages. */
#include "support/make_tree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <splatd/pack.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "dataset/rewrite.h"

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "make_tree: %s\n", err->message);
    abort();
}

static void write_ground(const char *path, size_t count)
{
    FILE *f = fopen(path, "wb");
    size_t side = (size_t)ceil(sqrt((double)count));
    spl_assert(f);
    fprintf(f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty double x\nproperty double y\n"
            "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
            count);
    for (size_t i = 0; i < count; i++) {
        double x = 100.0 * (double)(i % side) / (double)side, y = 100.0 * (double)(i / side) / (double)side;
        double at[3] = {x, y, 3 * sin(x / 7) * cos(y / 9)};
        unsigned char color[3] = {(unsigned char)(2 * x), (unsigned char)(2 * y), (unsigned char)i};
        fwrite(at, sizeof at, 1, f);
        fwrite(color, sizeof color, 1, f);
    }
    spl_assert(!fclose(f));
}

void make_tree_file(const char *path, size_t count, size_t page_bytes)
{
    char scan[512], packed[512];
    const char *input = scan;
    struct spl_error err = {0};
    struct spl_pack_options options;
    struct spl_dataset *dataset;
    snprintf(scan, sizeof scan, "%s.ply", path);
    snprintf(packed, sizeof packed, "%s.packed", path);
    write_ground(scan, count);
    spl_pack_options_init(&options);
    options.inputs = &input;
    options.input_count = 1;
    options.output = packed;
    must(spl_pack(&options, NULL, &err), &err);
    must(spl_dataset_open_whole(packed, false, &dataset, &err), &err);
    must(spl_dataset_rewrite(&(struct spl_rewrite){.from = dataset, .page_bytes = page_bytes}, path, &err), &err);
    spl_dataset_close(dataset);
    unlink(scan);
    unlink(packed);
}
