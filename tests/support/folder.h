/* A folder for the files of a test program: two fixtures of its group, and names in it. Anything that goes wrong ends
 * the program. */
#ifndef TEST_SUPPORT_FOLDER_H
#define TEST_SUPPORT_FOLDER_H

#include <stddef.h>

extern char test_folder[256]; /* after folder_make() */

/* For cmocka_run_group_tests(); what lies in the folder goes with it. */
int folder_make(void **state);
int folder_remove(void **state);

/* The path of `name` there; the eighth call from now writes over it. */
const char *in_folder(const char *name);

/* How many are in a folder, but for those that begin with a dot; 0 where it is none. */
size_t folder_count(const char *path);

/* What file `name` holds, for the caller to free. */
char *folder_get(const char *name, size_t *length);

/* Fails the test unless both hold the same bytes. */
void folder_assert_same(const char *name, const char *other);

void folder_put(const char *name, const void *bytes, size_t length);
void folder_put_text(const char *name, const char *text);

#endif
