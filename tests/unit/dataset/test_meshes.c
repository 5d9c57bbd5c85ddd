/* Chunks of meshes: heights come back to half a step, beside cells and colours as of panels; the surface is that of the
 * lattice's triangles; what no chunk of meshes has is refused or read within its words. */
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

#include "dataset/codec.h"
#include "dataset/dataset.h"
#include "dataset/panels.h"
#include "support/make_dataset.h"
#include "support/spoil.h"

enum { side = SPL_PANEL_SIDE, levels = SPL_RELIEF_LEVEL_MAX + 1, most = SPL_PANELS_MAX };

static uint64_t random_state = 1;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

struct made {
    struct spl_panel panels[most];
    struct spl_relief reliefs[most];
    struct spl_chunk chunk;
    uint32_t words[SPL_MESH_CHUNK_WORDS_MAX], used;
};

static const struct spl_panel_plane slope = {.origin = {3, -2, 0.5},
                                             .normal = {0.6f, 0, -0.8f},
                                             .cell = 0.02f,
                                             .error_mean = 0.001f,
                                             .error_most = 0.004f,
                                             .points = 700};

/* Heights up to `height` either way. */
static void make_relief(struct spl_relief *relief, unsigned level, double height)
{
    *relief = (struct spl_relief){.level = level};
    for (int i = 0; i < SPL_RELIEF_POINTS(level); i++)
        relief->height[i] = (float)(height * (2 * uniform() - 1));
}

/* Cells at random, each there with a chance of `share`. */
static void make(struct made *m, uint32_t count, unsigned level, double height, double share)
{
    *m = (struct made){.used = 0};
    for (uint32_t i = 0; i < count; i++) {
        struct spl_panel *panel = &m->panels[i];
        panel->column = (uint8_t)(i * 5);
        panel->row = (uint8_t)(i * 3 % 7);
        make_relief(&m->reliefs[i], level, height);
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++) {
                if (share >= 1 || uniform() < share || (x == 3 && y == 9))
                    panel->cells[y] |= (uint16_t)(1u << x);
                for (int c = 0; c < 3; c++)
                    panel->color[y][x][c] = (uint8_t)(90 + 20 * c + 2 * x + y);
            }
    }
    spl_panels_begin(&slope, &m->chunk);
    m->used = spl_meshes_encode(m->panels, m->reliefs, count, spl_relief_choose_step(slope.cell, (float)height), 3,
                                &m->chunk, m->words);
}

static const struct spl_chunk_codec *meshes(void)
{
    return spl_chunk_get_codec(SPL_CHUNK_MESHES);
}

/* As a panel that is flat, but for heights, which are off by half a step at most. */
static void heights_come_back(void **state)
{
    (void)state;
    static struct made m;
    static uint32_t flat[SPL_PANEL_CHUNK_WORDS_MAX];
    for (unsigned level = 0; level < levels; level++)
        for (double height = 1e-7; height < 3; height *= 4.3) {
            const uint32_t heights = ((1u << level) + 1) * ((1u << level) + 1), words = (heights + 3) / 4;
            struct spl_chunk panels;
            make(&m, most, level, height, 0.7);
            spl_panels_begin(&slope, &panels);
            assert_int_equal(m.used, spl_panels_encode(m.panels, most, 3, &panels, flat) + most * words);
            assert_null(meshes()->judge(&m.chunk));
            assert_string_equal(meshes()->name, "meshes");
            assert_int_equal(spl_chunk_kind(&m.chunk), SPL_CHUNK_MESHES);
            assert_int_equal(spl_chunk_words(&m.chunk), m.used);
            assert_int_equal(spl_panels_get_points(&m.chunk), slope.points);
            assert_int_equal(spl_panels_get_level(&m.chunk), level);
            const float worth = spl_panels_get_worth(&m.chunk);
            assert_true(spl_panels_get_reach(&m.chunk) == 128 * worth && worth > 0);
            for (uint32_t i = 0; i < most; i++) {
                struct spl_panel out, plain;
                struct spl_relief relief;
                spl_panels_decode(&m.chunk, m.words, i, &out);
                spl_panels_decode(&panels, flat, i, &plain);
                assert_memory_equal(&out, &plain, sizeof out);
                spl_panels_get_relief(&m.chunk, m.words, i, &relief);
                assert_int_equal(relief.level, level);
                for (uint32_t k = 0; k < heights; k++)
                    assert_true(fabsf(relief.height[k] - m.reliefs[i].height[k]) <= 0.501f * worth);
                spl_panels_get_relief(&panels, flat, i, &relief);
                assert_true(relief.level == 0 && relief.height[0] == 0 && relief.height[3] == 0);
            }
            assert_true(spl_panels_get_reach(&panels) == 0 && spl_panels_get_level(&panels) == 0);
        }
}

