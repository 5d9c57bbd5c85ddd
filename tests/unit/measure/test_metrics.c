/* Each metric against values worked out by hand, SSIM and PSNR also against scikit-image 0.19.3 and against a direct
 * double-precision window of 11x11 as the paper has it; planted faults move the figures that they should and no others.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/memory.h"
#include "measure/metrics.h"
#include "measure/pictures.h"
#include "support/motion.h"

static bool close_to(double a, double b, double within)
{
    return fabs(a - b) <= within;
}

static struct spl_image make(enum spl_layer layer, uint32_t width, uint32_t height)
{
    static const enum spl_pixel_type types[SPL_LAYER_COUNT] = {SPL_PIXEL_RGBA8, SPL_PIXEL_F32, SPL_PIXEL_F32,
                                                               SPL_PIXEL_F32X3, SPL_PIXEL_U32, SPL_PIXEL_F32};
    return (struct spl_image){layer, types[layer], width, height,
                              calloc((size_t)width * height, spl_pixel_bytes(types[layer]))};
}

static void set(struct spl_image *image, uint32_t x, uint32_t y, int r, int g, int b, int a)
{
    uint8_t *p = (uint8_t *)image->pixels + 4 * ((size_t)y * image->width + x);
    p[0] = (uint8_t)r;
    p[1] = (uint8_t)g;
    p[2] = (uint8_t)b;
    p[3] = (uint8_t)a;
}

static struct spl_image make_flat(uint32_t width, uint32_t height, int r, int g, int b)
{
    struct spl_image image = make(SPL_LAYER_COLOR, width, height);
    for (uint32_t i = 0; i < width * height; i++)
        set(&image, i % width, i / width, r, g, b, 255);
    return image;
}

static struct spl_metrics compare(struct spl_picture image, struct spl_picture truth)
{
    struct spl_metrics m;
    struct spl_error err = {0};
    if (spl_metrics_compare(&image, &truth, 2, &m, &err))
        fail_msg("%s", err.message);
    return m;
}

static struct spl_metrics compare_colors(const struct spl_image *image, const struct spl_image *truth)
{
    return compare((struct spl_picture){.color = image}, (struct spl_picture){.color = truth});
}

static struct spl_image wrap(enum spl_layer layer, uint32_t width, uint32_t height, float *values)
{
    return (struct spl_image){layer, layer == SPL_LAYER_NORMAL ? SPL_PIXEL_F32X3 : SPL_PIXEL_F32, width, height,
                              values};
}

static void what_cannot_be_compared_is_refused_by_layer(void **state)
{
    (void)state;
    float values[12] = {0};
    struct spl_image a = wrap(SPL_LAYER_DEPTH, 2, 2, values), b = wrap(SPL_LAYER_DEPTH, 4, 1, values),
                     c = wrap(SPL_LAYER_COVERAGE, 2, 2, values), empty = wrap(SPL_LAYER_DEPTH, 0, 2, values),
                     n = wrap(SPL_LAYER_NORMAL, 2, 2, values), color = make_flat(2, 2, 1, 2, 3);
    n.type = SPL_PIXEL_F32;
    const struct {
        struct spl_picture image, truth;
        const char *field;
    } rows[] = {
        {{.depth = &a}, {.depth = &b}, "depth"},
        {{.coverage = &c}, {.depth = &b}, "coverage"},
        {{.depth = &empty}, {.depth = &a}, "depth"},
        {{.depth = &c}, {.depth = &a}, "depth"},
        {{.normal = &n}, {.depth = &a}, "normal"},
        {{.color = &a}, {.color = &color}, "color"},
        {{.depth = &a}, {.depth = &a, .tolerance = -1}, "tolerance"},
        {{.depth = &a, .tolerance = NAN}, {.depth = &a}, "tolerance"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_metrics m, before;
        struct spl_error err = {0};
        memset(&m, 0x55, sizeof m);
        before = m;
        assert_int_equal(spl_metrics_compare(&rows[i].image, &rows[i].truth, 1, &m, &err), SPL_E_INPUT);
        assert_string_equal(err.field, rows[i].field);
        assert_memory_equal(&m, &before, sizeof m);
    }
    spl_image_finish(&color);
}

static void what_lacks_a_layer_is_not_a_number(void **state)
{
    (void)state;
    struct spl_metrics m = compare((struct spl_picture){0}, (struct spl_picture){0});
    const double *figures = (const double *)&m;
    for (size_t i = 0; i < sizeof m / sizeof *figures; i++)
        assert_true(isnan(figures[i]));
    float depth[4] = {1, 1, 1, 1};
    struct spl_image a = wrap(SPL_LAYER_DEPTH, 2, 2, depth);
    m = compare((struct spl_picture){0}, (struct spl_picture){.depth = &a});
    assert_true(isnan(m.depth_rmse) && isnan(m.see_through));
    float nothing[12] = {0};
    for (int i = 0; i < 4; i++)
        depth[i] = NAN;
    struct spl_image n = wrap(SPL_LAYER_NORMAL, 2, 2, nothing), c = wrap(SPL_LAYER_COVERAGE, 2, 2, nothing);
    m = compare((struct spl_picture){.depth = &a, .normal = &n, .coverage = &c},
                (struct spl_picture){.depth = &a, .normal = &n, .coverage = &c});
    assert_true(isnan(m.depth_rmse) && isnan(m.depth_median) && isnan(m.depth_beyond) && isnan(m.see_through));
    assert_true(isnan(m.normal_mean) && isnan(m.normal_median) && isnan(m.holes));
    assert_true(m.halo == 0); /* all is empty, nothing is painted */
}

