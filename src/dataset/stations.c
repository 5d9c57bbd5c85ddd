/* Stations as JSON; see stations.h. */
#include "dataset/stations.h"

#include "geom/station.h"

json_t *spl_station_to_json(const struct spl_dataset_info *info, uint32_t number)
{
    const double *pose = info->stations[number];
    double forward[3], up[3];
    json_t *matrix = json_array();
    for (int i = 0; i < 16; i++)
        json_array_append_new(matrix, json_real(pose[i]));
    spl_station_look(pose, info->default_up, forward, up);
    return json_pack("{s:I, s:[f, f, f], s:[f, f, f], s:[f, f, f], s:o}", "station", (json_int_t)number, "world",
                     pose[3], pose[7], pose[11], "forward", forward[0], forward[1], forward[2], "up", up[0], up[1],
                     up[2], "matrix", matrix);
}
