/* make_wall NAME.spld…: a coloured wall of 40 × 40 splats, two levels, in the plane x = 0. */
#include <math.h>
#include <stdio.h>

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
    for (int i = 1; i < argc; i++)
        make_dataset_file(argv[i], splats, side * side, 2);
    return 0;
}
