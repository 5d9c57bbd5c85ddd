/* Maps of stations: blocks, atlases, ranges, and whole packs of a room that is known. Bad input first. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include <splatd/pack.h>

#include "base/array.h"
#include "dataset/block.h"
#include "dataset/dataset.h"
#include "pack/maps/agree.h"
#include "pack/maps/atlas.h"
#include "pack/maps/colors.h"
#include "pack/maps/even.h"
#include "pack/maps/ranges.h"
#include "pack/maps/sees.h"
#include "support/make_dataset.h"
#include "support/sanitised.h"

static uint32_t random_state = 1;

static double random_real(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) / (double)(1 << 24);
}

/* ---- blocks ---- */

static void blocks_hold_what_they_can(void **state)
{
    (void)state;
    float texels[16][3], decoded[3];
    uint32_t words[2];
    for (int i = 0; i < 16; i++)
        texels[i][0] = texels[i][1] = texels[i][2] = i < 8 ? 0 : 255;
    assert_true(spl_block_encode((const float(*)[3])texels, words) == 0); /* black and white are exact */
    for (int trial = 0; trial < 200; trial++) {
        float base[3], step[3];
        for (int c = 0; c < 3; c++) {
            base[c] = (float)(40 + 150 * random_real());
            step[c] = (float)(trial % 2 ? 40 * random_real() - 20 : 0);
        }
        for (int i = 0; i < 16; i++)
            for (int c = 0; c < 3; c++)
                texels[i][c] = base[c] + step[c] * (float)(i % 4) / 3;
        double error = spl_block_encode((const float(*)[3])texels, words), sum = 0;
        for (uint32_t i = 0; i < 16; i++) { /* what is promised is what the file's decoder gives: a level of side 0 */
            spl_map_get_color(words, 0, i % 4, i / 4, decoded);
            for (int c = 0; c < 3; c++)
                sum += (double)((decoded[c] - texels[i][c]) * (decoded[c] - texels[i][c]));
        }
        assert_true(fabs(sum - error) < 1e-2 + 1e-3 * error);
        assert_true(sum / 48 < (trial % 2 ? 6 : 1.7)); /* even colours lie between steps of 8 and 4 */
    }
}

/* ---- atlases ---- */

/* Colours that differ smoothly all over the sphere, linear. */
static void smooth(const double d[3], float out[4])
{
    for (int c = 0; c < 3; c++)
        out[c] = (float)(0.4 + 0.25 * d[c] + 0.1 * d[(c + 1) % 3] * d[2]);
    out[3] = 1;
}

static void paint(struct spl_atlas *atlas, bool (*is_open)(const double d[3]))
{
    for (uint32_t y = 0; y < atlas->height; y++)
        for (uint32_t x = 0; x < atlas->width; x++) {
            double d[3];
            spl_polar_direction(atlas->side, SPL_MAP_APRON, (double[2]){x + 0.5, y + 0.5}, d);
            if (!is_open || !is_open(d))
                smooth(d, atlas->texels[(size_t)y * atlas->width + x]);
        }
}

static double worst_of(const struct spl_atlas *atlas)
{
    double worst = 0;
    for (int i = 0; i < 20000; i++) { /* poles, the wrap of the azimuth and 45 degrees among them */
        double z = i % 5 == 0 ? 1 - 1e-4 * random_real() : i % 5 == 1 ? sin(M_PI / 4) : 2 * random_real() - 1;
        double turn = i % 3 ? 2 * M_PI * random_real() : 1e-3 * (random_real() - 0.5), flat = sqrt(1 - z * z);
        const double d[3] = {flat * cos(turn), flat * sin(turn), i % 2 ? z : -z};
        float color[3], truth[4];
        spl_atlas_get(atlas, d, color);
        smooth(d, truth);
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, fabs((double)(color[c] - spl_srgb_of_linear(truth[c]))));
    }
    return worst;
}

static void levels_show_no_seams(void **state)
{
    (void)state;
    struct spl_atlas atlas, half;
    assert_int_equal(spl_atlas_init(&atlas, 128, NULL), 0);
    paint(&atlas, NULL);
    assert_true(worst_of(&atlas) < 1);
    for (int level = 1; level < 3; level++) {
        assert_int_equal(spl_atlas_halve(&atlas, 2, &half, NULL), 0);
        spl_atlas_finish(&atlas);
        atlas = half;
        assert_true(worst_of(&atlas) < 1);
    }
    spl_atlas_finish(&atlas);
}

