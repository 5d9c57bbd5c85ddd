/* Scans in, a dataset out. */
#ifndef SPLATD_PACK_H
#define SPLATD_PACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/cancel.h>
#include <splatd/dataset.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

struct spl_progress {          /* one call about every 100 ms while work runs, from the calling thread */
    const char *stage;         /* static: "reading scan.ply", "neighbours", … (valid during the call) */
    const char *unit;          /* static: what is counted, a plural in s; NULL = nothing that a user knows */
    uint64_t done, total;      /* items of this stage; total 0 = unknown */
    double rate;               /* items per second */
    double left_s;             /* of everything, so never less than of this stage; 0 = unknown */
};

/* How photographs are coded: into nothing but the splats' colours; as sums of atoms of a dictionary, of which a splat
 * takes those that are worth their bits; or as in the paper, dictionaries of 8, 12 or 16 bit and weights of 4 or 8. */
enum spl_texture_coding {
    SPL_TEXTURES_NONE,
    SPL_TEXTURES_ADAPTIVE,
    SPL_TEXTURES_D8W4,
    SPL_TEXTURES_D12W4,
    SPL_TEXTURES_D16W8,
    SPL_TEXTURES_COUNT
};

/* How much work goes into textures, and what comes of it (api/photographs.md has the figures). */
enum spl_texture_preset { SPL_TEXTURE_NORMAL, SPL_TEXTURE_DRAFT, SPL_TEXTURE_BEST, SPL_TEXTURE_PRESET_COUNT };

/* Colours and textures from photographs with known poses. */
struct spl_photo_options {
    size_t size;               /* spl_photo_options_init() */
    const char *cameras;       /* COLMAP's folder, transforms.json, Open3D's trajectory, pose folder, list of views */
    const char *images;        /* folder of the photographs; NULL = where `cameras` says */
    const char *device;        /* as of struct spl_renderer_options: draws how far the splats lie from photographs */
    uint64_t memory_bytes;     /* of this pass; 0 = 2 GiB */
    enum spl_texture_coding textures;
    enum spl_texture_preset preset;
    double texture_quality;    /* dB that textures are coded to, all together; 0 = the preset's */
    const char *keep_textures; /* a file for the textures before they are coded (sparse/texture_file.h); NULL = none */
    /* Each photograph that cannot be used, and why: the others are still taken. NULL: the first one fails all. */
    void (*refused)(void *context, const struct spl_error *why);
    /* After each epoch of training; may be NULL. `psnr` of the sample, dB. */
    void (*trained)(void *context, uint32_t epoch, double seconds, double psnr, double atoms_per_splat, uint32_t atoms);
    void *context;
};

static inline void spl_photo_options_init(struct spl_photo_options *options)
{
    spl_sized_init(options, sizeof *options);
}

struct spl_photo_report {
    uint32_t photographs;      /* whose poses and files could be used */
    uint32_t refused;
    uint64_t unseen;           /* splats that none of them shows; with panels as large a share of them as of splats
                                * and cells */
    uint64_t textured;         /* splats whose texture was coded */
    uint32_t texture_size;     /* texels a side, 8, 16 or 32; 0 = no textures */
    uint32_t atoms;            /* of the dictionary */
    double resampling_psnr;    /* of textures before coding, against the pixels on their discs, dB; NaN = none */
    double texture_psnr;       /* of what is coded, against the textures, dB */
    uint64_t histogram[9];     /* textured splats by their number of atoms */
    double seconds;
};

