/* What tests of panels and meshes draw and compare; see panel_scenes.h. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>

#include "gpu/panel_scenes.h"
#include "gpu/frames.h"

enum { side = SPL_PANEL_SIDE };

void random_unit(float n[3])
{
    double v[3], length = 0;
    for (int c = 0; c < 3; c++) {
        v[c] = uniform() - 0.5;
        length += v[c] * v[c];
    }
    for (int c = 0; c < 3; c++)
        n[c] = (float)(v[c] / sqrt(length));
}

void random_panel(struct spl_panel *panel, unsigned column, unsigned row)
{
    *panel = (struct spl_panel){.column = (uint8_t)column, .row = (uint8_t)row};
    double full = uniform(), empty = uniform() * (1 - full), noise = uniform() < 0.3 ? 0 : 200 * uniform() * uniform();
    double base[3], slope[3][2];
    for (int c = 0; c < 3; c++) {
        base[c] = 30 + 150 * uniform();
        for (int a = 0; a < 2; a++)
            slope[c][a] = uniform() < 0.3 ? 0 : 8 * uniform() - 4;
    }
    for (int block = 0; block < 16; block++) {
        double kind = uniform();
        for (int k = 0; k < 16; k++) {
            int x = block % 4 * 4 + k % 4, y = block / 4 * 4 + k / 4;
            bool there = kind < full || (kind >= full + empty && uniform() < 0.7);
            panel->cells[y] |= (uint16_t)(there << x);
        }
    }
    panel->cells[5] |= 1 << 9;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++)
            for (int c = 0; c < 3; c++)
                panel->color[y][x][c] = (uint8_t)fmin(
                    fmax(base[c] + x * slope[c][0] + y * slope[c][1] + noise * (uniform() - 0.5), 0), 255);
}

void random_relief(struct spl_relief *relief, unsigned level, double most)
{
    const int points = 1 << level;
    double tilt[2] = {uniform() - 0.5, uniform() - 0.5}, rough = uniform() * uniform();
    *relief = (struct spl_relief){.level = level};
    for (int j = 0; j <= points; j++)
        for (int i = 0; i <= points; i++) {
            double at = tilt[0] * i / points + tilt[1] * j / points;
            relief->height[(points + 1) * j + i] =
                (float)(most * ((1 - rough) * at + rough * (2 * uniform() - 1)));
        }
}

struct spl_dataset *random_panels(size_t planes, size_t splats, const double center[3], double cell, double relief)
{
    enum { most = 40, across = 7 };
    struct make_panels *made = calloc(planes, sizeof *made);
    struct spl_panel *panels = calloc(planes * most, sizeof *panels);
    struct spl_relief *reliefs = relief > 0 ? calloc(planes * most, sizeof *reliefs) : NULL;
    struct make_splat *discs = random_splats(splats + 1, center, cell);
    assert_true(made && panels && discs && (reliefs || !(relief > 0)));
    for (size_t i = 0; i < planes; i++) {
        struct spl_panel_plane *plane = &made[i].plane;
        made[i].panels = panels + i * most;
        made[i].classes_vary = true;
        made[i].color_error = uniform() < 0.5 ? 3 : 12;
        plane->cell = (float)(cell * pow(4, uniform() - 0.5));
        plane->points = 100;
        random_unit(plane->normal);
        for (int c = 0; c < 3; c++)
            plane->origin[c] = center[c] + 2 * uniform() - 1;
        for (unsigned place = 0; place < across * across && made[i].count < most; place++)
            if (uniform() < 0.5)
                random_panel(&panels[i * most + made[i].count++], place % across, place / across);
        made[i].count += made[i].count == 0;
        made[i].reliefs = reliefs ? reliefs + i * most : NULL;
        for (size_t p = 0; reliefs && p < made[i].count; p++)
            random_relief(&reliefs[i * most + p], (unsigned)i % (SPL_RELIEF_LEVEL_MAX + 1),
                          relief * (double)plane->cell);
    }
    struct spl_dataset *dataset = make_dataset_panels(discs, splats, made, planes, 1);
    free(made);
    free(panels);
    free(reliefs);
    free(discs);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

void same_of(const struct spl_dataset *dataset, const struct spl_view *from, enum spl_method method,
             const char *what)
{
    for (int shapes = SPL_SHAPES_OFF; shapes < SPL_SHAPES_COUNT; shapes += SPL_SHAPES_ALL) {
        struct spl_view view = *from;
        char text[128];
        view.method = method;
        view.shapes = (enum spl_shapes)shapes;
        snprintf(text, sizeof text, "%s, %s, primitives %s", what, spl_method_name(method),
                 spl_shapes_name((enum spl_shapes)shapes));
        if (!shapes || spl_method_get_params(method) & SPL_PARAM_BIT(primitives))
            same_images(dataset, &view, text);
    }
}

void same_of_all(const struct spl_dataset *dataset, const struct spl_view *from, const char *what)
{
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        if (method != SPL_METHOD_FILL || from->camera.width < 200)
            same_of(dataset, from, (enum spl_method)method, what);
}

struct spl_frame render(const struct spl_dataset *dataset, const struct spl_view *view)
{
    struct spl_frame frame;
    struct spl_error err = {0};
    if (spl_renderer_render(renderer, dataset, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

void look(struct spl_view *view, const double eye[3], const double target[3])
{
    const double up[3] = {0.03, 0.02, 1};
    assert_int_equal(spl_camera_look_at(&view->camera, eye, target, up, NULL), SPL_OK);
}
