/* Are terms in range? Names of attributes are asked of datasets (marks_terms.c). Pure; any thread. */
#include "render/terms.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"

static const char *const shape_names[SPL_TERM_MEASURES] = {
    [SPL_TERM_AXIS] = "axis",   [SPL_TERM_PLANE] = "plane",     [SPL_TERM_BOX] = "box",
    [SPL_TERM_COORDINATE] = "z", [SPL_TERM_POLYGON] = "polygon",
};

const char *spl_term_shape_name(enum spl_term_measure measure)
{
    return (unsigned)measure < SPL_TERM_MEASURES ? shape_names[measure] : NULL;
}

static bool say(char fault[SPL_TERM_FAULT_MAX], const char *what)
{
    snprintf(fault, SPL_TERM_FAULT_MAX, "%s", what);
    return false;
}

static bool check_box(const double s[9], char fault[SPL_TERM_FAULT_MAX])
{
    for (int i = 0; i < 3; i++)
        if (s[i] > s[i + 3]) {
            snprintf(fault, SPL_TERM_FAULT_MAX, "has a box that ends at %.9g before it begins at %.9g", s[i + 3], s[i]);
            return false;
        }
    for (int i = 0; i < 3; i++)
        if (!isfinite(s[i + 3] - s[i])) {
            snprintf(fault, SPL_TERM_FAULT_MAX, "has a box from %.9g to %.9g, wider than numbers go", s[i], s[i + 3]);
            return false;
        }
    for (int i = 6; i < 9; i++)
        if (!(fabs(s[i]) <= 360)) {
            snprintf(fault, SPL_TERM_FAULT_MAX, "has a box that is turned by %.9g degrees, not within -360 and 360",
                     s[i]);
            return false;
        }
    return true;
}

static bool check_polygon(const struct spl_term *term, const double *corners, char fault[SPL_TERM_FAULT_MAX])
{
    const double low = term->shape[0], high = term->shape[1];
    if (term->corners > SPL_TERMS_CORNERS_MAX || term->first_corner > SPL_TERMS_CORNERS_MAX - term->corners)
        return say(fault, "has corners that are not there");
    if (!isinf(low) != !isinf(high))
        return say(fault, "has a polygon with one height");
    if (!(low < high)) {
        snprintf(fault, SPL_TERM_FAULT_MAX, "has a polygon that ends at height %.9g, not above %.9g", high, low);
        return false;
    }
    return spl_polygon_check(corners + 2 * term->first_corner, term->corners, fault);
}

static bool check_shape(const struct spl_term *term, const double *corners, char fault[SPL_TERM_FAULT_MAX])
{
    const double *s = term->shape, length = hypot(hypot(s[3], s[4]), s[5]);
    if (term->measure == SPL_TERM_POLYGON)
        return check_polygon(term, corners, fault);
    for (int i = 0; i < 9; i++)
        if (!isfinite(s[i]))
            return say(fault, "has a number that is not finite");
    if (term->measure == SPL_TERM_BOX)
        return check_box(s, fault);
    if (term->measure == SPL_TERM_COORDINATE)
        return (s[3] == 1) + (s[4] == 1) + (s[5] == 1) == 1 && length == 1 ? true : say(fault, "is of no coordinate");
    return length > 0 && isfinite(length) ? true : say(fault, "has a direction without length");
}

static bool is_share(double end)
{
    return isinf(end) || (end >= 0 && end <= 1);
}

bool spl_term_check(const struct spl_term *term, const double *corners, char fault[SPL_TERM_FAULT_MAX])
{
    *fault = '\0';
    if ((unsigned)term->measure >= SPL_TERM_MEASURES)
        return say(fault, "measures nothing that exists");
    if ((unsigned)term->joint > SPL_TERM_AND)
        return say(fault, "is joined in no way that exists");
    if (isnan(term->least) || isnan(term->most) || term->least > term->most || term->least == INFINITY ||
        term->most == -INFINITY) {
        snprintf(fault, SPL_TERM_FAULT_MAX, "ends at %.9g before it begins at %.9g", term->most, term->least);
        return false;
    }
    if (term->measure >= SPL_TERM_AXIS)
        return check_shape(term, corners, fault);
    if (!term->name[0] || !memchr(term->name, 0, sizeof term->name))
        return say(fault, "names no attribute");
    if (term->measure == SPL_TERM_QUANTILE && !(is_share(term->least) && is_share(term->most))) {
        snprintf(fault, SPL_TERM_FAULT_MAX, "has quantile %.9g, which is not within 0 and 1",
                 is_share(term->least) ? term->most : term->least);
        return false;
    }
    return true;
}

bool spl_term_is_inside(const struct spl_term *term)
{
    return (term->measure == SPL_TERM_BOX || term->measure == SPL_TERM_POLYGON) && term->least == -INFINITY &&
           term->most == 0 && term->with_most;
}

/* What clips: nothing is in an empty box, and what has no room in a mark is refused here, where all terms are known. */
static int check_clip(const struct spl_terms *terms, struct spl_error *err)
{
    uint32_t mixed = 0;
    for (uint32_t i = 0; i < terms->count;) {
        bool attributes = false, shapes = false;
        do {
            const struct spl_term *term = &terms->terms[i];
            const double *s = term->shape;
            *(term->measure < SPL_TERM_AXIS ? &attributes : &shapes) = true;
            if (term->measure == SPL_TERM_BOX && term->most <= 0 && (s[0] == s[3] || s[1] == s[4] || s[2] == s[5]))
                return spl_fail_field(err, SPL_E_USAGE, "clip", "term %u of clip has an empty box", i + 1);
        } while (++i < terms->count && terms->terms[i].joint != SPL_TERM_AND);
        mixed += attributes && shapes;
    }
    if (mixed > SPL_TERMS_MIXED_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "clip",
                              "%u conditions have both attributes and shapes, of which there may "
                              "be %d",
                              mixed, SPL_TERMS_MIXED_MAX);
    return SPL_OK;
}

int spl_terms_check(const struct spl_terms *terms, const char *field, struct spl_error *err)
{
    char fault[SPL_TERM_FAULT_MAX];
    uint32_t corners = 0; /* as kernels have them: each term its own */
    if (terms->count > SPL_TERMS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, field, "%u terms are more than %d", terms->count, SPL_TERMS_MAX);
    for (uint32_t i = 0; i < terms->count; i++) {
        const struct spl_term *term = &terms->terms[i];
        if (!spl_term_check(term, terms->corners[0], fault))
            return spl_fail_field(err, SPL_E_USAGE, field, "term %u of %s %s", i + 1, field, fault);
        corners += term->measure == SPL_TERM_POLYGON ? term->corners : 0;
        if (corners > SPL_TERMS_CORNERS_MAX)
            return spl_fail_field(err, SPL_E_USAGE, field, "polygons of %s have more than %d corners in all", field,
                                  SPL_TERMS_CORNERS_MAX);
    }
    return strcmp(field, "clip") ? SPL_OK : check_clip(terms, err);
}
