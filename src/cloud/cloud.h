/* Point clouds from files, streamed in batches: a file larger than memory is no reason to fail.
 *
 * spl_cloud_open() recognises the format by content alone and dispatches to one reader per format (readers.c). Owned by
 * one thread at a time. */
#ifndef SPL_CLOUD_CLOUD_H
#define SPL_CLOUD_CLOUD_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "cloud/keep.h"

enum spl_cloud_attribute {
    SPL_CLOUD_COLOR = 1 << 0, /* measured colour, or intensity as grey when the file has no colour */
    SPL_CLOUD_NORMAL = 1 << 1,
    SPL_CLOUD_CLASS = 1 << 2,
    SPL_CLOUD_STATION = 1 << 3, /* batch.station indexes info.stations */
};

/* Numbers that a point may have. */
enum spl_scalar {
    SPL_SCALAR_INTENSITY,
    SPL_SCALAR_RETURN,
    SPL_SCALAR_RETURNS,
    SPL_SCALAR_KEPT, /* the first of SPL_KEPT_MAX, in the order of struct spl_keep */
    SPL_SCALAR_COUNT = SPL_SCALAR_KEPT + SPL_KEPT_MAX
};

/* What a file's colours are made from, and the values that are black and white. */
struct spl_cloud_colors {
    enum { SPL_COLORS_CONSTANT, SPL_COLORS_RGB, SPL_COLORS_INTENSITY } from; /* the first: the file has neither */
    double black, white; /* of RGB 0 and 1, 255, 1023, 4095 or 65535 */
    bool guessed; /* by the values of this file, since their type has room for more */
    bool blank;   /* there are fields for RGB, but they hold nothing but 0 */
    bool sampled; /* white is what the first points say: spl_cloud_read() may find that it is another */
    double dark;  /* of RGB of 16 bits none is above this, which is nearly black; 0: some are */
};

/* What a header says of its coordinates, as far as it does (crs.h). */
struct spl_cloud_coordinates {
    uint32_t epsg;        /* of the projected, else the geographic or compound system; 0 = not said */
    uint32_t height_epsg; /* of the heights' own; 0 = not said */
    char name[64];        /* of the system; "" = not said. A header says it by number or by name */
    char *wkt;            /* where it has one; may be NULL. Owned by the cloud, where it is a cloud's */
    double unit_m;        /* metres a unit of x and y; 0 = not said */
    double height_unit_m; /* of z; 0 = not said: as x and y, metres where those are angles */
    bool angles;          /* x and y are longitudes and latitudes */
    double step[3];       /* that they are multiples of; 0 = not said */
    double first[3];      /* from where on these are counted */
    bool floats;          /* of 32 bits, so that their steps grow with their size */
    char apart[96];       /* of x and y, where headings name units that contradict each other, "x in m, y in ft"; "" */
    char lost[200];       /* what it says of its system and is not kept, as a sentence; "" = nothing */
};

struct spl_cloud_options {
    const char *columns; /* text formats: e.g. "x,y,z,intensity,r,g,b,class,nx,ny,nz,-"; NULL = recognise */
    bool intensity;      /* grey from intensity where there is one, whatever colours there are */
    const struct spl_cloud_colors *colors; /* what an earlier open found, or that of several files; NULL = find out */
    const struct spl_keep *keep;           /* NULL = class, intensity and returns where there are any */
    uint64_t max_points;                   /* an even part: of COPC whole levels, of others so many; 0 = all */
    uint64_t points; /* info.points_total of an earlier open; 0 = find out, which may take a pass over the file */
    unsigned threads;                      /* of readers that decode chunks side by side; 0 = all cores */
    const atomic_bool *cancelled;          // may be NULL; outlives the cloud
    bool sample_colors; /* of a file that is slow to read the first points say what white is; see colors.sampled */
};

/* An image that a scan's file holds. */
struct spl_cloud_image {
    const char *name;     /* printable; "" = it has none */
    const char *kind;     /* static: "pinhole", "spherical", "cylindrical", or "visual reference": no projection */
    const char *coding;   /* static: "JPEG", "PNG", "" = neither */
    double width, height; /* pixels, as the file says */
    uint64_t bytes;
    bool posed;
};

