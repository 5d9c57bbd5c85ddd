/* Sheets of panels with relief; see make_sheet.h. */
#include "support/make_sheet.h"

#include <math.h>
#include <string.h>

enum { side = SPL_PANEL_SIDE };

void make_sheet_begin(struct make_sheet *sheet, const float normal[3], const double center[3], unsigned across,
                      double cell, unsigned level)
{
    struct spl_panel_frame frame;
    struct spl_chunk chunk;
    *sheet = (struct make_sheet){.made = {.plane = {.cell = (float)cell, .points = 100}, .color_error = 3}};
    memcpy(sheet->made.plane.normal, normal, sizeof sheet->made.plane.normal);
    spl_panels_begin(&sheet->made.plane, &chunk);
    spl_panels_get_frame(&chunk, &frame);
    for (int a = 0; a < 3; a++)
        sheet->made.plane.origin[a] =
            center[a] - 0.5 * cell * side * across * ((double)frame.u[a] + (double)frame.v[a]);
    for (unsigned i = 0; i < across * across; i++) {
        struct spl_panel *panel = &sheet->panels[i];
        *panel = (struct spl_panel){.column = (uint8_t)(i % across), .row = (uint8_t)(i / across)};
        for (int y = 0; y < side; y++) {
            panel->cells[y] = 0xffff;
            for (int x = 0; x < side; x++)
                memcpy(panel->color[y][x], (uint8_t[]){200, 120, 40}, 3);
        }
        sheet->reliefs[i].level = level;
    }
    sheet->made.panels = sheet->panels;
    sheet->made.reliefs = sheet->reliefs;
    sheet->made.count = across * across;
}

void make_sheet_waves(struct make_sheet *sheet, double high, double length, const double turn[2])
{
    const double cell = (double)sheet->made.plane.cell, round = 2 * M_PI / length;
    for (size_t i = 0; i < sheet->made.count; i++) {
        struct spl_relief *relief = &sheet->reliefs[i];
        int squares = 1 << relief->level;
        for (int k = 0; k < (squares + 1) * (squares + 1); k++) {
            double x = sheet->panels[i].column + k % (squares + 1) / (double)squares;
            double y = sheet->panels[i].row + k / (squares + 1) / (double)squares;
            relief->height[k] = (float)(high * cell * sin(round * x + turn[0]) * cos(round * y + turn[1]));
        }
    }
}
