/* Checked before a scan is read, put into META when all is known. The caller's thread. */
#include "pack/said.h"

#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "dataset/saved_views.h"

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
    if (view.up[0] == 0 && view.up[1] == 0 && view.up[2] == 0)
        memcpy(view.up, up, sizeof view.up);
    if (view.fov == 0)
        view.fov = SPL_SAVED_VIEW_FOV;
    return view;
}

/* Up is not known yet where it is left out: any that is not along the view does here. */
static int check_view(const struct spl_saved_view *given, const char *field, bool named, struct spl_error *err)
{
    struct spl_error why = {0};
    bool upright = given->eye[0] == given->target[0] && given->eye[1] == given->target[1];
    struct spl_saved_view view = complete(given, upright ? (double[]){0, 1, 0} : (double[]){0, 0, 1});
    if (!named && given->view_height != 0)
        return spl_fail_field(err, SPL_E_USAGE, field, "--%s: it is a pinhole's; orthographic views have names", field);
    return spl_saved_view_check(&view, named, &why)
               ? spl_fail_field(err, SPL_E_USAGE, field, "--%s: %s", field, why.message)
               : SPL_OK;
}

int spl_said_check(const struct spl_pack_options *o, struct spl_error *err)
{
    int rc = check_text(o->title, "title", SPL_TITLE_BYTES_MAX, false, err);
    if (!rc)
        rc = check_text(o->description, "description", SPL_DESCRIPTION_BYTES_MAX, true, err);
    if (!rc && o->default_view)
        rc = check_view(o->default_view, "default-view", false, err);
    if (!rc && o->view_count > SPL_SAVED_VIEWS_MAX)
        rc = spl_fail_field(err, SPL_E_USAGE, "view", "%zu views; %d at most", o->view_count, SPL_SAVED_VIEWS_MAX);
    for (size_t i = 0; !rc && i < o->view_count; i++) {
        rc = check_view(&o->views[i], "view", true, err);
        if (!rc && spl_saved_views_find(o->views, (uint32_t)i, o->views[i].name))
            rc = spl_fail_field(err, SPL_E_USAGE, "view", "--view %s is given twice", o->views[i].name);
    }
    return rc;
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
    bool failed = (o->title && json_object_set_new(meta, "title", json_string(o->title))) ||
                  (o->description && json_object_set_new(meta, "description", json_string(o->description)));
    for (size_t i = 0; i < o->view_count; i++) {
        struct spl_error why = {0};
        views[i] = complete(&o->views[i], up);
        if (spl_saved_view_check(&views[i], true, &why))
            return spl_fail_field(err, SPL_E_USAGE, "view", "--view %s: %s", views[i].name, why.message);
    }
    spl_saved_views_sort(views, (uint32_t)o->view_count);
    if (o->view_count)
        failed |= json_object_set_new(meta, "views", spl_saved_views_to_json(views, (uint32_t)o->view_count)) != 0;
    return failed ? spl_fail(err, SPL_E_NOMEM, "out of memory while describing the dataset") : SPL_OK;
}
