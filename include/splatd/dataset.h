/* A packed dataset (NAME.spld), read-only. api/format.md documents the file byte by byte.
 *
 * Threads: open and close on any one thread; between them every call below may run on any thread at once.
 * A dataset is a file, what a reader gives, or an object at a URL, which takes longer and can fail whenever it is read.
 * A file that is renamed over or removed goes on being what it was. One that is cut or overwritten in place makes
 * frames that need its pages anew fail with SPL_E_CORRUPT. */
#ifndef SPLATD_DATASET_H
#define SPLATD_DATASET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/camera.h>
#include <splatd/cancel.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

struct spl_dataset;

enum spl_attribute {
    SPL_ATTRIBUTE_POSITION,
    SPL_ATTRIBUTE_RADIUS,
    SPL_ATTRIBUTE_NORMAL,
    SPL_ATTRIBUTE_COLOR,
    SPL_ATTRIBUTE_LINEAR,
    SPL_ATTRIBUTE_CLIP,    /* clip lines and the mask that says which splats have one */
    SPL_ATTRIBUTE_LINES,   /* chunks of lines, with their headers: wires, poles and cables */
    SPL_ATTRIBUTE_PANELS,  /* chunks of panels, with their headers: what is flat */
    SPL_ATTRIBUTE_MESHES,  /* the same of meshes: what is curved, but smooth */
    SPL_ATTRIBUTE_CHUNK,   /* chunk, node and stream headers, spread over the splats */
    SPL_ATTRIBUTE_TEXTURE, /* indices and weights of atoms, their masks and headers */
    SPL_ATTRIBUTE_DICTIONARY,
    SPL_ATTRIBUTE_COUNT
};

/* An optional attribute, as the file names it. */
enum { SPL_STREAMS_MAX = 16, SPL_STREAM_TEXT_MAX = 32 };
struct spl_stream_info {
    char name[SPL_STREAM_TEXT_MAX]; /* "class", "uncertainty", … */
    char type[SPL_STREAM_TEXT_MAX]; /* how codes become values; one that this library does not know is skipped */
    char unit[SPL_STREAM_TEXT_MAX]; /* "" = none */
    uint64_t bits;                  /* of its codes, over all splats */
};

/* How the values of an optional attribute are distributed over the leaf splats that have one, and over the points that
 * panels and meshes of leaves stand for, each of which has its panel's. */
enum { SPL_VALUES_QUANTILES = 64, SPL_VALUES_KINDS_MAX = 64 };
struct spl_stream_values {
    uint64_t count;                              /* that have one; 0 = the file does not say */
    double quantiles[SPL_VALUES_QUANTILES + 1];  /* the i-th: a share i / SPL_VALUES_QUANTILES have less */
    double p99;                                  /* the 99th percentile */
    uint32_t kind_count;                         /* different values, where there are so few, each with how many have
                                                    it, rising; 0 = there are more */
    struct spl_value_count {
        double value;
        uint64_t count;
    } kinds[SPL_VALUES_KINDS_MAX];
};

/* A view that somebody has put down under a name: at most 63 letters, digits, '.', '_' and '-', the first no '.'. */
enum { SPL_VIEW_NAME_BYTES = 64, SPL_SAVED_VIEWS_MAX = 64, SPL_VIEW_SETTINGS_BYTES = 1024 };
struct spl_saved_view {
    char name[SPL_VIEW_NAME_BYTES];
    double eye[3], target[3], up[3]; /* world */
    double fov; /* degrees, vertical; across where an image is narrower than high */
    char settings[SPL_VIEW_SETTINGS_BYTES]; /* what of the dataset it shows and how, as JSON; "" = all, as ever */
    double view_height; /* of an orthographic view, in the dataset's unit; 0 = a pinhole's */
};

