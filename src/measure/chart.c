/* The SVG chart: axes, curves, points, legend, labels. Points and labels are laid out first, in units of the picture,
 * so that a label can be tried at eight places round its point and dropped where none is free. Text widths are
 * estimates for a sans-serif face (0.56 em a character), which is all a file without fonts can know. The root's
 * data-plot (left, top, right, bottom), data-ms (logarithmic) and data-psnr say where the axes lie, for those who add
 * points of their own. Pure; any thread. */
#include "measure/chart.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "measure/markup.h"

enum {
    WIDTH = 720,
    HEIGHT = 476,
    LEFT = 56,
    RIGHT = 20,
    TOP = 82,
    BOTTOM = 52,
    COLORS = 6,
    DASHES = 7,
    LEGEND_ROW = 17,
    LEGEND_ROWS = 6
};

struct box {
    double x, y, w, h;
};

struct place { /* a point of the chart, laid out */
    const struct spl_chart_point *point;
    const struct spl_chart_curve *curve;
    double x, y;
};

struct layout {
    double ms_low, ms_high, psnr_low, psnr_high;
    struct place *places; /* curve after curve, by ms inside a curve */
    size_t place_count;
    struct box *taken; /* by points and labels */
    size_t taken_count;
    FILE *out;
};

static const char style[] =
    "<style>\n"
    ".spl-chart{--ground:#fff;--ink:#1b1f24;--faint:#d9dde2;--soft:#5b6570;background:var(--ground)}\n"
    ".spl-chart .ground{fill:var(--ground)} .spl-chart text{fill:var(--ink)} .spl-chart .soft{fill:var(--soft)}\n"
    ".spl-chart .grid{stroke:var(--faint);fill:none} .spl-chart .curve{fill:none;stroke-width:1.6;opacity:.75}\n"
    ".spl-chart .point circle{stroke-width:1.8} .spl-chart .open{fill:var(--ground)}\n"
    ".spl-chart .label{font-size:11px;paint-order:stroke;stroke:var(--ground);stroke-width:3px}\n"
    ".spl-chart .s0{stroke:#0b62a4}.spl-chart .f0{fill:#0b62a4}.spl-chart .s1{stroke:#b4450f}.spl-chart "
    ".f1{fill:#b4450f}\n"
    ".spl-chart .s2{stroke:#0a7a50}.spl-chart .f2{fill:#0a7a50}.spl-chart .s3{stroke:#9a3d7e}.spl-chart "
    ".f3{fill:#9a3d7e}\n"
    ".spl-chart .s4{stroke:#7a6400}.spl-chart .f4{fill:#7a6400}.spl-chart .s5{stroke:#555}.spl-chart .f5{fill:#555}\n"
    "@media (prefers-color-scheme:dark){\n"
    ".spl-chart{--ground:#15181c;--ink:#e6e9ed;--faint:#363c44;--soft:#a3acb6}\n"
    ".spl-chart .s0{stroke:#6cb6f5}.spl-chart .f0{fill:#6cb6f5}.spl-chart .s1{stroke:#f08a4b}.spl-chart "
    ".f1{fill:#f08a4b}\n"
    ".spl-chart .s2{stroke:#4fcf9a}.spl-chart .f2{fill:#4fcf9a}.spl-chart .s3{stroke:#e08cc6}.spl-chart "
    ".f3{fill:#e08cc6}\n"
    ".spl-chart .s4{stroke:#d8bd3a}.spl-chart .f4{fill:#d8bd3a}.spl-chart .s5{stroke:#b5b5b5}.spl-chart "
    ".f5{fill:#b5b5b5}\n"
    "}\n</style>\n";

static const char *const dashes[DASHES] = {"none", "6 3", "2 3", "8 3 2 3", "12 3", "1 5", "8 3 2 3 2 3"};

static bool drawable(const struct spl_chart_point *p)
{
    return isfinite(p->ms) && p->ms > 0 && !isnan(p->psnr);
}

static int by_ms(const void *a, const void *b)
{
    const struct place *x = a, *y = b;
    return (x->point->ms > y->point->ms) - (x->point->ms < y->point->ms);
}

