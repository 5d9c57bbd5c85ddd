/* How long the stages of a build will take, for who waits: seconds of each, from what it did with other scans. */
#include "pack/build_parts.h"

#include "pack/job/part.h"
#include "pack/texture/pass.h"

/* Seconds a million points on two cores, of the vault and the street. Reading costs most where it is text. */
void spl_build_plan(const struct spl_build *p, const struct spl_passes *later)
{
    static const struct {
        const char *name;
        double seconds;
        enum { ALL, SURFACE, PRIMITIVES, DRAWING } of; /* who has the stage */
        double early, twice; /* more, where nodes are encoded while levels are built; where the end is done again */
    } parts[] = {{"reading", 0.4, ALL},
                 {"ordering", 0.15, ALL},
                 {"wires", 0.25, ALL},
                 {"normals and radii", 1, SURFACE},
                 {"clip lines", 0.15, SURFACE},
                 {"planes", 0.5, PRIMITIVES},
                 {"joining wires", 0.05, ALL},
                 {"outlines", 0.2, DRAWING},
                 {"panels", 0.3, PRIMITIVES},
                 {"levels", 0.2, ALL, .early = 0.2},
                 {"encoding", 0.25, ALL, .early = -0.2},
                 {"writing", 0.3, ALL, .twice = 0.75}};
    const struct spl_pack_options *o = p->options;
    const bool primitives = o->primitives != SPL_PRIMITIVES_OFF, early = p->stage->spill && !primitives;
    const bool twice = spl_build_writes_twice(p, later);
    const bool has[] = {[ALL] = true,
                        [SURFACE] = !o->points_only,
                        [PRIMITIVES] = !o->points_only && primitives,
                        [DRAWING] = !o->points_only && o->export_primitives};
    uint64_t read = 0; /* of which a part keeps some */
    for (size_t i = 0; i < p->scans.count; i++)
        read += p->scans.list[i].points_expected;
    const uint64_t points = p->part ? spl_part_get_expected(p->part) : read;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (has[parts[i].of])
            spl_stage_plan(p->stage, parts[i].name,
                           (parts[i].seconds + early * parts[i].early + twice * parts[i].twice) * 1e-6 *
                               (double)(i ? points : read),
                           i ? 0 : read);
    if (later && later->photographs.count)
        spl_photos_plan(o->photos, p->stage, (uint32_t)later->photographs.count, (uint64_t)(1.33 * (double)points), 0);
    if (later && o->maps) /* scans say with their points how many stations they have */
        spl_maps_plan(p->stage, &later->pictures, 1, points);
}