/* Colours from maps of stations: what each of them saw around itself, finer than its points. */
struct spl_map_options {
    size_t size;           /* spl_map_options_init() */
    /* Panoramas and photographs on tripods, with poses: panoramas.json, a scan's E57 file, COLMAP's folder, and all
     * that spl_photo_options has; NULL = the splats' own colours alone make the maps. */
    const char *panoramas;
    const char *images;    /* folder of the photographs; NULL = where `panoramas` says */
    /* Each picture that cannot be used, and why: the others are still taken. NULL: the first one fails all. */
    void (*refused)(void *context, const struct spl_error *why);
    void *context;
    const char *export_to; /* a new or empty folder for the maps as PNG (api/photographs.md); NULL = none */
    const char *edits;     /* such a folder, whose colours are taken after they were edited; NULL = none */
    /* Where `panoramas` is NULL: those that the scans bring along, an E57 file's own and the folder panoramas beside a
     * scan; maps are made only where there are any, and what is wrong with them is warned of, not refused. */
    bool find;
};

static inline void spl_map_options_init(struct spl_map_options *options)
{
    spl_sized_init(options, sizeof *options);
}

struct spl_map_report {
    uint32_t stations;         /* that have a map; 0 = no maps were made */
    uint32_t pictures;         /* that were named, of a panorama one; so many of them could not be used: */
    uint32_t refused;
    uint32_t side;             /* of the largest: texels a quarter turn */
    uint64_t texels, bytes;    /* of all maps: texels of the finest colours; all that they take */
    double block_psnr;         /* of the blocks, against the colours that they hold, dB */
    double seconds;
    uint32_t edits, edited;    /* maps that options->edits lists; that took their colours from there */
};

/* What is said as something else than a disc a point. */
enum spl_pack_primitives { SPL_PRIMITIVES_OFF, SPL_PRIMITIVES_ALL };

struct spl_pack_options {
    size_t size;               /* spl_pack_options_init() */
    const char *const *inputs; /* scans; folders, for all scans below them; @NAME, a list with a path a line */
    size_t input_count;
    const char *output;        /* NAME.spld */
    const char *columns;       /* of text inputs, of which there must then be one; may be NULL */
    bool intensity;            /* grey from intensity where a scan has one, whatever colours it has */
    unsigned neighbours;       /* K of eq. 20 and of the PCA; 0 = 12 */
    double position_error;     /* mean, as a share of the splat radius; 0 = 0.016 */
    double normal_error;       /* mean, degrees; 0 = 1 */
    bool points_only;          /* neither normals nor radii: fast, for methods that need none (points, fill) */
    bool no_linear;            /* wires, poles and cables are not looked for */
    bool no_clip_lines;        /* discs are not cut where surfaces end */
    unsigned threads;          /* 0 = all cores */
    const struct spl_photo_options *photos; /* NULL = the scan's own colours */
    void (*progress)(void *context, const struct spl_progress *progress); /* may be NULL */
    /* Each thing in which scans disagree, once they have been read, and wires that are too dear to join: a sentence or
     * two without a newline. May be NULL. */
    void (*warn)(void *context, const char *text);
    void *progress_context; /* of all of them */
    const struct spl_cancel *cancel; // may be NULL; the old file, or none, is left
    /* Each input that cannot be read, and why: the dataset is made of the others, META names it. NULL: the first one
     * fails all. */
    void (*left_out)(void *context, const struct spl_error *why);
    /* Fields of the scans to keep beside class, intensity and returns, as "gps_time,Amplitude"; "none" among them
     * leaves those out. NULL = no others. */
    const char *keep;
    /* An even part of all scans' points: of COPC the coarse levels, which alone are read; of others so many. A
     * scan gives one point at least. 0 = all. */
    uint64_t max_points;
    /* Of coordinates, whatever scans say: "m", "ft", "us-ft", "unknown", …; NULL = as they say. */
    const char *unit;
    const char *crs;           /* likewise: "EPSG:25832", a file that holds WKT, "none"; NULL = as they say */
    /* What is up there, of any length; 0, 0, 0 = z, or as photographs without a crs have it. */
    double up[3];
    const struct spl_map_options *maps; /* NULL = none are made */
    /* About one of so many leaf splats stays, where maps show their colours and surfaces are plain; more of them where
     * splats of a coarser level lose shape. Two cells of panels count as a splat. 2..1000; 0 and 1 = all stay. */
    uint32_t prune;
    /* Metres that a primitive may be off the points that it stands for; 0 = from the scan's noise and spacing. More
     * only with primitives. */
    double error;
    /* What is flat becomes panels, what bends smoothly meshes. Not with points_only. */
    enum spl_pack_primitives primitives;
    /* Where planes, meshes and lines are written besides, as polygons, triangles and polylines (api/primitives.md): a
     * name that ends in .ply, .obj or .dxf; only with primitives. NULL = nowhere. */
    const char *export_primitives;
    const char *title;       /* at most 200 bytes of UTF-8 in a line; NULL = none */
    const char *description; /* at most 4000, in lines; NULL = none */
    /* Instead of the one that is found; its name does not matter. NULL = found. In this and the next, up 0, 0, 0 is
     * what is up in the dataset (+y of an orthographic one that looks along that), and fov 0 is 60. */
    const struct spl_saved_view *default_view;
    const struct spl_saved_view *views; /* by their names, of any order */
    size_t view_count;                  /* at most SPL_SAVED_VIEWS_MAX */
    /* Bytes that the process may take while scans become a dataset; what is beyond lies in files without a name in the
     * output's folder. At least SPL_PACK_MEMORY_MIN; 0 = as much as there is need. The dataset is the same. */
    uint64_t memory_bytes;
    /* What text scans were taken for where they do not say it, before they are read: a sentence or two without a
     * newline. May be NULL. */
    void (*note)(void *context, const char *text);
};

