/* The colours of a station's map: of its pictures, and of its splats where there is none. */
#ifndef SPL_PACK_MAPS_COLORS_H
#define SPL_PACK_MAPS_COLORS_H

#include "image/pyramid.h"
#include "pack/maps/atlas.h"
#include "pack/maps/hits.h"
#include "pack/maps/ranges.h"

/* Texels of a side that are as wide as the pixels in the middle of the finest of the station's pictures, where these
 * show enough to be worth it, a multiple of SPL_MAP_SIDE_STEP; 0 without pictures. */
uint32_t spl_colors_find_side(const struct spl_stations *stations, const struct spl_view_list *views, uint32_t station);

/* Adds what the station's splats are painted in, of next to no weight beside pictures, over the factors that the
 * colours of these are going to be multiplied by. */
void spl_colors_add_hits(struct spl_atlas *atlas, struct spl_hits *hits, const struct spl_inverse_ranges *inverse,
                         const float factors[3], unsigned threads);

/* Adds a picture, a panorama as a whole where the view is a face of one: each texel's point, by its range, is looked up
 * where the picture has it, over the texel's area. The better a picture resolves a texel, and the nearer its middle
 * that lies, the more it counts; sharply, so that only seams are mixed. Parallel. */
void spl_colors_add_picture(struct spl_atlas *atlas, const struct spl_station *station,
                            const struct spl_inverse_ranges *inverse, const struct spl_named_view *view,
                            const struct spl_pyramid *pixels, unsigned threads);

#endif
