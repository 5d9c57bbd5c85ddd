/* What a PLY header declares. The structs are filled by spl_ply_parse_header() and read by ply.c. */
#ifndef SPL_CLOUD_PLY_H
#define SPL_CLOUD_PLY_H

#include "cloud/numbers.h"
#include "cloud/reader.h"

enum { SPL_PLY_ELEMENTS = 64, SPL_PLY_PROPERTIES = 1024 }; /* over all elements; more is refused */

struct spl_ply_property {
    char name[48];      /* shortened, for messages */
    uint8_t type;       /* enum spl_number; of the items when it is a list */
    uint8_t count_type; /* of a list's length, SPL_NUMBER_NONE when it is no list */
    int8_t column;      /* enum spl_column; SKIP for what is not kept */
    bool packed;        /* red, green and blue in one number: 0x..RRGGBB */
    bool told;          /* in info.unused, with the reason */
    uint16_t offset;    /* in the row, where no list precedes it */
};

struct spl_ply_element {
    char name[24];
    uint64_t count;
    unsigned first, properties;
    unsigned row_bytes; /* binary: least bytes of a row, exact without lists */
    bool lists;
};

struct spl_ply_header {
    enum { SPL_PLY_ASCII, SPL_PLY_LITTLE, SPL_PLY_BIG } format;
    struct spl_ply_element elements[SPL_PLY_ELEMENTS];
    struct spl_ply_property properties[SPL_PLY_PROPERTIES];
    unsigned element_count, property_count;
    unsigned vertex;      /* index into elements */
    uint64_t vertex_line; /* of its declaration, for messages */
};

/* Reads the header, and takes columns from the vertices' properties; the cursor is then at the first byte of the data.
 */
int spl_ply_parse_header(struct spl_cloud *cloud, struct spl_ply_header *header, struct spl_error *err);

#endif
