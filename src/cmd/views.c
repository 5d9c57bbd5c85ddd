/* What --default-view and --view say, of every command that writes a dataset. Whether such a view can be drawn is the
 * library's to say. Pure. */
#include "cmd/views.h"

#include <ctype.h>
#include <string.h>

#include "cmd/options.h"

/* "eye=X,Y,Z,target=X,Y,Z,up=X,Y,Z,fov=DEG,view_height=UNITS", in any order. */
static int parse_view(const char *option, char *text, struct spl_saved_view *view, struct spl_error *err)
{
    static const char *const names[] = {"eye", "target", "up", "fov", "view_height"};
    enum { count = sizeof names / sizeof *names };
    bool given[count] = {0};
    for (char *at = text, *next; at && *at; at = next) {
        int key = 0;
        size_t length = strcspn(at, "=");
        while (key < count && (strlen(names[key]) != length || strncmp(at, names[key], length)))
            key++;
        if (key == count || at[length] != '=' || given[key])
            return spl_fail_field(
                err, SPL_E_USAGE, option + 2,
                "%s takes eye=X,Y,Z,target=X,Y,Z, and up=X,Y,Z, fov=DEG and view_height=UNITS, each once, not '%.60s'",
                option, at);
        given[key] = true;
        char *value = at + length + 1;
        for (next = value; *next && !(*next == ',' && isalpha((unsigned char)next[1]));)
            next++;
        if (*next)
            *next++ = 0;
        double *out[] = {view->eye, view->target, view->up};
        int rc = key < 3    ? spl_cmd_parse_vector(option, value, out[key], err)
                 : key == 3 ? spl_cmd_parse_real(option, value, 1e-6, 179, &view->fov, err)
                            : spl_cmd_parse_real(option, value, 1e-9, 1e12, &view->view_height, err);
        if (rc)
            return rc;
    }
    return given[0] && given[1]
               ? SPL_OK
               : spl_fail_field(err, SPL_E_USAGE, option + 2, "%s needs eye=X,Y,Z and target=X,Y,Z", option);
}

int spl_cmd_views_take_first(struct spl_cmd_views *views, const char *option, char *text, struct spl_error *err)
{
    views->first = (struct spl_saved_view){0};
    return parse_view(option, text, &views->first, err);
}

int spl_cmd_views_take(struct spl_cmd_views *views, const char *option, char *text, struct spl_error *err)
{
    size_t length = strcspn(text, "=");
    if (views->count == SPL_SAVED_VIEWS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "view", "%s is given more than %d times", option, SPL_SAVED_VIEWS_MAX);
    struct spl_saved_view *view = &views->named[views->count];
    *view = (struct spl_saved_view){0};
    if (text[length] != '=' || !length || length >= sizeof view->name)
        return spl_fail_field(
            err, SPL_E_USAGE, "view",
            "%s takes NAME=eye=X,Y,Z,target=X,Y,Z, the name of at most 63 letters, digits, '.', '_' and "
            "'-', not '%.60s'",
            option, text);
    memcpy(view->name, text, length);
    views->count++;
    return parse_view(option, text + length + 1, view, err);
}
