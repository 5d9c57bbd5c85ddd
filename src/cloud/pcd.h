/* What a PCD header declares. The structs are filled by spl_pcd_parse_header() and read by pcd.c. */
#ifndef SPL_CLOUD_PCD_H
#define SPL_CLOUD_PCD_H

#include "cloud/numbers.h"
#include "cloud/reader.h"

enum { SPL_PCD_FIELDS = 256 }; /* more are refused */

struct spl_pcd_field {
    char name[48];   /* shortened */
    uint8_t type;    /* enum spl_number */
    int8_t column;   /* enum spl_column; SKIP for what is not read */
    bool packed;     /* red, green and blue in one number: 0x..RRGGBB */
    bool told;       /* in info.unused, with the reason */
    uint32_t count;  /* numbers of this name in a point */
    uint32_t bytes;  /* of all of them */
    uint32_t offset; /* in a point; compressed: of one byte for each point, in all fields before it */
};

struct spl_pcd_header {
    enum { SPL_PCD_ASCII, SPL_PCD_BINARY, SPL_PCD_COMPRESSED } data;
    struct spl_pcd_field fields[SPL_PCD_FIELDS];
    unsigned field_count;
    uint32_t point_bytes; /* at most SPL_SOURCE_WINDOW */
    uint32_t numbers;     /* of a point, over all fields */
    uint64_t width, height, points;
    bool has_viewpoint;
    double viewpoint[7];               /* translation, then quaternion w x y z */
    uint64_t fields_line, points_line; /* of their declaration, for messages */
};

/* Reads the header; the cursor is then at the first byte of the data. Columns are left SKIP. */
int spl_pcd_parse_header(struct spl_source *source, struct spl_pcd_header *header, struct spl_error *err);

/* True when the first lines of a file are those of a PCD header. */
bool spl_pcd_is_header(const char *bytes, size_t available);

#endif
