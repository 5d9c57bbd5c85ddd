/* Maps of stations: what they trim and how they colour, against the plain C reference and against what is known of a
 * scene. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "geom/polar.h"
#include "gpu/frames.h"
#include "render/fault.h"
#include "shared.h"
#include "support/mapped_dataset.h"
#include "support/sanitised.h"

static const double spheres[3] = {1.1, 0.7, 0.9};

/* A ball around the origin before stripes of sky and of what was not scanned; colours are waves of direction. */
static void look_anywhere(const struct make_map *map, const double d[3], double color[3], double *range)
{
    double away = 0, along = 0, local[3];
    const double middle[3] = {0, 0, 0};
    mapped_local(&map->row, middle, local);
    for (int i = 0; i < 3; i++) {
        away += local[i] * local[i];
        along += local[i] * d[i];
        color[i] = 127.5 + 100 * sin(9 * d[i] + 5 * d[(i + 1) % 3] * d[(i + 2) % 3]);
    }
    double radius = spheres[0], root = along * along - away + radius * radius;
    *range = root > 0 && along > 0 ? fmax(along - sqrt(root), 0.06) : sin(20 * d[2]) > 0 ? INFINITY : NAN;
}

/* Turns a splat that turns its back to the eye of looking(), or nearly, towards it. */
static void face_eye(struct make_splat *splat, double distance)
{
    const struct spl_view view = looking(origin, distance, 16, 16);
    double towards = 0, along[3], length = 0;
    for (int c = 0; c < 3; c++) {
        along[c] = view.camera.eye[c] - splat->position[c];
        towards += (double)splat->normal[c] * along[c];
        length += along[c] * along[c];
    }
    length = sqrt(length);
    for (int c = 0; c < 3; c++)
        splat->normal[c] = fabs(towards) < 0.1 * length ? (float)(along[c] / length)
                                                        : copysignf(1, (float)towards) * splat->normal[c];
}

/* Where `facing` is not 0, all face the eye of looking() at that distance: maps turn the backs of no discs away. */
static struct spl_dataset *random_mapped(size_t count, double radius, int levels, uint32_t stations, bool trims,
                                         double facing)
{
    static const double places[4][3] = {{3, 0.5, 1}, {-1, -2.5, 0.2}, {0.1, 0.2, 0.05}, {0.5, 3, -2}};
    struct make_splat *splats = random_splats(count, origin, radius);
    for (size_t i = 0; i < count && i % 300 < 200; i += 3) /* some end at a line, too */
        splats[i].clip[0] = -splats[i].normal[1], splats[i].clip[1] = splats[i].normal[0], splats[i].clip_offset = 0.4f;
    for (size_t i = 0; facing > 0 && i < count; i++)
        face_eye(&splats[i], facing);
    struct spl_dataset *plain = make_dataset_levels(splats, count, levels);
    struct make_map maps[4];
    for (uint32_t i = 0; i < stations; i++)
        maps[i] = (struct make_map){.row = mapped_row(places[i], 1 + i, 64 << (i % 2), 1 + i % 3, 30 + 7 * i),
                                    .look = look_anywhere};
    struct spl_dataset *dataset = make_mapped_alike(plain, maps, stations, trims);
    spl_dataset_close(plain);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void maps_match_the_reference(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        size_t splats;
        double radius, distance, lod, margin;
        int levels, supersample;
        uint32_t stations;
        bool trims;
    } rows[] = {
        {"colours", 3000, 0.05, 3, 0, 1, 1, 1, 2, false}, {"trimmed", 3000, 0.05, 3, 0, 1, 1, 1, 3, true},
        {"pruned", 6000, 0.05, 6, 12, 2, 2, 1, 4, true},  {"among them", 3000, 0.03, 0.9, 1, 1, 1, 1, 4, true},
        {"supersampled", 2000, 0.1, 3, 1, 0, 1, 2, 1, true}, {"wide", 96, 1.5, 5, 0, 1, 1, 1, 1, true},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_dataset *dataset =
            random_mapped(rows[i].splats, rows[i].radius, rows[i].levels, rows[i].stations, rows[i].trims,
                          rows[i].trims ? 0 : rows[i].distance);
        spl_renderer_set_work_at_once(renderer, i % 2 ? UINT64_MAX : 1); // in parts, or not
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_view view = looking(origin, rows[i].distance, 112, 84);
            char what[64];
            if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
                continue;
            view.method = method;
            view.lod = rows[i].lod;
            view.disc.margin = rows[i].margin;
            view.supersample = rows[i].supersample;
            snprintf(what, sizeof what, "%s, %s", rows[i].what, spl_method_name(method));
            same_images(dataset, &view, what);
            struct spl_frame on, off;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &on, NULL), SPL_OK);
            assert_true(on.stats.complete);
            view.maps = SPL_MAPS_OFF;
            same_images(dataset, &view, what);
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &off, NULL), SPL_OK);
            struct tally t = compare(&on, &off);
            if (t.color_differs < t.pixels / 20 || (t.depth_differs > 0) != rows[i].trims)
                fail_msg("%s: maps change %zu colours and %zu depths", what, t.color_differs, t.depth_differs);

            spl_frame_finish(&on);
            spl_frame_finish(&off);
        }
        done(dataset);
    }
}

