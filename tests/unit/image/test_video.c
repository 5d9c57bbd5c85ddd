/* Videos: the same pictures give the same file, whatever memory held before, in this process and in others. */
#include <malloc.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include "image/video.h"

enum { frames = 8, height = 120, widest = 336, path_bytes = 64 };

/* A picture that moves, with noise: encoders then look at more than one frame. Runs in children too, which assert
 * nothing. */
static int encode(const char *path, uint32_t width)
{
    static uint8_t pixels[widest * height * 4];
    struct spl_error err = {0};
    struct spl_video *video;
    int rc = spl_video_create(path, width, height, 30, &video, &err);
    for (int frame = 0; !rc && frame < frames; frame++) {
        uint32_t random = 12345;
        for (uint32_t i = 0; i < width * height * 4; i++) {
            double x = i / 4 % width + 3 * frame, y = i / 4 / width;
            random = random * 1664525 + 1013904223;
            pixels[i] = (uint8_t)(110 + 60 * sin(x * 0.13 + i % 4) + 40 * cos(y * 0.2 - frame * 0.3) + (random >> 28));
        }
        const struct spl_image image = {.layer = SPL_LAYER_COLOR, .type = SPL_PIXEL_RGBA8, .width = width,
                                        .height = height, .pixels = pixels};
        rc = spl_video_add(video, &image, &err);
    }
    if (!rc)
        rc = spl_video_finish(video, &err);
    spl_video_destroy(video);
    return rc;
}

static char *read_file(const char *path, size_t *length)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *bytes = NULL;
    for (size_t got = 1 << 16, room = 0; got == 1 << 16;) {
        assert_non_null(bytes = realloc(bytes, room += 1 << 16));
        got = fread(bytes + room - (1 << 16), 1, 1 << 16, file);
        *length = room - (1 << 16) + got;
    }
    fclose(file);
    return bytes;
}

/* What malloc() gives is full of one byte or another, as it is of leftovers in a daemon; a child's heap goes its own
 * way. Rows of 8 blocks, 10, 11 and 21: of those that are no multiple of 8, x264's AVX-512 code for mbtree gave other
 * bytes (on processors without it this has never failed). */
static void the_same_pictures_give_the_same_file(void **state)
{
    (void)state;
    static const uint32_t widths[] = {128, 160, 176, widest};
    static const int leftovers[] = {0, 1, 85, 170, 254};
    struct spl_error err = {0};
    if (spl_video_check(16, 16, &err) == SPL_E_UNSUPPORTED)
        skip();
    char folder[] = "/tmp/test-video.XXXXXX", path[path_bytes];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a.mp4", folder);
    for (size_t w = 0; w < sizeof widths / sizeof *widths; w++) {
        size_t length = 0, others = 0;
        assert_int_equal(encode(path, widths[w]), 0);
        char *first = read_file(path, &length);
        assert_true(length > 1000 && !memcmp(first + 4, "ftyp", 4));
        for (size_t i = 0; i < 2 * sizeof leftovers / sizeof *leftovers; i++) {
            assert_int_equal(unlink(path), 0);
            mallopt(M_PERTURB, leftovers[i / 2]);
            pid_t child = i % 2 ? fork() : 0;
            assert_true(child >= 0);
            int status = 0;
            if (i % 2 == 0)
                status = encode(path, widths[w]);
            else if (!child)
                _exit(encode(path, widths[w]) != 0);
            else
                assert_int_equal(waitpid(child, &status, 0), child);
            mallopt(M_PERTURB, 0);
            assert_int_equal(status, 0);
            char *again = read_file(path, &others);
            assert_int_equal(others, length);
            assert_memory_equal(again, first, length);
            free(again);
        }
        free(first);
    }
    unlink(path);
    assert_int_equal(rmdir(folder), 0);
}

static void pictures_of_other_sizes_are_refused(void **state)
{
    (void)state;
    struct spl_error err = {0};
    if (spl_video_check(16, 16, &err) == SPL_E_UNSUPPORTED)
        skip();
    assert_int_equal(spl_video_check(15, 16, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "width");
    err = (struct spl_error){0};
    assert_int_equal(spl_video_check(16, 15, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "height");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_pictures_give_the_same_file),
        cmocka_unit_test(pictures_of_other_sizes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
