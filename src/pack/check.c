/* What is wrong with options of packing, by their names. The output may be a file that is there, but no input. Any
 * thread; no state. */
#include "pack/check.h"

#include <math.h>
#include <sys/stat.h>

#include "base/file.h"
#include "pack/neighbours.h"

static const double error_most = 1e6; /* metres: a tenth of the way from a pole to the equator */

int spl_pack_check_primitives(const struct spl_pack_options *o, struct spl_error *err)
{
    static const char *const field = "primitives";
    if (!(o->error >= 0 && o->error < INFINITY))
        return spl_fail_field(err, SPL_E_USAGE, "error",
                              "%g; what primitives may be off their points is a length, 0 or "
                              "more metres",
                              o->error);
    if (o->error > error_most) // what each scan's own size says as well, once it is read
        return spl_fail_field(
            err, SPL_E_USAGE, "error",
            "%g m; what primitives may be off their points is at most a tenth of the scan, and %g m in "
            "any case: name some millimetres, or leave it out",
            o->error, error_most);
    if (o->primitives != SPL_PRIMITIVES_OFF && o->primitives != SPL_PRIMITIVES_ALL)
        return spl_fail_field(err, SPL_E_USAGE, field, "%d; off or all", (int)o->primitives);
    if (o->primitives == SPL_PRIMITIVES_OFF && o->export_primitives)
        return spl_fail_field(err, SPL_E_USAGE, "export-primitives",
                              "there are no primitives to write: name --primitives all, or leave out "
                              "--export-primitives");
    if (o->primitives == SPL_PRIMITIVES_OFF)
        return o->error > 0 ? spl_fail_field(err, SPL_E_USAGE, "error",
                                             "there are no primitives that could be off: name --primitives all, or "
                                             "leave out --error")
                            : SPL_OK;
    if (o->points_only)
        return spl_fail_field(err, SPL_E_USAGE, field,
                              "planes are found by normals and radii; pack without --points-only, or without "
                              "--primitives");
    return SPL_OK;
}

int spl_pack_check(const struct spl_pack_options *o, unsigned *neighbours, struct spl_chunk_options *chunk,
                   struct spl_error *err)
{
    if (!o->input_count)
        return spl_fail_field(err, SPL_E_USAGE, "inputs", "name at least one scan to pack");
    if (!o->output || !o->output[0])
        return spl_fail_field(err, SPL_E_USAGE, "output", "name the dataset to write, such as scan.spld");
    *neighbours = o->neighbours ? o->neighbours : 12;
    if (*neighbours < 3 || *neighbours > SPL_NEIGHBOURS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "neighbours", "%u neighbours; 3 to %d can be used", *neighbours,
                              SPL_NEIGHBOURS_MAX);
    double position = o->position_error != 0 ? o->position_error : 0.016;
    double normal = o->normal_error != 0 ? o->normal_error : 1;
    if (!(position >= 1e-6 && position <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "position-error",
                              "%g; the mean error is a share of the splat radius, "
                              "1e-6 to 1",
                              position);
    if (!(normal >= 0.01 && normal <= 30))
        return spl_fail_field(err, SPL_E_USAGE, "normal-error", "%g; the mean error is an angle of 0.01 to 30 degrees",
                              normal);
    if (o->memory_bytes && o->memory_bytes < SPL_PACK_MEMORY_MIN)
        return spl_fail_field(err, SPL_E_USAGE, "memory", "%llu bytes; a pack takes %llu MiB at least",
                              (unsigned long long)o->memory_bytes, SPL_PACK_MEMORY_MIN >> 20);
    if (!(isfinite(o->up[0]) && isfinite(o->up[1]) && isfinite(o->up[2])))
        return spl_fail_field(err, SPL_E_USAGE, "up", "%g, %g, %g; up is a direction of three finite numbers", o->up[0],
                              o->up[1], o->up[2]);
    *chunk = (struct spl_chunk_options){
        .position_error = position, .normal_error = normal * M_PI / 180, .radius_error = 0.05};
    struct stat output;
    for (size_t i = 0; i < o->input_count; i++)
        if (spl_file_is_same(o->inputs[i], o->output))
            return spl_fail_field(err, SPL_E_USAGE, "output", "%s is an input too; choose another name", o->output);
    if (!stat(o->output, &output) && !S_ISREG(output.st_mode))
        return spl_fail_field(err, SPL_E_USAGE, "output", "%s exists and is no file", o->output);
    return 0;
}