/* The bytes as api/format.md has them. */
static void heights_are_bytes(void **state)
{
    (void)state;
    struct spl_panel panel = {.column = 2, .row = 7};
    struct spl_relief relief = {.level = 1};
    struct spl_chunk chunk;
    uint32_t words[SPL_MESH_CHUNK_WORDS_MAX];
    memset(words, 0xff, sizeof words);
    for (int y = 0; y < side; y++)
        panel.cells[y] = 0xffff;
    for (int i = 0; i < 9; i++)
        relief.height[i] = (float)(i - 4) * slope.cell / 8; /* of a step of 2^(-6 / 2) cells */
    relief.height[0] = -1e9f;
    relief.height[8] = 1e9f;
    spl_panels_begin(&slope, &chunk);
    assert_int_equal(spl_meshes_encode(&panel, &relief, 1, 6, 0, &chunk, words), 2 + 3 + 1);
    assert_int_equal(chunk.extra_bits, 3u << 24 | 1u << 16 | 6u << 8);
    assert_int_equal(words[0], 2 | 7u << 8 | 0xffff0000);
    assert_int_equal(words[1], 2 | 3u << 13 | 0xffff0000);
    assert_int_equal(words[2], 1 | 125u << 8 | 126u << 16 | 127u << 24);
    assert_int_equal(words[3], 128 | 129u << 8 | 130u << 16 | 131u << 24);
    assert_int_equal(words[4], 255);
    uint64_t bits[SPL_ATTRIBUTE_COUNT] = {0};
    spl_chunk_add_bits(&chunk, bits);
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        assert_int_equal(bits[a], a == SPL_ATTRIBUTE_MESHES ? 32 * 6 + 8 * 60 : 0);
}

static void the_finest_step_is_chosen(void **state)
{
    (void)state;
    for (int i = 0; i < 2000; i++) {
        float cell = (float)pow(10, 6 * uniform() - 4), height = cell * (float)pow(10, 6 * uniform() - 4);
        unsigned step = spl_relief_choose_step(cell, height);
        assert_true(step <= 24);
        assert_true(fabs(spl_relief_worth(cell, step) / (cell * pow(2, -0.5 * step)) - 1) < 1e-6);
        assert_true(step == 0 || 127.001 * (double)spl_relief_worth(cell, step) >= (double)height);
        assert_true(step == 24 || 126.999 * (double)spl_relief_worth(cell, step + 1) < (double)height);
    }
    assert_int_equal(spl_relief_choose_step(0.01f, 0), 24);
    assert_int_equal(spl_relief_choose_step(0.01f, INFINITY), 0);
}

/* The height over (x, y) of the plane through three points of the lattice, in doubles. */
static double height_of(const struct spl_relief *relief, const int point[3][2], double x, double y, double rise[2])
{
    const int wide = (1 << relief->level) + 1;
    double spacing = 16.0 / (1 << relief->level), p[3][3], a[3], b[3];
    for (int i = 0; i < 3; i++) {
        p[i][0] = spacing * point[i][0];
        p[i][1] = spacing * point[i][1];
        p[i][2] = (double)relief->height[wide * point[i][1] + point[i][0]];
    }
    for (int c = 0; c < 3; c++) {
        a[c] = p[1][c] - p[0][c];
        b[c] = p[2][c] - p[0][c];
    }
    double across = a[0] * b[1] - a[1] * b[0];
    rise[0] = (a[2] * b[1] - b[2] * a[1]) / across;
    rise[1] = (b[2] * a[0] - a[2] * b[0]) / across;
    return p[0][2] + rise[0] * (x - p[0][0]) + rise[1] * (y - p[0][1]);
}