/* Collects the points, curve after curve, and the range of the axes. */
static void gather(struct layout *l, const struct spl_chart *chart)
{
    double low = INFINITY, high = -INFINITY, first = INFINITY, last = 0;
    for (size_t c = 0; c < chart->curve_count; c++) {
        size_t begin = l->place_count;
        for (size_t i = 0; i < chart->curves[c].count; i++) {
            const struct spl_chart_point *p = &chart->curves[c].points[i];
            if (!drawable(p))
                continue;
            l->places[l->place_count++] = (struct place){.point = p, .curve = &chart->curves[c]};
            first = fmin(first, p->ms);
            last = fmax(last, p->ms);
            if (p->psnr < SPL_CHART_EXACT) {
                low = fmin(low, p->psnr);
                high = fmax(high, p->psnr);
            }
        }
        qsort(l->places + begin, l->place_count - begin, sizeof *l->places, by_ms);
    }
    if (!l->place_count)
        first = last = 1;
    if (!(low <= high))
        low = high = 30;
    l->ms_low = first / 1.2;
    l->ms_high = fmax(last * 1.25, l->ms_low * 3);
    l->psnr_low = floor(fmax(low, -100) - 0.5);
    l->psnr_high = ceil(fmax(high + 0.5, l->psnr_low + 3));
}

static double to_x(const struct layout *l, double ms)
{
    return LEFT + (WIDTH - LEFT - RIGHT) * log(ms / l->ms_low) / log(l->ms_high / l->ms_low);
}

static double to_y(const struct layout *l, double psnr)
{
    double share = (l->psnr_high - psnr) / (l->psnr_high - l->psnr_low);
    return TOP + (HEIGHT - TOP - BOTTOM) * fmin(fmax(share, 0), 1);
}

static void write_axes(const struct layout *l, const struct spl_chart *chart)
{
    static const double steps[] = {0.5, 1, 2, 5, 10, 20, 50}, coarse[] = {1, 2, 5}, fine[] = {1, 1.5, 2, 3, 4, 5, 6, 8};
    size_t s = 0;
    while (s < 6 && (l->psnr_high - l->psnr_low) / steps[s] > 9)
        s++;
    for (double v = ceil(l->psnr_low / steps[s]) * steps[s]; v <= l->psnr_high; v += steps[s])
        fprintf(l->out,
                "<path class=\"grid\" d=\"M%d %.1fH%d\"/><text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%g</text>\n",
                LEFT, to_y(l, v), WIDTH - RIGHT, LEFT - 8, to_y(l, v) + 4, v);
    bool wide = l->ms_high / l->ms_low > 8;
    const double *ticks = wide ? coarse : fine;
    for (int decade = (int)floor(log10(l->ms_low)); decade <= (int)ceil(log10(l->ms_high)); decade++)
        for (size_t i = 0; i < (wide ? sizeof coarse : sizeof fine) / sizeof *ticks; i++) {
            double v = ticks[i] * pow(10, decade), x = to_x(l, v);
            if (v >= l->ms_low && v <= l->ms_high)
                fprintf(l->out,
                        "<path class=\"grid\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                        "text-anchor=\"middle\">%g</text>\n",
                        x, TOP, HEIGHT - BOTTOM, x, HEIGHT - BOTTOM + 18, v);
        }
    fprintf(l->out, "<text class=\"soft\" x=\"%d\" y=\"%d\" text-anchor=\"end\">", WIDTH - RIGHT, HEIGHT - BOTTOM + 38);
    spl_markup_text(l->out, chart->axis ? chart->axis : "milliseconds a frame");
    fputs("</text>\n", l->out);
    fprintf(l->out,
            "<text class=\"soft\" transform=\"translate(15 %d) rotate(-90)\" text-anchor=\"end\">PSNR, dB</text>\n",
            TOP);
}

/* The attribute that makes a curve's lines paler; a style would break pages that allow none. */
static struct fading {
    char text[40];
} fading(const struct spl_chart_curve *curve)
{
    struct fading out = {""};
    if (curve->fade > 0)
        snprintf(out.text, sizeof out.text, " stroke-opacity=\"%.2f\"", 1 - curve->fade);
    return out;
}

static void write_curves(const struct layout *l)
{
    for (size_t i = 0; i < l->place_count;) {
        const struct spl_chart_curve *curve = l->places[i].curve;
        fprintf(l->out, "<polyline class=\"curve s%u\" stroke-dasharray=\"%s\"%s points=\"", curve->color % COLORS,
                dashes[curve->dash % DASHES], fading(curve).text);
        for (; i < l->place_count && l->places[i].curve == curve; i++)
            fprintf(l->out, "%.1f,%.1f ", l->places[i].x, l->places[i].y);
        fputs("\"/>\n", l->out);
    }
}