static bool is_small_hole(const double d[3])
{
    return d[0] * 0.6 + d[2] * 0.8 > 0.995 || d[0] * 0.6 - d[2] * 0.8 > 0.999;
}

static bool is_everywhere(const double d[3])
{
    (void)d;
    return true;
}

static void holes_are_filled_from_around(void **state)
{
    (void)state;
    struct spl_atlas atlas;
    assert_int_equal(spl_atlas_init(&atlas, 64, NULL), 0);
    paint(&atlas, is_small_hole);
    assert_int_equal(spl_atlas_fill(&atlas, 2, NULL), 0);
    assert_true(worst_of(&atlas) < 12); /* a hole of 11 degrees spans 25 levels */
    spl_atlas_finish(&atlas);
    assert_int_equal(spl_atlas_init(&atlas, 64, NULL), 0);
    paint(&atlas, is_everywhere);
    assert_int_equal(spl_atlas_fill(&atlas, 1, NULL), 0);
    float color[3];
    spl_atlas_get(&atlas, (double[3]){0, 0, 1}, color);
    assert_true(color[0] > 50 && color[0] < 200);
    spl_atlas_finish(&atlas);
}

/* Splats colour texels of a chart proper alone: what repeats them must not be filled from around. */
static void aprons_repeat_their_texels(void **state)
{
    (void)state;
    const uint32_t side = 64;
    struct spl_atlas atlas;
    size_t repeated = 0;
    assert_int_equal(spl_atlas_init(&atlas, side, NULL), 0);
    for (uint32_t y = 0; y < atlas.height; y++)
        for (uint32_t x = 0; x < atlas.width; x++)
            for (int c = 0; c < 4 && spl_polar_is_proper(side, SPL_MAP_APRON, x, y); c++)
                atlas.texels[(size_t)y * atlas.width + x][c] = c < 3 ? (float)random_real() : 1;
    assert_int_equal(spl_atlas_fill(&atlas, 2, NULL), 0);
    for (uint32_t y = 0; y < atlas.height; y++)
        for (uint32_t x = 0; x < atlas.width; x++) {
            double d[3], at[2];
            spl_polar_direction(side, SPL_MAP_APRON, (double[2]){x + 0.5, y + 0.5}, d);
            spl_polar_place(side, SPL_MAP_APRON, d, at);
            if (spl_polar_is_proper(side, SPL_MAP_APRON, x, y) ||
                !spl_polar_is_proper(side, SPL_MAP_APRON, (uint32_t)at[0], (uint32_t)at[1]))
                continue;
            assert_memory_equal(atlas.texels[(size_t)y * atlas.width + x],
                                atlas.texels[(size_t)at[1] * atlas.width + (size_t)at[0]], 3 * sizeof(float));
            repeated++;
        }
    assert_true(repeated > 8 * side * SPL_MAP_APRON);
    spl_atlas_finish(&atlas);
}

/* ---- ranges ---- */

enum { rows = 240, columns = 480 };

/* A room of 4 x 6 x 3 metres around the station, 1.5 above its floor; a window in +x, no roof; blind below -60 degrees.
 * 0 = nothing comes back, -1 = not looked at. */
static double range_of(const double d[3])
{
    double t = INFINITY;
    const double walls[6] = {2, -2, 3, -3, 1.5, -1.5};
    if (d[2] < -sin(M_PI / 3))
        return -1;
    for (int k = 0; k < 6; k++)
        if (k != 4 && d[k / 2] / walls[k] > 0)
            t = fmin(t, walls[k] / d[k / 2]);
    if (t * d[2] > 1.5)
        return 0;
    if (d[0] > 0 && fabs(t * d[0] - 2) < 1e-9 && fabs(t * d[1]) < 0.5 && t * d[2] > -0.5 && t * d[2] < 0.7)
        return 0;
    return t;
}

