/* Of a closed surface the mean of normal times place, from anywhere, is three times its volume over its area (Gauss).
 * Measured from its middle, in units of how far its points are from there, that is 1 of a ball, 0.78 of a cube, 0.7 of
 * an empty room; furniture takes away from it (0.5), and of what is open, flat, long or a thicket little is left. */
#include "pack/shell.h"

#include <math.h>

static const double compact = 0.65;

void spl_shell_add(struct spl_shell *shell, const double place[3], const float normal[3], double area, bool turned)
{
    double weight = turned ? -area : area;
    shell->area += area;
    for (int c = 0; c < 3; c++) {
        shell->normal[c] += weight * (double)normal[c];
        shell->place[c] += area * place[c];
        shell->flux += weight * (double)normal[c] * place[c];
        shell->square += area * place[c] * place[c];
    }
}

bool spl_shell_shows_in(const struct spl_shell *shell)
{
    double flux = shell->flux, square = shell->square;
    if (!(shell->area > 0))
        return false;
    for (int c = 0; c < 3; c++) {
        flux -= shell->normal[c] * shell->place[c] / shell->area;
        square -= shell->place[c] * shell->place[c] / shell->area;
    }
    return -flux > compact * sqrt(fmax(square, 0) * shell->area);
}
