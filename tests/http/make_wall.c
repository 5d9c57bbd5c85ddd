/* make_wall [--small] NAME.spld…: a coloured wall of 40 × 40 splats (--small: its lower half), two levels, in the plane
 * x = 0. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "support/make_dataset.h"

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
    int small = argc > 1 && !strcmp(argv[1], "--small");
    for (int i = 1 + small; i < argc; i++)
        make_dataset_file(argv[i], splats, side * side / (1 + small), 2);
    return 0;
}
