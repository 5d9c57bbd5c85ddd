/* splatd bench: a table of frame times, or with -o a comparison with a reference. Progress goes to stderr, figures to
 * stdout. */
#include "cmd/bench.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cmd/cmd.h"

static void help(void)
{
    puts(
        "usage: splatd bench NAME.spld… [OPTION…]\n"
        "\n"
        "Measures frame times of datasets on this machine: each combination of dataset, device, method and level of\n"
        "detail renders the same camera path, all in turn. Beside them runs a calibrator in plain C (5 M points, two\n"
        "threads); 'units' are multiples of its time, which compare between machines and days, milliseconds do not.\n"
        "\n"
        "  --views FILE --set NAME   path from the view 'overview' to the view 'close' of entry NAME in a JSON file\n"
        "                            {\"NAME\": {\"overview\": {\"eye\": [x, y, z], \"target\": […], \"up\": […],\n"
        "                            \"vfov_deg\": 40, \"near\": 0.1, \"far\": 50}, \"close\": {…}}};\n"
        "                            default: round the dataset's default view, closing in\n"
        "  --frames N                places on the path (20)\n"
        "  --size WxH                (1280x720); W or xH alone: at 16:9\n"
        "  --device LIST             such as vulkan,egl (auto); 'splatd devices' lists them\n"
        "  --method LIST             such as splat,points,fill (splat)\n"
        "  --lod LIST                pixels a splat, such as 1,2 (1)\n"
        "  --memory-limit MIB        device memory, or 2G and such; less than the dataset needs measures paging\n"
        "  --json                    everything, quartiles too, as one JSON object\n"
        "\n"
        "Accuracy against time, with -o: every view under every setting, compared with a reference and timed in turn.\n"
        "OUT gets bench.json, bench.csv, chart.svg, index.html (open it in a browser) and state.jsonl, from which the\n"
        "same command goes on when it was stopped. What each setting costs goes to NAME.profile.json, from which\n"
        "'splatd serve' chooses.\n"
        "  -o, --output OUT          the folder\n"
        "  --views FILE|DIR          views as JSON, or a COLMAP text model; without it, or with --set, --frames places "
        "(8)\n"
        "                            on the path above\n"
        "  --reference DIR           exact images VIEW.color.png, VIEW.depth.npy, VIEW.normal.npy, VIEW.coverage.npy, "
        "as\n"
        "                            'splatd synth SCENE --views' writes them\n"
        "  --photographs             the views' photographs; without either: the dataset's own render with every "
        "splat\n"
        "                            and 4x4 samples a pixel\n"
        "  --method LIST --lod LIST  (all; 0.5,0.75,1,1.5,2,3)\n"
        "  --supersample LIST        samples a pixel side, of 0.25,0.5,1,2,4 (0.25,0.5,1,2)\n"
        "  --atoms LIST              of a splat's texture at most, where the dataset has textures (0,2,8)\n"
        "  --repeats N               times each view and setting is timed (5)\n"
        "  --peers FILE.csv          rows name,ms,psnr of other programs, for the same chart\n"
        "  --profile FILE, --no-profile\n"
        "  --restart                 forget what OUT/state.jsonl holds");
    puts(
        "\n"
        "Textures, with --textures first: how dictionaries are learned, and their bytes against quality, beside the\n"
        "sparse-coding paper's settings (D8W4, D12W4, D16W8). FILE is what 'splatd pack --keep-textures' wrote, "
        "NAME.spld\n"
        "what it packed: its geometry is counted, its frames are timed by pass. With --cameras, photographs put "
        "straight\n"
        "onto the splats are measured too: whole, at half size, in BC7 and BC1; against the views that were packed, "
        "and\n"
        "against those of MODEL that were left out. OUT gets textures.csv, training.csv, rate.svg and training.svg; "
        "half\n"
        "an hour for 500,000 textures.\n"
        "  --textures FILE [NAME.spld [--cameras MODEL [--images DIR]]] -o OUT\n"
        "  --codings LIST            of training (its chart), D8W4, D12W4, D16W8, adaptive (all); none: NAME.spld "
        "alone\n"
        "  --epochs N                rounds of each training (12)\n"
        "  --sample N                textures that are trained on at most, and others coded (all; D16W8: 196608, "
        "once)\n"
        "  --views N                 compared at most, of either kind (8)\n"
        "  --repeats N --size WxH    times each pass is timed, and the size of its frames (9; 1280x720)\n"
        "  --threads N --memory MIB --device NAME      (all cores; 2048; auto)\n"
        "\n"
        "Photographs left out of packing, with --left-out first: renders from their poses, with textures and without,\n"
        "by the width of splats: as they are, with exposure matched, with the means of blocks of 16x16 pixels made\n"
        "equal, and with each block moved by up to 2 pixels to where it fits best. MODEL holds the poses of those\n"
        "photographs; OUT gets the photograph and both renders of each.\n"
        "  --left-out NAME.spld --cameras MODEL [--images DIR] [--lod L] [--device D] [-o OUT]\n"
        "\n"
        "  splatd bench hall.spld\n"
        "  splatd bench hall.spld --device vulkan,egl --method splat,points --lod 1,2\n"
        "  splatd bench hall.spld hall-1m.spld --views cameras.json --set hall --json > hall.json\n"
        "  splatd bench hall.spld -o hall-bench\n"
        "  splatd bench courtyard.spld --views views.json --reference truth -o courtyard-bench\n"
        "  splatd bench hall.spld --views colmap/sparse --photographs --lod 1,2 -o hall-bench\n"
        "  splatd bench --textures hall.textures hall.spld --cameras colmap/sparse -o hall-textures");
}

static void show_progress(void *context, uint32_t frame, uint32_t frames)
{
    (void)context;
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\rframe %u of %u%s", frame + 1, frames, frame + 1 < frames ? "" : "\r\033[K");
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
        return spl_cmd_bench_textures(argc - 1, argv + 1, &err) ? spl_cmd_fail(&err) : 0;
    if (argc > 1 && !strcmp(argv[1], "--left-out"))
        return spl_cmd_bench_left_out(argc - 1, argv + 1, &err) ? spl_cmd_fail(&err) : 0;
    int status = spl_cmd_bench_parse(&a, argc, argv, &err);
    if (status)
        goto done;
    if (a.sweep.output) {
        status = spl_cmd_bench_sweep(&a.sweep, a.datasets[0], &err);
        goto done;
    }
    a.bench.progress = show_progress;
    status = spl_bench(&a.bench, &report, &err);
    if (status)
        goto done;
    if (a.json)
        status = spl_cmd_bench_print_json(&a.bench, &report, &err);
    else
        spl_cmd_bench_print_table(&a.bench, &report);
done:
    spl_bench_report_finish(&report);
    for (size_t i = 0; i < a.bench.dataset_count; i++)
        spl_dataset_close(a.datasets[i]);
    return status ? spl_cmd_fail(&err) : 0;
}