static void the_surface_is_of_triangles(void **state)
{
    (void)state;
    for (unsigned level = 0; level < levels; level++)
        for (int round = 0; round < 500; round++) {
            struct spl_relief relief;
            float rise[2];
            make_relief(&relief, level, 1);
            const int squares = 1 << level, i = (int)(uniform() * squares), j = (int)(uniform() * squares);
            double spacing = 16.0 / squares, within[2] = {uniform(), uniform()}, wanted[2];
            bool low = within[0] > within[1];
            if (fabs(within[0] - within[1]) < 1e-3 || fmax(within[0], within[1]) > 0.999)
                continue;
            const int corners[3][2] = {{i, j}, {i + 1, j + 1}, {i + low, j + !low}};
            double x = spacing * (i + within[0]), y = spacing * (j + within[1]);
            double height = height_of(&relief, corners, x, y, wanted);
            assert_float_equal(spl_relief_height(&relief, (float)x, (float)y, rise), height, 1e-5);
            for (int a = 0; a < 2; a++)
                assert_float_equal(rise[a], wanted[a], 1e-5);
            /* at a point of the lattice it is the height there, also on the far edges */
            int to[2] = {i + round % 2, j + round / 2 % 2};
            assert_float_equal(spl_relief_height(&relief, (float)(spacing * to[0]), (float)(spacing * to[1]), NULL),
                               relief.height[(squares + 1) * to[1] + to[0]], 1e-6);
        }
}

/* Where the two parts of a square meet, and where squares do, either side's height is the same. */
static void the_surface_is_closed(void **state)
{
    (void)state;
    for (int round = 0; round < 400; round++) {
        struct spl_relief relief;
        make_relief(&relief, 1 + (unsigned)round % SPL_RELIEF_LEVEL_MAX, 1);
        const float spacing = 16.0f / (float)(1 << relief.level), off = 1e-4f;
        float along = spacing * (float)uniform();
        const float at[3][2] = {{along, along}, {spacing, along}, {along, spacing}};
        const float away[3][2] = {{off, -off}, {off, 0}, {0, off}};
        for (int k = 0; k < 3; k++)
            assert_float_equal(spl_relief_height(&relief, at[k][0] - away[k][0], at[k][1] - away[k][1], NULL),
                               spl_relief_height(&relief, at[k][0] + away[k][0], at[k][1] + away[k][1], NULL), 1e-3);
    }
}

static void places_lie_on_the_surface(void **state)
{
    (void)state;
    static struct made m;
    make(&m, 9, 2, 0.1, 1);
    struct spl_panel_frame frame;
    spl_panels_get_frame(&m.chunk, &frame);
    for (int round = 0; round < 300; round++) {
        uint32_t i = (uint32_t)(9 * uniform());
        float x = (float)(16 * uniform()), y = (float)(16 * uniform()), position[3], normal[3], rise[2];
        struct spl_relief relief;
        spl_panels_get_relief(&m.chunk, m.words, i, &relief);
        spl_panels_place(&frame, &m.panels[i], &relief, x, y, position, normal);
        double height = (double)spl_relief_height(&relief, x, y, rise), off[3], length = 0, along[3] = {0},
               tilt[3] = {0};
        for (int c = 0; c < 3; c++) {
            off[c] = (double)position[c] - slope.origin[c];
            along[0] += off[c] * (double)frame.u[c];
            along[1] += off[c] * (double)frame.v[c];
            along[2] += off[c] * (double)frame.normal[c];
            tilt[0] += (double)normal[c] * (double)(0.02f * frame.u[c] + rise[0] * frame.normal[c]);
            tilt[1] += (double)normal[c] * (double)(0.02f * frame.v[c] + rise[1] * frame.normal[c]);
            tilt[2] += (double)normal[c] * (double)frame.normal[c];
            length += (double)normal[c] * (double)normal[c];
        }
        assert_float_equal(along[0], 0.02 * (16 * m.panels[i].column + (double)x), 1e-5);
        assert_float_equal(along[1], 0.02 * (16 * m.panels[i].row + (double)y), 1e-5);
        assert_float_equal(along[2], height, 1e-5);
        assert_float_equal(tilt[0], 0, 1e-6); /* square on what runs along the surface */
        assert_float_equal(tilt[1], 0, 1e-6);
        assert_float_equal(length, 1, 1e-6);
        assert_true(tilt[2] > 0);
    }
}

