/* Panels, and meshes, which are panels with relief, against the plain C reference: every kind of mask and colours,
 * every level of lattice, from far away, near by, within; as the discs and points that their cells stand for; forged
 * ones; in tiles. One body for both kinds and every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "support/sanitised.h"
#include "support/spoil.h"

enum { side = SPL_PANEL_SIDE };

/* What the tests are given as their state. */
enum { PANELS, MESHES };
struct kind {
    double relief[2]; /* cells that heights reach to, of some datasets and of others */
};

static struct kind kinds[] = {[PANELS] = {{0, 0}}, [MESHES] = {{4, 12}}};

static void match_from_every_side(void **state)
{
    const struct kind *kind = *state;
    for (uint64_t seed = 1; seed <= TEST_SIZE(2, 1); seed++) {
        random_state = seed;
        struct spl_dataset *dataset = random_panels(4, seed % 2 ? 300 : 0, origin, 0.01, kind->relief[seed % 2 == 0]);
        struct spl_view view = looking(origin, 3, 160, 120);
        same_of_all(dataset, &view, "aside");
        view.supersample = 2;
        view.lod = 0;
        same_of_all(dataset, &view, "in full");
        view = looking(origin, 40, 160, 120);
        same_of_all(dataset, &view, "far away");
        done(dataset);
    }
}

/* Cells as large as half the image, the eye among them: windows, and panels that reach the near plane; planes near and
 * far go through the middle of some. Not of fill, whose filter has tests of its own. */
static void around_the_eye_they_match(void **state)
{
    const struct kind *kind = *state;
    for (uint64_t seed = 1; seed <= TEST_SIZE(2, 1); seed++) {
        random_state = 100 + seed;
        struct spl_dataset *dataset = random_panels(4, 100, origin, 0.05, kind->relief[0]);
        struct spl_view view = looking(origin, 0.1 + uniform(), 400, 240);
        view.camera.cx += 31.7;
        view.camera.fy *= 1.2;
        view.camera.near = seed % 2 ? view.camera.near : 0.4;
        view.camera.far = seed % 2 ? 0.9 : view.camera.far;
        same_of_all(dataset, &view, "among them");
        done(dataset);
    }
}

/* Heights of several times their panel's width, each view of a part of them. */
static void what_stands_out_is_found(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_panels(4, 0, origin, 0.01, 60);
    for (int k = 0; k < 12; k++) {
        struct spl_view view = looking(origin, 1, 64, 48);
        look(&view, (double[]){0.2, -4, 0.3}, (double[]){2 * uniform() - 1, 0, 2 * uniform() - 1});
        assert_int_equal(spl_camera_set_fov(&view.camera, 6, 64, 48, NULL), SPL_OK);
        same_of(dataset, &view, SPL_METHOD_NEAREST, "a part of what stands out");
    }
    done(dataset);
}

/* The height over cell (x, y)'s middle, in doubles, and how the surface rises there: by the weights of its triangle's
 * corners. */
static double height_of(const struct spl_relief *relief, int x, int y, double rise[2])
{
    const int squares = 1 << relief->level;
    const double q[2] = {(x + 0.5) * squares / side, (y + 0.5) * squares / side};
    const int i = (int)q[0], j = (int)q[1];
    const double f[2] = {q[0] - i, q[1] - j}, least = fmin(f[0], f[1]), more = fabs(f[0] - f[1]);
    const bool low = f[0] >= f[1];
    const double h00 = (double)relief->height[(squares + 1) * j + i];
    const double h11 = (double)relief->height[(squares + 1) * (j + 1) + i + 1];
    const double h = (double)relief->height[(squares + 1) * (j + !low) + i + low];
    rise[!low] = (h - h00) * squares / side;
    rise[low] = (h11 - h) * squares / side;
    return (1 - least - more) * h00 + more * h + least * h11;
}

