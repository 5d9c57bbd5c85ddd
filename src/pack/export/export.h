/* Primitives as files that CAD programs open. */
#ifndef SPL_PACK_EXPORT_EXPORT_H
#define SPL_PACK_EXPORT_EXPORT_H

#include <stdio.h>

#include <splatd/pack.h>

#include "cloud/cloud.h" /* SPL_DRAWING_MARK */
#include "pack/export/shapes.h"

/* Whether `path` names a kind of file that can be written, in a folder where one can be made, and is none of the
 * `count` scans; else SPL_E_USAGE with the field "export-primitives", or SPL_E_IO. Before any work begins. Any
 * thread. */
int spl_export_check(const char *path, const char *const *scans, size_t count, struct spl_error *err);

/* The file of the planes and the wires, by the ending of `path`: PLY, OBJ or DXF. *text (owned by the caller, free();
 * NULL on failure) has its *length bytes, to be written once the dataset is: the one is not new where the other is old.
 * *report says what is in it; but for `unit` zero on failure.
 * `unit_m`: metres a unit of the coordinates, 0 = unknown. Memory as of spl_shapes_init(), and the file itself. Errors
 * as there. */
int spl_export_primitives(const char *path, const struct spl_points *points, const struct spl_planes *planes,
                          const struct spl_wires *wires, double unit_m, struct spl_stage *stage, char **text,
                          size_t *length, struct spl_drawing_report *report, struct spl_error *err);

/* The formats (write_ply.c, write_obj.c, write_dxf.c). `unit` is a name. What cannot be written shows in ferror(). */
void spl_shapes_write_ply(const struct spl_shapes *shapes, const char *unit, FILE *out);
void spl_shapes_write_obj(const struct spl_shapes *shapes, const char *unit, FILE *out);
void spl_shapes_write_dxf(const struct spl_shapes *shapes, const char *unit, FILE *out);

#endif
