/* What people write in other languages of queries, and the names that they meant. Nothing is allocated. */
#include "render/terms_hints.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"
#include "base/near_name.h"
#include "dataset/classes.h"
#include "dataset/streams.h"

bool spl_terms_hint_sign(const char *name, const char *at, char hint[SPL_TERMS_HINT_MAX])
{
    const bool not = *at == '!';
    double value;
    char text[SPL_DECIMAL_MAX];
    if (*at != '=' && !(not && at[1] == '='))
        return false;
    at += strspn(at, "!=");
    const char *end = spl_decimal_parse(at + strspn(at, " "), &value);
    if (!end)
        snprintf(hint, SPL_TERMS_HINT_MAX, "there is no %s; write '%s:' and a value, a range or a list of them",
                 not ? "!=" : "=", name);
    else if (not)
        snprintf(hint, SPL_TERMS_HINT_MAX, "there is no !=; write what is meant: '%s<%s or %s>%s'", name,
                 spl_decimal_print(value, text), name, text);
    else
        snprintf(hint, SPL_TERMS_HINT_MAX, "there is no =; write '%s:%s'", name, spl_decimal_print(value, text));
    return true;
}

bool spl_terms_hint_list(const char *name, const char *at, char hint[SPL_TERMS_HINT_MAX])
{
    if (strcmp(name, "class") || !isalpha((unsigned char)*at) || (*at == 'q' && !isalpha((unsigned char)at[1])))
        return false;
    snprintf(hint, SPL_TERMS_HINT_MAX, "classes are numbers: %s", SPL_CLASSES_LISTED);
    return true;
}

/* NULL where none is near. */
static const char *find_near(const char *name, const struct spl_dataset_info *info)
{
    struct spl_near_name near = spl_near_name_of(name);
    for (uint32_t s = 0; s < info->stream_count; s++)
        if (spl_stream_type_from_name(info->streams[s].type) != SPL_STREAM_UNKNOWN)
            spl_near_name_offer(&near, info->streams[s].name);
    return near.found;
}

/* The axis that a coordinate's name means, or -1. */
static int axis_of(const char *name)
{
    static const char *const heights[] = {"height", "elevation", "altitude"};
    if (strchr("xyzXYZ", *name) && *name && !name[1])
        return tolower((unsigned char)*name) - 'x';
    for (size_t i = 0; i < sizeof heights / sizeof *heights; i++)
        if (!strcmp(name, heights[i]))
            return 2;
    return -1;
}

bool spl_terms_hint_name(const struct spl_term *term, const struct spl_dataset_info *info,
                        char hint[SPL_TERMS_HINT_MAX])
{
    const char *near = find_near(term->name, info);
    const int axis = axis_of(term->name);
    char at[SPL_DECIMAL_MAX];
    if (axis >= 0) {
        const bool above = isfinite(term->least) || !isfinite(term->most);
        const double end = above ? term->least : term->most;
        spl_decimal_print(isfinite(end) && term->measure == SPL_TERM_ATTRIBUTE ? end : 0, at);
        snprintf(hint, SPL_TERMS_HINT_MAX, "coordinates are x, y and z: write '%c%c%s'", 'x' + axis, above ? '>' : '<',
                 at);
        return true;
    }
    if (near)
        snprintf(hint, SPL_TERMS_HINT_MAX, "did you mean '%s'?", near);
    return near;
}