static void grid_direction(int row, int column, double d[3])
{
    double elevation = (row + 0.5) / rows * M_PI - M_PI / 2, azimuth = (column + 0.5) / columns * 2 * M_PI;
    d[0] = cos(elevation) * cos(azimuth);
    d[1] = cos(elevation) * sin(azimuth);
    d[2] = sin(elevation);
}

static struct spl_hits scan_room(double noise)
{
    struct spl_hits hits = {.list = calloc(rows * columns, sizeof *hits.list),
                            .texel = calloc(rows * columns, sizeof *hits.texel)};
    for (int row = 0; row < rows; row++)
        for (int column = 0; column < columns; column++) {
            double d[3], range;
            grid_direction(row, column, d);
            if ((range = range_of(d)) <= 0)
                continue;
            struct spl_hit *hit = &hits.list[hits.count++];
            hit->range = (float)(range + noise * (random_real() - 0.5));
            hit->radius = (float)(range * M_PI / rows);
            for (int k = 0; k < 3; k++)
                hit->direction[k] = (float)d[k];
        }
    return hits;
}

static void ranges_are_those_of_the_room(void **state)
{
    (void)state;
    struct spl_hits hits = scan_room(0.002);
    struct spl_ranges ranges;
    assert_int_equal(spl_ranges_init(&ranges, &hits, 512, 2, NULL), 0);
    /* texels about as wide as the steps, 0.75 degrees: 120 of them a quarter turn */
    assert_in_range(ranges.side, 88, 124);
    assert_true(ranges.near > 1.4 && ranges.near < 1.8);
    uint32_t width = spl_polar_width(ranges.side, 1), wrong = 0, asked = 0;
    for (uint32_t y = 0; y < spl_polar_height(ranges.side, 1); y++)
        for (uint32_t x = 0; x < width; x++) {
            double d[3], truth, low = INFINITY, high = 0;
            float range = ranges.texels[(size_t)y * width + x];
            bool open = false, blind = false;
            for (int k = 0; k < 9; k++) { /* of all that lies within a texel and a half */
                spl_polar_direction(ranges.side, 1, (double[2]){x - 0.5 + k % 3, y - 0.5 + k / 3}, d);
                truth = range_of(d);
                open |= truth == 0;
                blind |= truth < 0;
                low = truth > 0 ? fmin(low, truth) : low;
                high = truth > 0 ? fmax(high, truth) : high;
            }
            spl_polar_direction(ranges.side, 1, (double[2]){x + 0.5, y + 0.5}, d);
            asked++;
            if (high == 0)
                wrong += open ? !isinf(range) : !isnan(range);
            else
                wrong += isinf(range) ? !open : isnan(range) ? !blind : range < low - 0.01 || range > high + 0.01;
        }
    assert_true(wrong * 1000 < asked);
    spl_ranges_finish(&ranges);
    spl_hits_finish(&hits);
}

/* api/panoramas.md: slack + 0.35 radius + range * texel * tan(incidence), incidence up to 80 degrees. */
static void tolerances_are_as_documented(void **state)
{
    (void)state;
    const struct spl_map_row row = {.range_side = 256, .slack = 0.004f};
    const double texel = M_PI / 512, most = tan(80 * M_PI / 180);
    assert_float_equal(spl_map_tolerance(&row, 10, 0.03, 1), 0.004 + 0.35 * 0.03, 1e-6);
    assert_float_equal(spl_map_tolerance(&row, 10, 0.03, cos(M_PI / 4)), 0.004 + 0.35 * 0.03 + 10 * texel, 1e-6);
    for (int i = 0; i < 3; i++) /* 85 degrees, 90, and beyond */
        assert_float_equal(spl_map_tolerance(&row, 2, 0, (double[]){cos(85 * M_PI / 180), 0, -0.1}[i]),
                           0.004 + 2 * texel * most, 1e-2 * texel);
}

