/* Maps of stations in a tile: what kernels are told of one, and colours from all whose chunks are drawn, after those of
 * the splats themselves. */
#include "render/method.h"
#include "render/renderer.h"
#include "render/slot.h"

/* View space to the station's frame, in doubles: both may lie far from the origin. */
static void set_pose(const struct spl_camera *camera, const struct spl_map_row *row, float pose[12])
{
    for (int i = 0; i < 3; i++) {
        double offset = 0;
        for (int j = 0; j < 3; j++) {
            double turned = 0;
            for (int k = 0; k < 3; k++)
                turned += row->rotation[3 * k + i] * camera->rotation[3 * j + k];
            pose[4 * i + j] = (float)turned;
            offset += row->rotation[3 * j + i] * (camera->eye[j] - row->position[j]);
        }
        pose[4 * i + 3] = (float)offset;
    }
}

void spl_tile_set_map(struct spl_tile *tile, uint32_t station)
{
    const struct spl_dataset *dataset = tile->resident->dataset;
    const struct spl_map_row *row = &spl_dataset_get_maps(dataset, &(uint32_t){0})[station];
    tile->map = tile->resident->pages[spl_slot_of_map(dataset, station)].buffer;
    set_pose(&tile->camera, row, tile->params.map_pose);
    tile->params.map_near = row->near;
    tile->params.map_slack = row->slack;
    tile->params.map_sides = row->side / SPL_MAP_SIDE_STEP | row->levels << SPL_MAP_SIDES_LEVELS |
                             row->range_side << SPL_MAP_SIDES_RANGE;
}

bool spl_tile_has_map_colors(const struct spl_tile *tile, uint32_t group)
{
    return group == SPL_SUMS_COLOR && tile->renderer->list.map_count;
}

int spl_tile_dispatch_samples(struct spl_tile *tile, const struct spl_kernel_key *key, struct spl_error *err)
{
    struct spl_frame_params params = tile->params;
    params.entries = (uint32_t)tile->samples;
    return spl_tile_dispatch_items(tile, key, &params, params.entries, err);
}

int spl_tile_dispatch_maps(struct spl_tile *tile, struct spl_error *err)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    const uint32_t most = spl_gpu_get_limits(tile->renderer->gpu)->workgroups;
    bool bent = !spl_method_row(tile->view->method)->sums;
    int rc = spl_tile_dispatch_samples(tile, &(struct spl_kernel_key){"map_base", bent, {bent}}, err);
    for (size_t i = 0; i < list->map_count; i++) {
        const struct spl_draw_map *map = &list->maps[i];
        spl_tile_set_map(tile, map->station);
        for (uint32_t done = 0; done < map->cells && !rc; done += most) {
            struct spl_frame_params params = tile->params;
            params.first_entry = map->first_entry + done;
            params.entries = map->cells - done < most ? map->cells - done : most;
            rc = spl_tile_add_work(tile, spl_tile_get_map_work(params.entries), err);
            rc = rc ? rc
                    : spl_tile_dispatch_items(tile, &(struct spl_kernel_key){"map", bent, {bent}}, &params,
                                              params.entries * SPL_WORKGROUP, err);
        }
    }
    return rc;
}