/* The discs that the cells of the dataset's panels stand for; the caller's. */
static struct make_splat *make_discs(const struct spl_dataset *dataset, size_t *count)
{
    uint64_t chunk_count, node_count;
    size_t bytes;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &node_count);
    const uint32_t *page = spl_dataset_get_page(dataset, node->page, &bytes);
    struct make_splat *discs = calloc(chunk_count * SPL_PANELS_MAX * side * side, sizeof *discs);
    assert_non_null(discs);
    *count = 0;
    for (uint64_t c = 0; c < chunk_count; c++) {
        struct spl_panel_frame plane;
        spl_panels_get_frame(&chunks[c], &plane);
        for (uint32_t i = 0; i < chunks[c].count; i++) {
            struct spl_panel panel;
            struct spl_relief relief;
            spl_panels_decode(&chunks[c], page, i, &panel);
            spl_panels_get_relief(&chunks[c], page, i, &relief);
            for (int y = 0; y < side; y++)
                for (int x = 0; x < side; x++) {
                    struct make_splat *disc = &discs[*count];
                    double cell = (double)plane.cell, rise[2], height = height_of(&relief, x, y, rise);
                    double u = cell * (side * panel.column + x + 0.5), v = cell * (side * panel.row + y + 0.5);
                    double length = sqrt(1 + (rise[0] * rise[0] + rise[1] * rise[1]) / cell / cell);
                    if (!(panel.cells[y] >> x & 1))
                        continue;
                    for (int a = 0; a < 3; a++) {
                        double n = (double)plane.normal[a], along[2] = {(double)plane.u[a], (double)plane.v[a]};
                        disc->position[a] = node->origin[a] + (double)plane.origin[a] + u * along[0] + v * along[1] +
                                            height * n;
                        disc->normal[a] = (float)((n - rise[0] / cell * along[0] - rise[1] / cell * along[1]) / length);
                    }
                    disc->radius = SPL_RADIUS_SPACING * plane.cell;
                    memcpy(disc->color, panel.color[y][x], 3);
                    ++*count;
                }
        }
    }
    return discs;
}

