/* What the colours of a view mean, as a small SVG: values along a ramp, or a colour and a name each. It takes the
 * parameters of a view that say so, and names what it does not take. Owned by the loop's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "measure/markup.h"
#include "render/paint.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/reply.h"
#include "service/request/values.h"

enum { width = 280, margin = 12, bar = 18, row = 20, title = 22, ticks = 5, text_room = 5 };
enum { stops = 17, kinds_most = 32, digits_least = 5, digits_most = 15 };

static void begin(FILE *out, const char *name, const char *unit, int height)
{
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" "
            "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<rect width=\"%d\" height=\"%d\" rx=\"4\" "
            "fill=\"#fff\" fill-opacity=\"0.9\"/>\n<text x=\"%d\" y=\"%d\" font-weight=\"bold\">",
            width, height, width, height, width, height, margin, title - 4);
    spl_markup_text(out, name);
    if (*unit) {
        fprintf(out, " (");
        spl_markup_text(out, unit);
        fprintf(out, ")");
    }
    fprintf(out, "</text>\n");
}

/* As paint has colours: r | g << 8 | b << 16. */
static void print_color(FILE *out, uint32_t color)
{
    fprintf(out, "#%02x%02x%02x", color & 255, color >> 8 & 255, color >> 16 & 255);
}

/* As many as tell values apart: large ones close to each other have more, as coordinates and times have. */
static int digits_of(double low, double high)
{
    const double most = fmax(fabs(low), fabs(high)), step = (high - low) / (ticks - 1);
    const double digits = step > 0 && most > 0 ? ceil(log10(most / step)) + 2 : 0;
    return (int)fmin(fmax(digits, digits_least), digits_most);
}