/* A room of six walls, side 2, and what a station sees of it: smooth colours of direction, exact ranges. */
static double room_range(const struct make_map *map, const double d[3])
{
    double range = INFINITY;
    for (int i = 0; i < 3; i++) {
        double world = 0;
        for (int j = 0; j < 3; j++)
            world += map->row.rotation[3 * i + j] * d[j];
        double wall = world > 0 ? 1 : -1;
        range = fabs(world) > 1e-9 ? fmin(range, (wall - map->row.position[i]) / world) : range;
    }
    return range;
}

static void look_in_room(const struct make_map *map, const double d[3], double color[3], double *range)
{
    *range = room_range(map, d);
    for (int i = 0; i < 3; i++)
        color[i] = 127.5 + 100 * sin(3 * d[i] + 2 * d[(i + 1) % 3]);
}

static struct spl_dataset *make_room(const struct make_map *map)
{
    enum { side = 24 };
    struct make_splat *splats = calloc(6 * side * side, sizeof *splats), *s = splats;
    for (int wall = 0; wall < 6; wall++)
        for (int at = 0; at < side * side; at++, s++) {
            int axis = wall / 2;
            double along[2] = {(at % side + 0.5) * 2 / side - 1, (at / side + 0.5) * 2 / side - 1};
            s->position[axis] = wall % 2 ? 1 : -1;
            s->position[(axis + 1) % 3] = along[0];
            s->position[(axis + 2) % 3] = along[1];
            s->normal[axis] = wall % 2 ? -1 : 1;
            s->radius = 0.08f;
            s->color[0] = 255;
        }
    struct spl_dataset *plain = make_dataset(splats, 6 * side * side);
    struct spl_dataset *dataset = make_mapped_alike(plain, map, 1, false);
    spl_dataset_close(plain);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

/* The map's colour in direction d, from texels in doubles; channel c. */
static double map_color(const struct spl_map_row *row, const uint32_t *words, const double d[3], int c)
{
    double place[2], sum = 0;
    spl_polar_place(row->side, SPL_MAP_APRON, d, place);
    for (int i = 0; i < 4; i++) {
        double x = place[0] - 0.5, y = place[1] - 0.5, u = x - floor(x), v = y - floor(y);
        float texel[3];
        spl_map_get_color(words + spl_map_level_word(row, 0), row->side, (uint32_t)x + i % 2, (uint32_t)y + i / 2,
                          texel);
        sum += (double)texel[c] * (i % 2 ? u : 1 - u) * (i / 2 ? v : 1 - v);
    }
    return sum;
}

/* Every pixel of six views of the room has the colour of its own direction from the station, to a level: across the
 * seams of charts, at poles and where azimuths begin. Its corners, where depths of two walls blend, are left out. */
static void colours_are_those_of_their_directions(void **state)
{
    enum { width = 120, height = 120 };
    static const double place[3] = {0.2, -0.1, 0.15}, eye[3] = {-0.1, 0.1, -0.2};
    (void)state;
    skip_sanitised();
    struct make_map map = {.row = mapped_row(place, 0, 64, 1, 256), .look = look_in_room};
    struct spl_dataset *dataset = make_room(&map);
    uint32_t *words = malloc(spl_dataset_get_map_bytes(dataset, 0));
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        double worst = 0, off = 0, compared = 0;
        if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
            continue;
        for (int side = 0; side < 6; side++) {
            double target[3] = {eye[0], eye[1], eye[2]}, up[3] = {0.2, 0.3, 0.9};
            target[side / 2] += side % 2 ? 1 : -1;
            struct spl_view view = looking(origin, 1, width, height);
            struct spl_frame frame;
            assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
            assert_int_equal(spl_camera_set_fov(&view.camera, 95, width, height, NULL), SPL_OK);
            view.method = method;
            view.lod = 0;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            const uint8_t *pixels = frame.images[SPL_LAYER_COLOR].pixels;
            for (int at = 0; at < width * height; at++) {
                double x = (at % width + 0.5 - view.camera.cx) / view.camera.fx;
                double y = (at / width + 0.5 - view.camera.cy) / view.camera.fy, far = INFINITY, next = INFINITY;
                double world[3], local[3];
                for (int i = 0; i < 3; i++) {
                    const double *r = view.camera.rotation;
                    world[i] = r[i] * x + r[3 + i] * y + r[6 + i];
                    double to = ((world[i] > 0 ? 1 : -1) - eye[i]) / world[i];
                    next = to < far ? far : fmin(next, to);
                    far = fmin(far, to);
                }
                if (next < 1.15 * far)
                    continue;
                for (int i = 0; i < 3; i++)
                    world[i] = eye[i] + far * world[i];
                mapped_local(&map.row, world, local);
                for (int c = 0; c < 3; c++) {
                    double miss = fabs(pixels[4 * at + c] - map_color(&map.row, words, local, c));
                    worst = fmax(worst, miss);
                    off += miss > 1;
                    compared++;
                }
            }
            spl_frame_finish(&frame);
        }
        assert_true(compared > 100000);
        if (off > 0)
            fail_msg("%s: %g of %g channels are off by more than a level, the worst by %g", spl_method_name(method),
                     off, compared, worst);
    }
    free(words);
    done(dataset);
}