static void a_mesh_is_a_disc_from_afar(void **state)
{
    (void)state;
    static struct made m;
    struct spl_splat s;
    struct spl_relief relief;
    make(&m, 3, 3, 0.3, 1);
    spl_chunk_decode(&m.chunk, m.words, 2, &s);
    spl_panels_get_relief(&m.chunk, m.words, 2, &relief);
    double off = 0;
    for (int c = 0; c < 3; c++)
        off += ((double)s.position[c] - slope.origin[c]) * (double)slope.normal[c];
    assert_float_equal(off, relief.height[9 * 4 + 4], 1e-6);
    assert_true(fabs(s.radius - 16 * 0.02 * SPL_RADIUS_SPACING) < 1e-6);
}

#define FORGE(name, change)                                                                                            \
    static void name(struct spl_chunk *c)                                                                              \
    {                                                                                                                  \
        change;                                                                                                        \
    }
FORGE(too_many, c->count = SPL_PANELS_MAX + 1)
FORGE(no_words, c->color_bits = (2 + 7) * c->count - 1)
FORGE(too_many_words, c->color_bits = SPL_PANELS_MAX * (42 + 7) + 1)
FORGE(too_few_of_finer, c->extra_bits |= 3u << 16; c->color_bits = (2 + 21) * c->count - 1)
FORGE(step, c->extra_bits = (c->extra_bits & ~(255u << 8)) | 25u << 8)
FORGE(no_step, c->extra_bits |= 255u << 8)
FORGE(extra, c->extra_bits |= 1u << 18)
FORGE(no_worth, c->step = 1e-44f; c->extra_bits |= 24u << 8)
FORGE(of_a_panel, c->extra_bits = (c->extra_bits & 0xffffff) | (uint32_t)SPL_CHUNK_PANELS << 24)
FORGE(unknown, c->extra_bits = (c->extra_bits & 0xffffff) | (uint32_t)SPL_CHUNK_KINDS << 24)
FORGE(beyond_floats, c->origin[2] = 3.4e38f; c->step = 1e37f)
FORGE(heights_beyond_floats, c->step = 1e35f; c->extra_bits &= ~(255u << 8); c->origin[0] = 3e38f)

static void forged_headers_are_refused(void **state)
{
    (void)state;
    static void (*const forgeries[])(struct spl_chunk *) = {
        too_many, no_words, too_many_words, too_few_of_finer, step,          no_step,
        extra,    no_worth, of_a_panel,     unknown,          beyond_floats, heights_beyond_floats};
    static struct made m;
    make(&m, 4, 2, 0.1, 0.5);
    for (size_t f = 0; f < sizeof forgeries / sizeof *forgeries; f++) {
        struct spl_chunk forged = m.chunk;
        forgeries[f](&forged);
        const struct spl_chunk_codec *codec = spl_chunk_get_codec(spl_chunk_kind(&forged));
        if (codec && !codec->judge(&forged))
            fail_msg("forgery %zu is taken", f);
    }
    struct spl_chunk flat = m.chunk; /* what a mesh may have and a panel not */
    flat.extra_bits = (uint32_t)SPL_CHUNK_PANELS << 24;
    assert_null(spl_chunk_get_codec(SPL_CHUNK_PANELS)->judge(&flat));
    flat.extra_bits |= 1u << SPL_EXTRA_STEP;
    assert_non_null(spl_chunk_get_codec(SPL_CHUNK_PANELS)->judge(&flat));
}

