/* Between sRGB levels, 0..255, and linear light, 0..1 (IEC 61966-2-1). Levels need not be whole. Any thread. */
#ifndef SPL_SYNTH_LIGHT_H
#define SPL_SYNTH_LIGHT_H

#include <math.h>

static inline double light_of_level(double level)
{
    double s = level / 255;
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static inline double level_of_light(double light)
{
    double s = light <= 0.0031308 ? light * 12.92 : 1.055 * pow(light, 1 / 2.4) - 0.055;
    return 255 * s;
}

#endif
