/* make_wall [--small | --textured | --knot] NAME.spld…: a coloured wall of 40 × 40 splats (--small: its lower half),
 * two levels, in the plane x = 0. --textured gives its splats up to 8 of 16 atoms. --knot makes what takes long to
 * open. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "support/make_dataset.h"
#include "support/make_knot.h"
#include "support/make_textures.h"

enum { side = 40 };

int main(int argc, char **argv)
{
    static struct make_splat splats[side * side];
    for (int i = 0; i < side * side; i++) {
        double y = (i % side - side / 2) * 0.05, z = (i / side) * 0.05;
        splats[i] = (struct make_splat){
            .position = {0.2 * sin(y), y, z},
            .normal = {1, 0, 0},
            .radius = 0.05f,
            .color = {(uint8_t)(i % side * 6), (uint8_t)(i / side * 6), 90},
        };
    }
    int small = argc > 1 && !strcmp(argv[1], "--small"), textured = argc > 1 && !strcmp(argv[1], "--textured");
    if (textured) {
        struct spl_dataset *plain = make_dataset(splats, side * side);
        struct spl_dictionary dictionary = make_dictionary(16, 8, 1);
        for (int i = 2; i < argc; i++)
            make_textured_file(plain, &dictionary, 8, 1, argv[i]);
        spl_dictionary_finish(&dictionary);
        spl_dataset_close(plain);
        return 0;
    }
    if (argc > 2 && !strcmp(argv[1], "--knot")) {
        make_knot_file(argv[2], 500000);
        return 0;
    }
    for (int i = 1 + small; i < argc; i++)
        make_dataset_file(argv[i], splats, side * side / (1 + small), 2);
    return 0;
}
