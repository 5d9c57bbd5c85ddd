/* Writes the corpora of LAZ: small chunks, tables and records of every point format and version for fuzz-laz, small
 * files for fuzz-las. Run it when the format of either changes.
 *
 * usage: make-laz CORPUS      the folder that holds laz/ and las/ */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cloud/laz/items.h"
#include "support/laz_writer.h"

enum { records = 12, offset_to_points = 96 };

static void keep(const char *folder, const char *kind, unsigned points, unsigned version, const uint8_t *head,
                 size_t head_bytes, const uint8_t *bytes, size_t count)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s-%u-v%u", folder, kind, points, version);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(head, 1, head_bytes, f) != head_bytes || fwrite(bytes, 1, count, f) != count || fclose(f)) {
        fprintf(stderr, "%s cannot be written\n", path);
        exit(1);
    }
}

int main(int argc, char **argv)
{
    static const uint32_t chunks[] = {7, 5, 0};
    char laz[4000], las[4000];
    if (argc != 2)
        return 2;
    snprintf(laz, sizeof laz, "%s/laz", argv[1]);
    snprintf(las, sizeof las, "%s/las", argv[1]);
    for (unsigned points = 0; points <= 10; points++)
        for (unsigned later = 0; later <= 1; later++) {
            unsigned version = (points < 6 ? 1 : 3) + later, extra = points % 3 == 0 ? 2 : 0;
            struct spl_laz_format format = laz_format(points, extra, version, later ? 0 : 7);
            uint8_t *made = laz_make_records(&format, records, points);
            struct laz_out chunk = laz_write_chunk(&format, made, records, 1);
            struct laz_out file =
                laz_write_file(&format, points, made, chunks, later ? LAZ_TABLE_AT_END : LAZ_TABLE_USUAL);
            uint8_t head[6] = {0, (uint8_t)points, (uint8_t)(later | 4), (uint8_t)extra, records - 1, 0};
            keep(laz, "chunk", points, version, head, sizeof head, chunk.bytes, chunk.count);
            if (points % 5 == 0) {
                uint64_t start = spl_le_get32(file.bytes + offset_to_points);
                uint64_t table = later ? spl_le_get64(file.bytes + file.count - 8) : spl_le_get64(file.bytes + start);
                head[0] = 1;
                head[2] = (uint8_t)(later | (later ? 0 : 2));
                head[4] = later ? records - 1 : 6; /* chunks of 7 */
                keep(laz, "table", points, version, head, sizeof head, file.bytes + table, file.count - table);
                head[0] = 2;
                keep(laz, "record", points, version, head, sizeof head, file.bytes + 375 + 54, start - 375 - 54);
            }
            if (points % 3 == 1)
                keep(las, "laz", points, version, NULL, 0, file.bytes, file.count);
            free(made);
            free(chunk.bytes);
            free(file.bytes);
        }
    return 0;
}
