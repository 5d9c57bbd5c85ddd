/* Whether a surface is closed around nothing, and shows outwards. */
#ifndef SPL_PACK_SHELL_H
#define SPL_PACK_SHELL_H

#include <stdbool.h>

/* Sums over the points of a surface; zero at first. */
struct spl_shell {
    double area, normal[3], place[3], flux, square;
};

/* A point that stands for `area`, and its unit normal, which is `turned` before it counts. */
void spl_shell_add(struct spl_shell *shell, const double place[3], const float normal[3], double area, bool turned);

/* True where the surface is compact, has nothing within, and its normals show inwards. */
bool spl_shell_shows_in(const struct spl_shell *shell);

#endif