/* Words at random behind a good header: whatever they say is read within them (ASan looks). */
static void forged_words_are_read_within_the_chunk(void **state)
{
    (void)state;
    static struct made m;
    for (unsigned level = 0; level < levels; level++)
        for (int round = 0; round < 100; round++) {
            make(&m, SPL_PANELS_MAX, level, 0.1 + uniform(), 0.5);
            const uint32_t least = SPL_PANELS_MAX * (2 + (uint32_t)SPL_RELIEF_WORDS(level));
            m.chunk.color_bits = least + (uint32_t)(uniform() * (SPL_PANELS_MAX * SPL_MESH_WORDS_MAX - least));
            uint32_t *words = malloc(m.chunk.color_bits * sizeof *words);
            assert_non_null(words);
            for (uint32_t i = 0; i < m.chunk.color_bits; i++)
                words[i] = (uint32_t)(uniform() * 65536) | (uint32_t)(uniform() * 65536) << 16;
            for (uint32_t i = 0; i < m.chunk.count; i++) {
                struct spl_splat s;
                struct spl_relief relief;
                spl_chunk_decode(&m.chunk, words, i, &s);
                assert_true(isfinite(s.position[0] + s.position[1] + s.position[2] + s.radius) && s.radius > 0);
                assert_float_equal(s.normal[0] * s.normal[0] + s.normal[1] * s.normal[1] + s.normal[2] * s.normal[2], 1,
                                   1e-5);
                spl_panels_get_relief(&m.chunk, words, i, &relief);
                for (int k = 0; k < SPL_RELIEF_POINTS(level); k++)
                    assert_true(fabsf(relief.height[k]) <= spl_panels_get_reach(&m.chunk));
            }
            free(words);
        }
}

/* What META says of meshes is held against the rest of it, and against what there is. */
static void counts_are_judged(void **state)
{
    (void)state;
    static const struct {
        const char *text, *with, *message;
    } forgeries[] = {
        {"\"mesh_points\": 25", "\"mesh_points\": 25", NULL},
        {"\"mesh_points\": 25", "\"mesh_points\": 36", "\"counts.mesh_points\" is 36"},
        {"\"mesh_points\": 25", "\"mesh_points\": 24", "\"counts.splats\" is 3"},
        {"\"mesh_points\": 25", "\"mesh_points\": -1", "\"counts\" is an object, and must be"},
        {"\"meshes\": 4", "\"meshes\": 5", "\"counts\" is not what the nodes and chunks hold"},
        {"\"meshes\": 4", "\"meshes\": 9", "\"counts\" has more splats, pieces, panels or meshes than PDIR"},
        {"\"meshes\": 4,", "\"mosses\": 4,", "\"counts\" is not what the nodes and chunks hold"},
    };
    char folder[256], path[300];
    struct make_splat splats[3] = {0};
    struct spl_panel panel[4] = {{.cells = {1}}, {.cells = {1}}, {.cells = {1}}, {.cells = {1}}};
    struct spl_relief reliefs[4] = {0};
    const struct spl_panel_plane plane = {.normal = {0, 0, 1}, .cell = 0.1f, .points = 25};
    struct make_panels made = {.plane = plane, .panels = panel, .reliefs = reliefs, .count = 4};
    for (int i = 0; i < 3; i++)
        splats[i] = (struct make_splat){.position = {i, 0, 0}, .normal = {0, 0, 1}, .radius = 0.5f};
    make_folder(folder);
    snprintf(path, sizeof path, "%s/counts.spld", folder);
    for (size_t f = 0; f < sizeof forgeries / sizeof *forgeries; f++) {
        make_dataset_file_panels(path, splats, 3, &made, 1, 1);
        struct spoil file = spoil_load(path);
        struct spl_dataset *dataset;
        struct spl_error err = {0};
        char *meta = spoil_at(&file, SPL_SECTION_META), *at = strstr(meta, forgeries[f].text);
        assert_non_null(at);
        memcpy(at, forgeries[f].with, strlen(forgeries[f].with));
        spoil_store(&file, path, true);
        free(file.bytes);
        int rc = spl_dataset_open(path, true, &dataset, &err);
        if (!rc != !forgeries[f].message || (rc && !strstr(err.message, forgeries[f].message)))
            fail_msg("%s: %d, %s", forgeries[f].with, rc, err.message);
        if (!rc)
            spl_dataset_close(dataset);
    }
    unlink(path);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(heights_come_back),
        cmocka_unit_test(heights_are_bytes),
        cmocka_unit_test(the_finest_step_is_chosen),
        cmocka_unit_test(the_surface_is_of_triangles),
        cmocka_unit_test(the_surface_is_closed),
        cmocka_unit_test(places_lie_on_the_surface),
        cmocka_unit_test(a_mesh_is_a_disc_from_afar),
        cmocka_unit_test(forged_headers_are_refused),
        cmocka_unit_test(forged_words_are_read_within_the_chunk),
        cmocka_unit_test(counts_are_judged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
