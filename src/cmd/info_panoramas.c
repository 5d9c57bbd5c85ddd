/* Panoramas beside scans and inside them, found and judged by what packing finds and judges them by. Owned by the
 * command's thread. */
#include "cmd/info_panoramas.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "cmd/info_scan.h"
#include "cmd/output.h"
#include "dataset/map.h"
#include "pack/maps/pictures.h"

static void refuse(void *context, const struct spl_error *why)
{
    json_array_append_new(context, spl_info_text(why->message));
}

/* Of a map whose texels are as wide as the pixels in the middle of a picture of focal length `f`, pixels; one from
 * pictures has at most 0.75 byte a texel. */
static double estimate_bytes(double f)
{
    double side = fmin(f * M_PI / 2, SPL_MAP_SIDE_MAX);
    return 0.75 * 6 * side * side;
}

static bool stand_together(const struct spl_named_view *a, const struct spl_named_view *b)
{
    const double *p = a->camera.eye, *q = b->camera.eye;
    return fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]) < 0.5;
}

static void add_source(const char *path, json_t *all, json_t *warnings, uint64_t *map_bytes)
{
    const struct spl_map_picture_options how = {.paths = &path, .count = 1, .refuse = refuse, .context = warnings};
    struct spl_view_list views;
    struct spl_error err = {0};
    json_int_t panoramas = 0, photographs = 0;
    if (spl_map_pictures_load(&how, &views, &err))
        refuse(warnings, &err);
    double bytes = 0;
    for (size_t i = 0; i < views.count; i++) {
        uint32_t of = views.views[i].panorama;
        if (!i || !stand_together(&views.views[i - 1], &views.views[i]))
            bytes += estimate_bytes(views.views[i].camera.fx);
        photographs += !of;
        panoramas += of && (!i || views.views[i - 1].panorama != of);
    }
    spl_view_list_finish(&views);
    json_array_append_new(all, json_pack("{s:o, s:I, s:I, s:I}", "path", spl_info_text(path), "panoramas", panoramas,
                                         "photographs", photographs, "map_bytes", (json_int_t)bytes));
    *map_bytes += (uint64_t)bytes;
}

json_t *spl_info_list_panoramas(const struct spl_scan *list, size_t count, json_t *warnings, uint64_t *map_bytes)
{
    const char **paths = spl_alloc(count, sizeof *paths, NULL);
    struct spl_map_sources sources = {0};
    json_t *all = json_array();
    for (size_t i = 0; paths && i < count; i++)
        paths[i] = list[i].path;
    if (paths)
        spl_map_sources_find(paths, count, &sources, NULL);
    for (size_t i = 0; i < sources.count; i++)
        add_source(sources.paths[i], all, warnings, map_bytes);
    spl_map_sources_finish(&sources);
    free(paths);
    return all;
}

void spl_info_print_panoramas(const json_t *panoramas)
{
    const json_t *source;
    size_t i;
    json_array_foreach(panoramas, i, source)
    {
        json_int_t whole = json_integer_value(json_object_get(source, "panoramas"));
        json_int_t loose = json_integer_value(json_object_get(source, "photographs"));
        printf("  %-14s%lld", i ? "" : "panoramas", (long long)whole);
        if (loose)
            printf(" and %lld photographs", (long long)loose);
        printf(" of ");
        spl_cmd_put_text(stdout, json_string_value(json_object_get(source, "path")), 0);
        printf(", which become maps of stations\n");
    }
}