static void draw_ramp(FILE *out, const struct spl_paint *paint)
{
    fprintf(out, "<defs><linearGradient id=\"ramp\">");
    for (int i = 0; i < stops; i++) {
        fprintf(out, "<stop offset=\"%.4g\" stop-color=\"", i / (double)(stops - 1));
        print_color(out, paint->colors[i * (SPL_PALETTE_COLORS - 1) / (stops - 1)]);
        fprintf(out, "\"/>");
    }
    fprintf(out, "</linearGradient></defs>\n<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"url(#ramp)\"/>\n",
            margin, title + 4, width - 2 * margin, bar);
    char texts[ticks][32];
    size_t longest = 0;
    const int digits = digits_of(paint->low, paint->high);
    for (int i = 0; i < ticks; i++) {
        const double share = i / (double)(ticks - 1);
        snprintf(texts[i], sizeof texts[i], "%.*g", digits, paint->low + share * (paint->high - paint->low));
        if (strlen(texts[i]) > longest)
            longest = strlen(texts[i]);
    }
    const int step = longest <= text_room ? 1 : longest <= 2 * text_room ? 2 : ticks - 1; // others would touch
    for (int i = 0; i < ticks; i += step)
        fprintf(out, "<text x=\"%g\" y=\"%d\" text-anchor=\"%s\">%s</text>\n",
                margin + i * (width - 2 * margin) / (double)(ticks - 1), title + 4 + bar + 15,
                !i ? "start" : i == ticks - 1 ? "end" : "middle", texts[i]);
}

static void draw_swatch(FILE *out, int index, uint32_t color, const char *text)
{
    const int y = title + 4 + index * row;
    fprintf(out, "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"", margin, y, bar, row - 6);
    print_color(out, color);
    fprintf(out, "\"/><text x=\"%d\" y=\"%d\">", margin + bar + 8, y + row - 9);
    spl_markup_text(out, text);
    fprintf(out, "</text>\n");
}

/* The classes that the dataset has, or where it does not say those that have a name. */
static uint32_t list_classes(const struct spl_stream_values *values, uint32_t numbers[kinds_most])
{
    uint32_t count = 0;
    const bool known = values && values->kind_count;
    for (uint32_t i = 0; count < kinds_most && (known ? i < values->kind_count : spl_class_get_name(i) != NULL); i++)
        numbers[count++] = known ? (uint32_t)fmin(values->kinds[i].value, SPL_PALETTE_COLORS - 1) : i;
    return count;
}

static void draw_classes(FILE *out, const struct spl_paint *paint, const struct spl_stream_values *values)
{
    uint32_t numbers[kinds_most];
    const uint32_t count = list_classes(values, numbers);
    begin(out, "class", "", title + 8 + (int)count * row);
    for (uint32_t i = 0; i < count; i++) {
        char text[64];
        const char *name = spl_class_get_name(numbers[i]);
        snprintf(text, sizeof text, "%u%s%s", numbers[i], name ? " " : "", name ? name : "");
        draw_swatch(out, (int)i, paint->colors[numbers[i]], text);
    }
}

static void draw(FILE *out, const struct spl_paint *paint, const struct spl_color_params *color,
                 const struct spl_dataset_info *info)
{
    static const struct {
        const char *name;
        uint32_t color;
    } axes[] = {{"x", 0x8080ff}, {"y", 0x80ff80}, {"z", 0xff8080}};
    char name[SPL_COLOR_TEXT_MAX];
    spl_color_print(color, name, sizeof name);
    if (paint->classes) {
        draw_classes(out, paint, spl_dataset_info_get_values(info, (uint32_t)paint->stream));
    } else if (color->by == SPL_COLOR_BY_NORMAL) {
        begin(out, name, "", title + 8 + 3 * row);
        for (int i = 0; i < 3; i++)
            draw_swatch(out, i, axes[i].color, axes[i].name);
    } else if (color->by == SPL_COLOR_BY_FLAT) {
        begin(out, "flat", "", title + 8 + row);
        draw_swatch(out, 0, paint->colors[0], name);
    } else {
        const char *unit = paint->stream < 0 ? spl_unit_word(info) : info->streams[paint->stream].unit;
        if (paint->stream >= 0 && !strcmp(color->name, "uncertainty"))
            unit = spl_unit_word(info); /* the coordinates' */
        begin(out, color->by == SPL_COLOR_BY_PLANE ? "distance to the plane" : name, unit, title + 4 + bar + 24);
        draw_ramp(out, paint);
    }
    fprintf(out, "</svg>\n");
}

static int read_colors(const char *query, struct spl_color_params *color, struct spl_error *err)
{
    struct values values = {0};
    struct spl_view view;
    int rc = spl_values_from_query(&values, query, strlen(query), SPL_QUERY, err);
    for (int i = 0; i < PARAM_COUNT && !rc; i++)
        if (values.v[i].given && i != PARAM_color_by && i != PARAM_ramp && i != PARAM_range)
            rc = spl_fail_field(err, SPL_E_INPUT, spl_params[i].name, "a legend takes color_by, ramp and range, not %s",
                                spl_params[i].name);
    if (rc)
        return rc;
    spl_view_init(&view);
    spl_values_resolve_splats(&values, &view);
    spl_values_resolve_colors(&values, &view);
    *color = view.color;
    if (color->by == SPL_COLOR_BY_RGB)
        return spl_fail_field(err, SPL_E_INPUT, "color_by",
                              "color_by is needed, and something else than rgb, whose colours mean nothing");
    rc = spl_color_check(color, err);
    err->code = rc ? SPL_E_INPUT : err->code;
    return rc;
}

void spl_show_legend(struct request *request, const struct spl_call *call)
{
    const struct spl_dataset_info *info = call->entry->info;
    struct spl_color_params color;
    struct spl_paint paint;
    struct spl_error err = {0};
    char *svg = NULL;
    size_t length = 0;
    if (read_colors(request->query, &color, &err) || spl_paint_init(&paint, &color, info, &err)) {
        spl_reply_error(request, &err);
        return;
    }
    FILE *out = open_memstream(&svg, &length);
    if (out) {
        draw(out, &paint, &color, info);
        bool failed = ferror(out);
        if (fclose(out) || failed) {
            free(svg);
            svg = NULL;
        }
    }
    spl_reply_text(request, "image/svg+xml", svg);
}