static void equal_pictures_have_no_error(void **state)
{
    (void)state;
    struct spl_image a = make_flat(16, 12, 10, 200, 30);
    set(&a, 3, 3, 9, 9, 9, 0);
    struct spl_metrics m = compare_colors(&a, &a);
    assert_true(isinf(m.psnr) && m.psnr > 0 && m.ssim == 1);
    spl_image_finish(&a);
}

static void psnr_is_over_rgb_and_over_grey(void **state)
{
    (void)state;
    struct spl_image a = make_flat(2, 2, 100, 100, 100), b = make_flat(2, 2, 100, 100, 100);
    set(&a, 1, 0, 110, 95, 100, 255); /* (100 + 25) / 12 */
    assert_true(close_to(compare_colors(&a, &b).psnr, 10 * log10(65025.0 * 12 / 125), 1e-12));
    assert_true(isnan(compare_colors(&a, &b).ssim)); /* smaller than the window */
    set(&a, 1, 0, 7, 8, 9, 0);                       /* nothing there: 128 whatever the colour */
    assert_true(close_to(compare_colors(&a, &b).psnr, 10 * log10(65025.0 * 12 / (3 * 28 * 28)), 1e-12));
    set(&b, 1, 0, 255, 0, 99, 0);
    assert_true(isinf(compare_colors(&a, &b).psnr));
    set(&a, 1, 0, 200, 128, 1, 51); /* a fifth: 128 + 72/5 = 142.4, 128, 128 - 127/5 = 102.6 */
    assert_true(close_to(compare_colors(&a, &b).psnr, 10 * log10(65025.0 * 12 / (14 * 14 + 25 * 25)), 1e-12));
    spl_image_finish(&a);
    spl_image_finish(&b);
}

/* The pair whose figures scikit-image gave. */
static void make_pair(struct spl_image *image, struct spl_image *truth, uint32_t width, uint32_t height)
{
    uint32_t state = 12345;
    *image = make(SPL_LAYER_COLOR, width, height);
    *truth = make(SPL_LAYER_COLOR, width, height);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            int t[3], i[3];
            for (uint32_t c = 0; c < 3; c++) {
                state = state * 1664525 + 1013904223;
                t[c] = (x * 3 + y * 2 + c * 40 + (x * y & 63)) & 255;
                i[c] = t[c] + (int)(state >> 27) - 16;
                i[c] = i[c] < 0 ? 0 : i[c] > 255 ? 255 : i[c];
            }
            set(truth, x, y, t[0], t[1], t[2], 255);
            set(image, x, y, i[0], i[1], i[2], 255);
        }
}

