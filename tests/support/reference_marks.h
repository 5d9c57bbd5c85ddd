/* Which splats are soft, in plain C: by the value that a splat decodes to and by where it lies, in doubles, straight
 * from the view's terms; and what the kernel makes of a chunk's tests, word by word. Shares nothing with src/render but
 * the layout of the tests. */
#ifndef TEST_SUPPORT_REFERENCE_MARKS_H
#define TEST_SUPPORT_REFERENCE_MARKS_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/dataset.h>
#include <splatd/soft.h>

/* The distance that a term of a shape measures at `p`, world. */
double reference_distance(const struct spl_term *term, const double p[3]);

/* The same of any shape of `terms`. */
double reference_distance_of(const struct spl_terms *terms, const struct spl_term *term, const double p[3]);

/* Does a view's clip leave what lies at `p`, world, of splat, panel or mesh `id` (UINT64_MAX: it has no attributes)?
 * Opens quantiles as little as the next. */
bool reference_is_drawn(const struct spl_dataset *dataset, const struct spl_terms *clip, uint64_t id,
                        const double p[3]);

/* As cut.glsl, of the words from `first` on, at `p`, view space. */
bool reference_is_kept(const uint32_t *tests, uint32_t first, uint32_t known, const float p[3]);

/* W of eq. 22 of what measures `value` in a term whose range is blended over `blend`: 0 to 1; negative where it is not
 * soft. NaN is no value. */
double reference_share(const struct spl_term *term, double blend, double value);

/* Is splat, panel or mesh `id`, at `p`, soft? Opens no quantiles: of terms by value alone, `p99` that of
 * uncertainty. */
bool reference_is_soft(const struct spl_dataset *dataset, const struct spl_soft_params *soft, uint64_t id,
                       const double p[3]);

/* As soft_mark.comp: item `index` at `p`, view space, of a chunk whose tests begin at word `first` of `tests`. */
uint32_t reference_mark(const uint32_t *tests, uint32_t first, const uint32_t *page, uint32_t index, const float p[3]);

#endif