/* A map is as fine as its pictures, but no stamp through a telescope makes one of gigabytes. */
static void maps_are_as_fine_as_their_pictures_are_worth(void **state)
{
    (void)state;
    static char file[] = "a.jpg";
    uint32_t of[] = {0};
    struct spl_named_view view = {.photograph = file};
    struct spl_view_list views = {.views = &view, .count = 1};
    const struct spl_stations stations = {.count = 1, .of_view = of};
    const struct {
        uint32_t width, height;
        double f, side;
    } cases[] = {{600, 450, 600, 600 * M_PI / 2}, /* 53 degrees */
                 {64, 64, 1e5, sqrt(64. / 6) * 64},
                 {4000, 3000, 40000, SPL_MAP_SIDE_MAX}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        view.camera = (struct spl_camera){
            .width = cases[i].width, .height = cases[i].height, .fx = cases[i].f, .fy = cases[i].f};
        const double side = spl_colors_find_side(&stations, &views, 0), most = cases[i].side + SPL_MAP_SIDE_STEP / 4.;
        assert_true(side <= most && side > most - SPL_MAP_SIDE_STEP);
    }
    assert_int_equal(spl_colors_find_side(&stations, &views, 1), 0);
}

static void what_a_scan_in_part_did_not_look_at_is_not_sky(void **state)
{
    (void)state;
    struct spl_hits hits = scan_room(0);
    struct spl_ranges ranges;
    size_t kept = 0;
    for (size_t i = 0; i < hits.count; i++) /* a camera's view: 60 degrees around +y, up to 20 of elevation */
        if (hits.list[i].direction[1] > 0.87f && fabsf(hits.list[i].direction[2]) < 0.34f)
            hits.list[kept++] = hits.list[i];
    hits.count = kept;
    assert_int_equal(spl_ranges_init(&ranges, &hits, 512, 2, NULL), 0);
    size_t count = (size_t)spl_polar_width(ranges.side, 1) * spl_polar_height(ranges.side, 1), none = 0, known = 0;
    for (size_t i = 0; i < count; i++) {
        none += isinf(ranges.texels[i]) != 0;
        known += isfinite(ranges.texels[i]) != 0;
    }
    assert_true(known > 500 && none * 50 < known);
    spl_ranges_finish(&ranges);
    spl_hits_finish(&hits);
}

static void few_hits_make_a_map_all_the_same(void **state)
{
    (void)state;
    skip_under_tsan();
    for (size_t few = 1; few < 4; few++) {
        struct spl_hits hits = scan_room(0);
        struct spl_ranges ranges;
        struct spl_inverse_ranges inverse;
        hits.count = few;
        assert_int_equal(spl_ranges_init(&ranges, &hits, 512, 1, NULL), 0);
        assert_true(ranges.side >= 4 && ranges.near > 0);
        assert_int_equal(spl_inverse_ranges_init(&inverse, &ranges, NULL), 0);
        for (int i = 0; i < 100; i++) {
            double d[3];
            grid_direction(i * 7 % rows, i * 31 % columns, d);
            double value = spl_inverse_ranges_get(&inverse, d);
            assert_true(value >= 0 && value < 10);
        }
        spl_inverse_ranges_finish(&inverse);
        spl_ranges_finish(&ranges);
        spl_hits_finish(&hits);
    }
}

/* ---- agreement ---- */

/* Brightness with edges of 5 to 30 degrees all over, not the same mirrored or turned. */
static double pattern(const double d[3])
{
    return 130 + 45 * sin(11 * d[0] + 3 * d[1]) + 35 * sin(17 * d[1] * d[2] + 5 * d[0]) +
           20 * sin(40 * d[2] + 7 * d[1]);
}

static double unit(const double p[3], double d[3])
{
    double range = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (int k = 0; k < 3; k++)
        d[k] = p[k] / range;
    return range;
}

struct scene {
    struct spl_atlas atlas;
    struct spl_station station;
    struct spl_map_row row;
    uint32_t *codes;
    struct spl_samples samples;
};

/* A map in which all that comes back comes from 5 metres, and samples there as an eye saw them that stood `shift` away
 * and was turned by `turn` degrees, and mirrored. */
