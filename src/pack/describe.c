/* What a dataset says about itself (META), and what its packer is told. The caller's thread; nothing is kept. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "geom/unit.h"
#include "pack/build_parts.h"
#include "pack/job/part.h"
#include "pack/part.h"

static json_t *json_vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

/* Of all splats; 0 where panels have taken the place of all of them. */
static double mean_error(const struct spl_build *p, double sum)
{
    return p->emitted.splats ? sum / (double)p->emitted.splats : 0;
}

json_t *spl_build_describe(const struct spl_build *p, double radius, const struct spl_default_view *view)
{
    const struct spl_points *points = &p->points;
    json_t *bits = json_object(), *sources = spl_scans_describe_names(&p->scans), *stations = json_array();
    char unit[SPL_UNIT_TEXT_MAX];
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        json_object_set_new(bits, spl_attribute_name(a), json_integer((json_int_t)p->emitted.bits[a]));
    for (uint32_t s = 0; s < p->emitted.streams.count; s++)
        json_object_set_new(bits, p->emitted.streams.list[s].name,
                            json_integer((json_int_t)p->emitted.streams.bits[s]));
    for (uint32_t s = 0; s < points->station_count; s++) {
        json_t *pose = json_array();
        for (int i = 0; i < 16; i++)
            json_array_append_new(pose, json_real(points->stations[s][i]));
        json_array_append_new(stations, pose);
    }
    json_t *meta = json_pack(
        "{s:I, s:I, s:i, s:f, s:{s:o, s:o}, s:{s:o, s:o, s:o, s:f, s:[f, f]}, s:{s:b, s:b}, s:o, s:s, s:s?, s:o, s:o,"
        " s:o, s:{s:i, s:f, s:f, s:I, s:I, s:f, s:f}}",
        "points", (json_int_t)points->points_read, "leaf_splats", (json_int_t)points->count, "levels",
        (int)p->tree.levels, "splat_radius", radius, "bounds", "min", json_vector(points->bounds_min), "max",
        json_vector(points->bounds_max), "default_view", "eye", json_vector(view->eye), "target",
        json_vector(view->target), "up", json_vector(view->up), "fov", view->fov, "fit", view->fit[0], view->fit[1],
        "attributes", "color", (int)points->has_color, "surface", !points->no_surface, "bits", bits, "unit",
        spl_unit_print(p->system.unit_m, unit), "crs", p->system.crs, "sources", sources, "stations", stations, "color",
        spl_scans_describe(&p->scans), "pack", "neighbours", (int)p->neighbours, "position_error_bound",
        p->chunk.position_error, "normal_error_bound", p->chunk.normal_error * 180 / M_PI, "points_skipped",
        (json_int_t)points->points_skipped, "duplicates", (json_int_t)points->duplicates, "position_error",
        mean_error(p, p->emitted.error.position_over_radius), "normal_error",
        mean_error(p, p->emitted.error.normal_radians) * 180 / M_PI);
    if (!meta)
        return NULL;
    if (spl_part_of(&p->scans))
        json_object_set_new(meta, "part_of", json_integer((json_int_t)spl_part_of(&p->scans)));
    if (p->part)
        json_object_set_new(meta, "job", spl_part_describe(p->part, points->halo_points));
    if (p->up_from)
        json_object_set_new(meta, "up",
                            json_pack("{s:o, s:s}", "vector", json_vector(p->points.up), "from", p->up_from));
    if (p->scans.inputs->left_out_count)
        json_object_set_new(meta, "skipped", spl_scans_describe_left_out(&p->scans));
    if (p->options->primitives != SPL_PRIMITIVES_OFF)
        json_object_set_new(meta, "primitives",
                            json_pack("{s:s, s:I, s:I, s:f, s:f}", "which", "all", "planes", (json_int_t)p->planes.flat,
                                      "pieces", (json_int_t)(p->planes.count - p->planes.flat), "error_bound",
                                      p->planes.bound, "noise", p->planes.noise));
    return meta;
}

void spl_build_report(const struct spl_build *p, struct spl_pack_report *report)
{
    *report = (struct spl_pack_report){
        .points_read = p->points.points_read,
        .points_skipped = p->points.points_skipped,
        .duplicates = p->points.duplicates,
        .leaf_splats = p->points.count,
        .splats = p->emitted.splats,
        .pieces = p->emitted.pieces,
        .panels = p->emitted.panels,
        .panel_points = p->emitted.panel_points,
        .meshes = p->emitted.meshes,
        .mesh_points = p->emitted.mesh_points,
        .levels = p->tree.levels,
        .nodes = p->tree.count,
        .chunks = p->emitted.chunk_count,
        .pages = p->emitted.pages,
        .position_error = mean_error(p, p->emitted.error.position_over_radius),
        .normal_error = mean_error(p, p->emitted.error.normal_radians) * 180 / M_PI,
        .part_of = spl_part_of(&p->scans),
    };
    for (size_t i = 0; p->points.linear && i < p->points.count; i++)
        report->linear += p->points.linear[i];
    memcpy(report->attribute_bits, p->emitted.bits, sizeof report->attribute_bits);
    report->stream_count = p->emitted.streams.count;
    for (uint32_t s = 0; s < report->stream_count; s++) {
        snprintf(report->streams[s].name, SPL_STREAM_TEXT_MAX, "%s", p->emitted.streams.list[s].name);
        report->streams[s].bits = p->emitted.streams.bits[s];
    }
}
