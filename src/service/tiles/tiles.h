/* The routes of map tiles. Owned by the loop's thread. */
#ifndef SPL_SERVICE_TILES_TILES_H
#define SPL_SERVICE_TILES_TILES_H

struct request;
struct spl_call;

/* route.c: /v1/datasets/{id}/tiles/{z}/{x}/{y} and /v1/datasets/{id}/tiles.json. */
void spl_make_tile(struct request *request, const struct spl_call *call);
void spl_show_tiles(struct request *request, const struct spl_call *call);

#endif
