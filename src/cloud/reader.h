/* The inside of a cloud: the table of functions that each format fills, and what they share. One thread at a time. */
#ifndef SPL_CLOUD_READER_H
#define SPL_CLOUD_READER_H

#include "cloud/rows.h"

struct spl_cloud_reader {
    const char *format;
    bool text; /* lines, which may end with a carriage return alone */
    /* Checks the header, allocates cloud->state, fills info (attributes but COLOR), columns, sampling and what
     * else spl_cloud_find_colors() wants. */
    int (*open)(struct spl_cloud *cloud, struct spl_error *err);
    /* The next 1 to `limit` (<= SPL_ROWS) rows: 1, or 0 at the end, or negative. */
    int (*rows)(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err);
    /* Goes to about part / parts of the points, exactly to the first when part is 0. */
    int (*seek)(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err);
    /* Goes to a row, of info.rows. NULL where none can be gone to. */
    int (*seek_row)(struct spl_cloud *cloud, uint64_t row, struct spl_error *err);
    /* Releases what the state holds, not the state. May be NULL. Called whenever there is a state, also after a failed
     * open. */
    void (*close)(struct spl_cloud *cloud);
};

/* Which ranges come from samples all over a large file, where a pass over all of it would cost as much as reading it.
 */
enum spl_sampling {
    SPL_SAMPLE_NEVER,     /* rows can only be found by reading from the first */
    SPL_SAMPLE_INTENSITY, /* fixed-size rows: colours are cheap to look at, and exact matters */
    SPL_SAMPLE_ALL        /* text */
};

struct spl_cloud {
    struct spl_source source;
    struct spl_cloud_info info;
    const struct spl_cloud_reader *reader;
    const struct spl_cloud_options *options; /* during open only; never NULL then */
    void *state;                             /* the reader's, one allocation */
    uint32_t columns;                        /* bit 1 << enum spl_column for each that the file has */
    enum spl_sampling sampling;
    bool scan_colors;    /* the range of the colours is not fixed by their type */
    bool integer_colors; /* 1 is then the darkest grey, not white */
    bool slow_rows;      /* reading all of them twice is to be avoided */
    bool intensity;      /* wanted, whatever colours there are */
    struct spl_keep keep;
    char fields[400]; /* see info.fields */
    bool fields_cut;  /* there are more */
    struct spl_color_rule color;
    uint64_t row;                     /* index of the next row */
    uint64_t part, part_of, part_sum; /* so many of so many points are given, 0 = all; the sum decides on the next */
    struct spl_rows rows;
};

extern const struct spl_cloud_reader spl_e57_reader, spl_las_reader, spl_pcd_reader, spl_ply_reader, spl_ptx_reader,
    spl_text_reader;

/* The reader that the first bytes of a file ask for; says so to the source where lines end with '\r' alone. */
int spl_cloud_find_reader(struct spl_source *source, const struct spl_cloud_reader **reader, struct spl_error *err);

/* The format that the path's ending is of, static, where `format` of `reader` is another one; else NULL. */
const char *spl_cloud_find_wrong_ending(const char *path, const struct spl_cloud_reader *reader, const char *format);

/* For readers whose fields have names, while they open: the column that a field fills, if any, which is then one of the
 * cloud's. Names end up in messages about fields that are not there. */
int spl_cloud_take_column(struct spl_cloud *cloud, const char *name, size_t length);
void spl_cloud_name_field(struct spl_cloud *cloud, const char *name, size_t length);

/* Adds to info.unused, "NAME" or "NAME (WHY)", or that there are more; `why` may be NULL. */
void spl_cloud_add_unused(struct spl_cloud *cloud, const char *name, size_t length, const char *why);
/* Of a file whose fields have names, after spl_packed_tell_rest(): a field that fills nothing, unless it is `told`. */
void spl_cloud_tell_unused(struct spl_cloud *cloud, const char *name, int column, bool told);

/* For messages. */
const char *spl_cloud_column_name(const struct spl_cloud *cloud, int column);

/* Decides which of the columns batches have. */
void spl_cloud_keep_columns(struct spl_cloud *cloud);

/* Takes colours from the next rows on as `colors` say. */
void spl_cloud_set_colors(struct spl_cloud *cloud, const struct spl_cloud_colors *colors);

/* Behind a colour that sampled ones contradict. SPL_CLOUD_AGAIN. */
int spl_cloud_begin_again(struct spl_cloud *cloud, struct spl_point_batch *batch, struct spl_error *err);

/* Decides them from the columns and the values' range, and leaves the reader at its first row. */
int spl_cloud_find_colors(struct spl_cloud *cloud, struct spl_error *err);

#endif