/* What `primitives=off` draws is what a dataset of discs in the cells' places does, to what their coding rounds. */
static void cells_are_discs_on_the_surface(void **state)
{
    const struct kind *kind = *state;
    size_t count;
    struct spl_dataset *dataset = random_panels(3, 0, origin, 0.02, kind->relief[0]);
    struct make_splat *discs = make_discs(dataset, &count);
    struct spl_dataset *other = make_dataset(discs, count);
    free(discs);
    assert_int_equal(spl_renderer_add(renderer, other, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking(origin, 3, 240, 180);
        view.method = method;
        view.lod = 0;
        view.shapes = SPL_SHAPES_OFF;
        struct spl_frame a = render(dataset, &view), b = render(other, &view);
        struct tally t = compare(&a, &b);
        size_t covered = 0, apart = 0, turned = 0;
        const float *da = a.images[SPL_LAYER_DEPTH].pixels, *db = b.images[SPL_LAYER_DEPTH].pixels;
        const float *na = a.images[SPL_LAYER_NORMAL].pixels, *nb = b.images[SPL_LAYER_NORMAL].pixels;
        for (size_t i = 0; i < t.pixels; i++) {
            bool both = !isnan(da[i]) && !isnan(db[i]);
            covered += !isnan(da[i]);
            apart += both && fabsf(da[i] - db[i]) > 0.005f;
            turned += both && na &&
                      na[3 * i] * nb[3 * i] + na[3 * i + 1] * nb[3 * i + 1] + na[3 * i + 2] * nb[3 * i + 2] < 0.99f;
        }
        assert_true(covered > t.pixels / 20);
        if (t.covered_differs > covered / 15 || apart > covered / 30 || turned > covered / 15)
            fail_msg("%s: of %zu pixels %zu differ in coverage, %zu in depth, %zu in normal",
                     spl_method_name(view.method), covered, t.covered_differs, apart, turned);
        spl_frame_finish(&a);
        spl_frame_finish(&b);
    }
    done(dataset);
    done(other);
}

/* One plane of `count` panels around the origin, flat, as panels or as meshes of `level`. */
static struct spl_dataset *make_flat(struct spl_panel *panels, size_t count, int level)
{
    struct spl_relief *reliefs = calloc(count, sizeof *reliefs);
    struct make_panels made = {
        .plane = {.origin = {-1, 0.1, -1}, .normal = {0.1f, -0.99f, 0.0995f}, .cell = 0.02f, .points = 10},
        .panels = panels,
        .reliefs = level < 0 ? NULL : reliefs,
        .count = count,
        .color_error = 4,
        .classification = 6};
    assert_non_null(reliefs);
    for (size_t i = 0; i < count; i++)
        reliefs[i].level = level < 0 ? 0 : (unsigned)level;
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, &made, 1, 1);
    free(reliefs);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

/* A mesh without heights is drawn as the panel that it is, to the byte, but for what it says to be; a pick on it names
 * it, and no plane. */
static void flat_meshes_are_panels(void **state)
{
    (void)state;
    enum { count = 30 };
    struct spl_panel panels[count];
    for (unsigned i = 0; i < count; i++)
        random_panel(&panels[i], i % 6, i / 6);
    struct spl_dataset *plain = make_flat(panels, count, -1);
    for (int level = 0; level <= SPL_RELIEF_LEVEL_MAX; level++) {
        struct spl_dataset *mesh = make_flat(panels, count, level);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_view view = looking(origin, 2.5, 200, 150);
            view.method = method;
            view.shapes = SPL_SHAPES_OFF;
            struct spl_frame a = render(plain, &view), b = render(mesh, &view);
            const uint32_t *shape[2] = {a.images[SPL_LAYER_PRIMITIVE].pixels, b.images[SPL_LAYER_PRIMITIVE].pixels};
            size_t shown = 0, at = 0;
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
                const struct spl_image *x = &a.images[layer], *y = &b.images[layer];
                if (layer != SPL_LAYER_PRIMITIVE && x->pixels &&
                    memcmp(x->pixels, y->pixels, (size_t)200 * 150 * spl_pixel_bytes(x->type)))
                    fail_msg("%s, level %d: layer %s differs", spl_method_name(view.method), level,
                             spl_layer_name((enum spl_layer)layer));
            }
            for (size_t i = 0; i < 200 * 150; i++) {
                assert_true(shape[0][i] == SPL_SHAPE_PANEL ? shape[1][i] == SPL_SHAPE_MESH
                                                           : shape[0][i] == SPL_SHAPE_NONE && shape[1][i] == 0);
                shown += shape[1][i] == SPL_SHAPE_MESH;
                at = shape[1][i] == SPL_SHAPE_MESH && i % 200 > 100 ? i : at;
            }
            assert_true(shown > 1000 && at);
            struct spl_pick pick;
            const struct spl_pick_plane none = {0};
            assert_int_equal(spl_renderer_pick(renderer, mesh, &view, (double)(at % 200) + 0.5,
                                               (double)(at / 200) + 0.5, &pick, NULL), SPL_OK);
            assert_true(pick.hit && pick.primitive == SPL_SHAPE_MESH);
            assert_int_equal(pick.splat, ((const uint32_t *)b.images[SPL_LAYER_ID].pixels)[at]);
            assert_int_equal(pick.classification, 6);
            assert_memory_equal(&pick.plane, &none, sizeof none);
            spl_frame_finish(&a);
            spl_frame_finish(&b);
        }
        done(mesh);
    }
    done(plain);
}