static void make_scene(struct scene *s, const double shift[3], double turn, bool mirrored)
{
    double c = cos(turn * M_PI / 180), q = sin(turn * M_PI / 180);
    *s = (struct scene){.station = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .position = {7, 8, 9}},
                        .row = {.side = 128, .levels = 1, .range_side = 32, .near = 1, .slack = 0.1f}};
    assert_int_equal(spl_atlas_init(&s->atlas, s->row.side, NULL), 0);
    for (uint32_t y = 0; y < s->atlas.height; y++)
        for (uint32_t x = 0; x < s->atlas.width; x++) {
            double d[3];
            spl_polar_direction(s->row.side, SPL_MAP_APRON, (double[2]){x + 0.5, y + 0.5}, d);
            float *texel = s->atlas.texels[(size_t)y * s->atlas.width + x];
            for (int k = 0; k < 3; k++)
                texel[k] = spl_linear_of_srgb((float)pattern(d));
            texel[3] = 1;
        }
    size_t words = spl_map_range_words(&s->row);
    s->codes = malloc(words * sizeof *s->codes);
    for (size_t i = 0; i < 2 * words; i++)
        spl_map_set_code(s->codes, i, spl_map_code_of_range(&s->row, 5));
    s->samples = (struct spl_samples){.list = calloc(20000, sizeof *s->samples.list), .colored = true};
    for (int i = 0; i < 20000; i++) {
        struct spl_sample *sample = &s->samples.list[s->samples.count++];
        double z = 1.8 * random_real() - 0.9, turned = 2 * M_PI * random_real(), flat = sqrt(1 - z * z);
        const double d[3] = {flat * cos(turned), flat * sin(turned), z};
        double from[3], seen[3], e[3];
        for (int k = 0; k < 3; k++) {
            sample->position[k] = s->station.position[k] + 5 * d[k];
            sample->normal[k] = (float)-d[k];
            from[k] = 5 * d[k] - shift[k];
        }
        unit(from, e);
        seen[0] = c * e[0] - q * (mirrored ? -e[1] : e[1]);
        seen[1] = q * e[0] + c * (mirrored ? -e[1] : e[1]);
        seen[2] = e[2];
        /* one in 20 is something else */
        double noise = i % 20 ? 10 * (random_real() - 0.5) : 120 * (random_real() - 0.5);
        for (int k = 0; k < 3; k++)
            sample->color[k] = (uint8_t)fmin(fmax(0.8 * pattern(seen) + 20 + noise, 0), 255);
        sample->radius = 0.05f;
    }
}

static struct spl_agreement judge_scene(const double shift[3], double turn, bool mirrored)
{
    struct scene s;
    struct spl_agreement agreement;
    make_scene(&s, shift, turn, mirrored);
    const struct spl_map_sight map = {&s.row, s.codes};
    assert_int_equal(spl_agreement_find(&agreement, &s.atlas, &s.station, 0, false, &map, &s.samples, NULL), 0);
    spl_atlas_finish(&s.atlas);
    spl_samples_finish(&s.samples);
    free(s.codes);
    return agreement;
}

static void a_shift_is_found_to_the_millimetre(void **state)
{
    (void)state;
    skip_under_tsan();
    const double nowhere[3] = {0};
    struct spl_agreement a = judge_scene(nowhere, 0, false);
    assert_true(a.shared > 15000 && a.correlation > 0.9 && a.other < a.correlation - 0.05);
    assert_true(fabs(a.shift[0]) < 0.003 && fabs(a.shift[1]) < 0.003 && fabs(a.shift[2]) < 0.003 && a.turn < 0.001);
    for (int axis = 0; axis < 3; axis++)
        for (int k = 0; k < 2; k++) {
            double shift[3] = {0};
            shift[axis] = k ? 0.05 : -0.01;
            a = judge_scene(shift, 0, false);
            for (int i = 0; i < 3; i++)
                assert_true(fabs(a.shift[i] - shift[i]) < 0.003 && a.shift_error < 0.002);
        }
    a = judge_scene((const double[3]){0.3, 0, 0}, 0, false); /* sharp edges tell less: "at least" is never too much */
    assert_true(hypot(a.shift[0], hypot(a.shift[1], a.shift[2])) < 0.303);
    a = judge_scene(nowhere, 0.5, false);
    assert_true(fabs(a.turn * 180 / M_PI - 0.5) < 0.05 && fabs(a.shift[0]) < 0.005);
}

