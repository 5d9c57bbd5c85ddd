/* Lists of tiles as kernels walk them, an entry for each sphere that may reach the tile, front to back; and what the
 * spheres of a list hide, as the dispatch says it. `border`: some may be partly solid (eq. 22); `thin`: some may be
 * narrower than a sample. Both are known before the kernel is built, and cost nothing where they are not so. */
#ifndef SPL_SOFT_LISTS_GLSL
#define SPL_SOFT_LISTS_GLSL

#include "common/soft.glsl"
#include "common/soft_step.glsl"

SPL_TEXEL_BUFFER(SPL_TEXELS_ITEMS) item_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) entry_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_LISTS) list_texels;

struct soft_list {
    ivec2 corner;    /* the tile's first sample */
    uint begin, end; /* entries; none is empty */
};

soft_list load_list(uint slot)
{
    int at = int(job.first + 3u * slot);
    uint place = imageLoad(list_texels, at).x;
    soft_list list;
    list.corner = ivec2(place & 65535u, place >> 16) * ivec2(SPL_SOFT_TILE, SPL_SOFT_TILE_ROWS);
    list.begin = imageLoad(list_texels, at + 1).x;
    list.end = imageLoad(list_texels, at + 2).x;
    return list;
}

/* The item of an entry. */
int load_entry(int entry)
{
    return int(imageLoad(entry_texels, entry).x);
}

struct listed_item {
    float x, y;
    uint key; /* depth's word */
    float radius;
    uint paint; /* colour and mark */
};

listed_item load_listed(int index)
{
    int at = SPL_SOFT_ITEM_WORDS * index;
    listed_item item;
    item.x = uintBitsToFloat(imageLoad(item_texels, at).x);
    item.y = uintBitsToFloat(imageLoad(item_texels, at + 1).x);
    item.key = imageLoad(item_texels, at + 2).x;
    item.radius = uintBitsToFloat(imageLoad(item_texels, at + 3).x);
    item.paint = imageLoad(item_texels, at + 4).x;
    return item;
}

/* W of eq. 22, of a paint's mark: SPL_MARK_WHOLE is 1. */
float soft_of_mark(uint mark)
{
    precise float soft = (float(mark) - 1.0) * (1.0 / 254.0);
    return soft;
}

/* Opacity in model express, of 65536, at m = 1 - q, of what has `share` of the opacity of others. */
float express_opacity(float m, float soft, float share, bool border, bool thin)
{
    precise float fall = m * (job.fall_0 + m * (job.fall_1 + m * (job.fall_2 + m * (job.fall_3 + m * job.fall_4))));
    if (border) {
        precise float linear = 1.0 - sqrt(1.0 - m);
        precise float mixed = linear * 65536.0 * (1.0 - soft) + fall * soft;
        fall = mixed;
    }
    precise float thinned = thin ? fall * share : fall;
    return thinned;
}

/* Optical depth of `part` of a chord, of which `whole` is half; models base and concentric. */
float dense_depth(float part, float whole, float q, float soft, float share, bool border, bool thin)
{
    float depth = job.depth * part;
    if (thin)
        depth *= share * (job.thin + (1.0 - job.thin) * share);
    if (border && soft < 1.0) {
        float opacity = 1.0 - exp(-2.0 * job.depth * whole);
        float wanted = -log(max(1.0 - soft_modulate(opacity, q, soft) * share, 1.0 / 1024.0));
        depth = 0.5 * wanted * part / max(whole, 1e-12);
    }
    return depth;
}

#endif
