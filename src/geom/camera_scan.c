/* Views of all directions: equirectangular, cube, lists of rays; and a scanner's rays, whose first and last column and
 * row are given. Pure functions, any thread. */
#include <math.h>

#include "geom/camera_parts.h"

/* A scanner's rays: where the first and the last column and row look, and how many there are. Their counts become the
 * size in `own`, a copy of the values. */
static const enum spl_camera_param scan[] = {SPL_CAMERA_azimuth, SPL_CAMERA_elevation},
                                   scan_sides[] = {SPL_CAMERA_width, SPL_CAMERA_height};

int spl_camera_take_scan(const struct spl_value *v, struct spl_value own[SPL_CAMERA_PARAMS], struct spl_error *err)
{
    const int first = !given(v, scan[0]); // of the two that is there, maybe alone
    if (!given(v, SPL_CAMERA_projection) || v[SPL_CAMERA_projection].n[0] != SPL_EQUIRECTANGULAR)
        return spl_fail_field(err, SPL_E_INPUT, spl_camera_param_names[scan[first]],
                              "'%s' goes with projection equirectangular alone", spl_camera_param_names[scan[first]]);
    if (!given(v, scan[!first]))
        return spl_camera_missing(scan[!first], scan[first], err);
    for (int i = 0; i < 2; i++) {
        const double *n = v[scan[i]].n, most = i ? 90 : 360;
        const char *name = spl_camera_param_names[scan[i]];
        if (given(v, scan_sides[i]))
            return spl_camera_conflict(v, scan_sides[i], scan[i], err);
        if (!(fabs(n[0]) <= most && fabs(n[1]) <= most && fabs(n[1] - n[0]) <= 360))
            return spl_fail_field(err, SPL_E_INPUT, name,
                                  "%s from %g to %g is not within -%g and %g, or more than a turn", name, n[0], n[1],
                                  most, most);
        if (!(n[2] >= 1 && n[2] == floor(n[2])) || (n[2] > 1 && n[0] == n[1]))
            return spl_fail_field(err, SPL_E_INPUT, name, "%g is no number of rays from %g to %g", n[2], n[0], n[1]);
        own[scan_sides[i]] = (struct spl_value){.given = true, .count = 1, .n = {n[2]}};
    }
    return 0;
}

/* From one ray to the next; a full turn's last is one before its first. */
static double scan_step(const double n[3])
{
    const bool turn = fabs(fabs(n[1] - n[0]) - 360) < 1e-9;
    return (n[2] > 1 ? (n[1] - n[0]) / (n[2] - (turn ? 0 : 1)) : 1) * (M_PI / 180);
}

/* Of all directions there are no two ways to draw. */
int spl_camera_resolve_around(const struct spl_value *v, struct spl_camera *camera, struct spl_error *err)
{
    for (enum spl_camera_param other = SPL_CAMERA_model; other <= SPL_CAMERA_cy; other++)
        if (other != SPL_CAMERA_projection && given(v, other))
            return spl_camera_conflict(v, other, SPL_CAMERA_projection, err);
    if (v[SPL_CAMERA_projection].n[0] == SPL_RAYS) { // their list is the caller's: spl_camera_set_rays()
        camera->projection = SPL_RAYS;
        camera->fx = camera->fy = 1;
        camera->cx = camera->cy = 0.5;
        return SPL_OK;
    }
    int rc = spl_camera_set_around(camera, (enum spl_projection)v[SPL_CAMERA_projection].n[0], camera->width,
                                   camera->height, err);
    if (rc || !given(v, scan[0]))
        return rc;
    const double *azimuth = v[scan[0]].n, *elevation = v[scan[1]].n;
    camera->fx = 1 / scan_step(azimuth);
    camera->fy = -1 / scan_step(elevation);
    camera->cx = 0.5 - azimuth[0] * (M_PI / 180) * camera->fx;
    camera->cy = 0.5 + elevation[0] * (M_PI / 180) * camera->fy;
    return 0;
}
