/* A view of a dataset as a PNG, and what lies in its middle, by libsplatd alone:
 *
 *     cc view.c $(pkg-config --cflags --libs splatd) -o view
 *     ./view courtyard.spld view.png
 *
 * The order is always the same: open a dataset, make a renderer, add the one to the other, ask for views. */
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include <splatd/splatd.h>

/* One flag ends whatever takes long. spl_cancel_set() may be called from a signal handler or another thread. */
static struct spl_cancel cancel;

static void on_interrupt(int number)
{
    (void)number;
    spl_cancel_set(&cancel);
}

/* Without this, what the library has to say beside its errors goes to stderr. */
static void on_message(void *context, enum spl_log_level level, const char *message)
{
    (void)context;
    if (level <= SPL_LOG_WARN)
        fprintf(stderr, "view: %s\n", message);
}

static int write_file(const char *path, const struct spl_encoded *encoded)
{
    FILE *file = fopen(path, "wb");
    int good = file && fwrite(encoded->bytes, 1, encoded->length, file) == encoded->length;
    if (file && fclose(file))
        good = 0;
    if (!good)
        fprintf(stderr, "view: %s cannot be written\n", path);
    return good ? 0 : -1;
}

/* Picks the view's middle and says what lies there. */
static int print_pick(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                      struct spl_error *err)
{
    struct spl_pick pick;
    int rc =
        spl_renderer_pick(renderer, dataset, view, view->camera.width / 2.0, view->camera.height / 2.0, &pick, err);
    if (rc)
        return rc;
    if (pick.hit)
        printf("middle: %.3f %.3f %.3f, %.3f away, splat %" PRId64 "\n", pick.position[0], pick.position[1],
               pick.position[2], pick.distance, pick.splat);
    else
        printf("middle: nothing\n");
    return 0;
}

int main(int argc, char **argv)
{
    /* What is destroyed at the end may be NULL there, so each failure can go straight to it. */
    struct spl_dataset *dataset = NULL;
    struct spl_renderer *renderer = NULL;
    struct spl_frame frame = {0};
    struct spl_encoded png = {0};
    /* An error record begins empty. Every call that can fail returns 0 or a negative SPL_E_… and fills it. */
    struct spl_error err = {0};

    if (argc != 3) {
        fprintf(stderr, "usage: view NAME.spld OUT.png\n");
        return 2;
    }
    if (spl_version_number() / 100 != SPL_VERSION_NUMBER / 100) { /* the same minor version, or the soname lies */
        fprintf(stderr, "view: made for libsplatd %d.%d, this is %s\n", SPL_VERSION_MAJOR, SPL_VERSION_MINOR,
                spl_version());
        return 1;
    }
    spl_log_set_callback(on_message, NULL);
    signal(SIGINT, on_interrupt);

    /* Structs of options begin with their size, which their init function sets; zero is the default of all else. */
    struct spl_open_options opening;
    spl_open_options_init(&opening);
    opening.verify = true; /* the checksums of the whole file, not only of what describes it */
    opening.cancel = &cancel;
    int rc = spl_dataset_open_with(argv[1], &opening, &dataset, &err);
    if (rc)
        goto done;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset); /* lent by the dataset */
    printf("%s: %" PRIu64 " splats of %" PRIu64 " points\n", info->id, (uint64_t)info->splats, info->points);

    /* The best device there is: a GPU where there is one, else the processor. A renderer belongs to one thread. */
    struct spl_renderer_options rendering;
    spl_renderer_options_init(&rendering);
    if ((rc = spl_renderer_create(&rendering, &renderer, &err)) || (rc = spl_renderer_add(renderer, dataset, &err)))
        goto done;
    printf("drawn by %s\n", spl_renderer_get_device(renderer)->name);

    /* What to show. The default view is a camera like any other: spl_camera_look_at() and its kin make others. */
    struct spl_view view;
    spl_view_init(&view);
    if ((rc = spl_dataset_get_default_camera(dataset, 640, 360, &view.camera, &err)))
        goto done;
    struct spl_render_options how;
    spl_render_options_init(&how);
    how.cancel = &cancel;
    if ((rc = spl_renderer_render_with(renderer, dataset, &view, &how, &frame, &err)))
        goto done;
    if (!frame.stats.complete)
        printf("coarser than asked for: not all of it fits the device\n");

    /* The frame is ours now; an image of it can be encoded, or its pixels used as they are. */
    struct spl_encode_options encoding;
    spl_encode_options_init(&encoding);
    encoding.format = SPL_FORMAT_PNG;
    if ((rc = spl_image_encode(&frame.images[SPL_LAYER_COLOR], &encoding, &png, &err)) ||
        (rc = print_pick(renderer, dataset, &view, &err)))
        goto done;
    rc = write_file(argv[2], &png);

done:
    if (err.code)
        fprintf(stderr, "view: %s: %s\n", spl_code_get_info(err.code)->name, err.message);
    spl_encoded_finish(&png);
    spl_frame_finish(&frame);
    spl_renderer_destroy(renderer); /* before the datasets that it draws */
    spl_dataset_close(dataset);
    return rc ? 1 : 0;
}
