/* Panoramas beside scans and inside them, found and judged by what packing finds and judges them by. Owned by the
 * command's thread. */
#include "cmd/info_panoramas.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cmd/info_scan.h"
#include "cmd/output.h"
#include "dataset/map.h"
#include "pack/maps/colors.h"
#include "pack/maps/pictures.h"

static void refuse(void *context, const struct spl_error *why)
{
    json_array_append_new(context, spl_info_text(why->message));
}

/* Of the map of a station whose finest picture this is, as packing chooses its side; one from pictures has at most 0.75
 * byte a texel, where aprons are no more than that. */
static double estimate_map(struct spl_named_view *finest)
{
    const struct spl_stations station = {.count = 1, .of_view = (uint32_t[]){0}};
    const struct spl_view_list only = {.views = finest, .count = 1};
    const struct spl_map_row least = {.side = spl_colors_find_side(&station, &only, 0),
                                      .levels = SPL_MAP_LEVELS_MAX,
                                      .range_side = 4};
    double side = least.side;
    return side > 0 ? fmax(0.75 * 6 * side * side, (double)(sizeof(uint32_t) * spl_map_words(&least))) : 0;
}

struct place {
    double eye[3];
    struct spl_named_view *finest; // may be NULL: no picture was taken there
};

static double get_focal_length(const struct spl_named_view *view)
{
    return fmax(view->camera.fx, view->camera.fy);
}

/* Pictures whose eyes are within half a metre of the first of them are one station's. More stations than a dataset can
 * have are refused by packing. */
static double estimate_maps(const struct spl_view_list *views)
{
    struct place *places = spl_alloc(SPL_MAPS_MAX, sizeof *places, NULL);
    uint32_t count = 0;
    double bytes = 0;
    for (size_t v = 0; places && v < views->count; v++) {
        struct spl_named_view *view = &views->views[v];
        const double *eye = view->camera.eye;
        uint32_t p = count;
        while (p--) {
            const double *at = places[p].eye, x = eye[0] - at[0], y = eye[1] - at[1], z = eye[2] - at[2];
            if (x * x + y * y + z * z <= 0.25)
                break;
        }
        if (p == UINT32_MAX && count == SPL_MAPS_MAX)
            continue;
        if (p == UINT32_MAX)
            memcpy(places[p = count++].eye, eye, sizeof places->eye);
        struct place *place = &places[p];
        if (view->photograph && (!place->finest || get_focal_length(view) > get_focal_length(place->finest)))
            place->finest = view;
    }
    for (uint32_t p = 0; p < count; p++)
        bytes += places[p].finest ? estimate_map(places[p].finest) : 0;
    free(places);
    return bytes;
}

static void add_source(const char *path, json_t *all, json_t *warnings, uint64_t *map_bytes)
{
    const struct spl_map_picture_options how = {.paths = &path, .count = 1, .refuse = refuse, .context = warnings};
    struct spl_view_list views;
    struct spl_error err = {0};
    json_int_t panoramas = 0, photographs = 0, places = 0;
    if (spl_map_pictures_load(&how, &views, &err))
        refuse(warnings, &err);
    double bytes = estimate_maps(&views);
    for (size_t i = 0; i < views.count; i++) {
        uint32_t of = views.views[i].panorama;
        photographs += !of && views.views[i].photograph;
        places += !views.views[i].photograph;
        panoramas += of && views.views[i].photograph && (!i || views.views[i - 1].panorama != of);
    }
    spl_view_list_finish(&views);
    json_array_append_new(all, json_pack("{s:o, s:I, s:I, s:I, s:I}", "path", spl_info_text(path), "panoramas",
                                         panoramas, "photographs", photographs, "places", places, "map_bytes",
                                         (json_int_t)bytes));
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
        static const char *const kinds[][2] = {{"panoramas", ""}, {"photographs", " photograph"}, {"places", " place"}};
        const char *between = "";
        printf("  %-14s", i ? "" : "panoramas");
        for (int k = 0; k < 3; k++) {
            json_int_t count = json_integer_value(json_object_get(source, kinds[k][0]));
            if (!count)
                continue;
            printf("%s%lld%s%s", between, (long long)count, kinds[k][1], k && count > 1 ? "s" : "");
            between = " and ";
        }
        printf("%s of ", *between ? "" : "none");
        spl_cmd_put_text(stdout, json_string_value(json_object_get(source, "path")), 0);
        printf("%s\n", *between ? ", which become maps of stations" : " can be used");
    }
}
