/* What tests of whole frames share: a renderer, random scenes, cameras that look at them, comparisons. Included by one
 * test program each, after cmocka.h. */
#ifndef TEST_GPU_FRAMES_H
#define TEST_GPU_FRAMES_H

#include <stddef.h>
#include <stdint.h>

#include <splatd/render.h>

#include "dataset/dataset.h"
#include "support/make_dataset.h"

extern struct spl_renderer *renderer; /* the program's, from frames_run() on */
extern char *device;                  /* that it runs on; may be NULL */
extern const double origin[3];

/* Of uniform(); every test begins with 1. */
extern uint64_t random_state;

/* In [0, 1). */
double uniform(void);

/* A test for frames_run(), with random numbers of its own: one more test changes the data of no other. */
#define frames_test(test) {#test, test, frames_seed, NULL, NULL}
int frames_seed(void **state);

/* Runs the tests on the device that the command line or SPLATD_TEST_DEVICE names; the exit code, 77 without it. */
int frames_run(int argc, char **argv, const char *name, const struct CMUnitTest *tests, size_t count);

/* The program's renderer keeps all its kernels; so does this one then. */
void keep_kernels(struct spl_renderer *of);

struct tally {
    size_t pixels, covered_differs, depth_differs, color_differs, id_differs, normal_differs, primitive_differs;
    double depth_worst;
    int color_worst;
};

/* Of two frames with every layer. */
struct tally compare(const struct spl_frame *a, const struct spl_frame *b);

/* Fails unless the renderer and the plain C reference draw the same, but where rounding moves a fragment across a
 * border. */
void same_images(const struct spl_dataset *dataset, const struct spl_view *view, const char *what);

/* Random splats in a cube around `center`: every orientation, radii over two decades. The caller's to free(). */
struct make_splat *random_splats(size_t count, const double center[3], double radius);

/* The same as a dataset of the renderer's, until done(). */
struct spl_dataset *random_cube(size_t count, const double center[3], double radius);
void done(struct spl_dataset *dataset);

/* From aside, every layer. */
struct spl_view looking(const double center[3], double distance, uint32_t width, uint32_t height);

#endif