/* Words at random in place of panels' own: what is read is held within the chunk, and drawn as C reads it. */
static void forged_words_match(void **state)
{
    const struct kind *kind = *state;
    char folder[256], path[300];
    struct spl_panel panels[SPL_PANELS_MAX] = {0};
    struct spl_relief reliefs[SPL_PANELS_MAX];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/forged.spld", folder);
    for (int seed = 0; seed < 8; seed++) {
        for (int i = 0; i < SPL_PANELS_MAX; i++) {
            random_panel(&panels[i], (unsigned)i % 6, (unsigned)i / 6);
            random_relief(&reliefs[i], (unsigned)seed % (SPL_RELIEF_LEVEL_MAX + 1), 0.03);
        }
        struct make_panels made[2] = {{.plane = {.cell = 0.01f, .normal = {0.6f, -0.8f, 0}, .points = 1},
                                       .panels = panels,
                                       .reliefs = kind->relief[0] > 0 ? reliefs : NULL,
                                       .count = SPL_PANELS_MAX,
                                       .color_error = 2}};
        made[1] = made[0];
        made[1].plane.normal[2] = 1;
        made[1].plane.normal[0] = made[1].plane.normal[1] = 0;
        make_dataset_file_panels(path, NULL, 0, made, 2, 1);
        struct spoil file = spoil_load(path);
        struct spl_dataset *dataset;
        uint64_t chunk_count;
        assert_int_equal(spl_dataset_open(path, false, &dataset, NULL), SPL_OK);
        const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
        assert_int_equal(chunk_count, 2);
        uint32_t *page = spoil_at(&file, SPL_SECTION_PAGE), first = chunks[0].geometry_word;
        for (uint32_t w = 0; w < chunks[0].color_bits + chunks[1].color_bits; w++)
            if (seed % 2 == 0 || uniform() < 0.1) {
                page[first + w] = (uint32_t)(uniform() * 65536) | (uint32_t)(uniform() * 65536) << 16;
                if (seed % 4 == 0 && w % 2 == 0 && w < 2 * SPL_PANELS_MAX)
                    page[first + w] &= 0xffff0303; /* within the grid */
            }
        spl_dataset_close(dataset);
        spoil_store(&file, path, true);
        free(file.bytes);
        assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, 1.5, 160, 120);
        same_of_all(dataset, &view, "forged");
        look(&view, (double[]){0.3, 0.3, 0.1}, (double[]){0, 0.1, 0});
        same_of(dataset, &view, SPL_METHOD_SPLAT, "forged, near by");
        done(dataset);
    }
    unlink(path);
    rmdir(folder);
}

/* A pixel is the same in whatever tile it lies, to the bit; of splat only what has no sums (test_tiles.c). */
static void tiles_leave_no_seams(void **state)
{
    const struct kind *kind = *state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    keep_kernels(small);
    for (uint64_t seed = 1; seed <= TEST_SIZE(2, 1); seed++) {
        random_state = seed;
        struct spl_dataset *dataset = random_panels(seed % 2 ? 30 : 4, 500, origin, seed % 2 ? 0.004 : 0.03,
                                                    kind->relief[0]);
        assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
        for (int setting = 0; setting < 2 * SPL_METHOD_COUNT; setting++) {
            struct spl_view view = looking(origin, seed % 3 ? 3 : 0.7, 203, 151);
            struct spl_frame cut, whole;
            view.method = setting / 2;
            view.shapes = setting % 2 ? SPL_SHAPES_ALL : SPL_SHAPES_OFF;
            view.supersample = 1 + (double)(seed % 2);
            view.fill.kernel = 8.0 / view.supersample;
            whole = render(dataset, &view);
            assert_int_equal(spl_renderer_render(small, dataset, &view, &cut, NULL), SPL_OK);
            assert_true(cut.stats.tiles > 1 && whole.stats.tiles == 1);
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
                const struct spl_image *a = &whole.images[layer], *b = &cut.images[layer];
                bool summed = view.method == SPL_METHOD_SPLAT && layer != SPL_LAYER_COVERAGE && layer != SPL_LAYER_ID;
                if (!summed && memcmp(a->pixels, b->pixels, (size_t)203 * 151 * spl_pixel_bytes(a->type)))
                    fail_msg("%s, primitives %s, seed %d: layer %s differs", spl_method_name(view.method),
                             spl_shapes_name(view.shapes), (int)seed, spl_layer_name((enum spl_layer)layer));
            }
            spl_frame_finish(&whole);
            spl_frame_finish(&cut);
        }
        spl_renderer_remove(small, dataset);
        done(dataset);
    }
    spl_renderer_destroy(small);
}

#define OF_KIND(test, kind) {#test ", " #kind, test, frames_seed, NULL, &kinds[kind]}
#define OF_BOTH(test) OF_KIND(test, PANELS), OF_KIND(test, MESHES)

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        OF_BOTH(match_from_every_side),
        OF_BOTH(around_the_eye_they_match),
        OF_BOTH(cells_are_discs_on_the_surface),
        OF_BOTH(forged_words_match),
        OF_BOTH(tiles_leave_no_seams),
        frames_test(what_stands_out_is_found),
        frames_test(flat_meshes_are_panels),
    };
    return frames_run(argc, argv, "panel-kinds", tests, sizeof tests / sizeof *tests);
}
