/* Poses and lenses held against the headers of their files, before anything is packed: pixels are read in the second
 * pass, when packing has taken its time. Faults of single photographs are handed out and the photographs left out, or
 * they fail the packing, as the options say. Owned by the caller's thread. */
#include "pack/texture/photographs.h"

#include "image/load.h"
#include "pack/texture/candidates.h"
#include "pack/texture/photo_image.h"

int spl_photos_refuse(const struct spl_photo_options *options, struct spl_photo_report *report, int rc,
                      const struct spl_error *why, struct spl_error *err)
{
    if (!options->refused || rc == SPL_E_NOMEM || rc == SPL_E_DEVICE_LOST)
        return spl_fail_field(err, rc, why->field, "%s", why->message);
    report->refused++;
    options->refused(options->context, why);
    return SPL_OK;
}

struct reading {
    const struct spl_photo_options *options;
    struct spl_photo_report *report;
};

static void refuse_pose(void *context, const struct spl_error *why)
{
    const struct reading *reading = context;
    reading->report->refused++;
    reading->options->refused(reading->options->context, why);
}

static int check_file(const struct spl_named_view *view, struct spl_error *err)
{
    struct spl_image_info info;
    const struct spl_camera *camera = &view->camera;
    if (!view->photograph)
        return spl_fail_field(err, SPL_E_INPUT, "color", "%s: is a place without a photograph", view->name);
    int rc = spl_photo_image_get_info(view, &info, err);
    if (!rc && (info.width != camera->width || info.height != camera->height))
        rc = spl_fail_field(err, SPL_E_INPUT, "width",
                            "%s: %u x %u pixels; its camera says %u x %u: scale the photograph or its lens",
                            view->photograph, info.width, info.height, camera->width, camera->height);
    return rc;
}

int spl_photos_load(const struct spl_photo_options *options, struct spl_view_list *list,
                    struct spl_photo_report *report, struct spl_error *err)
{
    struct reading reading = {options, report};
    const struct spl_photograph_options how = {
        .images = options->images,
        .get_size = spl_image_get_size,
        .refuse = options->refused ? refuse_pose : NULL,
        .context = &reading,
    };
    size_t kept = 0;
    int rc = spl_view_list_load_photographs(list, options->cameras, &how, err);
    if (rc)
        return rc;
    for (size_t i = 0; !rc && i < list->count; i++) {
        struct spl_error why = {0};
        struct spl_named_view view = list->views[i];
        if ((rc = check_file(&view, &why)) && (rc = spl_photos_refuse(options, report, rc, &why, err)))
            break;
        list->views[i] = list->views[kept];
        list->views[kept] = view;
        kept += why.code == 0;
    }
    if (!rc && (!kept || kept > SPL_PHOTOS_TAKEN_MAX))
        rc = kept ? spl_fail_field(err, SPL_E_LIMIT, "images", "%zu photographs; at most %d are taken", kept,
                                   SPL_PHOTOS_TAKEN_MAX)
                  : spl_fail_field(err, SPL_E_INPUT, "images", "%s: none of %zu photographs can be used",
                                   options->cameras, list->count);
    report->photographs = (uint32_t)kept;
    if (rc)
        spl_view_list_finish(list);
    return rc;
}
