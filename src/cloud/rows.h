/* What every reader has in common: rows of named columns as doubles, how colours are to be taken, and their way into a
 * batch. Owned by the thread that reads the cloud. */
#ifndef SPL_CLOUD_ROWS_H
#define SPL_CLOUD_ROWS_H

#include "cloud/cloud.h"
#include "cloud/source.h"

enum spl_column {
    SPL_COLUMN_SKIP = -1,
    SPL_COLUMN_X,
    SPL_COLUMN_Y,
    SPL_COLUMN_Z,
    SPL_COLUMN_RED,
    SPL_COLUMN_GREEN,
    SPL_COLUMN_BLUE,
    SPL_COLUMN_NX,
    SPL_COLUMN_NY,
    SPL_COLUMN_NZ,
    SPL_COLUMN_CLASS,
    SPL_COLUMN_INTENSITY, /* from here on: as enum spl_scalar */
    SPL_COLUMN_RETURN,
    SPL_COLUMN_RETURNS,
    SPL_COLUMN_KEPT, /* the first of SPL_KEPT_MAX, in the order of struct spl_keep */
    SPL_COLUMN_COUNT = SPL_COLUMN_KEPT + SPL_KEPT_MAX
};

enum { SPL_ROWS = 256 }; /* so that the columns of a file stay in the first-level cache */

struct spl_rows {
    size_t count;
    uint64_t line[SPL_ROWS];                  /* text formats: of each row; binary ones leave 0 */
    uint16_t station;                         /* of all rows */
    double value[SPL_COLUMN_COUNT][SPL_ROWS]; /* columns that the file lacks are never read */
};

/* How columns become an 8-bit colour: RGB takes value × scale, grey takes (intensity - offset) × scale. */
struct spl_color_rule {
    enum { SPL_COLOR_ABSENT, SPL_COLOR_RGB, SPL_COLOR_GREY } kind;
    double scale, offset;
    double limit; /* RGB: values above it contradict the rule */
};

/* The column that a property or header name means ("Red", "diffuse_red", "scalar_Intensity", "nx", …), else SKIP; what
 * is kept beside them is known by spl_keep_find_column(). */
int spl_column_from_name(const char *name, size_t length);
const char *spl_column_name(int column);

/* True when `mask` has all three of the columns from `first` on. */
static inline bool spl_columns_have3(uint32_t mask, int first)
{
    return (mask >> first & 7u) == 7u;
}

/* Does a field with this column of `columns` fill anything? Of colours and normals that lack a component none does. */
static inline bool spl_column_is_used(uint32_t columns, int column)
{
    if (column >= SPL_COLUMN_RED && column < SPL_COLUMN_NX)
        return spl_columns_have3(columns, SPL_COLUMN_RED);
    if (column >= SPL_COLUMN_NX && column < SPL_COLUMN_CLASS)
        return spl_columns_have3(columns, SPL_COLUMN_NX);
    return column >= 0;
}

struct spl_color_rule spl_color_rule_rgb(double white); /* 1, 255, 1023, … */
struct spl_color_rule spl_color_rule_grey(double black, double white);

/* Appends the rows to `batch`, which has room for them; rows with a non-finite position are counted in
 * info.points_skipped instead. Fails on a colour that contradicts the rule; `first` is the index of the first row, for
 * the message. */
int spl_rows_emit(const struct spl_rows *rows, uint64_t first, const struct spl_color_rule *rule,
                  const struct spl_source *source, struct spl_cloud_info *info, struct spl_point_batch *batch,
                  struct spl_error *err);

#endif
