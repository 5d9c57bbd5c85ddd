/* Progress lines: "stage  42 %  1.2 M points/s  3 s left, 50 s until all is done", rewritten in place on a terminal. A
 * log gets two plain lines a stage instead and one every ten seconds, so that it stays readable and short, and nobody
 * takes work for a hang. A stage ends where the next begins or the work is over. */
#include "cmd/progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/text.h"

static const double least_share = 0.01; /* of a stage, before which nothing is said of how long it takes */

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

void spl_cmd_progress_clear(void)
{
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\r\033[K");
}

void spl_cmd_progress_finish(struct spl_cmd_progress *state)
{
    if (!state->stage[0])
        return;
    double seconds = (double)(spl_now_ns() - state->start_ns) / 1e9;
    char done[16];
    spl_cmd_progress_clear();
    if (state->done && state->unit)
        fprintf(stderr, "%s: %s %.*s in %.1f s\n", state->stage, scaled((double)state->done, done),
                (int)strlen(state->unit) - (state->done == 1), state->unit, seconds); /* 1 point, 2 points */
    else
        fprintf(stderr, "%s: %.1f s\n", state->stage, seconds);
    state->stage[0] = 0;
}

/* "45 s", "3 min": what a guess is worth. */
static const char *rough(double seconds, char text[32])
{
    if (seconds < 100)
        snprintf(text, 32, "%.0f s", ceil(seconds));
    else
        snprintf(text, 32, "%.0f min", ceil(seconds / 60));
    return text;
}

static void print_line(const struct spl_cmd_progress *state, const struct spl_progress *p)
{
    char text[32];
    fprintf(stderr, "%s", state->stage);
    if (p->total)
        fprintf(stderr, "  %3.0f %%", floor(100.0 * fmin((double)p->done / (double)p->total, 1)));
    if (p->rate >= 1 && p->unit)
        fprintf(stderr, "  %s %s/s", scaled(p->rate, text), p->unit);
    else if (p->rate > 0 && p->unit)
        fprintf(stderr, "  %s s a %.*s", scaled(1 / p->rate, text), (int)strlen(p->unit) - 1, p->unit);
    if (p->total && (double)p->done < least_share * (double)p->total)
        return; /* the rate of the first few says nothing of the rest */
    if (p->rate > 0 && p->total > p->done)
        fprintf(stderr, "  %s left", rough((double)(p->total - p->done) / p->rate, text));
    if (p->left_s > 0)
        fprintf(stderr, ", %s until all is done", rough(p->left_s, text));
}

void spl_cmd_progress(void *context, const struct spl_progress *progress)
{
    static const uint64_t interval_ns = 10 * SPL_NS_PER_S;
    struct spl_cmd_progress *state = context;
    int terminal = isatty(STDERR_FILENO);
    uint64_t now = spl_now_ns();
    char stage[sizeof state->stage];
    spl_text_show(progress->stage, stage, sizeof stage); // with the name of a scan
    if (strcmp(state->stage, stage)) {
        spl_cmd_progress_finish(state);
        strcpy(state->stage, stage);
        state->start_ns = state->said_ns = now;
        if (!terminal)
            fprintf(stderr, "%s...\n", state->stage);
    }
    state->done = progress->done;
    state->unit = progress->unit;
    if (!terminal && now - state->said_ns < interval_ns)
        return;
    state->said_ns = now;
    fprintf(stderr, "%s", terminal ? "\r" : "");
    print_line(state, progress);
    fprintf(stderr, "%s", terminal ? "\033[K" : "\n");
}
