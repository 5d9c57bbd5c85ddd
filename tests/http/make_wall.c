/* make_wall [--station] [--unit=UNIT] [--crs=CRS] [--small | --large | --textured | --mapped | --knot | --tree |
 * --heap] NAME.spld…: a coloured wall of 40 × 40 splats (--small: its lower half; --large: 600 × 600, several MiB), two
 * levels, in the plane x = 0. --textured gives its splats up to 8 of 16 atoms, --mapped the map of a station at (2, 0,
 * 1) that sees it in other colours, striped, and through its splats from y = 0.5 on. --knot makes what once took long
 * to open, --tree a ground of several levels on many small pages, --heap 20,000 discs, one behind the other, each of
 * which covers the image. --unit= and --crs= are what the dataset says, nothing where they are empty; --station is one
 * that looks along +x from the origin. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "support/make_dataset.h"
#include "support/make_knot.h"
#include "support/make_textures.h"
#include "support/make_tree.h"
#include "support/mapped_dataset.h"

enum { side_usual = 40, side_large = 600, map_side = 256 };

static const double station[3] = {2, 0, 1};

static void look(const struct make_map *map, const double d[3], double color[3], double *range)
{
    static const double stripes[2][3] = {{20, 200, 30}, {240, 30, 200}};
    double y = 0;
    (void)map;
    *range = INFINITY;
    for (int i = 0; i < 20 && d[0] < 0; i++) { /* to where the ray meets the wall */
        *range = (0.2 * sin(y) - station[0]) / d[0];
        y = *range * d[1];
    }
    bool odd = (int)floor(2 * fmin(fmax(y, -9), 9)) & 1;
    memcpy(color, stripes[odd], sizeof stripes[odd]);
    if (y > 0.5)
        *range = INFINITY;
}

static void make_heap(const char *path)
{
    enum { discs = 20000 };
    static struct make_splat splats[discs];
    for (int i = 0; i < discs; i++)
        splats[i] = (struct make_splat){
            .position = {1e-4 * i, 0, 0}, .normal = {1, 0, 0}, .radius = 4, .color = {200, 90, 30}};
    make_dataset_file(path, splats, discs, 1);
}

int main(int argc, char **argv)
{
    if (argc > 1 && !strcmp(argv[1], "--station")) {
        make_dataset_station = true;
        argc--, argv++;
    }
    if (argc > 1 && !strncmp(argv[1], "--unit=", 7)) {
        make_dataset_unit = argv[1][7] ? argv[1] + 7 : NULL;
        argc--, argv++;
    }
    if (argc > 1 && !strncmp(argv[1], "--crs=", 6)) {
        make_dataset_crs = argv[1][6] ? argv[1] + 6 : NULL;
        argc--, argv++;
    }
    const char *kind = argc > 1 ? argv[1] : "";
    if (!strcmp(kind, "--heap")) {
        make_heap(argv[2]);
        return 0;
    }
    int small = !strcmp(kind, "--small"), textured = !strcmp(kind, "--textured"), large = !strcmp(kind, "--large");
    int side = large ? side_large : side_usual;
    struct make_splat *splats = calloc((size_t)side * (size_t)side, sizeof *splats);
    if (!splats)
        return 1;
    double step = 2.0 / side;
    for (int i = 0; i < side * side; i++) {
        double y = (i % side - side / 2) * step, z = (i / side) * step;
        splats[i] = (struct make_splat){
            .position = {0.2 * sin(y), y, z},
            .normal = {1, 0, 0},
            .radius = (float)step,
            .color = {(uint8_t)(i % side * 240 / side), (uint8_t)(i / side * 240 / side), 90},
        };
    }
    if (textured) {
        struct spl_dataset *plain = make_dataset(splats, side * side);
        struct spl_dictionary dictionary = make_dictionary(16, 8, 1);
        for (int i = 2; i < argc; i++)
            make_textured_file(plain, &dictionary, 8, 1, argv[i]);
        spl_dictionary_finish(&dictionary);
        spl_dataset_close(plain);
        free(splats);
        return 0;
    }
    if (!strcmp(kind, "--mapped")) {
        struct spl_dataset *plain = make_dataset_levels(splats, (size_t)(side * side), 2);
        const struct make_map map = {.row = mapped_row(station, 0, map_side, SPL_MAP_LEVELS_MAX, map_side),
                                     .look = look};
        for (int i = 2; i < argc; i++)
            write_mapped_alike(plain, &map, 1, true, argv[i]);
        spl_dataset_close(plain);
        free(splats);
        return 0;
    }
    if (argc > 2 && !strcmp(kind, "--knot")) {
        make_knot_file(argv[2], 500000);
        free(splats);
        return 0;
    }
    if (argc > 2 && !strcmp(kind, "--tree")) {
        make_tree_file(argv[2], 200000, 20000);
        free(splats);
        return 0;
    }
    for (int i = 1 + (small | large); i < argc; i++)
        make_dataset_file(argv[i], splats, (size_t)(side * side / (1 + small)), 2);
    free(splats);
    return 0;
}
