/* Which of the numbers that points bring are kept, once all points are read, and in which steps. The packer's
 * thread. */
#include "pack/points.h"

#include "pack/job/rules.h"
#include "pack/kept.h"

static bool votes(int scalar)
{
    return scalar == SPL_SCALAR_RETURN || scalar == SPL_SCALAR_RETURNS || scalar == SPL_SCALAR_SCAN;
}

/* Those of a part are kept as those of all others, whatever values it has. */
static int settle_as_ruled(struct spl_points *p, const struct spl_part_rules *rules, struct spl_error *err)
{
    int rc = SPL_OK;
    for (int s = 0; s < SPL_POINT_SCALARS && !rc && p->count; s++) {
        struct spl_scalar_values *scalar = &p->scalar[s];
        if (!(rules->scalars >> s & 1)) {
            spl_spill_free(p->spill, scalar->values);
            *scalar = (struct spl_scalar_values){0};
            continue;
        }
        scalar->votes = votes(s);
        if (!scalar->values) /* no point here has any */
            rc = spl_scalar_add(scalar, p->capacity, p->count, NULL, 0, err);
        if (!rc && !spl_scalar_settle_as(scalar, &rules->steps[s]))
            rc = spl_fail_field(err, SPL_E_INPUT, "scalars",
                                "the scans' \"%s\" is from %.17g to %.17g%s, unlike in the plan (from %.17g in %.17g a "
                                "unit): make the plan anew",
                                spl_kept_name(p->keep, s), scalar->min, scalar->max,
                                scalar->missing ? " and missing in some" : "", rules->steps[s].first,
                                rules->steps[s].steps_a_unit);
    }
    return rc;
}

/* Leaves out those that say nothing: all points have the same, and nobody named it. */
static int settle_scalars(struct spl_points *p, struct spl_error *err)
{
    int rc = SPL_OK;
    for (int s = 0; s < SPL_POINT_SCALARS && !rc; s++) {
        struct spl_scalar_values *scalar = &p->scalar[s];
        if (!scalar->values)
            continue;
        scalar->votes = votes(s);
        if (!spl_scalar_is_constant(scalar) || spl_kept_is_named(p->keep, s)) {
            rc = spl_scalar_settle(scalar, p->count, err);
        } else {
            spl_spill_free(p->spill, scalar->values);
            *scalar = (struct spl_scalar_values){0};
        }
    }
    return rc;
}

int spl_points_settle(struct spl_points *points, const struct spl_part_rules *rules, struct spl_error *err)
{
    return rules ? settle_as_ruled(points, rules, err) : settle_scalars(points, err);
}

unsigned spl_points_list_scalars(const struct spl_points *points, int list[SPL_POINT_SCALARS])
{
    unsigned count = 0;
    for (int s = 0; s < SPL_POINT_SCALARS; s++)
        if (points->scalar[s].values)
            list[count++] = s;
    return count;
}
