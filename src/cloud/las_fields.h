/* The fields of a LAS point beside position and colour: where each lies in a record, and how its bytes become a number.
 * Extra bytes go by the names that record "LASF_Spec" 4 gives them. */
#ifndef SPL_CLOUD_LAS_FIELDS_H
#define SPL_CLOUD_LAS_FIELDS_H

#include "cloud/las_records.h"

enum { SPL_LAS_FIELDS_MAX = SPL_COLUMN_COUNT - SPL_COLUMN_CLASS };

/* As record 4 numbers them. */
enum spl_las_type {
    SPL_LAS_U8 = 1,
    SPL_LAS_I8,
    SPL_LAS_U16,
    SPL_LAS_I16,
    SPL_LAS_U32,
    SPL_LAS_I32,
    SPL_LAS_U64,
    SPL_LAS_I64,
    SPL_LAS_F32,
    SPL_LAS_F64
};

/* A field that is wanted. */
struct spl_las_field {
    int8_t column;                 // enum spl_column
    uint8_t type;                  // enum spl_las_type
    uint8_t shift, bits;           /* of a byte; bits 0: all of the number */
    uint16_t at;                   /* in the record */
    uint32_t layer;                // enum spl_laz_want
    double scale, offset, no_data; /* value = number × scale + offset; NaN: every number is one */
};

struct spl_las_fields {
    struct spl_las_field list[SPL_LAS_FIELDS_MAX];
    unsigned count;
};

/* Takes the cloud's columns from the fields that a record of this format and length has. Moves the cursor. */
int spl_las_find_fields(struct spl_las_fields *fields, struct spl_cloud *cloud, struct spl_las_record records,
                        unsigned format, unsigned standard_bytes, unsigned record_bytes, struct spl_error *err);

/* One field of `count` records that are `stride` bytes apart. */
void spl_las_read_field(const struct spl_las_field *field, const uint8_t *records, size_t stride, size_t count,
                        double *out);

#endif
