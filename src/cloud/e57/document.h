/* What the XML of an E57 file says: its scans, their fields, its images. Read-only once it is read; any thread. */
#ifndef SPL_CLOUD_E57_DOCUMENT_H
#define SPL_CLOUD_E57_DOCUMENT_H

#include <stdbool.h>

#include "cloud/e57/pages.h"

enum {
    SPL_E57_SCANS_MAX = 65535,
    SPL_E57_IMAGES_MAX = 65536,
    SPL_E57_NAME_MAX = 128,      /* bytes with the 0; longer ones are cut */
    SPL_E57_FIELDS_MAX = 1 << 20 /* of all scans together */
};

/* What a field of a point means. */
enum spl_e57_role {
    SPL_E57_X,
    SPL_E57_Y,
    SPL_E57_Z,
    SPL_E57_RANGE,
    SPL_E57_AZIMUTH,
    SPL_E57_ELEVATION,
    SPL_E57_STATE,           /* of x, y, z: 0 = valid, 1 = only the direction is, 2 = nothing is */
    SPL_E57_SPHERICAL_STATE, /* of range, azimuth, elevation */
    SPL_E57_RED,
    SPL_E57_GREEN,
    SPL_E57_BLUE,
    SPL_E57_NX,
    SPL_E57_NY,
    SPL_E57_NZ,
    SPL_E57_INTENSITY_STATE, /* not 0 = it means nothing */
    SPL_E57_ROW,
    SPL_E57_COLUMN,
    SPL_E57_CLASS, /* from here on: in the order of enum spl_column, and for the reader to give to other fields */
    SPL_E57_INTENSITY,
    SPL_E57_RETURN, /* counted from 0 */
    SPL_E57_RETURNS,
    SPL_E57_KEPT,
    SPL_E57_ROLES = SPL_E57_KEPT + 8,
    SPL_E57_OTHER = SPL_E57_ROLES
};

struct spl_e57_field {
    char name[48]; /* as in the XML, with its prefix; cut where it is longer */
    enum spl_e57_role role;
    enum { SPL_E57_INTEGER, SPL_E57_SCALED, SPL_E57_SINGLE, SPL_E57_DOUBLE, SPL_E57_STRING } type;
    uint8_t bits;         /* of a value: 0 to 64; 0 too for strings, which say their length themselves */
    int64_t least, most;  /* raw; integers */
    double scale, offset; /* value = raw x scale + offset */
    double limits[2];     /* of the values, as declared; NaN = not said */
};

struct spl_e57_pose {
    bool given;
    double rotation[4]; /* w x y z, not normalised; 1 0 0 0 where left out */
    double translation[3];
};

struct spl_e57_scan {
    char name[SPL_E57_NAME_MAX], guid[SPL_E57_NAME_MAX];
    uint64_t points, at;        /* records, and the physical offset of their section */
    size_t first_field, fields; /* of document.fields */
    int field[SPL_E57_ROLES];   /* index among the scan's fields, -1 = none */
    struct spl_e57_pose pose;
    double intensity_limits[2], color_limits[3][2]; /* NaN = not said */
};

struct spl_e57_image {
    char name[SPL_E57_NAME_MAX], scan_guid[SPL_E57_NAME_MAX]; /* "" = not said */
    enum { SPL_E57_NO_IMAGE, SPL_E57_VISUAL, SPL_E57_PINHOLE, SPL_E57_SPHERICAL, SPL_E57_CYLINDRICAL } kind;
    enum { SPL_E57_NO_CODING, SPL_E57_JPEG, SPL_E57_PNG } coding;
    uint64_t at, bytes;               /* physical offset of its section, bytes of the image itself */
    double width, height;             /* pixels */
    double pixel_width, pixel_height; /* metres, radians */
    double focal_length, radius;      /* metres */
    double principal[2];              /* pixels */
    struct spl_e57_pose pose;
};

struct spl_e57_document {
    struct spl_e57_scan *scans;
    struct spl_e57_field *fields;
    struct spl_e57_image *images;
    size_t scan_count, scan_capacity, field_count, field_capacity, image_count, image_capacity;
    char *coordinates; /* coordinateMetadata; may be NULL */
};

/* Reads the XML of `pages`. On failure nothing is held. */
int spl_e57_document_read(struct spl_e57_document *document, struct spl_e57_pages *pages, struct spl_error *err);
void spl_e57_document_finish(struct spl_e57_document *document);

/* The field of a scan that plays a role; NULL where none does. */
static inline const struct spl_e57_field *spl_e57_field(const struct spl_e57_document *document,
                                                        const struct spl_e57_scan *scan, enum spl_e57_role role)
{
    return scan->field[role] < 0 ? NULL : &document->fields[scan->first_field + (size_t)scan->field[role]];
}

static inline bool spl_e57_is_float(const struct spl_e57_field *field)
{
    return field->type == SPL_E57_SINGLE || field->type == SPL_E57_DOUBLE;
}

/* True when the scan has all three fields from `first` on. */
static inline bool spl_e57_have3(const struct spl_e57_scan *scan, enum spl_e57_role first)
{
    return scan->field[first] >= 0 && scan->field[first + 1] >= 0 && scan->field[first + 2] >= 0;
}

#endif
