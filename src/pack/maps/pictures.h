/* The pictures that maps take their colours from: found beside scans and inside them, and read as lists of views. */
#ifndef SPL_PACK_MAPS_PICTURES_H
#define SPL_PACK_MAPS_PICTURES_H

#include "cloud/views.h"

struct spl_map_sources {
    char **paths; /* as spl_panoramas_load() takes them */
    size_t count, capacity;
};

/* What scans bring along: an E57 file whose images have poses, itself; the folder `panoramas` beside a scan, where that
 * has a panoramas.json, as `splatd synth` writes it. `scans` are files. Fills `out`, which may stay empty; the caller
 * finishes it, also after a failure. SPL_E_NOMEM. Blocks for reading. */
int spl_map_sources_find(const char *const *scans, size_t count, struct spl_map_sources *out, struct spl_error *err);
void spl_map_sources_finish(struct spl_map_sources *sources);

struct spl_map_picture_options {
    const char *const *paths;
    size_t count;
    const char *images; /* as of struct spl_photograph_options */
    /* Each picture, or path of several, that cannot be used, and why: the others are taken. NULL: the first one fails.
     */
    void (*refuse)(void *context, const struct spl_error *why);
    void *context;
};

/* The views of all paths, one list, each photograph there and of 8 bits, of its camera's size and not CMYK by its
 * header. Pixels are not read. The caller finishes `list`, which is zeroed on failure. Blocks for reading. */
int spl_map_pictures_load(const struct spl_map_picture_options *options, struct spl_view_list *list,
                          struct spl_error *err);

/* Whether two views are faces of one panorama, of which the first stands for all. Either may be NULL. */
bool spl_map_is_same_picture(const struct spl_named_view *a, const struct spl_named_view *b);

#endif
