/* The table of readers: which one a file needs, by its first bytes alone, in the order in which they are asked. A
 * name's ending decides nothing of how a file is read; it says which files of a folder are scans, and a wrong one is
 * told. Pure functions; any thread. */
#include "cloud/reader.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "cloud/fields.h"
#include "cloud/pcd.h"

enum { first_bytes = 4096, drawing_bytes = 128 };

static bool begins_with(const uint8_t *bytes, size_t available, const char *text)
{
    size_t length = strlen(text);
    return available >= length && memcmp(bytes, text, length) == 0;
}

static bool is_drawing(const uint8_t *bytes, size_t available)
{
    return memmem(bytes, available < drawing_bytes ? available : drawing_bytes, SPL_DRAWING_MARK,
                  strlen(SPL_DRAWING_MARK));
}

bool spl_cloud_is_drawing(const char *path)
{
    uint8_t bytes[drawing_bytes];
    FILE *file = fopen(path, "rbe");
    size_t available = file ? fread(bytes, 1, sizeof bytes, file) : 0;
    if (file)
        fclose(file);
    return is_drawing(bytes, available);
}

static bool is_ply(const uint8_t *bytes, size_t available)
{
    return available >= 3 && !strncasecmp((const char *)bytes, "ply", 3) && (available == 3 || bytes[3] <= ' ');
}

static bool is_las(const uint8_t *bytes, size_t available)
{
    return begins_with(bytes, available, "LASF");
}

static bool is_e57(const uint8_t *bytes, size_t available)
{
    return begins_with(bytes, available, "ASTM-E57");
}

static bool is_pcd(const uint8_t *bytes, size_t available)
{
    return spl_pcd_is_header((const char *)bytes, available);
}

static bool is_text(const uint8_t *bytes, size_t available)
{
    while (available > 0 && (bytes[available - 1] == 0x1a || bytes[available - 1] == 0)) /* what fills the end */
        available--;
    for (size_t i = 0; i < available; i++)
        if ((bytes[i] < ' ' && !memchr("\t\n\f\r", bytes[i], 4)) || bytes[i] == 0x7f)
            return false;
    return available > 0;
}

/* Its first two lines are one whole number each: the columns and rows of a station. */
static bool is_ptx(const uint8_t *bytes, size_t available)
{
    const char *p = (const char *)bytes, *end = p + available;
    for (int k = 0; k < 2; k++) {
        uint64_t ignored;
        while (p < end && memchr(" \t\r\n", *p, 4))
            p++;
        p = spl_integer_parse(p, end, &ignored);
        while (p && p < end && (*p == ' ' || *p == '\t'))
            p++;
        if (!p || (p < end && *p != '\r' && *p != '\n'))
            return false;
    }
    return is_text(bytes, available);
}

static const struct {
    const struct spl_cloud_reader *reader;
    bool (*is)(const uint8_t *bytes, size_t available);
} readers[] = {
    {&spl_ply_reader, is_ply}, {&spl_las_reader, is_las}, {&spl_e57_reader, is_e57},
    {&spl_pcd_reader, is_pcd}, {&spl_ptx_reader, is_ptx}, {&spl_text_reader, is_text},
};