/* A wall before nothing: its discs reach beyond the edge, where its station saw no return, and end there; what was not
 * scanned trims nothing. */
static void look_past_edge(const struct make_map *map, const double d[3], double color[3], double *range)
{
    color[0] = color[1] = color[2] = 200;
    *range = d[0] > 0 && d[1] < 0 ? 2 / d[0] : *(const double *)map->context;
}

static void silhouettes_end_where_a_station_saw_through(void **state)
{
    enum { side = 20 };
    static const double place[3] = {0, 0, 0}, eye[3] = {-1, 0.3, 0.2}, target[3] = {2, 0, 0}, up[3] = {0, 0, 1};
    (void)state;
    skip_sanitised();
    struct make_splat splats[side * side];
    for (int i = 0; i < side * side; i++)
        splats[i] = (struct make_splat){.position = {2, -(i % side + 0.5) / side, (i / side + 0.5) / side - 0.5},
                                        .normal = {-1, 0, 0},
                                        .radius = 0.1f,
                                        .color = {50, 50, 50}};
    struct spl_dataset *plain = make_dataset(splats, side * side);
    const double behind[3] = {INFINITY, NAN, 5};
    for (int kind = 0; kind < 3; kind++) {
        struct make_map map = {
            .row = mapped_row(place, 0, 64, 2, 512), .look = look_past_edge, .context = &behind[kind]};
        struct spl_dataset *dataset = make_mapped_alike(plain, &map, 1, true);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, 1, 200, 150);
        assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            double most[2];
            view.method = method;
            if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
                continue;
            for (int off = 0; off < 2; off++) {
                struct spl_frame frame;
                view.maps = off ? SPL_MAPS_OFF : SPL_MAPS_ON;
                assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
                const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
                most[off] = -1;
                for (int at = 0; at < 200 * 150; at++) {
                    double x = (at % 200 + 0.5 - view.camera.cx) / view.camera.fx, y = 0;
                    y = (at / 200 + 0.5 - view.camera.cy) / view.camera.fy;
                    const double *r = view.camera.rotation;
                    double along = isnan(depth[at]) ? -1 : eye[1] + depth[at] * (r[1] * x + r[4] * y + r[7]);
                    most[off] = fmax(most[off], along);
                }
                spl_frame_finish(&frame);
            }
            double texel = 2 * M_PI / 2 / 512;
            assert_true(most[1] > 0.06 && most[1] < 0.11);
            if (kind == 1)
                assert_true(most[0] == most[1]);
            else if (!(most[0] > -0.01 && most[0] < 2 * texel + 0.02))
                fail_msg("%s, %d: the wall ends at %g instead of 0", spl_method_name(method), kind, most[0]);
        }
        done(dataset);
    }
    spl_dataset_close(plain);
}

static void look_at_a_veil(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map;
    (void)d;
    color[0] = color[1] = color[2] = 0;
    *range = 0.5;
}

static void look_at_nothing(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map;
    (void)d;
    color[0] = color[1] = color[2] = 0;
    *range = NAN;
}

static void look_at_wall(const struct make_map *map, const double d[3], double color[3], double *range)
{
    double world = 0;
    for (int j = 0; j < 3; j++)
        world += map->row.rotation[j] * d[j];
    color[0] = color[1] = color[2] = 200;
    *range = world > 1e-6 ? (2 - map->row.position[0]) / world : INFINITY;
}

