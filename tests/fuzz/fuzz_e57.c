/* E57 of any bytes whose pages are right, so that what lies behind their checksums is reached: a whole file, or (its
 * first byte is '<') the XML of one, or (0) pages as they are. Its corpus is made by make_e57.c. */
#include "fuzz_cloud.h"

#include "cloud/views.h"
#include "support/e57_writer.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { page = 1024 };

static void ignore(void *context, const struct spl_error *why)
{
    (void)context;
    require(why->message[0]);
}

/* The images of the same file. */
static void fuzz_views(const uint8_t *bytes, size_t size)
{
    const struct spl_photograph_options options = {.refuse = ignore};
    struct spl_view_list list;
    struct spl_error err = {0};
    char path[64];
    int memory = memfd_create("views", MFD_CLOEXEC);
    require(memory >= 0 && pwrite(memory, bytes, size, 0) == (ssize_t)size);
    require(pwrite(memory, "ASTM-E57", 8, 0) == 8);
    snprintf(path, sizeof path, "/proc/self/fd/%d", memory);
    int code = spl_view_list_load_photographs(&list, path, &options, &err);
    require(code == err.code && (code == 0) == (list.count > 0));
    for (size_t i = 0; i < list.count && i < 8; i++) {
        FILE *file = NULL;
        if (spl_view_open_inner(&list.views[i], &file, NULL) == 0)
            fclose(file);
    }
    spl_view_list_finish(&list);
    close(memory);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    if (data[0] == 0) {
        fuzz_cloud(data, size, "ASTM-E57", NULL);
        return 0;
    }
    size_t length = (size + page - 1) / page * page;
    uint8_t *file;
    if (data[0] == '<') {
        file = e57_make(data, size, size, &length);
    } else {
        file = calloc(1, length);
        memcpy(file, data, size);
        for (int i = 0; i < 8; i++) {
            file[16 + i] = (uint8_t)((uint64_t)length >> 8 * i);
            file[40 + i] = i == 1 ? page >> 8 : 0;
        }
        e57_seal(file, length);
    }
    fuzz_cloud(file, length, "ASTM-E57", NULL);
    fuzz_views(file, length);
    free(file);
    return 0;
}