static void what_is_turned_or_mirrored_is_called_so(void **state)
{
    (void)state;
    skip_under_tsan();
    const double nowhere[3] = {0};
    struct spl_agreement a = judge_scene(nowhere, 90, false);
    assert_true(a.correlation < 0.5 && a.other > 0.9 && !a.mirrored && fabs(a.turned - 90) < 1);
    a = judge_scene(nowhere, -45, true);
    assert_true(a.correlation < 0.5 && a.other > 0.9 && a.mirrored && fabs(a.turned + 45) < 1);
    a = judge_scene((const double[3]){3, -2, 1}, 0, false); /* another place altogether */
    assert_true(a.correlation < 0.5);
}

static void exposures_are_evened_out(void **state)
{
    (void)state;
    skip_under_tsan();
    const double exposures[4] = {1, 4, 0.5, 1}, tint[3] = {1, 1.2, 0.8};
    struct spl_samples samples = {.list = calloc(4000, sizeof *samples.list), .count = 4000};
    struct spl_sightings sightings = {0};
    float factors[4][3];
    for (int own = 0; own < 2; own++) {
        samples.colored = own;
        sightings.count = 0;
        for (uint32_t i = 0; i < samples.count; i++) {
            double albedo = 0.02 + 0.1 * random_real();
            for (int c = 0; c < 3; c++)
                samples.list[i].color[c] = (uint8_t)(spl_srgb_of_linear((float)albedo) + 0.5f);
            for (uint16_t row = 0; row < 3; row++) { /* each two maps share a third; the last shares nothing */
                if (i % 3 == row)
                    continue;
                assert_int_equal(
                    spl_array_reserve(sightings.list, sightings.capacity, sightings.count + 1, NULL), 0);
                struct spl_sighting *s = &sightings.list[sightings.count++];
                *s = (struct spl_sighting){.sample = i, .row = row};
                for (int c = 0; c < 3; c++) /* a sixth is of something that moved */
                    s->color[c] = (float)log((i % 6 ? albedo : 0.1 * random_real() + 0.01) * exposures[row] *
                                             (row == 1 ? tint[c] : 1) * (1 + 0.1 * (random_real() - 0.5)));
            }
        }
        assert_int_equal(spl_sightings_even_out(&sightings, &samples, 4, factors, NULL), 0);
        for (int c = 0; c < 3; c++) {
            double first = (double)factors[0][c];
            assert_true(fabs((double)factors[1][c] * 4 * tint[c] / first - 1) < 0.04);
            assert_true(fabs((double)factors[2][c] * 0.5 / first - 1) < 0.04);
            assert_true(factors[3][c] == 1);
            if (own)
                assert_true(fabs(first - 1) < 0.06);
            else
                assert_true(fabs(first * (double)factors[1][c] * (double)factors[2][c] - 1) < 0.02);
        }
    }
    spl_sightings_finish(&sightings);
    free(samples.list);
}

/* ---- whole packs ---- */

static char folder[256];

static const char *path_of(const char *name)
{
    static char path[4][512];
    static int next;
    snprintf(path[next = (next + 1) % 4], 512, "%s/%s", folder, name);
    return path[next];
}

static const double place[3] = {100, 200, 50};

static void color_of(const double d[3], int out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (int)(128 + 80 * d[c]);
}

/* The room as one station of a PTX, turned by a quarter around z, and shifted. */
static void write_room(const char *path)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fprintf(f, "%d\n%d\n%g %g %g\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n%g %g %g 1\n", columns, rows,
            place[0], place[1], place[2], place[0], place[1], place[2]);
    for (int column = 0; column < columns; column++)
        for (int row = 0; row < rows; row++) {
            double d[3];
            int color[3];
            grid_direction(row, column, d);
            double range = fmax(range_of(d), 0);
            color_of(d, color);
            fprintf(f, "%.5f %.5f %.5f 0.5 %d %d %d\n", range * d[0], range * d[1], range * d[2], color[0], color[1],
                    color[2]);
        }
    assert_int_equal(fclose(f), 0);
}

static uint32_t prune;

static int pack_room(const char *input, const char *output, const struct spl_map_options *maps, unsigned threads,
                     struct spl_pack_report *report, struct spl_error *err)
{
    const struct spl_pack_options options = {.size = sizeof options,
                                             .inputs = &input,
                                             .input_count = 1,
                                             .output = output,
                                             .threads = threads,
                                             .maps = maps,
                                             .prune = prune};
    return spl_pack(&options, report, err);
}

