/* The pictures that a sweep's page shows: of some views the reference, and under each setting the render and where it
 * is wrong, as JPEGs that are small enough to look through. A picture is on disk before the record that vouches for it,
 * so a resumed run has all pictures of what it skips. Any thread; one folder is one sweep's. */
#include "measure/sweep_pictures.h"

#include <stdio.h>

#include "base/file.h"
#include "measure/pictures.h"

size_t spl_sweep_page_views(size_t views)
{
    return views < SPL_SWEEP_PAGE_VIEWS ? views : SPL_SWEEP_PAGE_VIEWS;
}

size_t spl_sweep_page_view(size_t views, size_t i)
{
    return i * views / spl_sweep_page_views(views);
}

bool spl_sweep_has_pictures(size_t views, size_t view)
{
    for (size_t i = 0; i < spl_sweep_page_views(views); i++)
        if (spl_sweep_page_view(views, i) == view)
            return true;
    return false;
}

void spl_sweep_picture_path(const struct spl_sweep_options *o, enum spl_sweep_picture kind, size_t view, size_t setting,
                            char path[4096])
{
    if (kind == SPL_SWEEP_REFERENCE)
        snprintf(path, 4096, "%s/pictures/view%zu-reference%s.jpg", o->folder, view,
                 o->settings[setting].soft ? "-soft" : "");
    else
        snprintf(path, 4096, "%s/pictures/view%zu-setting%zu%s.jpg", o->folder, view, setting,
                 kind == SPL_SWEEP_ERROR ? "-error" : "");
}

int spl_sweep_save_picture(const struct spl_sweep_options *o, enum spl_sweep_picture kind, size_t view, size_t setting,
                           const struct spl_image *color, struct spl_error *err)
{
    struct spl_encoded encoded;
    int rc = spl_thumbnail(color, SPL_SWEEP_PICTURE_SIDE, &encoded, err);
    if (rc)
        return rc;
    char path[4096];
    spl_sweep_picture_path(o, kind, view, setting, path);
    rc = spl_file_replace(path, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    return rc;
}

int spl_sweep_save_pictures(const struct spl_sweep_options *o, size_t view, size_t setting,
                            const struct spl_image *color, const struct spl_image *truth, struct spl_error *err)
{
    struct spl_image map = {0};
    int rc = spl_sweep_save_picture(o, SPL_SWEEP_RENDER, view, setting, color, err);
    if (!rc)
        rc = spl_error_map(color, truth, &map, err);
    if (!rc)
        rc = spl_sweep_save_picture(o, SPL_SWEEP_ERROR, view, setting, &map, err);
    spl_image_finish(&map);
    return rc;
}
