/* Between an atlas of floats in linear light, with aprons, and a picture of bytes without. A texel counts as edited
 * where its bytes differ from those that it is written as; what repeats an edited texel (aprons, the corners of caps)
 * follows it. The caller's thread. */
#include "pack/maps/edit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static void get_bytes(const float texel[4], uint8_t bytes[3])
{
    for (int c = 0; c < 3; c++)
        bytes[c] = (uint8_t)lroundf(spl_srgb_of_linear(texel[c]));
}

/* The texel that shows the same direction within its chart proper: itself, or what it repeats. */
static size_t find_proper(const struct spl_atlas *atlas, uint32_t x, uint32_t y)
{
    double d[3], place[2];
    spl_polar_direction(atlas->side, SPL_MAP_APRON, (double[2]){x + 0.5, y + 0.5}, d);
    spl_polar_place(atlas->side, SPL_MAP_APRON, d, place);
    return (size_t)place[1] * atlas->width + (size_t)place[0];
}

static void write_bytes(const struct spl_atlas *atlas, struct spl_image *picture)
{
    uint8_t(*to)[4] = picture->pixels;
    for (uint32_t y = 0; y < picture->height; y++)
        for (uint32_t x = 0; x < picture->width; x++, to++) {
            uint32_t at[2];
            spl_map_picture_texel(atlas->side, SPL_MAP_APRON, x, y, at);
            get_bytes(atlas->texels[(size_t)at[1] * atlas->width + at[0]], *to);
            (*to)[3] = 255;
        }
}

/* Returns by texel of the atlas whether it was edited, the caller's; NULL: no memory. */
static bool *read_bytes(struct spl_atlas *atlas, const struct spl_image *picture, struct spl_error *err)
{
    const uint8_t(*from)[4] = picture->pixels;
    bool *edited = spl_alloc((size_t)atlas->width * atlas->height, sizeof *edited, err);
    for (uint32_t y = 0; edited && y < picture->height; y++)
        for (uint32_t x = 0; x < picture->width; x++, from++) {
            uint32_t at[2];
            uint8_t own[3];
            spl_map_picture_texel(atlas->side, SPL_MAP_APRON, x, y, at);
            size_t texel = (size_t)at[1] * atlas->width + at[0];
            get_bytes(atlas->texels[texel], own);
            if (!memcmp(own, *from, sizeof own) || find_proper(atlas, at[0], at[1]) != texel)
                continue;
            for (int c = 0; c < 3; c++)
                atlas->texels[texel][c] = spl_linear_of_srgb((*from)[c]);
            edited[texel] = true;
        }
    return edited;
}

/* As slow as a sine a texel: some seconds at side 4096, of an edited map alone. */
static void repeat(struct spl_atlas *atlas, const bool *edited)
{
    for (uint32_t y = 0; y < atlas->height; y++)
        for (uint32_t x = 0; x < atlas->width; x++) {
            size_t here = (size_t)y * atlas->width + x, there = find_proper(atlas, x, y);
            if (here != there && edited[there])
                memcpy(atlas->texels[here], atlas->texels[there], sizeof *atlas->texels);
        }
}

int spl_map_edit(struct spl_map_edits *edits, struct spl_map_export *out, uint32_t index,
                 const struct spl_map_row *row, const uint32_t *words, struct spl_atlas *atlas, struct spl_error *err)
{
    struct spl_image picture = {0};
    if (!edits->list && !out->folder)
        return SPL_OK;
    int rc = spl_map_picture_init(&picture, atlas->side, err);
    if (rc)
        return rc;
    write_bytes(atlas, &picture);
    if (edits->list && !(rc = spl_map_edits_apply(edits, index, row, &picture, err))) {
        bool *edited = read_bytes(atlas, &picture, err);
        if (edited)
            repeat(atlas, edited);
        else
            rc = SPL_E_NOMEM;
        free(edited);
    }
    if (!rc && out->folder)
        rc = spl_map_export_add(out, row, &picture, words, err);
    spl_image_finish(&picture);
    return rc;
}