/* Something stood before a wall's own station: its colours are the next station's, and neither black nor its own. */
static void what_the_own_station_does_not_see_another_colours(void **state)
{
    enum { side = 20 };
    static const double eye[3] = {-1, 0.3, 0.2}, target[3] = {2, 0, 0}, up[3] = {0, 0, 1};
    static const double places[2][3] = {{0, 0, 0}, {0.3, 0.2, -0.1}};
    (void)state;
    struct make_splat splats[side * side];
    for (int i = 0; i < side * side; i++)
        splats[i] = (struct make_splat){.position = {2, (i % side + 0.5) / side - 0.5, (i / side + 0.5) / side - 0.5},
                                        .normal = {-1, 0, 0},
                                        .radius = 0.1f,
                                        .color = {50, 50, 50}};
    struct spl_dataset *plain = make_dataset(splats, side * side);
    const struct make_map maps[2] = {{.row = mapped_row(places[0], 0, 64, 2, 256), .look = look_at_a_veil},
                                     {.row = mapped_row(places[1], 1, 64, 2, 256), .look = look_at_wall}};
    uint64_t chunks;
    spl_dataset_get_chunks(plain, &chunks);
    struct spl_chunk_stations *seen = calloc(chunks, sizeof *seen);
    for (uint64_t c = 0; c < chunks; c++)
        seen[c] = (struct spl_chunk_stations){.seen_by = {1, 2}};
    struct spl_dataset *dataset = make_mapped(plain, maps, 2, seen);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 1, 80, 60);
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_frame frame;
        view.method = method;
        if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
            continue;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        assert_in_range(((const uint8_t *)frame.images[SPL_LAYER_COLOR].pixels)[4 * (30 * 80 + 40)], 196, 204);
        spl_frame_finish(&frame);
    }
    done(dataset);
    spl_dataset_close(plain);
    free(seen);
}

/* Two faces of a wall that is thinner than its discs are wide: the one that faces the eye hides the other. Alone the
 * other is drawn, where it is. So with a map, of a scan that says its station, and where sides are guessed, be they all
 * wrong; only where both are guessed to be the same are they blended. */
static void backs_lie_behind(void **state)
{
    (void)state;
    enum { mapped, surveyed, guessed, turned, alike, all };
    const struct make_map map = {.row = mapped_row(origin, 0, 64, 2, 64), .look = look_at_nothing};
    for (int row = 0; row < 2 * all; row++) {
        const int sides = row / 2, alone = row % 2;
        const struct make_splat splats[2] = {
            {.position = {2.43, 0, 0}, .normal = {sides == turned ? -1 : 1, 0, 0}, .radius = 0.5f,
             .color = {0, 0, 250}},
            {.position = {2.3, 0, 0}, .normal = {sides < turned ? -1 : 1, 0, 0}, .radius = 0.5f, .color = {250, 0, 0}},
        };
        make_dataset_station = sides == surveyed;
        struct spl_dataset *plain = make_dataset(splats, alone ? 1 : 2);
        make_dataset_station = false;
        struct spl_dataset *dataset = sides == mapped ? make_mapped_alike(plain, &map, 1, false) : plain;
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, 1, 80, 60);
        const double eye[3] = {0, 0.01, 0.02}, target[3] = {2, 0, 0}, up[3] = {0, 0, 1};
        assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_frame frame;
            const size_t middle = 30 * 80 + 40;
            view.method = method;
            if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
                continue;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            const uint8_t *color = (const uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * middle;
            float depth = ((const float *)frame.images[SPL_LAYER_DEPTH].pixels)[middle];
            if (sides == alike && !alone && method == SPL_METHOD_SPLAT) {
                assert_in_range(color[0], 60, 200);
                assert_in_range(color[2], 60, 200);
            } else {
                assert_in_range(color[alone ? 2 : 0], 240, 255);
                assert_in_range(color[alone ? 0 : 2], 0, 10);
                assert_true(fabsf(depth - (alone ? 2.43f : 2.3f)) < 0.01f);
            }
            spl_frame_finish(&frame);
        }
        done(dataset);
        if (sides == mapped)
            spl_dataset_close(plain);
    }
}

/* A hundred stations, each chunk seen by others: the image is the same however it is cut, and when it is drawn
 * again. */
