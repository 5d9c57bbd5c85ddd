/* splatd bench: a table of frame times, or with -o a comparison with a reference. Progress goes to stderr, figures to
 * stdout. */
#include "cmd/bench.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cmd/cmd.h"
#include "cmd/drawing.h"

static void help(void)
{
    spl_cmd_table_print_help(&spl_cmd_bench_table);
    putchar('\n');
    spl_cmd_table_print_help(&spl_cmd_bench_textures_table);
    putchar('\n');
    spl_cmd_table_print_help(&spl_cmd_bench_left_out_table);
}

static void show_progress(void *context, uint32_t frame, uint32_t frames)
{
    (void)context;
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\rframe %u of %u%s", frame + 1, frames, frame + 1 < frames ? "" : "\r\033[K");
}

/* Where rows of what is soft are of nothing. Without a report what the datasets' files say. */
static void warn(const struct spl_cmd_bench_arguments *a, const struct spl_bench_report *report)
{
    struct spl_view view;
    spl_view_init(&view);
    view.layers = 1u << SPL_LAYER_COLOR;
    view.soft = a->soft;
    for (size_t d = 0; d < a->bench.dataset_count && a->soft.what.count; d++) {
        struct spl_frame_stats stats = {0};
        for (size_t i = 0; i < report->row_count; i++)
            if (report->rows[i].dataset == a->datasets[d])
                stats.soft_drawn += (uint64_t)report->rows[i].spheres;
        spl_cmd_warn_soft(&view, a->datasets[d], report->row_count ? &stats : NULL);
    }
}

int spl_cmd_bench(int argc, char **argv)
{
    if (argc == 2 && (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h"))) {
        help();
        return 0;
    }
    struct spl_error err = {0};
    struct spl_bench_report report = {0};
    struct spl_cmd_bench_arguments a = {0};
    if (argc > 1 && !strcmp(argv[1], "--textures"))
        return spl_cmd_bench_textures(argc - 1, argv + 1, &err) < 0 ? spl_cmd_fail(&err) : 0;
    if (argc > 1 && !strcmp(argv[1], "--left-out"))
        return spl_cmd_bench_left_out(argc - 1, argv + 1, &err) < 0 ? spl_cmd_fail(&err) : 0;
    int status = spl_cmd_bench_parse(&a, argc, argv, &err);
    if (status)
        goto done;
    if (a.sweep.output) {
        warn(&a, &report);
        status = spl_cmd_bench_sweep(&a.sweep, a.datasets[0], &err);
        goto done;
    }
    a.bench.progress = show_progress;
    status = spl_bench(&a.bench, &report, &err);
    if (status)
        goto done;
    warn(&a, &report);
    if (a.json)
        status = spl_cmd_bench_print_json(&a.bench, &report, &err);
    else
        spl_cmd_bench_print_table(&a.bench, &report);
done:
    spl_bench_report_finish(&report);
    for (size_t i = 0; i < a.bench.dataset_count; i++)
        spl_dataset_close(a.datasets[i]);
    return status < 0 ? spl_cmd_fail(&err) : 0;
}
