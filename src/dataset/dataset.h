/* What the renderer sees of a mapped dataset beyond the public header. Everything is borrowed until close. */
#ifndef SPL_DATASET_DATASET_H
#define SPL_DATASET_DATASET_H

#include <splatd/dataset.h>

#include <jansson.h>

#include "dataset/format.h"

const struct spl_node *spl_dataset_get_nodes(const struct spl_dataset *dataset, uint32_t *count);
const struct spl_chunk *spl_dataset_get_chunks(const struct spl_dataset *dataset, uint32_t *count);
const json_t *spl_dataset_get_meta(const struct spl_dataset *dataset);

/* Reads page `index` (< info.pages) to `out`, which has room for the bytes that spl_dataset_get_page() states, and
 * holds it against its checksum where the dataset was opened with `verify`. SPL_E_CORRUPT when the file was cut or
 * overwritten in place since. Any thread; blocks on disk. What a daemon reads pages with. */
int spl_dataset_read_page(const struct spl_dataset *dataset, uint32_t index, void *out, struct spl_error *err);

/* The bytes of page `index` (< info.pages) in a map of the file, for tools: touching them raises SIGBUS when the file
 * was cut short in place. */
const uint32_t *spl_dataset_get_page(const struct spl_dataset *dataset, uint32_t index, size_t *bytes);

/* Reads and decodes splat `id` of any level; false (*splat untouched) when there is none, or the file was cut short in
 * place. Its position is relative to its node. Any thread; blocks on disk. */
struct spl_splat;
bool spl_dataset_find_splat(const struct spl_dataset *dataset, uint32_t id, struct spl_splat *splat);

/* META's keys, written by pack and read by open (all required unless said):
 *   "points" int, "leaf_splats" int, "levels" int, "splat_radius" real, "bounds" {"min": [3], "max": [3]},
 *   "default_view" {"eye": [3], "target": [3], "up": [3], "fov": real}, "attributes" {"color": bool, "class": bool,
 *   "uncertainty": bool}, "sources" [string], "pack" {...} (optional, free: settings, statistics), "stations"
 *   [[16 reals: row-major station-to-world]] (optional). */

#endif
