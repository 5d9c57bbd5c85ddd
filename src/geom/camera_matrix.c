/* Matrices in JSON, flat or as rows. A flat array does not say in which order it is, so each form of a camera has its
 * own (camera_forms.c); rows say it themselves. Three rows of a pose are taken because the fourth can be only 0 0 0 1;
 * twelve flat numbers are not, since they could be by columns. Pure functions, any thread. */
#include "geom/camera_matrix.h"

#include <stdbool.h>

#include "geom/camera_json.h"

static int read_number(const json_t *json, const char *name, unsigned row, unsigned column, double *out,
                       struct spl_error *err)
{
    if (!json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "row %u, column %u of %s must be a number; it is %s", row + 1,
                              column + 1, name, spl_json_type_name(json));
    *out = json_number_value(json);
    return 0;
}

static int read_row(const json_t *json, const char *name, unsigned row, unsigned columns, double *out,
                    struct spl_error *err)
{
    char shape[40];
    int rc = 0;
    if (!json_is_array(json) || json_array_size(json) != columns)
        return spl_fail_field(err, SPL_E_INPUT, name, "row %u of %s must hold %u numbers; it is %s", row + 1, name,
                              columns, spl_json_show_shape(json, shape));
    for (unsigned i = 0; !rc && i < columns; i++)
        rc = read_number(json_array_get(json, i), name, row, i, out + i, err);
    return rc;
}

int spl_json_get_matrix(const json_t *json, const char *name, unsigned rows, unsigned columns,
                        enum spl_matrix_order order, double *out, struct spl_error *err)
{
    size_t size = json_array_size(json);
    bool nested = json_is_array(json_array_get(json, 0)), pose = rows == 4 && columns == 4;
    char shape[40];
    unsigned given = pose && nested && size == 3 ? 3 : rows;
    int rc = 0;
    if (!json_is_array(json) || size != (nested ? given : rows * columns))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be %u numbers, or %s%u rows of %u; it is %s%s", name,
                              rows * columns, pose ? "3 or " : "", rows, columns, spl_json_show_shape(json, shape),
                              nested ? " rows" : "");
    for (unsigned i = 0; i < columns && given < rows; i++)
        out[given * columns + i] = i == columns - 1;
    for (unsigned row = 0; !rc && nested && row < given; row++)
        rc = read_row(json_array_get(json, row), name, row, columns, out + row * columns, err);
    for (unsigned i = 0; !rc && !nested && i < rows * columns; i++) {
        unsigned row = i / columns, column = i % columns;
        rc = read_number(json_array_get(json, order == SPL_ROW_MAJOR ? i : column * rows + row), name, row, column,
                         out + i, err);
    }
    return rc;
}
