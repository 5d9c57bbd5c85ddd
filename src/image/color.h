/* Colours from text. */
#ifndef SPL_IMAGE_COLOR_H
#define SPL_IMAGE_COLOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* RRGGBB or RRGGBBAA in hex, with or without # or 0x; a name of CSS Color 4 in any case; transparent. False, `rgba`
 * untouched, for anything else. */
bool spl_color_from_text(const char *text, uint8_t rgba[4]);
#define SPL_COLOR_FORMS "a CSS name such as white, RRGGBB, RRGGBBAA or transparent"

/* The names in their order, NULL behind the last. */
const char *spl_color_name(size_t index);

#endif
