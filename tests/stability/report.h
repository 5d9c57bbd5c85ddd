/* Verdicts of the suite. Each figure is held against a limit that follows from the truth or from arithmetic. */
#ifndef STABILITY_REPORT_H
#define STABILITY_REPORT_H

#include <stdbool.h>
#include <stddef.h>

struct place { /* what a figure is of; any may be NULL */
    const char *scene, *view, *method, *layer;
};

struct report {
    size_t passed, failed, known;
    const char *must_fail; /* the check that a planted fault is to be caught by; may be NULL */
    size_t caught;         /* failures of that check */
    bool verbose;          /* prints what passes as well */
    bool known_seen[32];   /* of report.c's expected failures */
};

/* Passes where figure <= limit (a NaN never does). What fails is printed: check, place, figure, limit and `why` the
 * limit is what it is. */
void report_at_most(struct report *report, const char *check, const struct place *place, double figure, double limit,
                    const char *why);
void report_at_least(struct report *report, const char *check, const struct place *place, double figure, double limit,
                     const char *why);

/* Something broke that has no figure. */
void report_broken(struct report *report, const char *check, const struct place *place, const char *message);

/* Prints the counts; the program's exit code. */
int report_finish(struct report *report);

#endif
