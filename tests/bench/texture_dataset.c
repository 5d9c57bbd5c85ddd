/* Gives a dataset textures of random smooth atoms, to measure what drawing them costs.
 *
 * usage: texture-dataset IN.spld OUT.spld SIZE ATOMS PLANES    splats get 0 to PLANES of the ATOMS atoms of SIZE × SIZE
 */
#include <stdio.h>
#include <stdlib.h>

#include "support/make_textures.h"

int main(int argc, char **argv)
{
    struct spl_dataset *from;
    struct spl_error err = {0};
    if (argc != 6) {
        fprintf(stderr, "usage: texture-dataset IN.spld OUT.spld SIZE ATOMS PLANES\n");
        return 2;
    }
    if (spl_dataset_open(argv[1], false, &from, &err)) {
        fprintf(stderr, "%s\n", err.message);
        return 1;
    }
    struct spl_dictionary dictionary = make_dictionary((uint32_t)atoi(argv[4]), (uint32_t)atoi(argv[3]), 1);
    make_textured_file(from, &dictionary, (uint32_t)atoi(argv[5]), 1, argv[2]);
    spl_dictionary_finish(&dictionary);
    spl_dataset_close(from);
    return 0;
}
