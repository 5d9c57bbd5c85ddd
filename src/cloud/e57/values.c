/* What the elements of a scan and of an image mean: tables of their places below them, and the fields of a point.
 * Owned by the thread that reads the file; no state. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <strings.h>

#include "base/array.h"
#include "base/text.h"
#include "cloud/e57/parser.h"

struct value {
    const char *place;
    size_t member;
};

#define OF_SCAN(member) offsetof(struct spl_e57_scan, member)
#define OF_IMAGE(member) offsetof(struct spl_e57_image, member)
#define POSE(of)                                                                                                       \
    {"/pose/rotation/w", of(pose.rotation[0])}, {"/pose/rotation/x", of(pose.rotation[1])},                            \
        {"/pose/rotation/y", of(pose.rotation[2])}, {"/pose/rotation/z", of(pose.rotation[3])},                        \
        {"/pose/translation/x", of(pose.translation[0])}, {"/pose/translation/y", of(pose.translation[1])},            \
    {                                                                                                                  \
        "/pose/translation/z", of(pose.translation[2])                                                                 \
    }

static const struct value scan_values[] = {
    POSE(OF_SCAN),
    {"/intensityLimits/intensityMinimum", OF_SCAN(intensity_limits[0])},
    {"/intensityLimits/intensityMaximum", OF_SCAN(intensity_limits[1])},
    {"/colorLimits/colorRedMinimum", OF_SCAN(color_limits[0][0])},
    {"/colorLimits/colorRedMaximum", OF_SCAN(color_limits[0][1])},
    {"/colorLimits/colorGreenMinimum", OF_SCAN(color_limits[1][0])},
    {"/colorLimits/colorGreenMaximum", OF_SCAN(color_limits[1][1])},
    {"/colorLimits/colorBlueMinimum", OF_SCAN(color_limits[2][0])},
    {"/colorLimits/colorBlueMaximum", OF_SCAN(color_limits[2][1])},
};

static const struct value image_values[] = {POSE(OF_IMAGE)};

/* Below the representation, whichever it is. */
static const struct value representation_values[] = {
    {"/imageWidth", OF_IMAGE(width)},
    {"/imageHeight", OF_IMAGE(height)},
    {"/pixelWidth", OF_IMAGE(pixel_width)},
    {"/pixelHeight", OF_IMAGE(pixel_height)},
    {"/focalLength", OF_IMAGE(focal_length)},
    {"/radius", OF_IMAGE(radius)},
    {"/principalPointX", OF_IMAGE(principal[0])},
    {"/principalPointY", OF_IMAGE(principal[1])},
};

static const struct {
    const char *name;
    enum spl_e57_role role;
} roles[] = {
    {"cartesianX", SPL_E57_X},
    {"cartesianY", SPL_E57_Y},
    {"cartesianZ", SPL_E57_Z},
    {"sphericalRange", SPL_E57_RANGE},
    {"sphericalAzimuth", SPL_E57_AZIMUTH},
    {"sphericalElevation", SPL_E57_ELEVATION},
    {"cartesianInvalidState", SPL_E57_STATE},
    {"sphericalInvalidState", SPL_E57_SPHERICAL_STATE},
    {"colorRed", SPL_E57_RED},
    {"colorGreen", SPL_E57_GREEN},
    {"colorBlue", SPL_E57_BLUE},
    {"intensity", SPL_E57_INTENSITY},
    {"isIntensityInvalid", SPL_E57_INTENSITY_STATE},
    {"returnIndex", SPL_E57_RETURN},
    {"returnCount", SPL_E57_RETURNS},
    {"rowIndex", SPL_E57_ROW},
    {"columnIndex", SPL_E57_COLUMN},
};

/* Of extensions, whatever prefix their writer chose. */
static const struct {
    const char *name;
    enum spl_e57_role role;
} extension_roles[] = {
    {"normalX", SPL_E57_NX},
    {"normalY", SPL_E57_NY},
    {"normalZ", SPL_E57_NZ},
    {"classification", SPL_E57_CLASS},
};

static enum spl_e57_role role_of(const char *name)
{
    const char *colon = strchr(name, ':');
    for (size_t i = 0; i < sizeof roles / sizeof *roles; i++)
        if (!strcmp(roles[i].name, name))
            return roles[i].role;
    for (size_t i = 0; i < sizeof extension_roles / sizeof *extension_roles; i++)
        if (!strcmp(extension_roles[i].name, colon ? colon + 1 : name))
            return extension_roles[i].role;
    return SPL_E57_OTHER;
}

/* Whole numbers of a range take as many bits as its width needs. */
static bool read_integer(struct spl_e57_parser *p, struct spl_e57_field *field, const char **attributes)
{
    const char *least = spl_e57_parser_get(attributes, "minimum"), *most = spl_e57_parser_get(attributes, "maximum");
    field->least = INT64_MIN;
    field->most = INT64_MAX;
    if ((least && !spl_e57_parser_integer(p, "minimum", least, &field->least)) ||
        (most && !spl_e57_parser_integer(p, "maximum", most, &field->most)))
        return false;
    if (field->least > field->most) {
        spl_e57_parser_fail(p, field->name, "minimum %lld lies above maximum %lld", (long long)field->least,
                            (long long)field->most);
        return false;
    }
    uint64_t span = (uint64_t)field->most - (uint64_t)field->least;
    field->bits = span ? (uint8_t)(64 - __builtin_clzll(span)) : 0;
    if (field->type == SPL_E57_SCALED) {
        field->scale = p->scale;
        field->offset = p->offset;
        if (!isfinite(field->scale) || field->scale == 0 || !isfinite(field->offset)) {
            spl_e57_parser_fail(p, field->name, "scale %g, offset %g", field->scale, field->offset);
            return false;
        }
    }
    double ends[2] = {(double)field->least * field->scale + field->offset,
                      (double)field->most * field->scale + field->offset};
    field->limits[0] = fmin(ends[0], ends[1]);
    field->limits[1] = fmax(ends[0], ends[1]);
    return true;
}

