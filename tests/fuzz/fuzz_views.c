/* Lists of views: bytes that start with '{' are our JSON; others are a COLMAP model, cameras.txt up to the line
 * "images", images.txt behind it. Whatever is accepted must be cameras that the renderer takes, under names that files
 * can carry. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cloud/views.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char folder[] = "/tmp/splatd-fuzz-views-XXXXXX";

static void put(const char *name, const uint8_t *data, size_t size)
{
    char path[64];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    require(file && fwrite(data, 1, size, file) == size);
    fclose(file);
}

static void clean_up(void)
{
    static const char *const names[] = {"/views.json", "/cameras.txt", "/images.txt", ""};
    char path[64];
    for (int i = 0; i < 4; i++) {
        snprintf(path, sizeof path, "%s%s", folder, names[i]);
        remove(path);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char divider[] = "\nimages\n";
    static bool made;
    struct spl_view_list list;
    struct spl_error err = {0};
    char path[64];
    if (!made) {
        require(mkdtemp(folder) && !atexit(clean_up));
        made = true;
    }
    bool json = size && data[0] == '{';
    if (json) {
        put("views.json", data, size);
    } else {
        const uint8_t *found = memmem(data, size, divider, strlen(divider)), *end = found ? found : data + size;
        put("cameras.txt", data, (size_t)(end - data));
        put("images.txt", found ? found + strlen(divider) : end,
            found ? size - (size_t)(end - data) - strlen(divider) : 0);
    }
    snprintf(path, sizeof path, json ? "%s/views.json" : "%s", folder);
    int rc = spl_view_list_load(&list, path, &err);
    require(rc == err.code && (rc == 0) == (err.message[0] == 0) && (rc == 0) == (list.count > 0));
    for (size_t i = 0; i < list.count; i++) {
        const struct spl_named_view *view = &list.views[i];
        require(view->name[0] && view->name[0] != '.' && !strchr(view->name, '/'));
        require(strlen(view->name) <= SPL_VIEW_NAME_MAX);
        require(spl_camera_check(&view->camera, NULL) == 0);
        require((uint64_t)view->camera.width * view->camera.height <= 64 << 20);
        require(json || view->photograph);
    }
    spl_view_list_finish(&list);
    return 0;
}