/* What is often met instead of a scan, by its first bytes, in whatever case; some would else be read as text. */
static const struct {
    const char *begins;
    size_t length;
    const char *what;
} strangers[] = {
    {"\x1f\x8b", 2, "is packed with gzip: unpack it first (gunzip)"},
    {"PK\3\4", 4, "is a ZIP file: unpack it first (unzip)"},
    {"BZh", 3, "is packed with bzip2: unpack it first (bunzip2)"},
    {"\xfd\x37zXZ", 5, "is packed with xz: unpack it first (unxz)"},
    {"\x28\xb5\x2f\xfd", 4, "is packed with Zstandard: unpack it first (unzstd)"},
    {"7z\xbc\xaf", 4, "is a 7z file: unpack it first (7z x)"},
    {"Rar!", 4, "is a RAR file: unpack it first"},
    {"\xff\xfe", 2, "is text in UTF-16: write it as UTF-8 first (iconv -f UTF-16 -t UTF-8)"},
    {"\xfe\xff", 2, "is text in UTF-16: write it as UTF-8 first (iconv -f UTF-16 -t UTF-8)"},
    {"version https://git-lfs", 23, "is a pointer of Git LFS, not the file itself: \"git lfs pull\" fetches that"},
    {"<!doctype html", 14, "is a web page and no scan: what it was loaded from may have answered with an error"},
    {"<html", 5, "is a web page and no scan: what it was loaded from may have answered with an error"},
    {"<?xml", 5, "is XML and no scan"},
    {"{", 1, "is JSON and no scan"},
    {"[{", 2, "is JSON and no scan"},
    {"%PDF", 4, "is a PDF and no scan"},
    {"\x89PNG", 4, "is a picture and no scan"},
    {"\xff\xd8\xff", 3, "is a picture and no scan"},
    {"II*", 4, "is a TIFF and no scan; of a raster of heights \"gdal_translate -of XYZ\" makes points"},
    {"MM\0*", 4, "is a TIFF and no scan; of a raster of heights \"gdal_translate -of XYZ\" makes points"},
    {"ncols ", 6, "is a raster of heights (Esri's grid) and no scan; \"gdal_translate -of XYZ\" makes points of it"},
    {"DSAA", 4, "is a raster of heights (Surfer's grid) and no scan; \"gdal_translate -of XYZ\" makes points of it"},
    {"# vtk DataFile", 14, "is a VTK file: write it as PLY first"},
    {"# timestamp tx ty tz", 20, "is a trajectory and no scan"},
    {"solid ", 6, "is a mesh (STL) and no scan"},
    {"OFF\n", 4, "is a mesh (OFF) and no scan: write its vertices as PLY first"},
    {"OFF\r", 4, "is a mesh (OFF) and no scan: write its vertices as PLY first"},
    {"COFF\n", 5, "is a mesh (OFF) and no scan: write its vertices as PLY first"},
    {"COFF\r", 5, "is a mesh (OFF) and no scan: write its vertices as PLY first"},
    {"glTF", 4, "is a model (glTF) and no scan"},
    {"\x89HDF", 4, "is an HDF5 file: write its points as PLY or LAS first"},
    {"\x93NUMPY", 6, "is an array of NumPy: write it as text (numpy.savetxt), PLY or LAS first"},
    {"SQLite format 3", 15, "is a database (SQLite) and no scan"},
};

/* Its first line, comments aside, is one that only Wavefront's models have: their faces are no points. */
static bool is_obj(const uint8_t *bytes, size_t available)
{
    static const char *const words[] = {"mtllib ", "usemtl ", "o ", "g ", "v ", "vn ", "vt "};
    const uint8_t *end = bytes + available, *line = bytes;
    while (line < end && memchr("#\r\n", *line, 3)) {
        const uint8_t *newline = memchr(line, '\n', (size_t)(end - line));
        line = newline ? newline + 1 : end;
    }
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (begins_with(line, (size_t)(end - line), words[i]))
            return true;
    return false;
}

/* "*110001+0000000000000001 ": two digits of what a word is, four of how, a sign, 8 or 16 characters. */
static bool is_gsi(const uint8_t *bytes, size_t available)
{
    const char *p = (const char *)bytes, *end = p + available;
    p += p < end && *p == '*';
    for (int word = 0; word < 2; word++) {
        size_t size = 0;
        bool head = end - p > 7 && p[0] && strchr("0123456789", p[0]) && p[1] && strchr("0123456789", p[1]);
        for (int k = 2; head && k < 6; k++)
            head = p[k] && strchr("0123456789.", p[k]);
        if (!head || (p[6] != '+' && p[6] != '-'))
            return false;
        for (p += 7; p < end && (unsigned char)*p > ' '; p++)
            size++;
        if ((size != 8 && size != 16) || p == end || *p != ' ')
            return word && (size == 8 || size == 16);
        while (p < end && *p == ' ')
            p++;
    }
    return true;
}

/* NULL: none that is known. */
static const char *find_stranger(const uint8_t *bytes, size_t available)
{
    for (size_t i = 0; i < sizeof strangers / sizeof *strangers; i++)
        if (available >= strangers[i].length &&
            !strncasecmp((const char *)bytes, strangers[i].begins, strangers[i].length))
            return strangers[i].what;
    if (available && bytes[0] == '#' && memmem(bytes, available < 400 ? available : 400, "CAMERA_ID", 9))
        return "is COLMAP's list of cameras or images and no scan: --cameras takes its folder";
    if (available >= 4 && bytes[0] && !bytes[1] && bytes[2] && !bytes[3])
        return "may be text in UTF-16, and is none known here: write it as UTF-8 first (iconv -f UTF-16 -t UTF-8)";
    if (is_gsi(bytes, available))
        return "is a list of Leica's in GSI, which is not read here: export its points as text (CSV), LAS or E57";
    return is_obj(bytes, available)
               ? "is a model of Wavefront's (OBJ) and no scan: write its vertices as PLY or as text first"
               : NULL;
}

