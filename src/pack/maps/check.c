/* Pictures against the splats that their station sees: another's pose, another station's picture and other coordinates
 * are refused, what is off by little is told. Maps of a side that is enough for it are made for this. The caller's
 * thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/maps/even.h"
#include "pack/maps/pass.h"

enum { few = SPL_AGREEMENT_LEAST }; /* splats that a station sees at least, or its share of them is told */

int spl_map_check_any(const struct spl_map_pass *p, struct spl_error *err)
{
    bool any = !p->views->count || p->options->find;
    for (size_t v = 0; v < p->views->count && !any; v++)
        any = p->stations.of_view[v] != UINT32_MAX;
    if (any)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_INPUT, "panoramas",
                          "%s: none of its %u picture%s stands within half a metre of a station of the scan: are they "
                          "of this scan, and their poses in its coordinates? --panoramas scan takes the scan's own "
                          "colours",
                          p->options->panoramas, p->report->pictures, p->report->pictures == 1 ? "" : "s");
}

/* The station's first picture; NULL without. */
static const struct spl_named_view *find_picture(const struct spl_map_pass *p, uint32_t station)
{
    for (size_t v = 0; v < p->views->count; v++)
        if (p->stations.of_view[v] == station && p->views->views[v].photograph)
            return &p->views->views[v];
    return NULL;
}

/* "station 3", and what stands there. */
static void name_station(const struct spl_map_pass *p, uint32_t station, char *name, size_t size)
{
    const struct spl_named_view *view = find_picture(p, station);
    for (size_t v = 0; v < p->views->count && !view; v++)
        if (p->stations.of_view[v] == station)
            view = &p->views->views[v];
    snprintf(name, size, view ? "station %u (%s)" : "station %u", station + 1,
             view ? view->photograph ? view->photograph : view->name : "");
}

void spl_map_check_sight(const struct spl_map_pass *p, uint32_t station, size_t hits, double near)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(p->splats.dataset);
    double across = 0, share = (double)info->leaf_splats / p->stations.count;
    char name[512];
    for (int k = 0; k < 3; k++)
        across = hypot(across, info->bounds_max[k] - info->bounds_min[k]);
    bool far = hits && near > across, little = hits < few && (double)hits * 10 < share;
    if (!far && !little)
        return;
    name_station(p, station, name, sizeof name);
    if (far)
        spl_map_warn(p,
                     "%s stands %.4g away from all that it sees of the scan, which is %.4g wide: are its position and "
                     "the scan of the same coordinates, and in the same unit?",
                     name, near, across);
    else
        spl_map_warn(p, "%s sees %zu of the scan's %llu splats%s: is it of this scan, and its position right?", name,
                     hits, (unsigned long long)info->leaf_splats, hits ? "" : ", so it has no map");
}

/* What pictures that do not fit their station are told, or warned of; 0, or below it where they are not to be used. */
static int judge(struct spl_map_pass *p, const char *name, const struct spl_agreement *a, struct spl_error *why)
{
    char cause[160] = "is its pose another's, or of another system of coordinates?";
    double length = sqrt(a->shift[0] * a->shift[0] + a->shift[1] * a->shift[1] + a->shift[2] * a->shift[2]);
    bool other = a->other > 0.5 && a->other > a->correlation + 0.25;
    if (a->shared < SPL_AGREEMENT_LEAST || isnan(a->correlation)) {
        spl_map_warn(p, "%s: %s, so nothing tells whether it fits the scan", name,
                     a->shared < SPL_AGREEMENT_LEAST ? "it sees too few of the splats without doubt"
                                                     : "it, or what it shows of the scan, is of one colour");
        return SPL_OK;
    }
    if (other)
        snprintf(cause, sizeof cause, "%s%s%.0f degrees around the vertical it would be %.2f",
                 a->mirrored ? "mirrored" : "", a->mirrored ? " and turned by " : "turned by ", a->turned, a->other);
    if (a->correlation < 0.25 || other)
        return spl_fail_field(why, SPL_E_INPUT, "panoramas",
                              "%s: its colours are not those of the splats that it shows (correlation %.2f of %zu): %s",
                              name, a->correlation, a->shared, cause);
    if (a->correlation < 0.6) {
        spl_map_warn(p, "%s: its colours hardly are those of the splats that it shows (correlation %.2f of %zu)",
                     name, a->correlation, a->shared);
        return SPL_OK;
    }
    if (length * p->metre > 0.007 && length > 4 * a->shift_error)
        spl_map_warn(p,
                     "%s: it stands at least %.1f mm (+- %.1f) from where its pose says, towards %.4f, %.4f, %.4f: "
                     "as far as its edges tell, which are followed so far alone; correct the pose and pack again to "
                     "see what is left",
                     name, 1000 * length * p->metre, 2000 * a->shift_error * p->metre, a->shift[0], a->shift[1],
                     a->shift[2]);
    if (a->turn > 0.0015 && a->turn > 4 * a->turn_error)
        spl_map_warn(p, "%s: it is turned by at least %.2f degrees (+- %.2f), as far as its edges tell", name,
                     a->turn * 180 / M_PI, 2 * a->turn_error * 180 / M_PI);
    return SPL_OK;
}

int spl_map_check_pictures(struct spl_map_pass *p, struct spl_error *err)
{
    enum { side_enough = 512, samples_most = 300000, compared_most = 40000 };
    struct spl_samples samples, compared = {0};
    struct spl_sightings sightings = {0};
    int rc = spl_samples_init(&samples, &p->splats, &p->stations, samples_most, err);
    if (!rc)
        rc = spl_samples_init(&compared, &p->splats, &p->stations, compared_most, err);
    if (!rc && !samples.colored && spl_map_count_placed(p))
        spl_map_warn(p, "the scan has no colours, so nothing tells whether its panoramas fit it");
    spl_stage_begin(p->stage, "checking maps", NULL, p->count + spl_map_count_placed(p));
    for (uint32_t row = 0; !rc && row < p->count; row++) {
        uint32_t station = p->station_of[row], side = p->rows[row].side;
        const struct spl_named_view *picture = find_picture(p, station);
        const struct spl_map_sight map = {&p->rows[row], p->codes[row]};
        struct spl_atlas atlas = {0};
        struct spl_agreement agreement = {0};
        struct spl_error why = {0};
        spl_stage_add(p->stage, 1, 0);
        if (!picture)
            continue;
        rc = spl_map_pass_make_colors(p, row, side < side_enough ? side : side_enough, &atlas, err);
        if (!rc && samples.colored)
            rc = spl_agreement_find(&agreement, &atlas, &p->stations.list[station], station, p->stations.scanned, &map,
                                    &samples, err);
        int fault = rc || !samples.colored ? SPL_OK : judge(p, picture->photograph, &agreement, &why);
        if (!rc && !fault)
            rc = spl_sightings_add(&sightings, &atlas, (uint16_t)row, &p->stations.list[station], &map, &compared, err);
        spl_atlas_finish(&atlas);
        for (size_t v = 0; fault && v < p->views->count; v++)
            if (p->stations.of_view[v] == station)
                p->stations.of_view[v] = UINT32_MAX;
        if (fault)
            rc = spl_map_pass_refuse(p, fault, &why, err);
    }
    spl_stage_end(p->stage);
    if (!rc && (p->factors = spl_alloc(p->count, sizeof *p->factors, err)))
        rc = spl_sightings_even_out(&sightings, &compared, p->count, p->factors, err);
    else if (!rc)
        rc = SPL_E_NOMEM;
    spl_sightings_finish(&sightings);
    spl_samples_finish(&compared);
    spl_samples_finish(&samples);
    return rc;
}