static void write_points(const struct layout *l, const struct spl_chart *chart)
{
    const char *unit = chart->unit ? chart->unit : "ms";
    for (size_t i = 0; i < l->place_count; i++) {
        const struct place *at = &l->places[i];
        const struct spl_chart_point *p = at->point;
        unsigned color = at->curve->color % COLORS;
        fputs("<g class=\"point\"", l->out);
        if (p->index >= 0)
            fprintf(l->out, " data-index=\"%d\"", p->index);
        fprintf(l->out, "><title>");
        spl_markup_text(l->out, at->curve->name);
        fputs(p->label[0] ? " " : "", l->out);
        spl_markup_text(l->out, p->label);
        if (isfinite(p->psnr))
            fprintf(l->out, ": %.2f dB, %.4g %s", p->psnr, p->ms, unit);
        else
            fprintf(l->out, ": equal, %.4g %s", p->ms, unit);
        fputs(p->detail[0] ? "; " : "", l->out);
        spl_markup_text(l->out, p->detail);
        fprintf(l->out, "</title><circle class=\"s%u ", color);
        if (p->front)
            fprintf(l->out, "f%u", color);
        else
            fputs("open", l->out);
        fprintf(l->out, "\"%s cx=\"%.1f\" cy=\"%.1f\" r=\"%s\"/></g>\n", fading(at->curve).text, at->x, at->y,
                p->front ? "5" : "3.6");
    }
}

static bool is_free(const struct layout *l, const struct box *b)
{
    if (b->x < LEFT || b->y < TOP - 8 || b->x + b->w > WIDTH - 4 || b->y + b->h > HEIGHT - BOTTOM)
        return false;
    for (size_t i = 0; i < l->taken_count; i++) {
        const struct box *o = &l->taken[i];
        if (b->x < o->x + o->w && o->x < b->x + b->w && b->y < o->y + o->h && o->y < b->y + b->h)
            return false;
    }
    return true;
}

/* Sets the label of one point at the first free place round it. */
static void write_label(struct layout *l, const struct place *at)
{
    double w = 6.2 * (double)strlen(at->point->label) + 2, h = 12;
    const double where[8][2] = {{7, 1},      {7, -h - 1},      {-w - 7, -h - 1}, {-w - 7, 1},
                                {-w / 2, 7}, {-w / 2, -h - 7}, {9, -h / 2},      {-w - 9, -h / 2}};
    for (size_t i = 0; i < 8; i++) {
        struct box b = {at->x + where[i][0], at->y + where[i][1], w, h};
        if (!is_free(l, &b))
            continue;
        l->taken[l->taken_count++] = b;
        fprintf(l->out, "<text class=\"label f%u\" x=\"%.1f\" y=\"%.1f\" textLength=\"%.0f\">",
                at->curve->color % COLORS, b.x + 1, b.y + h - 2, w - 2);
        spl_markup_text(l->out, at->point->label);
        fputs("</text>\n", l->out);
        return;
    }
}

static void write_labels(struct layout *l)
{
    for (size_t i = 0; i < l->place_count; i++)
        l->taken[l->taken_count++] = (struct box){l->places[i].x - 5, l->places[i].y - 5, 10, 10};
    for (int front = 1; front >= 0; front--)
        for (size_t i = 0; i < l->place_count; i++)
            if (l->places[i].point->front == front && l->places[i].point->label[0])
                write_label(l, &l->places[i]);
}

/* The curves' names in rows under the title, those that are not dashed first; what does not fit stays in the points'
 * own texts. Returns how many rows; `out` NULL: that alone. */