/* What scans are called. Of formats that one reader has, `formats` has those that the ending is right for. */
static const struct ending {
    const char *ending;
    const struct spl_cloud_reader *reader;
    const char *format;                    /* for people */
    const char *formats;                   // may be NULL: all of the reader
    bool loose;                            /* other things are called so too: no folder is searched for it */
} endings[] = {
    {"ply", &spl_ply_reader, "PLY", NULL, false},
    {"las", &spl_las_reader, "LAS", "LAS", false},
    {"laz", &spl_las_reader, "LAZ", "LAZ COPC", false},
    {"e57", &spl_e57_reader, "E57", NULL, false},
    {"pcd", &spl_pcd_reader, "PCD", NULL, false},
    {"ptx", &spl_ptx_reader, "PTX", NULL, false},
    {"pts", &spl_text_reader, "PTS", NULL, false},
    {"xyz", &spl_text_reader, "text", NULL, false},
    {"xyzrgb", &spl_text_reader, "text", NULL, false},
    {"txt", &spl_text_reader, "text", NULL, true},
    {"csv", &spl_text_reader, "text", NULL, true},
    {"asc", &spl_text_reader, "text", NULL, true},
};

static const struct ending *find_ending(const char *path)
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
    if (!dot || (slash && dot < slash))
        return NULL;
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        if (!strcasecmp(dot + 1, endings[i].ending))
            return &endings[i];
    return NULL;
}

bool spl_cloud_is_named_scan(const char *path)
{
    const struct ending *ending = find_ending(path);
    return ending && !ending->loose;
}

void spl_cloud_list_endings(char *text, size_t size)
{
    size_t used = 0;
    text[0] = 0;
    for (size_t i = 0; i < sizeof endings / sizeof *endings && used < size; i++)
        if (!endings[i].loose)
            used += (size_t)snprintf(text + used, size - used, "%s.%s", used ? ", " : "", endings[i].ending);
}

const char *spl_cloud_find_wrong_ending(const char *path, const struct spl_cloud_reader *reader, const char *format)
{
    const struct ending *ending = find_ending(path);
    bool right = !ending || (ending->reader == reader && (!ending->formats || strstr(ending->formats, format)));
    return right ? NULL : ending->format;
}

int spl_cloud_find_reader(struct spl_source *source, const struct spl_cloud_reader **reader, struct spl_error *err)
{
    const uint8_t *bytes;
    size_t available, found = 0;
    int code = spl_source_peek(source, first_bytes, &bytes, &available, err);
    if (code < 0)
        return code;
    static const char mark[] = "\xef\xbb\xbf"; /* of UTF-8, which editors put before whatever they write */
    if (begins_with(bytes, available, mark)) {
        spl_source_take(source, sizeof mark - 1);
        bytes += sizeof mark - 1;
        available -= sizeof mark - 1;
    }
    if (begins_with(bytes, available, "SPLD\r\n"))
        return spl_source_fail(
            source, SPL_E_INPUT, "", err,
            "is packed already: \"splatd info\", \"splatd serve\" and \"splatd render\" take it as it "
            "is; pack takes the scans that it was made of");
    if (is_drawing(bytes, available))
        return spl_source_fail(source, SPL_E_INPUT, "", err,
                               "is a drawing that \"splatd pack --export-primitives\" wrote, and no scan; pack takes "
                               "the scans that it was made of");
    const char *stranger = find_stranger(bytes, available);
    if (stranger)
        return spl_source_fail(source, SPL_E_INPUT, "", err, "%s", stranger);
    while (found < sizeof readers / sizeof *readers && !readers[found].is(bytes, available))
        found++;
    if (found == sizeof readers / sizeof *readers)
        return spl_source_fail(
            source, SPL_E_INPUT, "", err,
            "is no point cloud known here (PLY, LAS, LAZ, E57, PCD, PTX, PTS, or UTF-8 text with columns)");
    *reader = readers[found].reader;
    if ((*reader)->text && !memchr(bytes, '\n', available) && memchr(bytes, '\r', available))
        source->newline = '\r';
    return *reader == &spl_text_reader || *reader == &spl_ptx_reader ? spl_source_cut_zeros(source, err) : SPL_OK;
}