static bool read_float(struct spl_e57_parser *p, struct spl_e57_field *field, const char **attributes)
{
    const char *precision = spl_e57_parser_get(attributes, "precision");
    const char *ends[2] = {spl_e57_parser_get(attributes, "minimum"), spl_e57_parser_get(attributes, "maximum")};
    if (precision && strcmp(precision, "single") && strcmp(precision, "double")) {
        spl_e57_parser_fail(p, field->name, "precision '%.40s' is neither single nor double", precision);
        return false;
    }
    field->type = precision && precision[0] == 's' ? SPL_E57_SINGLE : SPL_E57_DOUBLE;
    field->bits = field->type == SPL_E57_SINGLE ? 32 : 64;
    for (int i = 0; i < 2; i++)
        if (ends[i] && !spl_e57_parser_number(p, i ? "maximum" : "minimum", ends[i], &field->limits[i]))
            return false;
    return true;
}

void spl_e57_parser_add_field(struct spl_e57_parser *p, struct spl_e57_scan *scan, const char **attributes)
{
    struct spl_e57_document *d = p->document;
    const char *name = strrchr(p->path, '/') + 1, *type = spl_e57_parser_get(attributes, "type");
    struct spl_e57_field field = {.role = role_of(name), .scale = 1, .limits = {NAN, NAN}};
    spl_text_show(name, field.name, sizeof field.name);
    if (type && (!strcmp(type, "Structure") || !strcmp(type, "Vector")))
        return; /* its leaves are fields */
    if (type && (!strcmp(type, "Integer") || !strcmp(type, "ScaledInteger"))) {
        field.type = type[0] == 'S' ? SPL_E57_SCALED : SPL_E57_INTEGER;
        if (!read_integer(p, &field, attributes))
            return;
    } else if (type && !strcmp(type, "Float")) {
        if (!read_float(p, &field, attributes))
            return;
    } else if (type && !strcmp(type, "String")) {
        field.type = SPL_E57_STRING;
        field.role = SPL_E57_OTHER;
    } else {
        spl_e57_parser_fail(p, field.name, "type '%.40s' cannot be part of a point", type ? type : "");
        return;
    }
    if (d->field_count == SPL_E57_FIELDS_MAX) {
        spl_e57_parser_fail(p, "prototype", "more than %d fields", SPL_E57_FIELDS_MAX);
        return;
    }
    if (spl_array_reserve(d->fields, d->field_capacity, d->field_count + 1, p->err)) {
        p->code = SPL_E_NOMEM;
        XML_StopParser(p->xml, XML_FALSE);
        return;
    }
    if (field.role != SPL_E57_OTHER && scan->field[field.role] < 0)
        scan->field[field.role] = (int)scan->fields;
    d->fields[d->field_count++] = field;
    scan->fields++;
}

static void set_number(struct spl_e57_parser *p, const struct value *values, size_t count, const char *below, void *of)
{
    double value;
    for (size_t i = 0; i < count; i++)
        if (!strcmp(values[i].place, below)) {
            const char *name = strrchr(values[i].place, '/') + 1;
            if (spl_e57_parser_number(p, name, p->text, &value))
                *(double *)((char *)of + values[i].member) = value * p->scale + p->offset;
            return;
        }
}

void spl_e57_parser_set_scan(struct spl_e57_parser *p, struct spl_e57_scan *scan, const char *below)
{
    if (!strcmp(below, "/name"))
        spl_text_show(p->text, scan->name, sizeof scan->name);
    else if (!strcmp(below, "/guid"))
        spl_text_show(p->text, scan->guid, sizeof scan->guid);
    else
        set_number(p, scan_values, sizeof scan_values / sizeof *scan_values, below, scan);
}

void spl_e57_parser_set_image(struct spl_e57_parser *p, struct spl_e57_image *image, const char *below)
{
    static const char *const kinds[] = {"", "/visualReferenceRepresentation", "/pinholeRepresentation",
                                        "/sphericalRepresentation", "/cylindricalRepresentation"};
    size_t length = strlen(kinds[image->kind]);
    if (!strcmp(below, "/name"))
        spl_text_show(p->text, image->name, sizeof image->name);
    else if (!strcmp(below, "/associatedData3DGuid"))
        spl_text_show(p->text, image->scan_guid, sizeof image->scan_guid);
    else if (image->kind != SPL_E57_NO_IMAGE && !strncmp(below, kinds[image->kind], length))
        set_number(p, representation_values, sizeof representation_values / sizeof *representation_values,
                   below + length, image);
    else
        set_number(p, image_values, sizeof image_values / sizeof *image_values, below, image);
}
