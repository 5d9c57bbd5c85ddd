/* The Pareto front by its definition: every pair is compared. Profiles have some dozens of settings, so that the square
 * costs less than sorting is long. Pure; any thread. */
#include "measure/front.h"

#include <math.h>

static bool beats(double cost, double error, double other_cost, double other_error)
{
    return cost <= other_cost && error <= other_error && (cost < other_cost || error < other_error);
}

void spl_front_mark(const double *cost, const double *error, size_t count, bool *front)
{
    for (size_t i = 0; i < count; i++) {
        front[i] = !isnan(cost[i]) && !isnan(error[i]);
        for (size_t j = 0; front[i] && j < count; j++)
            front[i] = !beats(cost[j], error[j], cost[i], error[i]); // false for any NaN in j
    }
}
