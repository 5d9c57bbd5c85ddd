/* Method fill: points as method points draws them, with their spacing in the depth's low bits and linear ones joined by
 * lines, then the screen-space filter over what is not linear. */
#include "render/fill.h"
#include "render/renderer.h"

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    int rc = spl_points_record(tile, group, SPL_KERNEL_FILL_POINTS, err);
    return rc ? rc : spl_fill_record(tile, group, first, err);
}

const struct spl_method_ops spl_method_fill = {.name = "fill", .record = record};