#define SPL_PACK_MEMORY_MIN (64ull << 20)

static inline void spl_pack_options_init(struct spl_pack_options *options)
{
    spl_sized_init(options, sizeof *options);
}

/* What --export-primitives wrote; lengths in `unit` (m, ft, …, or unknown). */
struct spl_drawing_report {
    uint64_t planes, polygons, meshes, triangles, lines;
    double polygon_area, triangle_area, line_length; /* in all */
    char unit[32];
};

struct spl_pack_report {
    uint64_t points_read, points_skipped, duplicates, leaf_splats, splats;
    uint64_t linear; /* leaf splats on wires, poles and cables */
    uint64_t pieces; /* straight ones between them, of all levels */
    uint32_t levels, pages;
    uint64_t nodes, chunks;
    uint64_t attribute_bits[SPL_ATTRIBUTE_COUNT];
    uint32_t stream_count; /* attributes beyond these: name and bits */
    struct spl_stream_info streams[SPL_STREAMS_MAX];
    double position_error;     /* measured mean, share of the radius */
    double normal_error;       /* measured mean, degrees */
    double seconds;
    struct spl_photo_report photos;
    uint64_t part_of; /* points of all scans, where options->max_points left some out; else 0 */
    struct spl_map_report maps;
    uint64_t pruned_of; /* leaf splats of which leaf_splats are left; 0 = all are */
    uint64_t panels, panel_points, meshes, mesh_points; /* as in struct spl_dataset_info */
    struct spl_drawing_report drawing; /* zero without options->export_primitives */
};

/* Reads, cleans, estimates normals and radii, builds the levels and writes `options->output` (temporary file, sync,
 * rename: a crash leaves the old file or none). With photographs or maps the dataset is first written beside `output`,
 * removed as soon as it is open again, and then written with their colours, with maps once more. Blocks; uses
 * options->threads threads and about 30 MB, 80 bytes a point, 1 to 10 for each field that is kept, and 100 more for
 * each point on a wire, a pole or a cable; with memory_bytes it aims to stay below that, has one thread more and says
 * at its end (warn) where it did not. Photographs take photos->memory_bytes beside them. `report` may be NULL. Any
 * thread. */
SPL_API int spl_pack(const struct spl_pack_options *options, struct spl_pack_report *report, struct spl_error *err);

SPL_END_DECLARATIONS

#endif