static int write_legend(FILE *out, const struct spl_chart *chart)
{
    double x = LEFT;
    int row = 0;
    for (size_t i = 0; i < 2 * chart->curve_count; i++) {
        const struct spl_chart_curve *curve = &chart->curves[i % chart->curve_count];
        if ((curve->dash % DASHES != 0) != (i >= chart->curve_count))
            continue;
        double w = 34 + 6.8 * (double)strlen(curve->name) + 14;
        if (x + w > WIDTH && row + 1 == LEGEND_ROWS)
            break;
        if (x + w > WIDTH) {
            x = LEFT;
            row++;
        }
        if (out) {
            int y = 54 + LEGEND_ROW * row;
            fprintf(out,
                    "<path class=\"curve s%u\" stroke-dasharray=\"%s\"%s d=\"M%.1f %dh26\"/><text x=\"%.1f\" "
                    "y=\"%d\">",
                    curve->color % COLORS, dashes[curve->dash % DASHES], fading(curve).text, x, y - 4, x + 32, y);
            spl_markup_text(out, curve->name);
            fputs("</text>\n", out);
        }
        x += w;
    }
    return row + 1;
}

/* Beneath the legend, which is given room for two rows. */
static void write_plot(struct layout *l, const struct spl_chart *chart, int shift)
{
    fprintf(l->out, "<g transform=\"translate(0 %d)\">\n<text class=\"soft\" x=\"%d\" y=\"%d\">", shift, LEFT,
            HEIGHT - BOTTOM + 38);
    spl_markup_text(l->out, chart->note ? chart->note : "labels: lod; filled: on the front");
    fputs("</text>\n", l->out);
    write_axes(l, chart);
    write_curves(l);
    write_labels(l);
    write_points(l, chart);
    fputs("</g>\n", l->out);
}

static void write_chart(struct layout *l, const struct spl_chart *chart)
{
    const int rows = write_legend(NULL, chart), shift = rows > 2 ? (rows - 2) * LEGEND_ROW : 0;
    fprintf(l->out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"spl-chart\" viewBox=\"0 0 %d %d\" role=\"img\" "
            "font-family=\"system-ui, sans-serif\" font-size=\"12\" data-plot=\"%d %d %d %d\" data-ms=\"%.9g %.9g\" "
            "data-psnr=\"%.9g %.9g\">\n<title>",
            WIDTH, HEIGHT + shift, LEFT, TOP + shift, WIDTH - RIGHT, HEIGHT - BOTTOM + shift, l->ms_low, l->ms_high,
            l->psnr_low, l->psnr_high);
    spl_markup_text(l->out, chart->title);
    fprintf(l->out, "</title>\n%s<rect class=\"ground\" width=\"%d\" height=\"%d\"/>\n", style, WIDTH, HEIGHT + shift);
    fprintf(l->out, "<text x=\"%d\" y=\"20\" font-size=\"15\" font-weight=\"600\">", LEFT);
    spl_markup_text(l->out, chart->title);
    double fits = (WIDTH - LEFT - RIGHT) / (0.55 * (double)(strlen(chart->subtitle) + 1));
    fprintf(l->out, "</text>\n<text class=\"soft\" x=\"%d\" y=\"37\" font-size=\"%.1f\">", LEFT, fits < 11 ? fits : 11);
    spl_markup_text(l->out, chart->subtitle);
    fputs("</text>\n", l->out);
    write_legend(l->out, chart);
    write_plot(l, chart, shift);
    fputs("</svg>\n", l->out);
}

int spl_chart_write(const struct spl_chart *chart, char **svg, size_t *length, struct spl_error *err)
{
    *svg = NULL;
    *length = 0;
    size_t count = 0;
    for (size_t c = 0; c < chart->curve_count; c++)
        count += chart->curves[c].count;
    struct layout l = {.places = spl_alloc(count, sizeof *l.places, err)};
    l.taken = spl_alloc(2 * count, sizeof *l.taken, err);
    int rc = SPL_E_NOMEM;
    if (!l.places || !l.taken)
        goto done;
    gather(&l, chart);
    for (size_t i = 0; i < l.place_count; i++) {
        l.places[i].x = to_x(&l, l.places[i].point->ms);
        l.places[i].y = to_y(&l, l.places[i].point->psnr);
    }
    l.out = open_memstream(svg, length);
    if (!l.out) {
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory: the chart could not be written");
        goto done;
    }
    write_chart(&l, chart);
    bool failed = ferror(l.out);
    failed |= fclose(l.out) != 0;
    rc = failed ? spl_fail(err, SPL_E_NOMEM, "out of memory: the chart could not be written") : SPL_OK;
    if (rc) {
        free(*svg);
        *svg = NULL;
        *length = 0;
    }
done:
    free(l.places);
    free(l.taken);
    return rc;
}