struct spl_dataset_info {
    char id[128];              /* the file's stem */
    uint64_t version;          /* XXH3 over the section table: changes whenever any content does */
    uint64_t file_bytes;
    uint64_t page_bytes;       /* bytes that become resident on the GPU when everything is */
    uint64_t dictionary_bytes; /* of them: the textures' atoms, expanded with their mips */
    uint64_t points;           /* read from the sources, before duplicates were dropped */
    uint64_t leaf_splats;      /* the points that were kept: splats of the leaves, and points that their panels and
                                  meshes stand for */
    uint64_t splats; /* of the leaves and the inner levels, without what panels and meshes stand for: may be 0 */
    uint64_t pieces;           /* straight pieces of wires, poles and cables, of all levels */
    uint64_t ids;              /* of splats, of the pieces' vertices, of panels and meshes: below it */
    uint32_t levels;           /* depth of the octree, 1 = a single node */
    uint64_t nodes, chunks;
    uint32_t pages;
    double bounds_min[3], bounds_max[3]; /* of the leaf positions, world */
    double default_eye[3], default_target[3], default_up[3], default_fov; /* a view that shows the dataset */
    double splat_radius;       /* median radius of the leaf splats */
    bool has_color, has_class, has_uncertainty;
    bool has_surface; /* normals and radii; false: bare points, whose radii are those of a grid of their density */
    bool has_linear;  /* some splats lie on wires, poles or cables, and are marked */
    uint32_t atoms, texture_size; /* of the dictionary: atoms of texture_size x texture_size texels; 0 = no textures */
    uint64_t attribute_bits[SPL_ATTRIBUTE_COUNT]; /* over all splats; bytes per splat = bits / 8 / splats */
    uint32_t stream_count; /* attributes beyond these, up to SPL_STREAMS_MAX */
    struct spl_stream_info streams[SPL_STREAMS_MAX];
    char unit[SPL_STREAM_TEXT_MAX]; /* of coordinates: "m", "ft", "us-ft", "unknown" */
    uint32_t maps;                  /* stations with a panorama's map of colours and ranges */
    uint64_t map_texels, map_bytes; /* of all: texels of the colours' finest level; bytes, among page_bytes */
    uint64_t panels;                /* of all levels */
    uint64_t panel_points;          /* of the points, those that the leaves' panels stand for */
    uint64_t meshes, mesh_points;   /* the same of panels with relief, which are not counted as panels */
    bool has_sides; /* the scan said where it was taken from: normals show there, and discs that turn their back to an
                       eye lie behind those that face it */
    const struct spl_stream_values *stream_values; /* of each stream, borrowed until close; NULL = the file says nothing
                                                      of any */
    const struct spl_stream_values *heights; /* z of the leaf splats, likewise; NULL = the file does not say */
    double default_fit[2]; /* degrees across and upright that the default view shows in an image of any shape; 0 = it
                              has default_fov in all of them */
    const char *title, *description;    // may be NULL; what its packer called it; borrowed until close
    uint32_t view_count;                /* at most SPL_SAVED_VIEWS_MAX */
    const struct spl_saved_view *views; /* by name; borrowed until close */
    uint32_t epsg;  /* number of the horizontal coordinate system in EPSG's list; 0 = not known */
    uint32_t station_count;       /* places where a scanner stood, by their numbers, which attribute "scan" has too */
    const double (*stations)[16]; /* row-major, station to world, z up of most scanners; borrowed until close */
    uint32_t tiles; /* of a collection: datasets that it is made of, whose sums are in the figures above, but in
                       file_bytes and bits; 0 = it is none */
    bool stations_of_maps;        /* no scan says where it was taken from: they are the places of panoramas */
    uint64_t tile_bytes; /* of a collection: of its tiles' files; of one that does not say so, what their nodes, chunks
                            and pages take of these */
    const char *crs;     // may be NULL; its coordinate system, as "EPSG:25832" or WKT; borrowed until close
};

/* How the values of stream `stream` (of info.streams) are distributed; NULL where the file does not say. */
static inline const struct spl_stream_values *spl_dataset_info_get_values(const struct spl_dataset_info *info,
                                                                          uint32_t stream)
{
    return stream < info->stream_count && info->stream_values && info->stream_values[stream].count
               ? &info->stream_values[stream]
               : NULL;
}

