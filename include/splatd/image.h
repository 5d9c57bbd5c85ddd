/* Pixels of one rendered layer, and their encodings. */
#ifndef SPLATD_IMAGE_H
#define SPLATD_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

enum spl_layer {
    SPL_LAYER_COLOR,    /* RGBA8, straight alpha, sRGB */
    SPL_LAYER_DEPTH,    /* F32, linear depth along the viewing axis, dataset's unit; NaN = nothing there */
    SPL_LAYER_RANGE,    /* F32, length of the ray to the surface; NaN = nothing */
    SPL_LAYER_NORMAL,   /* F32X3, unit, world axes; (0,0,0) = nothing */
    SPL_LAYER_ID,       /* U32, index of the nearest splat, panel, mesh or vertex of a line in the dataset; UINT32_MAX =
                           nothing */
    SPL_LAYER_COVERAGE, /* F32, share of the pixel's samples that hit a surface, 0..1 */
    SPL_LAYER_PRIMITIVE, /* U32, an enum spl_shape: as what the nearest thing is drawn */
    SPL_LAYER_COUNT
};

/* What a dataset is drawn as. */
enum spl_shape {
    SPL_SHAPE_NONE,  /* nothing is there */
    SPL_SHAPE_SPLAT, /* a splat: a disc or a point */
    SPL_SHAPE_LINE,  /* a piece of a line */
    SPL_SHAPE_PANEL, /* a panel, or one of its cells */
    SPL_SHAPE_MESH,  /* a panel with relief: a triangle of it, or one of its cells */
    SPL_SHAPE_COUNT
};

enum spl_pixel_type { SPL_PIXEL_RGBA8, SPL_PIXEL_F32, SPL_PIXEL_F32X3, SPL_PIXEL_U32 };

struct spl_image {
    enum spl_layer layer;
    enum spl_pixel_type type;
    uint32_t width, height;
    void *pixels;       /* row-major, top row first; owned by whoever holds the struct */
    size_t row_bytes;   /* from one row's first pixel to the next one's; 0 = packed, as in all that the library makes */
};

enum spl_format {
    SPL_FORMAT_JPEG, /* color; float layers through a colour map, a picture for people */
    SPL_FORMAT_PNG, /* color RGBA8; depth and range 16 bit grey, `depth_scale` steps per unit, 0 = nothing; normal RGB8;
                       id RGBA8 (little-endian bytes of the id); coverage 8 bit grey; primitive RGB8, a colour for
                       each: spl_shape_color() */
    SPL_FORMAT_NPY, /* the layer's own type: |u1 (h,w,4), <f4 (h,w), <f4 (h,w,3), <u4 (h,w) */
    SPL_FORMAT_RAW, /* the same bytes without a header, little-endian */
    SPL_FORMAT_WEBP, /* lossy; as JPEG, with the alpha of color; only where it was built in */
    SPL_FORMAT_TIFF, /* GeoTIFF of a map: color RGB and alpha, depth and range as float32 heights, NaN = nothing; the
                        others as they are; only where it was built in */
    SPL_FORMAT_COUNT
};

/* Where the pixels of a map lie: column c and row r, the first pixel's corner at 0, 0, are at
 * origin + c across + r down (x, y). */
struct spl_ground {
    bool placed; /* false: the image is no map */
    double origin[2], across[2], down[2];
    double height; /* of depth 0 */
    uint32_t epsg; /* its coordinate system's number, 0 = not known */
};

struct spl_encode_options {
    size_t size;          /* spl_encode_options_init() */
    enum spl_format format;
    int quality;          /* JPEG and WebP, 1..100; 0 = 90 */
    int chroma;           /* JPEG: 420 (colour at half the resolution) or 444; 0 = 444 from quality 95 on, else 420 */
    double depth_scale;   /* steps per unit in 16 bit PNG; 0 = 1000 (millimetres of a metre dataset, ROS REP 118) */
    char unit[32];        /* of distances, for what 16 bit PNG and GeoTIFF say: "m", "ft"; "" = "unit" */
    struct spl_ground ground; /* of GeoTIFF, which is refused without */
    bool list;            /* NPY of an image of one column, of rays: (n), not (n,1); (n,4), not (n,1,4) */
    const char *crs;      // may be NULL; of GeoTIFF where ground.epsg is 0: WKT of its coordinate system; borrowed
};

static inline void spl_encode_options_init(struct spl_encode_options *options)
{
    spl_sized_init(options, sizeof *options);
}

struct spl_encoded {
    uint8_t *bytes;       /* owned by the receiver, release with spl_encoded_finish() */
    size_t length;
    const char *media_type; /* static: "image/jpeg", … */
    uint64_t saturated;   /* 16 bit depth: pixels beyond the scale's range, stored as 65535 */
    float near, far;      /* JPEG of a float layer: the values at the ends of the colour map, 0 otherwise */
};

SPL_API uint32_t spl_pixel_bytes(enum spl_pixel_type type);

/* Releases `image->pixels` and zeroes the struct. */
SPL_API void spl_image_finish(struct spl_image *image);

/* Encodes `image` into `out`. Any thread; blocks for the encoding only. SPL_E_UNSUPPORTED where the format cannot hold
 * the layer; SPL_E_LIMIT above the format's largest side (JPEG 65535). On failure `out` is zeroed. */
SPL_API int spl_image_encode(const struct spl_image *image, const struct spl_encode_options *options,
                             struct spl_encoded *out, struct spl_error *err);

/* NULL-safe. */
SPL_API void spl_encoded_finish(struct spl_encoded *encoded);

/* "color" <-> SPL_LAYER_COLOR and "jpeg", "jpg" <-> SPL_FORMAT_JPEG; lookups return -1 for an unknown name. */
SPL_API const char *spl_layer_name(enum spl_layer layer);
SPL_API int spl_layer_from_name(const char *name);
SPL_API const char *spl_format_name(enum spl_format format);
SPL_API int spl_format_from_name(const char *name);

/* "none", "splat", "line", "panel", "mesh"; static. "unknown" of other numbers. */
SPL_API const char *spl_shape_name(enum spl_shape shape);
/* Its colour in pictures of layer primitive, sRGB: apart from the others for colour-blind people, too. Black of none,
 * white of other numbers. */
SPL_API void spl_shape_color(enum spl_shape shape, uint8_t rgb[3]);

/* False for a format whose library this build does without. */
SPL_API bool spl_format_is_built(enum spl_format format);

/* 420 or 444: what a JPEG of these options has. */
SPL_API int spl_encode_chroma(const struct spl_encode_options *options);

/* "image/jpeg", …; static. */
SPL_API const char *spl_format_media_type(enum spl_format format);

SPL_END_DECLARATIONS

#endif
