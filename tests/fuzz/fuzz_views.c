/* Lists of views, and of photographs: bytes that start with '{' are JSON (ours, transforms.json, Open3D's); a line
 * "bin" in front means COLMAP's binary model, "poses" a folder of poses, nothing COLMAP's text. Each has two files, the
 * second behind the line "images". Whatever is accepted must be cameras that the renderer takes, under names that files
 * can carry, and lenses that give numbers. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cloud/views.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char folder[] = "/dev/shm/splatd-fuzz-views-XXXXXX"; /* in memory; files are made 100,000 times */

static void put(const char *name, const uint8_t *data, size_t size)
{
    char path[64];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    require(file && fwrite(data, 1, size, file) == size);
    fclose(file);
}

static const char *const files[][2] = {
    {"views.json", NULL},
    {"cameras.bin", "images.bin"},
    {"camera-intrinsics.txt", "a.pose.txt"},
    {"cameras.txt", "images.txt"},
};

static void remove_files(void)
{
    char path[64];
    for (int i = 0; i < 8; i++)
        if (files[i / 2][i % 2]) {
            snprintf(path, sizeof path, "%s/%s", folder, files[i / 2][i % 2]);
            remove(path);
        }
}

static void clean_up(void)
{
    remove_files();
    rmdir(folder);
}

static int some_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    bool sphere = strstr(path, "sphere"), cube = strstr(path, "cube");
    (void)err;
    *width = 640;
    *height = sphere ? 320 : cube ? 640 : 480;
    return 0;
}

static void count(void *context, const struct spl_error *why)
{
    require(why->code && why->message[0]);
    ++*(int *)context;
}

static void check(struct spl_view_list *list, int rc, const struct spl_error *err, bool photographs)
{
    require(rc == err->code && (rc == 0) == (err->message[0] == 0) && (rc == 0) == (list->count > 0));
    for (size_t i = 0; i < list->count; i++) {
        const struct spl_named_view *view = &list->views[i];
        double pixel[2] = {0}, depth = 1, p[3];
        require(view->name[0] && view->name[0] != '.' && !strchr(view->name, '/'));
        require(strlen(view->name) <= SPL_VIEW_NAME_MAX);
        require(spl_camera_check(&view->camera, NULL) == 0);
        require((uint64_t)view->camera.width * view->camera.height <= 64 << 20);
        require(!photographs || view->photograph);
        require(photographs || view->distortion.kind == SPL_DISTORTION_NONE);
        for (int c = 0; c < 3; c++)
            p[c] = view->camera.eye[c] + view->camera.rotation[6 + c] + 0.1 * view->camera.rotation[c];
        spl_distortion_project(&view->camera, &view->distortion, p, pixel, &depth);
        require(depth > 0);
    }
    spl_view_list_finish(list);
}

static int begins(const uint8_t *data, size_t size, const char *word)
{
    return size >= strlen(word) && !memcmp(data, word, strlen(word)) ? (int)strlen(word) : 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char divider[] = "\nimages\n";
    static bool made;
    struct spl_view_list list;
    struct spl_error err = {0};
    char path[64];
    int refused = 0, skip;
    static int last;
    if (!made) {
        if (!mkdtemp(folder)) {
            strcpy(folder, "/tmp/splatd-fuzz-views-XXXXXX");
            require(mkdtemp(folder));
        }
        require(!atexit(clean_up));
        made = true;
    }
    int kind = size && data[0] == '{'                   ? 0
               : (skip = begins(data, size, "bin\n"))   ? 1
               : (skip = begins(data, size, "poses\n")) ? 2
                                                        : 3;
    if (kind != last)
        remove_files();
    last = kind;
    if (kind) {
        data += skip;
        size -= (size_t)skip;
        const uint8_t *found = memmem(data, size, divider, strlen(divider)), *end = found ? found : data + size;
        put(files[kind][0], data, (size_t)(end - data));
        put(files[kind][1], found ? found + strlen(divider) : end,
            found ? size - (size_t)(end - data) - strlen(divider) : 0);
    } else {
        put(files[0][0], data, size);
    }
    snprintf(path, sizeof path, kind ? "%s" : "%s/views.json", folder);
    if (kind % 3 == 0 && size % 2) { /* one of both: reading costs more than all else */
        check(&list, spl_view_list_load(&list, path, &err), &err, false);
        return 0;
    }
    const struct spl_photograph_options options = {
        .images = "/nowhere", .get_size = some_size, .refuse = count, .context = &refused};
    check(&list, spl_view_list_load_photographs(&list, path, &options, &err), &err, true);
    return 0;
}