/* Opens `path` and checks header, section table and node graph. `verify` also hashes every section (else pages are
 * trusted); in a file of more than 1 GiB, pages only when they are read. Of a dataset whose tables (nodes, headers of
 * chunks: some 0.6 bytes a splat) take more than 64 MiB only the first part is kept; the others are read and checked
 * when they are needed. Errors name the section. On success the caller owns *out. Blocks on disk.
 * A path that begins with https://, http:// or s3:// is asked of that server (api/remote.md), with the keys of the
 * process's environment: do not pass on paths of strangers. Pages are then held against their checksums when they are
 * read, whatever `verify` says.
 * Deadlines of one: a read asks again until nothing has come for 30 s, and takes 10 s more for each MiB at most,
 * looking up names of hosts included; opening takes as many reads as the dataset's tables need. A `cancel` ends each
 * within a second or two. What reads while it is open blocks as long: spl_dataset_find_value() the thread that calls
 * it, pages the renderer's own threads, where frames have their deadlines.
 * Errors of one: SPL_E_USAGE (no URL that can be one, half of a key), SPL_E_UNSUPPORTED (there is no libcurl),
 * SPL_E_NOT_FOUND (404, 410), SPL_E_INPUT (no byte ranges, an empty file), SPL_E_TIMEOUT (given up; another attempt may
 * do), SPL_E_IO (anything else that its server refuses), SPL_E_CANCELLED, and SPL_E_CORRUPT, also where the file has
 * changed at its server since it was opened: then only what is here already can be drawn, and it is to be opened anew.
 * Messages have the URL without user, password and query. */
SPL_API int spl_dataset_open(const char *path, bool verify, struct spl_dataset **out, struct spl_error *err);

/* Bytes that do not lie in a file of their own: in an archive, in memory, on a server. */
struct spl_reader {
    size_t size;    /* of this struct: spl_reader_init() */
    uint64_t bytes; /* of the dataset */
    /* Puts up to `count` (> 0) bytes from `offset` on into `out`; what is asked for lies within `bytes`. Returns how
     * many, at least one; 0 where there are no longer as many; -errno. Called by any thread that uses the dataset, by
     * several at once; may block. */
    int64_t (*read)(void *context, uint64_t offset, void *out, size_t count);
    void (*close)(void *context); // may be NULL; called once, by spl_dataset_close() or behind the read that it could
                                  // not wait for, on that thread: not where opening fails
    void *context;
};

static inline void spl_reader_init(struct spl_reader *reader)
{
    spl_sized_init(reader, sizeof *reader);
}

struct spl_open_options {
    size_t size;                     /* spl_open_options_init() */
    bool verify;                     /* as of spl_dataset_open() */
    const struct spl_cancel *cancel; // may be NULL; borrowed until close (from a server: until reads have ended, too):
                                     // ends whatever takes long with the dataset
    const struct spl_reader *reader; // NULL = the file at `path`; the struct itself is read while opening only
    uint64_t tables_bytes;           /* what tables may take; 0 = 256 MiB */
};

static inline void spl_open_options_init(struct spl_open_options *options)
{
    spl_sized_init(options, sizeof *options);
}

/* The same as spl_dataset_open(), with options. With a reader `path` is the dataset's name in errors and, without
 * folder and extension, its id; nothing is opened there. SPL_E_CANCELLED. */
SPL_API int spl_dataset_open_with(const char *path, const struct spl_open_options *options, struct spl_dataset **out,
                                  struct spl_error *err);

/* NULL-safe. Where a renderer that has let go of the dataset is still in a read of it, a file is closed behind that
 * read. A reader's is waited for, 10 s at most: one that hangs longer goes on using `context` until it returns, so what
 * lies there is freed by the reader's close(). */
SPL_API void spl_dataset_close(struct spl_dataset *dataset);

/* Borrowed until close. */
SPL_API const struct spl_dataset_info *spl_dataset_get_info(const struct spl_dataset *dataset);

/* The default view as a camera of the given size: the narrower the image, the wider its vertical field of view, so that
 * what the view shows is not cut. Its near is splat_radius; an orthographic camera that is made of it may begin at the
 * eye, near 0. */
SPL_API int spl_dataset_get_default_camera(const struct spl_dataset *dataset, uint32_t width, uint32_t height,
                                           struct spl_camera *camera, struct spl_error *err);

/* Reads the value that splat `id` has in stream `stream` (of info.streams; less than 0: none): NaN where it is one of
 * those that have no value. False (*value untouched) where there is no such splat, it is the vertex of a wire, the
 * stream is of a type that this library does not know, the file was cut short in place, or its server could not be
 * read. Any thread; blocks on disk, or on its server. */
SPL_API bool spl_dataset_find_value(const struct spl_dataset *dataset, int stream, uint64_t id, double *value);

/* The file of the tile of a collection that has splat `id`; NULL where it is the collection's own, or there is none
 * such. Borrowed until close. Any thread. */
SPL_API const char *spl_dataset_find_tile(const struct spl_dataset *dataset, uint64_t id);

SPL_API const char *spl_attribute_name(enum spl_attribute attribute); /* "unknown" for none */

SPL_END_DECLARATIONS

#endif
