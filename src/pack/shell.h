/* Whether a surface is closed around nothing or a room, and which side of it should show. */
#ifndef SPL_PACK_SHELL_H
#define SPL_PACK_SHELL_H

#include <stdbool.h>

/* Sums over the points of a surface; zero at first. */
struct spl_shell {
    double area, normal[3], place[3], flux, square;
    double height, rise; /* area times height, times its square */
    double level[2][2];  /* of what shows up, and of what shows down: area, and times height */
};

/* A point that stands for `area`, and its unit normal, which is `turned` before it counts. */
void spl_shell_add(struct spl_shell *shell, const double place[3], const float normal[3], const double up[3],
                   double area, bool turned);

/* True where the surface is a room's and shows outwards, or is compact and shows inwards with nothing within;
 * `doubtful` says that up does not tell its side: only then it may be such a thing. */
bool spl_shell_is_inside_out(const struct spl_shell *shell, bool doubtful);

#endif
