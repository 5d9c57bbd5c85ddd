/* Numbers that points bring beside position, colour and class: intensity, returns, which scan they are of, and what a
 * user names. Each is an array of the smallest type that holds its values so far, and a rule by which they become the
 * whole numbers that a dataset keeps. */
#ifndef SPL_PACK_SCALARS_H
#define SPL_PACK_SCALARS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "cloud/cloud.h"
#include "pack/spill.h"

/* Those of a cloud (enum spl_scalar), and the scan's number. */
enum { SPL_SCALAR_SCAN = SPL_SCALAR_COUNT, SPL_POINT_SCALARS };

enum spl_storage { SPL_STORE_U8, SPL_STORE_U16, SPL_STORE_I32, SPL_STORE_F32, SPL_STORE_F64 };

/* How values become numbers. */
struct spl_scalar_steps {
    bool plain; /* whole, >= 0, without missing ones: numbers are the values */
    double first, steps_a_unit; /* number = value × steps_a_unit, rounded, - first */
};

struct spl_scalar_values {
    struct spl_spill *spill; // where values lie, borrowed; NULL: in memory
    void *values;     // owned; NULL = no point has any
    uint8_t storage;  // enum spl_storage
    bool missing;     /* some points have none: NaN */
    bool floats;      /* every value is a float */
    uint8_t decimals; /* every value is a multiple of 10^-decimals; more than there can be: of none */
    uint8_t halvings; /* the same of 2^-halvings */
    double min, max;  /* min > max: none has any */

    bool votes; /* on inner levels: what most have, not the mean; made by spl_scalar_settle(), as the rest is */
    bool plain; /* whole, >= 0, without missing ones: numbers are the values */
    double first, steps_a_unit; /* number = value × steps_a_unit, rounded, - first */
};

size_t spl_scalar_bytes(const struct spl_scalar_values *scalar); /* of a value */

/* Puts `count` values (NaN, or beyond 2^900: none) behind the first `used` of an array with room for `capacity`; NULL:
 * points that have none. On failure the array is as it was. */
int spl_scalar_add(struct spl_scalar_values *scalar, size_t capacity, size_t used, const double *values, size_t count,
                   struct spl_error *err);

/* Has every point the same value, or none? */
bool spl_scalar_is_constant(const struct spl_scalar_values *scalar);

/* Chooses the steps, of `count` values: exact where whole numbers, decimals or halvings fit 32 bits, else at least
 * 2^16 steps over what is left of the values without the outer hundredths (2^24 where they are no floats), or as many
 * as fit 32 bits where all together are much more than that. */
int spl_scalar_settle(struct spl_scalar_values *scalar, size_t count, struct spl_error *err);

/* Takes these instead. false where a value has no number then, or one is missing that must not. */
bool spl_scalar_settle_as(struct spl_scalar_values *scalar, const struct spl_scalar_steps *steps);

/* Of point `i`: a number, or SPL_STREAM_NONE. Any thread. */
uint32_t spl_scalar_number(const struct spl_scalar_values *scalar, size_t i);

#endif
