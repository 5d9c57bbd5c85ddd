/* The table of LAS 1.4, R15, table 17. Pure. */
#include "dataset/classes.h"

#include <stddef.h>

static const char *const names[] = {
    [0] = "never classified", [1] = "unclassified",    [2] = "ground",
    [3] = "low vegetation",   [4] = "medium vegetation", [5] = "high vegetation",
    [6] = "building",         [7] = "low noise",       [9] = "water",
    [10] = "rail",            [11] = "road",           [13] = "guard wire",
    [14] = "wire",            [15] = "tower",          [16] = "connector",
    [17] = "bridge",          [18] = "high noise",
};

const char *spl_class_name(double value)
{
    const double most = sizeof names / sizeof *names;
    return value >= 0 && value < most && value == (double)(unsigned)value ? names[(unsigned)value] : NULL;
}
