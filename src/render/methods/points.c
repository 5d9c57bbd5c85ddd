/* Method points: the nearest splat centre of every sample. One pass with 64 bit atomics, two without. */
#include "render/method.h"
#include "render/points.h"

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    (void)first; /* the payload of another group shares the word with the depth: every group starts anew */
    return spl_points_record(tile, group, false, err);
}

const struct spl_method_row spl_method_points = {
    .info = {.name = "points", .help = "one pixel each", .params = SPL_PARAMS_OF_ALL},
    .record = record,
    .resolve = SPL_RESOLVED_NEAREST,
    .guesses = {{4, 1, 4, 10, 14.8}, {2, 0.25, 4, 15, 17.2}, {1, 0.25, 4, 20, 20.2}},
};
