/* Writes the corpus of fuzz_e57.c: small files of every kind of field, packet, coordinates and image.
 * usage: make-e57 FOLDER */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/e57_writer.h"

enum { N = 40 };

static int64_t raw[N];
static double value[N];
static const char *folder;

static void save(const char *name, struct e57_writer *w, const char *root)
{
    char path[4096];
    size_t length;
    uint8_t *file = e57_end(w, root, &length);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(file, 1, length, f) != length || fclose(f)) {
        perror(path);
        exit(1);
    }
    free(file);
}

static void save_scan(const char *name, const char *more, const struct e57_field *fields, size_t count, int packets)
{
    struct e57_writer w;
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){name, more, fields, count, N, (unsigned)packets});
    save(name, &w, NULL);
}

int main(int argc, char **argv)
{
    if (argc != 2)
        return 2;
    folder = argv[1];
    for (int i = 0; i < N; i++) {
        raw[i] = i % 3;
        value[i] = i / 8.0;
    }
    const struct e57_field x = {.name = "cartesianX", .type = E57_DOUBLE, .values = value, .step = 64},
                           y = {.name = "cartesianY", .type = E57_SINGLE, .values = value, .step = 30},
                           z = {.name = "cartesianZ",
                                .type = E57_SCALED,
                                .least = -9,
                                .most = 900,
                                .scale = 0.5,
                                .offset = 3,
                                .raw = raw,
                                .step = 7},
                           state = {.name = "cartesianInvalidState", .type = E57_INTEGER, .most = 2, .raw = raw},
                           row = {.name = "rowIndex", .type = E57_INTEGER, .most = 99, .raw = raw},
                           column = {.name = "columnIndex", .type = E57_INTEGER, .most = 99, .raw = raw},
                           intensity = {.name = "intensity", .type = E57_INTEGER, .most = 1000, .raw = raw},
                           red = {.name = "colorRed", .type = E57_INTEGER, .most = 65535, .raw = raw},
                           green = {.name = "colorGreen", .type = E57_INTEGER, .most = 65535, .raw = raw},
                           blue = {.name = "colorBlue", .type = E57_SINGLE, .values = value},
                           class = {.name = "a:classification", .type = E57_INTEGER, .most = 255, .raw = raw},
                           note = {.name = "a:note", .type = E57_TEXT},
                           nx = {.name = "nor:normalX", .type = E57_SINGLE, .values = value},
                           ny = {.name = "nor:normalY", .type = E57_SINGLE, .values = value},
                           nz = {.name = "nor:normalZ", .type = E57_SINGLE, .values = value},
                           range = {.name = "sphericalRange", .type = E57_SINGLE, .values = value},
                           azimuth = {.name = "sphericalAzimuth", .type = E57_DOUBLE, .values = value},
                           elevation = {.name = "sphericalElevation", .type = E57_DOUBLE, .values = value},
                           wide = {.name = "a:wide",
                                   .type = E57_INTEGER,
                                   .least = INT64_MIN,
                                   .most = INT64_MAX,
                                   .raw = raw};
    const struct e57_field all[] = {x, y, z, state, intensity, red, green, blue, class, note, nx, ny, nz, wide},
                           cells[] = {row, column, range, azimuth, elevation, intensity}, plain[] = {x, y, z};
    const char *limits = "<colorLimits><colorRedMinimum type=\"Integer\"/><colorRedMaximum type=\"Integer\">99"
                         "</colorRedMaximum></colorLimits><intensityLimits><intensityMaximum type=\"Float\">9"
                         "</intensityMaximum></intensityLimits>";
    struct e57_writer w;
    save_scan("all.e57", limits, all, sizeof all / sizeof *all, E57_OTHER_PACKETS);
    save_scan("cells.e57", e57_pose(1, 2, 3, 4, 5, 6, 7), cells, 6, 0);
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"first", NULL, plain, 3, N, 0});
    e57_add_scan(&w, &(struct e57_scan){"empty", e57_pose(1, 0, 0, 0, 0, 0, 0), cells, 6, 0, 0});
    e57_add_scan(&w, &(struct e57_scan){"second", NULL, cells, 6, N, 0});
    e57_add_image(&w,
                  "<name type=\"String\">a</name>%s<pinholeRepresentation><jpegImage type=\"Blob\" fileOffset=\"%llu\" "
                  "length=\"4\"/><focalLength type=\"Float\">0.01</focalLength><imageWidth type=\"Integer\">4"
                  "</imageWidth></pinholeRepresentation>",
                  e57_pose(1, 0, 0, 0, 0, 0, 0), (unsigned long long)e57_add_blob(&w, "JPEG", 4));
    save("scans.e57", &w, "<coordinateMetadata type=\"String\"><![CDATA[PROJCS[\"UTM\"]]]></coordinateMetadata>");
    char path[4096];
    snprintf(path, sizeof path, "%s/small.xml", folder);
    FILE *f = fopen(path, "w");
    if (!f ||
        fputs("<e57Root><data3D><vectorChild><pose><rotation><w type=\"Float\">1</w></rotation></pose><points "
              "type=\"CompressedVector\" fileOffset=\"48\" recordCount=\"0\"><prototype><cartesianX "
              "type=\"ScaledInteger\" minimum=\"-1\" maximum=\"5\" scale=\"0.1\"/></prototype></points>"
              "</vectorChild></data3D></e57Root>",
              f) < 0 ||
        fclose(f)) {
        perror(path);
        return 1;
    }
    return 0;
}