struct spl_cloud_info {
    const char *format;       /* static: "PLY", "LAS", "LAZ", "E57", "PCD", "PTX", "PTS", "text" */
    const char *named;        /* static: the format that the name's ending is of, where it is another; else NULL */
    uint32_t attributes;      /* enum spl_cloud_attribute, known at open */
    uint64_t points_expected; /* as the header says (already checked against the file's size), 0 = unknown */
    bool points_at_most; /* of points_expected some may be none: cells of a grid that saw nothing, which are skipped, or
                            more than the file's bytes vouch for */
    uint64_t points_behind; /* that the file has room for behind those that its header counts: not read; 0 mostly */
    uint64_t rows;            /* that spl_cloud_seek() can go to; 0: it cannot */
    uint64_t points_total;    /* with those that max_points leaves out; 0 = unknown, never where it is set */
    uint64_t file_bytes;
    uint32_t station_count;         /* grows while a PTX is read; final at the end */
    double (*stations)[16];         /* row-major station-to-world; borrowed until the next read or destroy */
    struct spl_cloud_colors colors; /* of the points that come next: stations of a PTX may differ */
    uint64_t points_from[3];        /* points so far, by struct spl_cloud_colors.from */
    struct spl_cloud_coordinates coordinates;
    uint64_t points_skipped;              /* non-finite, or PTX "no return" cells */
    uint32_t scalars;                     /* bit 1 << enum spl_scalar for each that batches have */
    uint32_t columns;                     /* bit 1 << enum spl_column (rows.h) for each that the file has */
    /* Text whose columns nothing names: what their values say, "x,y,z,nx,ny,nz,-"; else "". Begins with '-' where the
     * first numbers, names or times the points. */
    char guessed[192];
    /* Headings of a text, properties of a PLY and fields of a PCD that fill nothing, as "Code, Dist"; of the latter two
     * with the reason what is called as a colour, and gives none, "rgb (a list)", or as another one, "x (again)";
     * ends in "…" where there are more; "" = none */
    char unused[200];
    /* Of a text whose columns nothing names, or the letters X and Y: what is odd about them where x may be the north,
     * "x has seven digits and y six"; static, NULL = nothing */
    const char *north_first; // may be NULL
    char footer[192]; /* of a text that ends in words: which lines are left out; "" = none */
    char units[96];   /* a text's headings, where they name units of some axes alone: "z in m"; "" = none */
    bool surveyors;   /* a text's headings Y and X were taken for east and north, x and y here */
    const char *fields;                   /* borrowed: names of what the file has, as far as it names any; "" = none */
    uint32_t image_count;                 /* inside the file: spl_view_list_load_photographs() takes them */
    const struct spl_cloud_image *images; /* borrowed until destroy */
    char version[48];                     /* of the format, and its kind: "1.4, point format 7"; "" = it has none */
    double bounds[2][3]; /* least and most of the coordinates, as the header says, which may be wrong */
    bool has_bounds;                      /* it does */
};

/* A batch in structure-of-arrays form; arrays for absent attributes are still allocated and zero-filled. */
struct spl_point_batch {
    size_t capacity, count;
    double (*position)[3]; /* exact: LAS integers × scale + offset, PTX transformed to world */
    uint8_t (*color)[3];   /* sRGB; 16 bit sources that use more than 8 bits are scaled down, rounded */
    float (*normal)[3];    /* unit; zero where the file has none or it is degenerate */
    uint8_t *classification;
    uint16_t *station;
    double *scalar[SPL_SCALAR_COUNT]; /* of info.scalars; NaN = the point has none */
};

struct spl_cloud;

enum { SPL_CLOUD_AGAIN = 2 };

int spl_point_batch_init(struct spl_point_batch *batch, size_t capacity, struct spl_error *err);
void spl_point_batch_finish(struct spl_point_batch *batch);

/* Puts point `from` of a batch in the place of point `to`, with those of `scalars` (bit 1 << enum spl_scalar). */
void spl_point_batch_move(struct spl_point_batch *batch, uint32_t scalars, size_t to, size_t from);

/* Whether a name ends as only scans do (".las"), so that a search of a folder takes it. */
bool spl_cloud_is_named_scan(const char *path);

/* What the drawings of primitives say that `splatd pack` writes (--export-primitives), in a comment among their first
 * 128 bytes, and whether a file does. Such a PLY is called as a scan is, but is none: opening it is refused. False also
 * where nothing can be read. */
#define SPL_DRAWING_MARK "planes, meshes and lines of a scan; unit of length: "
bool spl_cloud_is_drawing(const char *path);

/* These endings, ".ply, .las, …", into `text`, cut to `size`. */
void spl_cloud_list_endings(char *text, size_t size);

/* Opens and checks the header. Everything malformed gives SPL_E_INPUT with file,
 * offset or line, field and reason. On success the caller owns *out. `options` may be NULL. */
int spl_cloud_open(const char *path, const struct spl_cloud_options *options, struct spl_cloud **out,
                   struct spl_error *err);

const struct spl_cloud_info *spl_cloud_get_info(const struct spl_cloud *cloud);

/* Fills the next batch (overwriting it): 1 = batch.count > 0 points, 0 = end, negative = error. Points with a
 * non-finite coordinate are skipped and counted. A file with no usable point ends with 0 at once: the caller decides.
 * SPL_CLOUD_AGAIN where a point is brighter than sampled colours let expect: nothing that was read holds, info has the
 * right white, and the next batch is the first one. SPL_E_CANCELLED. */
int spl_cloud_read(struct spl_cloud *cloud, struct spl_point_batch *batch, struct spl_error *err);

/* Goes to a row of the file, of which each is a point, where the format has rows that can be gone to (info.rows > 0)
 * and no part of them was asked for; the next batch begins there. Cheap, but that LAZ decodes its chunk from the
 * beginning. */
int spl_cloud_seek(struct spl_cloud *cloud, uint64_t row, struct spl_error *err);

/* Moves what the header says of its coordinates to the caller, who releases it with spl_crs_finish(). */
void spl_cloud_take_coordinates(struct spl_cloud *cloud, struct spl_cloud_coordinates *out);

/* NULL-safe. */
void spl_cloud_destroy(struct spl_cloud *cloud);

#endif
