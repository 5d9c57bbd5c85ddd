/* Of a closed surface the mean of normal times place, from anywhere, is three times its volume over its area (Gauss).
 * Measured from its middle, in units of how far its points are from there, that is 1 of a ball, 0.78 of a cube, 0.7 of
 * an empty room; furniture takes away from it (0.5 to 0.6), and of what is open, flat, long or a thicket little is
 * left.
 *
 * A room and a thing are closed alike. But nobody sees the flat underside of what is higher than a man: it stands on
 * it. So where what is level are a floor, below nearly all else, and a ceiling above it, as far apart as those of
 * rooms, it is a room, seen from within. */
#include "pack/shell.h"

#include <math.h>

static const double compact = 0.65;                      /* things */
static const double room_least = 0.25, room_most = 0.85; /* a hall is long, none is a ball */
static const double low = 1.8, high = 40;                /* metres from floor to ceiling: smaller are things in metres,
                                                            larger ones things in millimetres */
static const double level = 0.8;                         /* how far a normal shows up or down; a vault's, too */
static const double share = 0.35;                        /* of the larger of floor and ceiling that the other has */
static const double apart = 0.7;                         /* of these from the middle, in units of how far points are */

void spl_shell_add(struct spl_shell *shell, const double place[3], const float normal[3], const double up[3],
                   double area, bool turned)
{
    double weight = turned ? -area : area, height = 0, upward = 0;
    shell->area += area;
    for (int c = 0; c < 3; c++) {
        shell->normal[c] += weight * (double)normal[c];
        shell->place[c] += area * place[c];
        shell->flux += weight * (double)normal[c] * place[c];
        shell->square += area * place[c] * place[c];
        height += up[c] * place[c];
        upward += up[c] * (double)normal[c];
    }
    shell->height += area * height;
    shell->rise += area * height * height;
    if (fabs(upward) > level) {
        double *sums = shell->level[(upward < 0) != turned];
        sums[0] += area;
        sums[1] += area * height;
    }
}

/* `over` and `under`: the sums of what would show up and down if it showed outwards. */
static bool is_room(const struct spl_shell *shell, const double over[2], const double under[2])
{
    if (!(fmin(over[0], under[0]) > share * fmax(over[0], under[0])))
        return false;
    double middle = shell->height / shell->area, far = sqrt(fmax(shell->rise / shell->area - middle * middle, 0));
    double ceiling = over[1] / over[0], ground = under[1] / under[0];
    return ceiling - ground > low && ceiling - ground < high && ceiling > middle + apart * far &&
           ground < middle - apart * far;
}

bool spl_shell_is_inside_out(const struct spl_shell *shell, bool doubtful)
{
    double flux = shell->flux, square = shell->square;
    if (!(shell->area > 0))
        return false;
    for (int c = 0; c < 3; c++) {
        flux -= shell->normal[c] * shell->place[c] / shell->area;
        square -= shell->place[c] * shell->place[c] / shell->area;
    }
    const bool out = flux > 0;
    double closed = fabs(flux) / sqrt(fmax(square, 0) * shell->area);
    if (closed > room_least && closed < room_most && is_room(shell, shell->level[!out], shell->level[out]))
        return out;
    return doubtful && closed > compact && !out;
}
