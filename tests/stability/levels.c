/* A finer level of detail costs time, so it has to be at least as good: PSNR against the truth may fall by 0.1 dB, the
 * noise of the measure, from one lod to the next finer one. */
#include "themes.h"

#include "measure.h"

enum { WIDTH = 240, HEIGHT = 180 };

static const double lods[] = {4, 2, 1, 0.5, 0};
enum { lod_count = sizeof lods / sizeof *lods };

static void check_view(struct suite *suite, const struct world *world, size_t v)
{
    struct spl_view view = world_view(world, v, WIDTH, HEIGHT);
    struct spl_image truth[SPL_LAYER_COUNT];
    truth_render(world, &view.camera, truth);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        static const char *const names[lod_count] = {"lod 4", "lod 2", "lod 1", "lod 0.5", "lod 0"};
        double coarser = 0;
        view.method = (enum spl_method)method;
        for (int i = 0; i < lod_count; i++) {
            struct spl_frame frame;
            struct place place = {world->name, world->scene->cameras[v].name, spl_method_name(view.method), names[i]};
            view.lod = lods[i];
            if (!world_render(suite, world, &place, &view, &frame))
                continue;
            double psnr = measure_frame(world, &view, &frame, truth).psnr;
            if (i)
                report_at_least(&suite->report, "finer-is-better", &place, psnr - coarser, -0.1,
                                "dB above the next coarser lod");
            coarser = psnr;
            spl_frame_finish(&frame);
        }
    }
    truth_finish(truth);
}

void check_levels(struct suite *suite)
{
    static const char *const scenes[] = {"courtyard", "density",   "interior", "thin-walls",
                                         "railway",   "powerline", "steps",    "tree"};
    for (size_t s = 0; s < (suite->whole ? sizeof scenes / sizeof *scenes : 2); s++) {
        struct world world;
        world_init(&world, &(struct scan){.scene = scenes[s], .points = 200000, .noise = -1});
        for (size_t v = 0; v < world.scene->camera_count; v += suite->whole ? 1 : 5)
            check_view(suite, &world, v);
        world_finish(suite, &world);
    }
}
