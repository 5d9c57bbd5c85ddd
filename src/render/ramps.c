/* Colours of values: ramps by name, and the usual ones of the classes of laser scans (ASPRS). viridis and turbo are
 * polynomials near the tables they are known by: a level to four, at turbo's dark ends up to 32. Pure functions; any
 * thread. */
#include <math.h>
#include <string.h>

#include "render/paint.h"

static const char *const names[SPL_RAMP_COUNT] = {
    [SPL_RAMP_AUTO] = "auto", [SPL_RAMP_VIRIDIS] = "viridis", [SPL_RAMP_TURBO] = "turbo",
    [SPL_RAMP_GREY] = "grey", [SPL_RAMP_TERRAIN] = "terrain",
};

const char *spl_ramp_name(enum spl_ramp ramp)
{
    return (unsigned)ramp < SPL_RAMP_COUNT ? names[ramp] : "unknown";
}

int spl_ramp_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_RAMP_COUNT; i++)
        if (!strcmp(name, names[i]))
            return i;
    return -1;
}

enum { terms = 7 };
static const double viridis[3][terms] = {
    {0.2777273272234177, 0.1050930431085774, -0.3308618287255563, -4.634230498983486, 6.228269936347081,
     4.776384997670288, -5.435455855934631},
    {0.005407344544966578, 1.404613529898575, 0.214847559468213, -5.799100973351585, 14.17993336680509,
     -13.74514537774601, 4.645852612178535},
    {0.3340998053353061, 1.384590162594685, 0.09509516302823659, -19.33244095627987, 56.69055260068105,
     -65.35303263337234, 26.3124352495832},
};
static const double turbo[3][terms] = {
    {0.13572138, 4.61539260, -42.66032258, 132.13108234, -152.94239396, 59.28637943, 0},
    {0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604, 0},
    {0.10667330, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973, 0},
};
static const double terrain[][4] = {{0, 51, 51, 153},      {0.15, 0, 153, 255},  {0.25, 0, 204, 102},
                                    {0.5, 255, 255, 153}, {0.75, 128, 92, 84}, {1, 255, 255, 255}};

static double polynomial(const double c[terms], double t)
{
    double sum = 0;
    for (int i = terms; i-- > 0;)
        sum = sum * t + c[i];
    return 255 * sum;
}

static double between(int channel, double t)
{
    int i = 1;
    while (t > terrain[i][0])
        i++;
    const double along = (t - terrain[i - 1][0]) / (terrain[i][0] - terrain[i - 1][0]);
    return terrain[i - 1][1 + channel] + along * (terrain[i][1 + channel] - terrain[i - 1][1 + channel]);
}

void spl_ramp_get(enum spl_ramp ramp, double share, uint8_t rgb[3])
{
    const double t = fmin(fmax(share, 0), 1);
    for (int i = 0; i < 3; i++) {
        const double level = ramp == SPL_RAMP_GREY      ? 255 * t
                             : ramp == SPL_RAMP_TURBO   ? polynomial(turbo[i], t)
                             : ramp == SPL_RAMP_TERRAIN ? between(i, t)
                                                        : polynomial(viridis[i], t);
        rgb[i] = (uint8_t)lround(fmin(fmax(level, 0), 255));
    }
}

static const struct {
    const char *name;
    uint32_t color; /* rrggbb */
} classes[] = {
    {"never classified", 0xbababa}, {"unclassified", 0xaaaaaa},    {"ground", 0xaa5500},
    {"low vegetation", 0x00aaaa},   {"medium vegetation", 0x55ff55}, {"high vegetation", 0x00aa00},
    {"building", 0xff5555},         {"low point", 0xaa0000},       {"reserved", 0x555555},
    {"water", 0x55ffff},            {"rail", 0xaa00aa},            {"road surface", 0x404060},
    {"reserved", 0x555555},         {"wire guard", 0xffff55},      {"wire conductor", 0xffff00},
    {"transmission tower", 0x5555ff}, {"wire connector", 0xff8000}, {"bridge deck", 0x8080aa},
    {"high noise", 0xff0000},
};
enum { class_count = sizeof classes / sizeof *classes };

/* Those that have no colour of their own get one of twelve, which differ most between neighbours. */
static const uint32_t others[] = {0x1f78b4, 0x33a02c, 0xe31a1c, 0xff7f00, 0x6a3d9a, 0xb15928,
                                  0xa6cee3, 0xb2df8a, 0xfb9a99, 0xfdbf6f, 0xcab2d6, 0xffff99};
enum { other_count = sizeof others / sizeof *others };

uint32_t spl_class_get_color(uint32_t number)
{
    const uint32_t c = number < class_count ? classes[number].color : others[(number - class_count) % other_count];
    return c >> 16 | (c & 0xff00) | (c & 0xff) << 16;
}

const char *spl_class_get_name(uint32_t number)
{
    return number < class_count ? classes[number].name : NULL;
}

enum spl_ramp spl_color_get_ramp(const struct spl_color_params *color)
{
    if (color->ramp != SPL_RAMP_AUTO)
        return color->ramp;
    return color->by == SPL_COLOR_BY_HEIGHT                                              ? SPL_RAMP_TERRAIN
           : color->by == SPL_COLOR_BY_ATTRIBUTE && !strcmp(color->name, "intensity") ? SPL_RAMP_GREY
                                                                                      : SPL_RAMP_VIRIDIS;
}