static double luma(const struct spl_image *image, uint32_t x, uint32_t y)
{
    const uint8_t *p = (const uint8_t *)image->pixels + 4 * ((size_t)y * image->width + x);
    return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

/* Wang et al. 2004, eq. 13 to 16, as they stand: moments about the means. */
static double direct_ssim(const struct spl_image *a, const struct spl_image *b)
{
    double total = 0, norm = 0, weights[11][11];
    for (int v = 0; v < 11; v++)
        for (int u = 0; u < 11; u++)
            norm += weights[v][u] = exp(-((u - 5) * (u - 5) + (v - 5) * (v - 5)) / (2 * 1.5 * 1.5));
    for (uint32_t y = 0; y + 11 <= a->height; y++)
        for (uint32_t x = 0; x + 11 <= a->width; x++) {
            double ma = 0, mb = 0, va = 0, vb = 0, cov = 0, c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
            for (uint32_t i = 0; i < 121; i++) {
                ma += weights[i / 11][i % 11] / norm * luma(a, x + i % 11, y + i / 11);
                mb += weights[i / 11][i % 11] / norm * luma(b, x + i % 11, y + i / 11);
            }
            for (uint32_t i = 0; i < 121; i++) {
                double w = weights[i / 11][i % 11] / norm;
                double da = luma(a, x + i % 11, y + i / 11) - ma, db = luma(b, x + i % 11, y + i / 11) - mb;
                va += w * da * da;
                vb += w * db * db;
                cov += w * da * db;
            }
            total += (2 * ma * mb + c1) * (2 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
        }
    return total / ((a->width - 10.0) * (a->height - 10.0));
}

static void psnr_and_ssim_are_those_of_others(void **state)
{
    (void)state;
    struct spl_image image, truth;
    make_pair(&image, &truth, 61, 43);
    struct spl_metrics m = compare_colors(&image, &truth);
    /* scikit-image 0.19.3: peak_signal_noise_ratio(T, I, data_range=255) and structural_similarity of the lumas with
     * gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=255 */
    assert_true(close_to(m.psnr, 29.011484049442693, 1e-9));
    assert_true(close_to(m.ssim, 0.9561915559205566, 1e-7));
    assert_true(close_to(m.ssim, direct_ssim(&image, &truth), 1e-7));
    spl_image_finish(&image);
    spl_image_finish(&truth);
    for (uint32_t side = 11; side < 14; side++) { /* windows at the edge of what fits */
        make_pair(&image, &truth, side, 24 - side);
        assert_true(close_to(compare_colors(&image, &truth).ssim, direct_ssim(&image, &truth), 1e-7));
        spl_image_finish(&image);
        spl_image_finish(&truth);
    }
    /* a smooth bright surface, where variances are small against the squares of the means */
    make_pair(&image, &truth, 32, 32);
    for (uint32_t i = 0; i < 32 * 32; i++) {
        set(&truth, i % 32, i / 32, 250, 251, 252 + (int)(i % 32 / 16), 255);
        set(&image, i % 32, i / 32, 250, 251 + (int)(i & 1), 252, 255);
    }
    assert_true(close_to(compare_colors(&image, &truth).ssim, direct_ssim(&image, &truth), 1e-7));
    spl_image_finish(&image);
    spl_image_finish(&truth);
}

static void depth_errors_are_those_worked_out_by_hand(void **state)
{
    (void)state;
    float truth[] = {1, 2, 3, NAN, 5, 6}, image[] = {1.5f, 2, 2, 4, INFINITY, 6.25f};
    struct spl_image t = wrap(SPL_LAYER_DEPTH, 6, 1, truth), i = wrap(SPL_LAYER_DEPTH, 6, 1, image);
    /* both: |errors| 0.5, 0, 1, 0.25 */
    struct spl_metrics m =
        compare((struct spl_picture){.depth = &i}, (struct spl_picture){.depth = &t, .tolerance = 0.25});
    assert_true(close_to(m.depth_rmse, sqrt((0.25 + 0 + 1 + 0.0625) / 4), 1e-12));
    assert_true(m.depth_median == 0.375);
    assert_true(m.depth_beyond == 0.5); /* 0.25 is not beyond 0.25 */
    /* five are truly covered; 1.5 lies before its neighbour's 2, 6.25 is within the tolerance */
    assert_true(m.see_through == 0);
    m = compare((struct spl_picture){.depth = &i}, (struct spl_picture){.depth = &t, .tolerance = 0.125});
    assert_true(m.depth_beyond == 0.75 && m.see_through == 1.0 / 5);
    /* the image's tolerance counts where the truth has none; a tolerance a pixel goes before one for all */
    m = compare((struct spl_picture){.depth = &i, .tolerance = 0.25}, (struct spl_picture){.depth = &t});
    assert_true(m.depth_beyond == 0.5);
    float tolerances[] = {0.4f, 9, 2, 0, 0, NAN};
    m = compare((struct spl_picture){.depth = &i, .tolerance_m = tolerances, .tolerance = 99},
                (struct spl_picture){.depth = &t});
    assert_true(m.depth_beyond == 0.25);
    image[5] = NAN; /* three are left: 0, 0.5, 1 */
    m = compare((struct spl_picture){.depth = &i}, (struct spl_picture){.depth = &t});
    assert_true(m.depth_median == 0.5);
}

static void the_median_is_exact_for_many_values(void **state)
{
    (void)state;
    enum { side = 101, count = side * side };
    static float truth[count], image[count];
    for (int i = 0; i < count; i++) { /* errors i * 1e-3 in some order; the middle one is 5.1 */
        truth[i] = 0;
        image[i] = (float)(i * 3571 % count) * 1e-3f;
    }
    struct spl_image t = wrap(SPL_LAYER_DEPTH, side, side, truth), i = wrap(SPL_LAYER_DEPTH, side, side, image);
    struct spl_metrics m = compare((struct spl_picture){.depth = &i}, (struct spl_picture){.depth = &t});
    assert_true(m.depth_median == (double)((float)(count / 2) * 1e-3f));
}

static void see_through_looks_at_the_neighbourhood(void **state)
{
    (void)state;
    /* a wall at 2 before a wall at 10; the image lets the far one through two columns beyond the edge */
    float truth[5 * 3], image[5 * 3];
    for (int i = 0; i < 15; i++) {
        truth[i] = i % 5 < 3 ? 2 : 10;
        image[i] = i % 5 < 1 ? 2 : 10;
    }
    struct spl_image t = wrap(SPL_LAYER_DEPTH, 5, 3, truth), i = wrap(SPL_LAYER_DEPTH, 5, 3, image);
    struct spl_metrics m =
        compare((struct spl_picture){.depth = &i}, (struct spl_picture){.depth = &t, .tolerance = 0.1});
    assert_true(m.see_through == 3.0 / 15); /* column 1; column 2 has the far wall beside it */
    assert_true(m.depth_beyond == 6.0 / 15);
    m = compare((struct spl_picture){.depth = &t}, (struct spl_picture){.depth = &i, .tolerance = 0.1});
    assert_true(m.see_through == 0); /* in front of the truth is no see-through */
    for (int k = 0; k < 15; k++)
        image[k] = NAN; /* holes are not seen through, either */
    m = compare((struct spl_picture){.depth = &i}, (struct spl_picture){.depth = &t});
    assert_true(m.see_through == 0 && isnan(m.depth_beyond));
}

static void holes_and_halo_are_counted(void **state)
{
    (void)state;
    enum { width = 6, height = 4 };
    /* covered but for one pixel that is covered by half, in the left half; the right one is empty */
    float truth[width * height], image[width * height];
    for (int i = 0; i < width * height; i++)
        truth[i] = image[i] = i % width < 3 ? 1 : 0;
    truth[0] = 0.5f;
    image[0] = 0;                /* not fully covered: no hole */
    image[1] = 0.49f;            /* a hole */
    image[2] = 0.5f;             /* none */
    image[width + 1] = NAN;      /* a hole */
    image[3] = 1;                /* beside the surface: no halo */
    image[5] = 0.5f;             /* halo */
    image[2 * width + 4] = 0.4f; /* less than half */
    struct spl_image t = wrap(SPL_LAYER_COVERAGE, width, height, truth),
                     i = wrap(SPL_LAYER_COVERAGE, width, height, image);
    struct spl_metrics m = compare((struct spl_picture){.coverage = &i}, (struct spl_picture){.coverage = &t});
    assert_true(m.holes == 2.0 / 11);
    assert_true(m.halo == 1.0 / 8);
    truth[2 * width + 5] = 0.01f; /* a wire empties its surroundings: rows 1 to 3 of columns 4 and 5 */
    m = compare((struct spl_picture){.coverage = &i}, (struct spl_picture){.coverage = &t});
    assert_true(m.halo == 1.0 / 2);
}

/* Blocks meet at 1024 pixels; neighbours across the seam count. */
static void the_neighbourhood_crosses_blocks(void **state)
{
    (void)state;
    enum { width = 3000 };
    static float truth[width], image[width];
    for (int i = 0; i < width; i++)
        image[i] = 1;
    truth[1023] = truth[2048] = 1;
    struct spl_image t = wrap(SPL_LAYER_COVERAGE, width, 1, truth), i = wrap(SPL_LAYER_COVERAGE, width, 1, image);
    struct spl_metrics m = compare((struct spl_picture){.coverage = &i}, (struct spl_picture){.coverage = &t});
    assert_true(m.holes == 0 && m.halo == 1);
    image[1022] = image[1024] = image[2047] = image[2049] = 0;
    m = compare((struct spl_picture){.coverage = &i}, (struct spl_picture){.coverage = &t});
    assert_true(m.halo == 1); /* those four were not asked */
    image[1025] = 0;
    m = compare((struct spl_picture){.coverage = &i}, (struct spl_picture){.coverage = &t});
    assert_true(close_to(m.halo, 1 - 1.0 / (width - 6), 1e-12));
}

static void normals_are_lines_without_a_sign(void **state)
{
    (void)state;
    float s = sinf((float)(M_PI / 6)), c = cosf((float)(M_PI / 6));
    float truth[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 1, 0, 0};
    float image[] = {0, 0, -1, 0, s, c, 1, 0, 0, 1, 0, 0, NAN, 0, 1, 2, 0.002f, 0};
    struct spl_image t = wrap(SPL_LAYER_NORMAL, 6, 1, truth), i = wrap(SPL_LAYER_NORMAL, 6, 1, image);
    struct spl_metrics m = compare((struct spl_picture){.normal = &i}, (struct spl_picture){.normal = &t});
    double small = 0.001 * 180 / M_PI; /* not of unit length, either */
    assert_true(close_to(m.normal_mean, (0 + 30 + 90 + small) / 4, 1e-4));
    assert_true(close_to(m.normal_median, (30 + small) / 2, 1e-4));
}

/* Everything that a fault can touch, on a surface that fills the picture but for a strip of sky. */
static void any_number_of_threads_gives_the_same_bits(void **state)
{
    (void)state;
    enum { width = 211, height = 97 };
    struct spl_image a[2][4];
    uint32_t random = 7;
    for (int k = 0; k < 2; k++) {
        static const enum spl_layer layers[] = {SPL_LAYER_COLOR, SPL_LAYER_DEPTH, SPL_LAYER_NORMAL, SPL_LAYER_COVERAGE};
        for (int l = 0; l < 4; l++) {
            a[k][l] = make(layers[l], width, height);
            for (size_t i = 0; i < (size_t)width * height * (l == 2 ? 3 : 1); i++) {
                random = random * 1664525 + 1013904223;
                if (l)
                    ((float *)a[k][l].pixels)[i] = random >> 30 ? (float)(random >> 8) * 0x1p-22f : l == 1 ? NAN : 0;
                else
                    ((uint32_t *)a[k][l].pixels)[i] = random;
            }
        }
    }
    struct spl_picture image = {&a[0][0], &a[0][1], &a[0][2], &a[0][3]},
                       truth = {&a[1][0], &a[1][1], &a[1][2], &a[1][3]};
    truth.tolerance = 0.3;
    struct spl_metrics one, many;
    assert_int_equal(spl_metrics_compare(&image, &truth, 1, &one, NULL), 0);
    for (unsigned threads = 2; threads < 9; threads += 3) {
        assert_int_equal(spl_metrics_compare(&image, &truth, threads, &many, NULL), 0);
        assert_memory_equal(&one, &many, sizeof one);
    }
    assert_true(one.see_through > 0 && one.holes > 0 && one.normal_mean > 0 && one.ssim < 0.1 && one.depth_rmse > 0);
    int rc = SPL_E_NOMEM, n = 0;
    while (rc == SPL_E_NOMEM) { /* no refused allocation is passed over */
        struct spl_error err = {0};
        spl_memory_fail_after(++n);
        rc = spl_metrics_compare(&image, &truth, 2, &many, &err);
        spl_memory_fail_after(0);
        assert_int_equal(err.code, rc);
    }
    assert_true(rc == 0 && n > 5);
    for (int k = 0; k < 2; k++)
        for (int l = 0; l < 4; l++)
            spl_image_finish(&a[k][l]);
}

/* ---- planted faults ---- */

/* A grating A sin(2 pi f x), seen half a pixel aside, differs by the mean square A^2 (1 - cos(pi f)). */
static void half_a_pixel_aside_costs_what_the_grating_says(void **state)
{
    (void)state;
    static const double frequencies[] = {1 / 64.0, 1 / 16.0, 1 / 4.0};
    for (int k = 0; k < 3; k++) {
        double f = frequencies[k], amplitude = 100;
        struct spl_image a = make(SPL_LAYER_COLOR, 256, 32), b = make(SPL_LAYER_COLOR, 256, 32);
        for (uint32_t i = 0; i < 256 * 32; i++) {
            int t = (int)lrint(128 + amplitude * sin(2 * M_PI * f * (i % 256)));
            int s = (int)lrint(128 + amplitude * sin(2 * M_PI * f * (i % 256 + 0.5)));
            set(&a, i % 256, i / 256, s, s, s, 255);
            set(&b, i % 256, i / 256, t, t, t, 255);
        }
        double expected = 10 * log10(65025 / (amplitude * amplitude * (1 - cos(M_PI * f))));
        struct spl_metrics m = compare_colors(&a, &b);
        assert_true(close_to(m.psnr, expected, 0.1)); /* rounding to levels */
        assert_true(close_to(m.ssim, direct_ssim(&a, &b), 1e-7));
        assert_true(k < 2 ||
                    close_to(m.ssim, cos(M_PI * f), 0.01)); /* the window sees whole waves: their correlation */
        spl_image_finish(&a);
        spl_image_finish(&b);
    }
}

static void swapped_channels_show(void **state)
{
    (void)state;
    struct spl_image a = make_flat(20, 20, 200, 90, 50), b = make_flat(20, 20, 50, 90, 200);
    struct spl_metrics m = compare_colors(&a, &b);
    assert_true(close_to(m.psnr, 10 * log10(65025.0 * 3 / (2 * 150 * 150)), 1e-9));
    double x = 0.299 * 200 + 0.587 * 90 + 0.114 * 50, y = 0.299 * 50 + 0.587 * 90 + 0.114 * 200, c1 = 6.5025;
    assert_true(
        close_to(m.ssim, (2 * x * y + c1) / (x * x + y * y + c1), 1e-7)); /* flat: the term of luminance alone */
    spl_image_finish(&a);
    spl_image_finish(&b);
    a = make_flat(20, 20, 2, 2, 2); /* in the dark, C1 decides */
    b = make_flat(20, 20, 5, 5, 5);
    assert_true(close_to(compare_colors(&a, &b).ssim, (2 * 2 * 5 + c1) / (2 * 2 + 5 * 5 + c1), 1e-7));
    spl_image_finish(&a);
    spl_image_finish(&b);
}

static void one_dark_pixel_shows(void **state)
{
    (void)state;
    struct spl_image a = make_flat(64, 48, 100, 100, 100), b = make_flat(64, 48, 100, 100, 100);
    set(&a, 30, 20, 0, 0, 0, 255);
    struct spl_metrics m = compare_colors(&a, &b);
    assert_true(close_to(m.psnr, 10 * log10(65025.0 * 64 * 48 / 10000), 1e-9));
    /* 121 of 2052 windows see it, those around its edge less */
    assert_true(close_to(m.ssim, direct_ssim(&a, &b), 1e-7) && m.ssim < 1 - 0.01);
    spl_image_finish(&a);
    spl_image_finish(&b);
}

static void an_offset_in_depth_shows_and_only_there(void **state)
{
    (void)state;
    enum { width = 40, height = 30, count = width * height };
    static float truth[count], image[count], coverage[count], normals[3 * count];
    struct spl_image t = wrap(SPL_LAYER_DEPTH, width, height, truth), i = wrap(SPL_LAYER_DEPTH, width, height, image);
    struct spl_image c = wrap(SPL_LAYER_COVERAGE, width, height, coverage),
                     n = wrap(SPL_LAYER_NORMAL, width, height, normals);
    for (int s = -1; s <= 1; s += 2)
        for (int k = 1; k <= 2; k++) {
            for (int p = 0; p < count; p++) {
                truth[p] = 8;
                image[p] = 8 + (float)(s * k) * 0.0625f;
                coverage[p] = normals[3 * p] = 1;
            }
            struct spl_metrics m =
                compare((struct spl_picture){.depth = &i, .coverage = &c, .normal = &n},
                        (struct spl_picture){.depth = &t, .coverage = &c, .normal = &n, .tolerance = 0.1});
            assert_true(m.depth_rmse == k * 0.0625 && m.depth_median == k * 0.0625);
            assert_true(m.depth_beyond == (k == 2) && m.see_through == (k == 2 && s > 0));
            assert_true(m.holes == 0 && isnan(m.halo) && m.normal_mean == 0);
        }
}

static void an_error_map_is_eight_times_the_difference(void **state)
{
    (void)state;
    enum { width = 1030 }; /* beyond a block */
    struct spl_image a = make_flat(width, 2, 100, 100, 100), b = make_flat(width, 2, 100, 100, 100), map;
    set(&a, 5, 0, 101, 90, 0, 255);
    set(&a, width - 1, 1, 255, 255, 255, 0); /* nothing there: grey 128 */
    assert_int_equal(spl_error_map(&a, &b, &map, NULL), 0);
    assert_true(map.layer == SPL_LAYER_COLOR && map.type == SPL_PIXEL_RGBA8 && map.width == width && map.height == 2);
    const uint8_t *p = map.pixels;
    assert_memory_equal(p, "\0\0\0\377", 4);
    assert_memory_equal(p + 4 * 5, "\10\120\377\377", 4);
    assert_memory_equal(p + 4 * (2 * width - 1), "\340\340\340\377", 4);
    spl_image_finish(&map);
    struct spl_error err = {0};
    b.width--;
    assert_int_equal(spl_error_map(&a, &b, &map, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "color");
    assert_null(map.pixels);
    b.width++;
    b.type = SPL_PIXEL_F32;
    assert_int_equal(spl_error_map(&a, &b, &map, NULL), SPL_E_INPUT);
    b.type = SPL_PIXEL_RGBA8;
    spl_memory_fail_after(1);
    assert_int_equal(spl_error_map(&a, &b, &map, NULL), SPL_E_NOMEM);
    spl_memory_fail_after(0);
    spl_image_finish(&a);
    spl_image_finish(&b);
}

/* ---- along a path ---- */

static void flicker_is_change_that_the_truth_does_not_have(void **state)
{
    (void)state;
    enum { side = 40, pixels = side * side };
    struct motion motion = {0};
    double flicker, popping;
    for (int frame = 0; frame < 5; frame++) { /* the truth changes, the error does not */
        struct spl_image truth = make_flat(side, side, 50 + 10 * frame, 60, 70),
                         image = make_flat(side, side, 55 + 10 * frame, 57, 70);
        motion_add(&motion, &image, &truth);
        if (frame == 0) {
            struct motion copy = motion;
            copy.previous = NULL;
            motion_finish(&copy, &flicker, NULL);
            assert_true(isnan(flicker)); /* one frame has no step */
        }
        spl_image_finish(&truth);
        spl_image_finish(&image);
    }
    motion_finish(&motion, &flicker, &popping);
    assert_true(flicker == 0 && popping == 0);
    assert_null(motion.previous);

    struct spl_image truth = make_flat(side, side, 100, 100, 100), image = make_flat(side, side, 100, 100, 100);
    for (int frame = 0; frame < 5; frame++) { /* a dark pixel in frame 2 alone: steps 0, 1, 1, 0 */
        set(&image, 7, 9, frame == 2 ? 0 : 100, 100, 100, 255);
        motion_add(&motion, &image, &truth);
    }
    motion_finish(&motion, &flicker, &popping);
    assert_true(close_to(flicker, sqrt(2 * 10000.0 / (3 * pixels) / 4), 1e-12));
    assert_true(close_to(popping, sqrt(10000.0 / (3 * pixels)), 1e-12));

    for (int frame = 0; frame < 2; frame++) { /* the largest step there is: from +255 to -255 */
        struct spl_image black = make_flat(side, side, 0, 0, 0), white = make_flat(side, side, 255, 255, 255);
        motion_add(&motion, frame ? &black : &white, frame ? &white : &black);
        spl_image_finish(&black);
        spl_image_finish(&white);
    }
    motion_finish(&motion, &flicker, &popping);
    assert_true(flicker == 510 && popping == 510);
    spl_image_finish(&truth);
    spl_image_finish(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_cannot_be_compared_is_refused_by_layer),
        cmocka_unit_test(what_lacks_a_layer_is_not_a_number),
        cmocka_unit_test(equal_pictures_have_no_error),
        cmocka_unit_test(psnr_is_over_rgb_and_over_grey),
        cmocka_unit_test(psnr_and_ssim_are_those_of_others),
        cmocka_unit_test(depth_errors_are_those_worked_out_by_hand),
        cmocka_unit_test(the_median_is_exact_for_many_values),
        cmocka_unit_test(see_through_looks_at_the_neighbourhood),
        cmocka_unit_test(holes_and_halo_are_counted),
        cmocka_unit_test(the_neighbourhood_crosses_blocks),
        cmocka_unit_test(normals_are_lines_without_a_sign),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
        cmocka_unit_test(half_a_pixel_aside_costs_what_the_grating_says),
        cmocka_unit_test(swapped_channels_show),
        cmocka_unit_test(one_dark_pixel_shows),
        cmocka_unit_test(an_offset_in_depth_shows_and_only_there),
        cmocka_unit_test(an_error_map_is_eight_times_the_difference),
        cmocka_unit_test(flicker_is_change_that_the_truth_does_not_have),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
