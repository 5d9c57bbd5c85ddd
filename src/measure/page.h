/* The page of a sweep: chart, pictures with their error maps, tables; one HTML file that needs nothing else. */
#ifndef SPL_MEASURE_PAGE_H
#define SPL_MEASURE_PAGE_H

#include "measure/report.h"

/* Reads the sweep's pictures from its folder. `svg` is the chart's text, without any outside markup. *html is released
 * with free(). Errors: SPL_E_IO names a picture that is gone. Blocks on disk. */
int spl_page_write(const struct spl_report *report, const struct spl_peers *peers, const char *svg, char **html,
                   size_t *length, struct spl_error *err);

#endif
