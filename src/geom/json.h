/* What readers of JSON share, and its writer: values, and words about them for messages. Pure functions, any thread. */
#ifndef SPL_GEOM_JSON_H
#define SPL_GEOM_JSON_H

#include <stdbool.h>
#include <stdio.h>

#include <jansson.h>

/* JSON that comes from outside, in which names may not be double: behind the mark of UTF-8 that editors on Windows put
 * first. NULL: refused, as `where` says. The file of spl_json_load_stream() stands anywhere in what it read. */
enum { SPL_JSON_MARK = 3 };
bool spl_json_is_marked(const void *text, size_t length);
json_t *spl_json_load(const char *text, size_t length, json_error_t *where);
json_t *spl_json_load_stream(FILE *file, json_error_t *where);
json_t *spl_json_load_file(const char *path, json_error_t *where);

/* Its text for people and programs: a line a value, numbers in as few digits as read back the same. malloc'd; NULL
 * without memory. Takes the reference, NULL too. */
char *spl_json_print(json_t *json);

/* An array of `count` numbers. False where it is none; `out` is of no use then. */
bool spl_json_get_numbers(const json_t *array, size_t count, double *out);

/* A flag: true or false, or 1 or 0. False where it is none; `out` stays then. What to say of it is "NAME must be
 * SPL_JSON_FLAG_FORMS, not spl_json_flag_fault()". */
#define SPL_JSON_FLAG_FORMS "true, false, 1 or 0"
bool spl_json_get_flag(const json_t *json, bool *out);
const char *spl_json_flag_fault(const json_t *json);

/* Why jansson has refused a text, for messages; where.text, but for what that tells in names of its own. */
const char *spl_json_fault(const json_error_t *where);

/* "an object", "text", …: for messages. */
const char *spl_json_type_name(const json_t *json);

/* The same with the length of what is an array: "an array of 3". Returns `text`. */
const char *spl_json_show_shape(const json_t *json, char text[40]);

#endif
