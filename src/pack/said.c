/* Checked before a scan is read, put into META when all is known. The caller's thread. */
#include "pack/said.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "dataset/saved_views.h"
#include "geom/camera_json.h"

static int check_text(const char *text, const char *field, size_t most, bool lines, struct spl_error *err)
{
    if (!text)
        return SPL_OK;
    if (strlen(text) > most)
        return spl_fail_field(err, SPL_E_USAGE, field, "the %s has %zu bytes; %zu at most", field, strlen(text), most);
    for (const char *p = text; *p;) {
        bool printable;
        size_t length = spl_text_next(p, &printable);
        if (!printable && !(lines && *p == '\n'))
            return spl_fail_field(err, SPL_E_USAGE, field, "the %s holds a character that cannot be shown, at byte %td",
                                  field, p - text + 1);
        p += length;
    }
    return SPL_OK;
}

/* With what stands for zeros. */
static struct spl_saved_view complete(const struct spl_saved_view *given, const double up[3])
{
    struct spl_saved_view view = *given;
    if (view.up[0] == 0 && view.up[1] == 0 && view.up[2] == 0) {
        memcpy(view.up, up, sizeof view.up);
        if (view.view_height != 0)
            spl_camera_choose_up(up, view.eye, view.target, view.up);
    }
    if (view.fov == 0)
        view.fov = SPL_SAVED_VIEW_FOV;
    return view;
}

/* NULL: up is not known yet; where it is left out any that is not along the view does then. */
static int check_view(const struct spl_saved_view *given, const char *field, const double *up, struct spl_error *err)
{
    const bool named = !strcmp(field, "view");
    const bool known = named && memchr(given->name, 0, sizeof given->name) && spl_view_name_is_valid(given->name);
    const char *space = known ? " " : "", *name = known ? given->name : "";
    struct spl_error why = {0};
    double across[3] = {0};
    int least = 0;
    for (int c = 1; c < 3; c++)
        if (fabs(given->target[c] - given->eye[c]) <= fabs(given->target[least] - given->eye[least]))
            least = c;
    across[least] = 1;
    struct spl_saved_view view = complete(given, up ? up : across);
    if (!named && given->view_height != 0)
        return spl_fail_field(err, SPL_E_USAGE, field, "--%s: it is a pinhole's; orthographic views have names", field);
    if (!spl_saved_view_check(&view, named, &why))
        return SPL_OK;
    if (strcmp(why.field, "up"))
        return spl_fail_field(err, SPL_E_USAGE, field, "--%s%s%s: %s", field, space, name, why.message);
    return spl_fail_field(err, SPL_E_USAGE, field,
                          "--%s%s%s: from eye %.6g,%.6g,%.6g to target %.6g,%.6g,%.6g with up %.6g,%.6g,%.6g: %s",
                          field, space, name, view.eye[0], view.eye[1], view.eye[2], view.target[0], view.target[1],
                          view.target[2], view.up[0], view.up[1], view.up[2], why.message);
}

int spl_said_check_views(const struct spl_pack_options *o, const double *up, struct spl_error *err)
{
    int rc = o->default_view ? check_view(o->default_view, "default-view", up, err) : SPL_OK;
    for (size_t i = 0; !rc && i < o->view_count; i++)
        rc = check_view(&o->views[i], "view", up, err);
    return rc;
}

int spl_said_check(const struct spl_pack_options *o, struct spl_error *err)
{
    int rc = check_text(o->title, "title", SPL_TITLE_BYTES_MAX, false, err);
    if (!rc)
        rc = check_text(o->description, "description", SPL_DESCRIPTION_BYTES_MAX, true, err);
    if (!rc && o->view_count > SPL_SAVED_VIEWS_MAX)
        rc = spl_fail_field(err, SPL_E_USAGE, "view", "%zu views; %d at most", o->view_count, SPL_SAVED_VIEWS_MAX);
    if (!rc)
        rc = spl_said_check_views(o, NULL, err);
    for (size_t i = 0; !rc && i < o->view_count; i++)
        if (spl_saved_views_find(o->views, (uint32_t)i, o->views[i].name))
            rc = spl_fail_field(err, SPL_E_USAGE, "view", "--view %s is given twice", o->views[i].name);
    return rc;
}

int spl_said_check_pack(const struct spl_pack_options *o, struct spl_error *err)
{
    static const double z[3] = {0, 0, 1};
    const bool given = o->up[0] != 0 || o->up[1] != 0 || o->up[2] != 0;
    int rc = spl_said_check(o, err);
    return rc || (!given && o->photos) ? rc : spl_said_check_views(o, given ? o->up : z, err);
}

void spl_said_view(const struct spl_saved_view *given, const double up[3], struct spl_default_view *out)
{
    struct spl_saved_view view = complete(given, up);
    *out = (struct spl_default_view){.fov = view.fov, .fit = {view.fov, view.fov}};
    memcpy(out->eye, view.eye, sizeof out->eye);
    memcpy(out->target, view.target, sizeof out->target);
    memcpy(out->up, view.up, sizeof out->up);
}

int spl_said_add(const struct spl_pack_options *o, const double up[3], json_t *meta, struct spl_error *err)
{
    struct spl_saved_view views[SPL_SAVED_VIEWS_MAX];
    int rc = spl_said_check_views(o, up, err);
    if (rc)
        return rc;
    bool failed = (o->title && json_object_set_new(meta, "title", json_string(o->title))) ||
                  (o->description && json_object_set_new(meta, "description", json_string(o->description)));
    for (size_t i = 0; i < o->view_count; i++)
        views[i] = complete(&o->views[i], up);
    spl_saved_views_sort(views, (uint32_t)o->view_count);
    if (o->view_count)
        failed |= json_object_set_new(meta, "views", spl_saved_views_to_json(views, (uint32_t)o->view_count)) != 0;
    return failed ? spl_fail(err, SPL_E_NOMEM, "out of memory while describing the dataset") : SPL_OK;
}