static void a_scan_without_stations_needs_panoramas(void **state)
{
    (void)state;
    FILE *f = fopen(path_of("a.xyz"), "w");
    for (int i = 0; i < 100; i++)
        fprintf(f, "%d %d 0\n", i % 10, i / 10);
    fclose(f);
    const struct spl_map_options maps = {.size = sizeof maps};
    struct spl_error err = {0};
    assert_int_equal(pack_room(path_of("a.xyz"), path_of("a.spld"), &maps, 1, NULL, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "--panoramas"));
    assert_int_not_equal(access(path_of("a.spld"), F_OK), 0);
}

static void a_room_becomes_a_map(void **state)
{
    (void)state;
    const struct spl_map_options maps = {.size = sizeof maps};
    struct spl_pack_report report = {0};
    struct spl_error err = {0};
    struct spl_dataset *dataset, *again;
    uint32_t count, sevens = 0;
    write_room(path_of("room.ptx"));
    if (pack_room(path_of("room.ptx"), path_of("room.spld"), &maps, 2, &report, &err) ||
        pack_room(path_of("room.ptx"), path_of("again.spld"), &maps, 1, NULL, &err) ||
        spl_dataset_open_whole(path_of("room.spld"), true, &dataset, &err) ||
        spl_dataset_open_whole(path_of("again.spld"), true, &again, &err))
        fail_msg("%s", err.message);
    assert_int_equal(report.maps.stations, 1);
    const struct spl_map_row *row = spl_dataset_get_maps(dataset, &count);
    assert_int_equal(count, 1);
    assert_memory_equal(row->position, place, sizeof place);
    assert_true(row->slack < 0.02f);
    uint32_t *words = malloc(spl_map_words(row) * 4), *other = malloc(spl_map_words(row) * 4);
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, &err), 0);
    assert_int_equal(spl_dataset_read_map(again, 0, other, &err), 0);
    assert_memory_equal(words, other, spl_map_words(row) * 4); /* whatever the threads */
    const struct spl_map_sight sight = {row, words};
    uint32_t outside = 0, drops = 0, shows = 0, asked = 0, beyond = 0;
    for (int i = 0; i < 4000; i++) { /* the grid's frame is the station's: what is turned is turned back */
        double d[3], range, around[3];
        bool edge = false;
        grid_direction(rows / 3 + i * 7 % (rows / 2), i * 31 % columns, d);
        range = range_of(d);
        for (int k = 0; k < 8; k++) { /* nothing ends within three texels */
            for (int c = 0; c < 3; c++)
                around[c] = d[c] + (k >> c & 1 ? 0.05 : -0.05);
            edge |= (range_of(around) > 0) != (range > 0);
        }
        if (edge || range < 0)
            continue;
        asked++;
        if (range == 0) {
            drops += spl_map_drops(&sight, (double[3]){3 * d[0], 3 * d[1], 3 * d[2]}, 0.05, 1);
            beyond++;
            continue;
        }
        const double own[3] = {range * d[0], range * d[1], range * d[2]};
        const double before[3] = {0.5 * own[0], 0.5 * own[1], 0.5 * own[2]};
        shows += spl_map_shows(&sight, own, 0.05, 0.3) > 0.5;
        outside += spl_map_drops(&sight, own, 0.05, 0.3);
        drops += spl_map_drops(&sight, before, 0.05, 0.3);
    }
    assert_true(asked > 2000 && beyond > 100);
    assert_int_equal(outside, 0);
    assert_int_equal(drops, asked);
    assert_true(shows * 100 >= (asked - beyond) * 99);
    const struct spl_chunk_stations *stations = spl_dataset_get_chunk_stations(dataset);
    uint64_t chunks = spl_dataset_get_info(dataset)->chunks;
    for (uint64_t c = 0; c < chunks; c++) {
        assert_int_equal(stations[c].seen_by[0] & SPL_STATION_ROW, 1);
        assert_int_equal(stations[c].seen_by[1], 0);
        sevens += stations[c].seen_by[0] >> 15;
    }
    assert_true(sevens > 0 && sevens < chunks); /* around the window and the upper end of the walls, not on the floor */
    free(words);
    free(other);
    spl_dataset_close(dataset);
    spl_dataset_close(again);
}

