/* One handle of libuv's runs before each wait: a turn is the time since it ran last, less what the loop was idle in
 * between. Callbacks of descriptors run inside libuv's wait, so no pair of handles would enclose them.
 *
 * Processor time tells a turn that computed from one that others kept off the processor, which is all that a test on a
 * shared machine can judge. It costs 0.7 us a turn: two readings of clocks here, and libuv's account of idle time.
 * Owned by the loop's thread. */
#include "service/ops/loop_turns.h"

#include <time.h>

#include "base/clock.h"

static const double bounds_s[SPL_LOOP_TURN_BUCKETS] = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1};

static uint64_t processor_ns(void)
{
    struct timespec t;
    return clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t) ? 0 : (uint64_t)t.tv_sec * SPL_NS_PER_S + (uint64_t)t.tv_nsec;
}

static void mark(struct spl_loop_turns *turns)
{
    turns->told_ns = spl_now_ns();
    turns->idle_ns = uv_metrics_idle_time(turns->prepare.loop);
    turns->busy_ns = processor_ns();
}

static void on_prepare(uv_prepare_t *prepare)
{
    struct spl_loop_turns *turns = prepare->data;
    uint64_t told = turns->told_ns, idle = turns->idle_ns, busy = turns->busy_ns;
    mark(turns);
    uint64_t since = turns->told_ns - told, waited = turns->idle_ns - idle;
    uint64_t turn = since > waited ? since - waited : 0; // the clocks are read one after the other
    size_t i = 0;
    while (i < SPL_LOOP_TURN_BUCKETS && (double)turn > bounds_s[i] * SPL_NS_PER_S)
        i++;
    turns->buckets[i]++;
    turns->sum_ns += turn;
    turns->longest_ns = turn > turns->longest_ns ? turn : turns->longest_ns;
    busy = turns->busy_ns - busy;
    turns->busiest_ns = busy > turns->busiest_ns ? busy : turns->busiest_ns;
}

void spl_loop_turns_watch(struct spl_loop_turns *turns, uv_loop_t *loop)
{
    uv_loop_configure(loop, UV_METRICS_IDLE_TIME); // without it every wait would count as a turn
    uv_prepare_init(loop, &turns->prepare);
    turns->prepare.data = turns;
    uv_prepare_start(&turns->prepare, on_prepare);
    uv_unref((uv_handle_t *)&turns->prepare); // it keeps no loop alive
    mark(turns);
}

static void print_longest(FILE *out, const char *name, const char *help, uint64_t ns)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s gauge\n%s %.9g\n", name, help, name, name, (double)ns / SPL_NS_PER_S);
}

void spl_loop_turns_print(const struct spl_loop_turns *turns, FILE *out)
{
    unsigned long long sum = 0;
    fprintf(out, "# HELP splatd_loop_turn_seconds How long the loop worked between two waits, serving nobody else.\n"
                 "# TYPE splatd_loop_turn_seconds histogram\n");
    for (size_t i = 0; i <= SPL_LOOP_TURN_BUCKETS; i++) {
        sum += turns->buckets[i];
        if (i < SPL_LOOP_TURN_BUCKETS)
            fprintf(out, "splatd_loop_turn_seconds_bucket{le=\"%g\"} %llu\n", bounds_s[i], sum);
    }
    fprintf(out,
            "splatd_loop_turn_seconds_bucket{le=\"+Inf\"} %llu\nsplatd_loop_turn_seconds_sum %.9g\n"
            "splatd_loop_turn_seconds_count %llu\n",
            sum, (double)turns->sum_ns / SPL_NS_PER_S, sum);
    print_longest(out, "splatd_loop_stall_seconds", "The longest turn since start.", turns->longest_ns);
    print_longest(out, "splatd_loop_stall_cpu_seconds", "The most processor time of a turn since start.",
                  turns->busiest_ns);
}
