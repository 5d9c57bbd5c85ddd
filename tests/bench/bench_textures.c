/* What textures cost: processor time of frames with all atoms, four, one, and of the coloured frame, in turns, at the
 * dataset's default view and at 2/5 and 1/5 of its distance, or at those given, 1280 x 720, lod 1; the lower quartile
 * of the rounds. Processor time, because other work on the machine stretches wall time.
 *
 * usage: bench-textures DATASET.spld [DEVICE [ROUNDS [DISTANCE...]]]    exit 1 where all atoms cost more than 1.5 times
 * the coloured frame at the default view, or 2.5 times in a nearer one */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <splatd/render.h>

enum { caps = 4, rounds_max = 1000 };

static double processor_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void must(int rc, const struct spl_error *err)
{
    if (rc) {
        fprintf(stderr, "%s\n", err->message);
        exit(2);
    }
}

int main(int argc, char **argv)
{
    static const uint32_t atoms[caps] = {0, 8, 4, 1};
    static const double usual[] = {1, 0.4, 0.2};
    static double ms[caps][rounds_max];
    struct spl_error err = {0};
    struct spl_dataset *dataset;
    struct spl_renderer *renderer;
    int rounds = argc > 3 ? atoi(argv[3]) : 9, worst = 0;
    if (argc < 2 || rounds < 1 || rounds > rounds_max) {
        fprintf(stderr, "usage: bench-textures DATASET.spld [DEVICE [ROUNDS [DISTANCE...]]]\n");
        return 2;
    }
    struct spl_renderer_options options = {.size = sizeof options, .device = argc > 2 ? argv[2] : NULL};
    must(spl_dataset_open(argv[1], false, &dataset, &err), &err);
    must(spl_renderer_create(&options, &renderer, &err), &err);
    must(spl_renderer_add(renderer, dataset, &err), &err);
    must(spl_renderer_preload(renderer, dataset, &err), &err);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    for (int v = 0; v < (argc > 4 ? argc - 4 : 3); v++) {
        double distance = argc > 4 ? atof(argv[4 + v]) : usual[v], bound = distance < 1 ? 2.5 : 1.5;
        struct spl_view view;
        spl_view_init(&view);
        must(spl_dataset_get_default_camera(dataset, 1280, 720, &view.camera, &err), &err);
        double eye[3];
        for (int a = 0; a < 3; a++)
            eye[a] = info->default_target[a] + distance * (info->default_eye[a] - info->default_target[a]);
        must(spl_camera_look_at(&view.camera, eye, info->default_target, info->default_up, &err), &err);
        uint64_t splats = 0;
        for (int round = -1; round < rounds; round++)
            for (int cap = 0; cap < caps; cap++) {
                struct spl_frame frame;
                view.disc.atoms = atoms[cap];
                double begin = processor_ms();
                must(spl_renderer_render(renderer, dataset, &view, &frame, &err), &err);
                if (round >= 0)
                    ms[cap][round] = processor_ms() - begin;
                splats = frame.stats.splats_drawn;
                spl_frame_finish(&frame);
            }
        printf("%.2f of the distance, %llu splats:", distance, (unsigned long long)splats);
        for (int cap = 0; cap < caps; cap++)
            qsort(ms[cap], (size_t)rounds, sizeof **ms, compare);
        for (int cap = 0; cap < caps; cap++)
            printf("  %u atoms %.0f ms (%.2f)", atoms[cap], ms[cap][rounds / 4],
                   ms[cap][rounds / 4] / ms[0][rounds / 4]);
        bool within = ms[1][rounds / 4] <= bound * ms[0][rounds / 4];
        printf("  %s %.1f\n", within ? "within" : "BEYOND", bound);
        fflush(stdout);
        worst |= !within;
    }
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    return worst;
}
