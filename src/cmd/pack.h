/* What the files of 'splatd pack' share: pack_options.c reads the options, pack.c packs, pack_report.c says what came
 * of it; pack_job.c and pack_parts.c pack in parts. */
#ifndef SPL_CMD_PACK_H
#define SPL_CMD_PACK_H

#include <splatd/pack.h>

#include "cmd/pack_report.h"
#include "cmd/views.h"

#define SPL_CMD_PACK_NO_PART UINT64_MAX

struct spl_cmd_pack {
    struct spl_pack_options pack;
    struct spl_photo_options photos;
    struct spl_map_options maps;
    bool wants_maps, no_panoramas;
    int textures;        /* enum spl_texture_coding; -1 = not given */
    const char *quality; // may be NULL
    bool keep_going, skip_broken;
    uint32_t plan; /* parts that are planned; 0 = none */
    uint64_t part; /* the one that is packed, or SPL_CMD_PACK_NO_PART */
    bool join, merge;
    uint32_t parts; /* one after the other, into one file; 0 = in one piece */
    double halo; /* negative: as wide as need be */
    struct spl_cmd_views views;
};

/* Fills *arguments from the command line, whose texts they borrow, callbacks and all; `listener` is their context.
 * SPL_CMD_DONE after --help; SPL_E_USAGE, for what contradicts itself too, before a scan is opened. */
int spl_cmd_pack_parse(struct spl_cmd_pack *arguments, struct spl_cmd_pack_listener *listener, int argc, char **argv,
                       struct spl_error *err);

#endif
