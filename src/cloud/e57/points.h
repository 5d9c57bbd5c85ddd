/* The points of one scan, field by field: bytestreams cut into packets, each stream with a window of its own, so that
 * streams may run ahead of each other and a file may be larger than memory. One thread at a time. */
#ifndef SPL_CLOUD_E57_POINTS_H
#define SPL_CLOUD_E57_POINTS_H

#include "cloud/e57/document.h"

struct spl_e57_stream {
    const struct spl_e57_field *field; // document.fields
    size_t index;                      /* among the fields of the scan */
    uint64_t packet;                   /* logical offset of the first packet that has not been taken */
    size_t bit, bytes;                 /* of the window: the first bit that is left, and how much it holds */
    uint8_t *window;                   // NULL until it is wanted
};

struct spl_e57_points {
    struct spl_e57_pages *pages;             // borrowed
    const struct spl_e57_document *document; // borrowed
    const struct spl_e57_scan *scan;         // document.scans; NULL before the first begin
    uint64_t start, end;                     /* of the scan's packets, logical */
    uint64_t next;                           /* point */
    uint64_t held;                           /* logical offset of the packet in the buffer */
    size_t held_bytes;                       /* 0 = none */
    uint8_t *packet;                         /* 64 KiB */
    struct spl_e57_stream streams[SPL_E57_ROLES];
};

int spl_e57_points_init(struct spl_e57_points *points, struct spl_e57_pages *pages,
                        const struct spl_e57_document *document, struct spl_error *err);
void spl_e57_points_finish(struct spl_e57_points *points);

/* Goes to the first point of a scan. Refuses a section that cannot hold as many points as the XML says. */
int spl_e57_points_begin(struct spl_e57_points *points, const struct spl_e57_scan *scan, struct spl_error *err);

/* Goes on to a later point of the scan, at the cost of its packets' heads. */
int spl_e57_points_skip(struct spl_e57_points *points, uint64_t to, struct spl_error *err);

/* The values of a role for the next `count` points; the caller asks each role for the same ones, then takes them. The
 * scan has this role, and that many points are left. */
int spl_e57_points_read(struct spl_e57_points *points, enum spl_e57_role role, double *out, size_t count,
                        struct spl_error *err);
static inline void spl_e57_points_take(struct spl_e57_points *points, size_t count)
{
    points->next += count;
}

#endif
