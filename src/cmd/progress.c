/* Progress lines: "stage  42 %  1.2 M/s  3 s left", rewritten in place on a terminal. A log gets two plain lines a
 * stage instead, so that it stays readable and short. A stage ends where the next begins or the work is over. */
#include "cmd/progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"

/* "950", "1.2 k", "34 M": two or three digits. */
static const char *scaled(double value, char text[16])
{
    static const char *const units[] = {"", " k", " M", " G", " T"};
    size_t unit = 0;
    for (; value >= 999.5 && unit < 4; unit++)
        value /= 1000;
    snprintf(text, 16, "%.*f%s", unit && value < 9.95, value, units[unit]);
    return text;
}

void spl_cmd_progress_finish(struct spl_cmd_progress *state)
{
    if (!state->stage[0])
        return;
    double seconds = (double)(spl_now_ns() - state->start_ns) / 1e9;
    char done[16];
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\r\033[K");
    if (state->done)
        fprintf(stderr, "%s: %s in %.1f s\n", state->stage, scaled((double)state->done, done), seconds);
    else
        fprintf(stderr, "%s: %.1f s\n", state->stage, seconds);
    state->stage[0] = 0;
}

void spl_cmd_progress(void *context, const struct spl_progress *progress)
{
    struct spl_cmd_progress *state = context;
    int terminal = isatty(STDERR_FILENO);
    if (strncmp(state->stage, progress->stage, sizeof state->stage - 1)) {
        spl_cmd_progress_finish(state);
        snprintf(state->stage, sizeof state->stage, "%s", progress->stage);
        state->start_ns = spl_now_ns();
        if (!terminal)
            fprintf(stderr, "%s...\n", state->stage);
    }
    state->done = progress->done;
    if (!terminal)
        return;
    char rate[16];
    fprintf(stderr, "\r%s", state->stage);
    if (progress->total)
        fprintf(stderr, "  %3.0f %%", 100.0 * (double)progress->done / (double)progress->total);
    if (progress->rate > 0) {
        fprintf(stderr, "  %s/s", scaled(progress->rate, rate));
        if (progress->total > progress->done)
            fprintf(stderr, "  %.0f s left", ceil((double)(progress->total - progress->done) / progress->rate));
    }
    fprintf(stderr, "\033[K");
}