static void stations_leave_no_seams(void **state)
{
    enum { count = 6000, stations = 100 };
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct make_splat *splats = random_splats(count, origin, 0.02);
    struct spl_dataset *plain = make_dataset(splats, count);
    struct make_map *maps = calloc(stations, sizeof *maps);
    for (uint32_t i = 0; i < stations; i++) {
        const double place[3] = {3 * uniform() - 1.5, 3 * uniform() - 1.5, 3 * uniform() - 1.5};
        maps[i] = (struct make_map){.row = mapped_row(place, i, 64, 1 + i % 2, 16), .look = look_anywhere};
        maps[i].row.slack = 0.3f;
    }
    uint64_t chunks;
    spl_dataset_get_chunks(plain, &chunks);
    struct spl_chunk_stations *seen = calloc(chunks, sizeof *seen);
    for (uint64_t c = 0; c < chunks; c++) {
        for (uint64_t i = 0; i < c % 5; i++)
            seen[c].seen_by[i] = (uint16_t)(1 + (7 * c + 13 * i) % stations);
        seen[c].seen_by[0] |= c % 3 && c % 5 ? SPL_STATION_TRIMS : 0;
    }
    struct spl_dataset *dataset = make_mapped(plain, maps, stations, seen);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int supersample = 1; supersample <= 2; supersample++) {
            struct spl_view view = looking(origin, 3, 203, 151);
            struct spl_frame frames[3];
            view.method = method;
            view.supersample = supersample;
            if (!(spl_method_get_params(method) & SPL_PARAM_BIT(maps)))
                continue;
            for (int i = 0; i < 3; i++)
                assert_int_equal(spl_renderer_render(i == 2 ? small : renderer, dataset, &view, &frames[i], NULL), 0);
            assert_true(frames[2].stats.tiles > 1);
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
                const struct spl_image *image = &frames[0].images[layer];
                size_t bytes = (size_t)image->width * image->height * spl_pixel_bytes(image->type);
                assert_memory_equal(image->pixels, frames[1].images[layer].pixels, bytes);
            }
            struct tally t = compare(&frames[0], &frames[2]); // of method splat each tile has its largest weight
            if (t.covered_differs || t.id_differs || t.color_worst > (method == SPL_METHOD_NEAREST ? 0 : 1))
                fail_msg("%s: %zu pixels differ in coverage, %zu in id, colours by %d", spl_method_name(method),
                         t.covered_differs, t.id_differs, t.color_worst);
            for (int i = 0; i < 3; i++)
                spl_frame_finish(&frames[i]);
        }
    spl_renderer_remove(small, dataset);
    spl_renderer_destroy(small);
    done(dataset);
    spl_dataset_close(plain);
    free(seen);
    free(maps);
    free(splats);
}

/* Maps are accounted for as pages are; where they have no room the splats' own colours are drawn, and the frame says
 * that it is not all. */
static void maps_count_as_memory(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_mapped(900, 0.1, 1, 4, true, 3);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_residency_info resident;
    struct spl_view view = looking(origin, 3, 64, 48);
    struct spl_frame off, on, poor;
    view.maps = SPL_MAPS_OFF;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &off, NULL), SPL_OK);
    spl_renderer_get_residency(renderer, dataset, &resident);
    uint64_t without = resident.bytes;
    assert_true(without < info->page_bytes);
    view.maps = SPL_MAPS_ON;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &on, NULL), SPL_OK);
    spl_renderer_get_residency(renderer, dataset, &resident);
    assert_int_equal(resident.bytes - without, info->map_bytes);
    assert_true(on.stats.complete);

    struct spl_renderer *small;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 1 << 16};
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    options.memory_limit = spl_renderer_get_memory(small) + 2 * without + 1024;
    spl_renderer_destroy(small);
    for (uint32_t i = 0; i < info->maps; i++)
        assert_true(without + 1024 < spl_dataset_get_map_bytes(dataset, i));
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    assert_int_equal(spl_renderer_preload(small, dataset, NULL), SPL_OK);
    assert_int_equal(spl_renderer_render(small, dataset, &view, &poor, NULL), SPL_OK);
    assert_false(poor.stats.complete);
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *image = &off.images[layer];
        size_t bytes = (size_t)image->width * image->height * spl_pixel_bytes(image->type);
        assert_memory_equal(image->pixels, poor.images[layer].pixels, bytes);
    }
    spl_renderer_destroy(small);
    spl_frame_finish(&off);
    spl_frame_finish(&on);
    spl_frame_finish(&poor);
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(maps_match_the_reference),
        frames_test(colours_are_those_of_their_directions),
        frames_test(silhouettes_end_where_a_station_saw_through),
        frames_test(what_the_own_station_does_not_see_another_colours),
        frames_test(backs_lie_behind),
        frames_test(stations_leave_no_seams),
        frames_test(maps_count_as_memory),
    };
    return frames_run(argc, argv, "maps", tests, sizeof tests / sizeof *tests);
}