static void colors_of_the_map_are_those_of_the_points(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_dataset *dataset;
    uint32_t count;
    double worst = 0;
    if (spl_dataset_open_whole(path_of("room.spld"), true, &dataset, &err))
        fail_msg("%s", err.message);
    const struct spl_map_row *row = spl_dataset_get_maps(dataset, &count);
    uint32_t *words = malloc(spl_map_words(row) * 4);
    assert_int_equal(spl_dataset_read_map(dataset, 0, words, &err), 0);
    for (uint32_t level = 0; level < 2; level++)
        for (int i = 0; i < 4000; i++) {
            double d[3], at[2];
            float color[3];
            int truth[3];
            grid_direction(rows / 3 + i * 7 % (rows / 2), i * 31 % columns, d);
            if (range_of(d) <= 0)
                continue;
            spl_polar_place(row->side >> level, SPL_MAP_APRON, d, at);
            spl_map_get_color(words + spl_map_level_word(row, level), row->side >> level, (uint32_t)at[0],
                              (uint32_t)at[1], color);
            color_of(d, truth);
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs((double)color[c] - truth[c]));
        }
    assert_true(worst < 14);
    free(words);
    spl_dataset_close(dataset);
}

static void a_pruned_room_has_the_same_map(void **state)
{
    (void)state;
    skip_under_tsan();
    const struct spl_map_options maps = {.size = sizeof maps};
    struct spl_pack_report report = {0};
    struct spl_error err = {0};
    uint32_t count, other_count;
    prune = 1001;
    assert_int_equal(pack_room(path_of("room.ptx"), path_of("none.spld"), &maps, 2, &report, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "prune");
    for (int with = 0; with < 2; with++) {
        struct spl_dataset *dataset = NULL, *whole = NULL;
        err = (struct spl_error){0};
        prune = 10;
        if (pack_room(path_of("room.ptx"), path_of("pruned.spld"), with ? &maps : NULL, 2, &report, &err) ||
            spl_dataset_open_whole(path_of("pruned.spld"), true, &dataset, &err) ||
            spl_dataset_open_whole(path_of("room.spld"), true, &whole, &err))
            fail_msg("%s", err.message);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        assert_true(report.pruned_of > 2 * report.leaf_splats);
        assert_true(info->leaf_splats == report.leaf_splats && info->points == spl_dataset_get_info(whole)->points);
        assert_int_equal(info->maps, with);
        const struct spl_map_row *row = spl_dataset_get_maps(dataset, &count);
        const struct spl_map_row *other = spl_dataset_get_maps(whole, &other_count);
        if (with) { /* of splats that lie in other chunks, and so decode to other last bits */
            assert_memory_equal(row, other, offsetof(struct spl_map_row, near));
            assert_float_equal(row->near, other->near, 1e-3 * (double)other->near);
            assert_float_equal(row->slack, other->slack, 0.1 * (double)other->slack);
        }
        spl_dataset_close(dataset);
        spl_dataset_close(whole);
    }
    prune = 0;
}

int main(void)
{
    make_folder(folder);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_hold_what_they_can),
        cmocka_unit_test(levels_show_no_seams),
        cmocka_unit_test(holes_are_filled_from_around),
        cmocka_unit_test(aprons_repeat_their_texels),
        cmocka_unit_test(ranges_are_those_of_the_room),
        cmocka_unit_test(tolerances_are_as_documented),
        cmocka_unit_test(maps_are_as_fine_as_their_pictures_are_worth),
        cmocka_unit_test(what_a_scan_in_part_did_not_look_at_is_not_sky),
        cmocka_unit_test(few_hits_make_a_map_all_the_same),
        cmocka_unit_test(a_shift_is_found_to_the_millimetre),
        cmocka_unit_test(what_is_turned_or_mirrored_is_called_so),
        cmocka_unit_test(exposures_are_evened_out),
        cmocka_unit_test(a_scan_without_stations_needs_panoramas),
        cmocka_unit_test(a_room_becomes_a_map),
        cmocka_unit_test(a_pruned_room_has_the_same_map),
        cmocka_unit_test(colors_of_the_map_are_those_of_the_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
