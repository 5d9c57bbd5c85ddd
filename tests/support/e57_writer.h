/* E57 files from values: what the reader is tested with where there are no scans. Written after the format and not
 * after the reader: checksums bit by bit, values bit by bit. Aborts without memory. */
#ifndef SPL_TEST_E57_WRITER_H
#define SPL_TEST_E57_WRITER_H

#include <stddef.h>
#include <stdint.h>

struct e57_field {
    const char *name;
    enum { E57_DOUBLE, E57_SINGLE, E57_INTEGER, E57_SCALED, E57_TEXT } type;
    int64_t least, most; /* of integers */
    double scale, offset;
    const int64_t *raw;   /* integers: one a point */
    const double *values; /* floats */
    size_t step;          /* bytes that a packet takes of this stream; 0 = 100 */
};

struct e57_scan {
    const char *name;
    const char *more; /* XML before the points: pose, limits; may be NULL */
    const struct e57_field *fields;
    size_t field_count, points;
    enum { E57_OTHER_PACKETS = 1 } packets; /* an index packet and ignored ones between those of data */
};

struct e57_writer {
    uint8_t *data; /* logical */
    size_t length, capacity;
    char *scans, *images; /* XML; the latter NULL without any */
};

/* A text of XML for `more`: the caller's until the next call. */
const char *e57_pose(double w, double x, double y, double z, double tx, double ty, double tz);

void e57_begin(struct e57_writer *writer);
void e57_add_scan(struct e57_writer *writer, const struct e57_scan *scan);

/* The physical offset of a blob's section. */
uint64_t e57_add_blob(struct e57_writer *writer, const void *bytes, size_t length);
void e57_add_image(struct e57_writer *writer, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The file, with `root` among the XML's first elements (may be NULL); the caller's. The writer is finished. */
uint8_t *e57_end(struct e57_writer *writer, const char *root, size_t *length);

/* The file of these logical bytes behind a header, the last `xml` of which are its XML. */
uint8_t *e57_make(const void *data, size_t length, size_t xml, size_t *out);

/* Makes all checksums right again after bytes were changed. */
void e57_seal(uint8_t *file, size_t length);

#endif
