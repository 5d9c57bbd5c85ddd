/* What scans were taken for: nothing in a text says which column is which, or how many bits colours have, so
 * a guess that is wrong must be seen before hours of work. The caller's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pack/names.h"
#include "pack/scans.h"
#include "pack/warn.h"

enum { kinds_told = 8 };

static void add(char *text, size_t size, const char *format, const char *of)
{
    size_t used = strlen(text);
    if (used)
        used += (size_t)snprintf(text + used, size - used, "; ");
    snprintf(text + used, size - used, format, of);
}

int spl_scan_guess(const struct spl_cloud_info *info, char **out, struct spl_error *err)
{
    char text[1200] = "", white[16];
    bool bits = info->colors.from == SPL_COLORS_RGB && info->colors.guessed && info->colors.white > 255 &&
                info->colors.white < 65535;
    *out = NULL;
    if (info->guessed[0] == '-')
        add(text, sizeof text, "columns are %s by their values, of which the first numbers, names or times the points",
            info->guessed);
    else if (info->guessed[0] && strcmp(info->guessed, "x,y,z") != 0)
        add(text, sizeof text, "columns are %s by their values", info->guessed);
    if (text[0])
        add(text, sizeof text, "%s", "--columns says otherwise");
    if (info->north_first)
        add(text, sizeof text, "%s, as where the north comes before the east: then y and x change places in --columns",
            info->north_first);
    if (info->surveyors)
        add(text, sizeof text, "%s", "Y is the east and X the north, as surveyors have it: x and y here");
    if (info->units[0])
        add(text, sizeof text,
            "its headings name %s, which is no unit of all three and not used: --unit says which one it is",
            info->units);
    if (info->footer[0])
        add(text, sizeof text, "%s", info->footer);
    if (info->unused[0])
        add(text, sizeof text,
            !strcmp(info->format, "PLY")   ? "properties not used: %s"
            : !strcmp(info->format, "PCD") ? "fields not used: %s"
                                           : "columns not used: %s",
            info->unused);
    snprintf(white, sizeof white, "%g", bits ? info->colors.white : info->colors.dark);
    if (bits)
        add(text, sizeof text, "0 is black and %s white by the largest colour", white);
    else if (info->colors.dark > 0)
        add(text, sizeof text, "colours are nearly black: 65535 is white, and none is above %s", white);
    if (text[0] && !(*out = strdup(text)))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a note");
    return SPL_OK;
}

/* Of many kinds the first are enough. */
void spl_scans_tell(const struct spl_scans *scans, void (*note)(void *context, const char *text), void *context)
{
    const char *told[kinds_told];
    size_t kinds = 0;
    for (size_t i = 0; i < scans->count && kinds < kinds_told; i++) {
        struct spl_names names = {0};
        bool again = !scans->list[i].guess;
        for (size_t k = 0; k < kinds && !again; k++)
            again = strcmp(told[k], scans->list[i].guess) == 0;
        if (again)
            continue;
        told[kinds++] = scans->list[i].guess;
        for (size_t k = i; k < scans->count; k++)
            if (scans->list[k].guess && strcmp(scans->list[i].guess, scans->list[k].guess) == 0)
                spl_names_add(&names, scans->list[k].name);
        spl_pack_warn(note, context, "%s: %s", spl_names_list(&names), scans->list[i].guess);
    }
}

void spl_scans_tell_unit(const struct spl_scans *scans, void (*note)(void *context, const char *text), void *context)
{
    struct spl_names names = {0};
    for (size_t i = 0; i < scans->count; i++)
        if (!strcmp(scans->list[i].format, "PTX"))
            spl_names_add(&names, scans->list[i].name);
    if (names.count)
        spl_pack_warn(note, context, "%s: PTX says no unit, and most are in metres: --unit m says so",
                      spl_names_list(&names));
}
