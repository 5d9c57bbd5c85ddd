/* The GPU layer on a real driver, one body for every backend: opening and refusing, buffers, fill, copy and dispatch
 * against C on random input, specialisation constants, timestamps, deadlines, loss and reopening; with validation
 * layers on throughout, and silent. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "base/memory.h"
#include "gpu/gpu.h"
#include "shared.h"

static const char *device; /* "vulkan" or "egl" */

static uint32_t random_word(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 32);
}

static struct spl_gpu *open_with(struct spl_gpu_options options)
{
    struct spl_gpu *gpu;
    struct spl_error err = {0};
    options.device = options.device ? options.device : device;
    if (spl_gpu_open(&options, &gpu, &err) < 0)
        fail_msg("%s", err.message);
    return gpu;
}

static struct spl_gpu *open_checked(void)
{
    return open_with((struct spl_gpu_options){.debug = true, .cache_dir = ""});
}

static void close_checked(struct spl_gpu *gpu)
{
    assert_int_equal(spl_gpu_get_memory(gpu), 0);
    spl_gpu_close(gpu);
    assert_int_equal(spl_gpu_count_complaints(), 0);
}

static struct spl_gpu_buffer *buffer(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes)
{
    struct spl_gpu_buffer *made;
    struct spl_error err = {0};
    if (spl_gpu_buffer_create(gpu, kind, bytes, &made, &err) < 0)
        fail_msg("%s", err.message);
    return made;
}

static void run(struct spl_gpu *gpu)
{
    uint64_t ticket;
    struct spl_error err = {0};
    if (spl_gpu_submit(gpu, &ticket, &err) < 0 || spl_gpu_wait(gpu, ticket, spl_now_ns() + 60 * SPL_NS_PER_S, &err) < 0)
        fail_msg("%s", err.message);
}

static void lists_what_it_opens(void **state)
{
    (void)state;
    struct spl_device_info devices[32];
    size_t count = spl_gpu_list(devices, 32), found = 0;
    assert_true(count > 0 && count <= 32);
    assert_int_equal(spl_gpu_list(NULL, 0), count);
    for (size_t i = 0; i < count; i++) {
        const struct spl_device_info *info = &devices[i];
        if (strcmp(info->backend, device) || info->unusable[0])
            continue;
        found++;
        char index[32], uuid[40], part[13];
        const char *const names[] = {index, part, uuid};
        snprintf(index, sizeof index, "%.15s:%u", info->backend, info->index);
        snprintf(part, sizeof part, "%.12s", info->name);
        for (char *c = part; *c; c++)
            *c ^= *c >= 'a' && *c <= 'z' ? 32 : 0;
        char *at = uuid;
        for (int b = 0; b < 16; b++)
            at += snprintf(at, 4, "%s%02X", b == 8 ? "-" : "", info->uuid[b]);
        static const uint8_t none[16];
        for (int n = 0; n < (memcmp(info->uuid, none, 16) ? 3 : 2); n++) {
            struct spl_gpu *gpu = open_with((struct spl_gpu_options){.device = names[n], .cache_dir = ""});
            if (n == 0)
                assert_memory_equal(spl_gpu_get_device(gpu), info, sizeof *info);
            else if (memcmp(info->uuid, none, 16)) // of another backend, maybe, which gives it another name
                assert_memory_equal(spl_gpu_get_device(gpu)->uuid, info->uuid, sizeof info->uuid);
            else
                assert_string_equal(spl_gpu_get_device(gpu)->name, info->name);
            spl_gpu_close(gpu);
        }
    }
    assert_true(found > 0);
}

static void refuses_devices_by_reason(void **state)
{
    (void)state;
    struct spl_gpu *gpu;
    char far_index[32], half_index[32];
    snprintf(far_index, sizeof far_index, "%s:999", device);
    snprintf(half_index, sizeof half_index, "%s:0x", device);
    const char *const wrong[] = {"no such card", far_index, half_index,
                                 "vulkan:",      "egl:x",   "ffffffffffffffffffffffffffffffff"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct spl_error err = {0};
        assert_int_equal(spl_gpu_open(&(struct spl_gpu_options){.device = wrong[i]}, &gpu, &err), SPL_E_NO_DEVICE);
        assert_null(gpu);
        assert_string_equal(err.field, "device");
        assert_non_null(strstr(err.message, wrong[i]));
    }
    gpu = open_checked();
    bool software = spl_gpu_get_device(gpu)->software;
    close_checked(gpu);
    if (software) {
        struct spl_error err = {0};
        struct spl_gpu_options options = {.device = device, .require_gpu = true};
        assert_int_equal(spl_gpu_open(&options, &gpu, &err), SPL_E_NO_DEVICE);
        assert_non_null(strstr(err.message, "a GPU is required"));
        assert_non_null(strstr(err.message, device));
    }
}

static void limits_are_sane(void **state)
{
    (void)state;
    struct spl_gpu *gpu = open_checked();
    const struct spl_gpu_limits *limits = spl_gpu_get_limits(gpu);
    assert_true(limits->buffer_bytes >= 128 << 20 && limits->buffer_bytes % 16 == 0);
    assert_true(limits->binding_bytes >= 128 << 20);
    assert_true(limits->memory_bytes >= limits->buffer_bytes);
    assert_true(limits->workgroups >= 65535);
    if (!strcmp(device, "egl"))
        assert_false(limits->atomics_64);
    close_checked(gpu);
    gpu = open_with((struct spl_gpu_options){.memory_limit = 1 << 20, .cache_dir = ""});
    struct spl_gpu_buffer *refused, *taken = buffer(gpu, SPL_GPU_DEVICE, (1 << 20) - 4096);
    assert_int_equal(spl_gpu_get_limits(gpu)->memory_bytes, 1 << 20);
    assert_int_equal(spl_gpu_buffer_create(gpu, SPL_GPU_DEVICE, 8192, &refused, NULL), SPL_E_LIMIT);
    spl_gpu_buffer_destroy(gpu, taken);
    spl_gpu_close(gpu);
}

/* Random fills and copies, a list at a time, against the same on host memory. */
static void fill_and_copy_match(void **state)
{
    (void)state;
    enum { words = 3000, rounds = 20, steps = 8 };
    static uint32_t host[words];
    struct spl_gpu *gpu = open_checked();
    struct spl_gpu_buffer *up = buffer(gpu, SPL_GPU_UPLOAD, 4 * words), *work = buffer(gpu, SPL_GPU_DEVICE, 4 * words);
    struct spl_gpu_buffer *down = buffer(gpu, SPL_GPU_READBACK, 4 * words);
    uint32_t *source = spl_gpu_buffer_map(up);
    for (int round = 0; round < rounds; round++) {
        for (int i = 0; i < words; i++)
            source[i] = random_word();
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        if (round == 0) {
            spl_gpu_fill(gpu, work, 0, 4 * words, 0);
            spl_gpu_barrier(gpu);
        }
        for (int step = 0; step < steps; step++) {
            uint32_t at = random_word() % words, count = random_word() % (words - at + 1), word = random_word();
            uint32_t from = random_word() % (words - count + 1);
            if (step % 2) {
                spl_gpu_fill(gpu, work, 4 * at, 4 * count, word);
                for (uint32_t i = 0; i < count; i++)
                    host[at + i] = word;
            } else {
                spl_gpu_copy(gpu, up, 4 * from, work, 4 * at, 4 * count);
                memcpy(host + at, source + from, 4 * count);
            }
            spl_gpu_barrier(gpu);
        }
        spl_gpu_copy(gpu, work, 0, down, 0, 4 * words);
        run(gpu);
        assert_memory_equal(spl_gpu_buffer_map(down), host, sizeof host);
    }
    spl_gpu_buffer_destroy(gpu, up);
    spl_gpu_buffer_destroy(gpu, work);
    spl_gpu_buffer_destroy(gpu, down);
    close_checked(gpu);
}

/* The self-test kernel's storage buffers in the order of their numbers. */
static const enum spl_resource resources[] = {SPL_RESOURCE_FRAME, SPL_RESOURCE_ENTRIES, SPL_RESOURCE_CHUNKS,
                                              SPL_RESOURCE_PAGE,  SPL_RESOURCE_DEPTH,   SPL_RESOURCE_SUMS,
                                              SPL_RESOURCE_OUTPUT, SPL_RESOURCE_IDS};
enum { ENTRIES = 1, SUMS = 5, IDS = 7, PLACES = 8 };

/* The self-test kernel on random input of many lengths, bound at offsets; 32 or 64 bit atomics. */
static void dispatch_matches(const char *name, bool wide)
{
    enum { capacity = 5000, region = 4 * 5120 }; /* regions on multiples of 256 */
    struct spl_gpu *gpu = open_checked();
    if (wide && !spl_gpu_get_limits(gpu)->atomics_64) {
        close_checked(gpu);
        skip();
    }
    struct spl_gpu_kernel *kernel;
    const uint32_t constants[] = {11, 22, 33};
    assert_int_equal(spl_gpu_kernel_create(gpu, name, constants, 3, &kernel, NULL), 0);
    struct spl_gpu_buffer *up = buffer(gpu, SPL_GPU_UPLOAD, 4 * region), *out = buffer(gpu, SPL_GPU_DEVICE, 4 * region);
    struct spl_gpu_buffer *down = buffer(gpu, SPL_GPU_READBACK, 4 * region);
    uint8_t *input = spl_gpu_buffer_map(up), *result = spl_gpu_buffer_map(down);
    const uint32_t *draw = (uint32_t *)(input + ENTRIES * region);
    static const uint32_t counts[] = {1, 63, 64, 65, 1000, 4097, capacity};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        for (int i = 0; i < region; i++)
            ((uint32_t *)input)[i] = random_word() >> 8;
        struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT] = {0};
        for (uint32_t i = 0; i < PLACES; i++)
            bindings[resources[i]] = (struct spl_gpu_binding){i < 4 ? up : out, i % 4 * region, region};
        bindings[SPL_RESOURCE_ENTRIES].bytes = 4 * counts[c];
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        spl_gpu_fill(gpu, out, 0, 4 * region, SPL_NOTHING);
        spl_gpu_barrier(gpu);
        spl_gpu_fill(gpu, out, 4, 12, wide ? SPL_NOTHING : 0);
        spl_gpu_barrier(gpu);
        uint32_t workgroups = (counts[c] + SPL_WORKGROUP - 1) / SPL_WORKGROUP;
        spl_gpu_dispatch(gpu, kernel, bindings, workgroups);
        spl_gpu_barrier(gpu);
        spl_gpu_copy(gpu, out, 0, down, 0, 4 * region);
        run(gpu);

        uint64_t nearest = UINT64_MAX;
        uint32_t least = UINT32_MAX, most = 0, sum = 0;
        for (uint32_t i = 0; i < counts[c]; i++) {
            uint64_t key = (uint64_t)draw[i] << 32 | i;
            float f = (float)draw[i] * 0.5f + 0.25f;
            nearest = key < nearest ? key : nearest;
            least = draw[i] < least ? draw[i] : least;
            most = draw[i] > most ? draw[i] : most;
            sum += draw[i];
            assert_memory_equal(result + (SUMS - 4) * region + 4 * i, &f, 4);
            assert_memory_equal(result + (IDS - 4) * region + 4 * i, &i, 4);
        }
        const uint32_t *depth = (uint32_t *)result, *words = depth + region / 2;
        if (wide) {
            assert_memory_equal(depth, &nearest, 8);
        } else {
            assert_int_equal(depth[0], least);
            assert_int_equal(depth[1], most);
            assert_int_equal(depth[2], sum);
        }
        for (uint32_t i = 0; i < SPL_GPU_CONSTANTS_MAX; i++)
            assert_int_equal(words[i], i < 3 ? constants[i] : 0); /* those not given keep the shader's default */
        const uint32_t *past = (uint32_t *)(result + (SUMS - 4) * region);
        assert_int_equal(past[counts[c]], SPL_NOTHING);
    }
    spl_gpu_kernel_destroy(gpu, kernel);
    spl_gpu_buffer_destroy(gpu, up);
    spl_gpu_buffer_destroy(gpu, out);
    spl_gpu_buffer_destroy(gpu, down);
    close_checked(gpu);
}

static void dispatch_matches_c(void **state)
{
    (void)state;
    dispatch_matches("selftest", false);
}

static void dispatch_with_64_bit_atomics_matches_c(void **state)
{
    (void)state;
    dispatch_matches("selftest64", true);
}

/* Lists in flight at once, each reading what the one before wrote. */
static void lists_run_in_order(void **state)
{
    (void)state;
    enum { lists = 50 };
    struct spl_gpu *gpu = open_checked();
    struct spl_gpu_buffer *work = buffer(gpu, SPL_GPU_DEVICE, 4096), *down = buffer(gpu, SPL_GPU_READBACK, 4096);
    uint64_t tickets[lists];
    for (uint32_t i = 0; i < lists; i++) {
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        spl_gpu_copy(gpu, work, 0, down, 0, 4096);
        spl_gpu_barrier(gpu);
        spl_gpu_fill(gpu, work, 0, 4096, i);
        assert_int_equal(spl_gpu_submit(gpu, &tickets[i], NULL), 0);
        assert_true(i == 0 || tickets[i] > tickets[i - 1]);
    }
    for (uint32_t i = lists; i-- > 0;) /* an old ticket stays a good one */
        assert_int_equal(spl_gpu_wait(gpu, tickets[i], spl_now_ns() + 60 * SPL_NS_PER_S, NULL), 0);
    const uint32_t *words = spl_gpu_buffer_map(down);
    for (int i = 0; i < 1024; i++)
        assert_int_equal(words[i], lists - 2);
    spl_gpu_buffer_destroy(gpu, work);
    spl_gpu_buffer_destroy(gpu, down);
    close_checked(gpu);
}

static void timestamps_grow(void **state)
{
    (void)state;
    struct spl_gpu *gpu = open_checked();
    if (!spl_gpu_get_limits(gpu)->timestamps) {
        close_checked(gpu);
        skip();
    }
    struct spl_gpu_buffer *work = buffer(gpu, SPL_GPU_DEVICE, 64 << 20);
    uint64_t last = 0;
    for (int round = 0; round < 3; round++) {
        uint64_t begin = spl_now_ns();
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        spl_gpu_timestamp(gpu, 0);
        spl_gpu_fill(gpu, work, 0, 64 << 20, 0x01020304);
        spl_gpu_barrier(gpu);
        spl_gpu_timestamp(gpu, 31);
        run(gpu);
        uint64_t wall = spl_now_ns() - begin;
        uint64_t first = spl_gpu_get_timestamp_ns(gpu, 0), second = spl_gpu_get_timestamp_ns(gpu, 31);
        assert_true(first > last && second > first);
        assert_true(second - first <= wall);
        assert_int_equal(spl_gpu_get_timestamp_ns(gpu, 1), 0);
        last = second;
    }
    assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
    run(gpu);
    assert_int_equal(spl_gpu_get_timestamp_ns(gpu, 0), 0); /* not written this time */
    spl_gpu_buffer_destroy(gpu, work);
    close_checked(gpu);
}

/* A deadline that has passed: either the work had ended (and is no loss), or the device is lost; both close cleanly. */
static void deadline_of_zero(void **state)
{
    (void)state;
    struct spl_gpu *gpu = open_checked();
    struct spl_gpu_buffer *work = buffer(gpu, SPL_GPU_DEVICE, 64 << 20);
    uint64_t ticket;
    int code = 0;
    /* Of 40, 120 ms in software, half a millisecond on the largest card; more where who asks was held up for longer. */
    const uint32_t fills_most = strcmp(device, "vulkan") ? 40 : 640;
    for (uint32_t fills = 40; code == 0 && fills <= fills_most; fills *= 2) {
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        for (uint32_t i = 0; i < fills; i++) {
            spl_gpu_fill(gpu, work, 0, 64 << 20, i * 0x01020304);
            spl_gpu_barrier(gpu);
        }
        assert_int_equal(spl_gpu_submit(gpu, &ticket, NULL), 0);
        code = spl_gpu_wait(gpu, ticket, 0, NULL);
    }
    if (!strcmp(device, "vulkan"))
        assert_int_equal(code, SPL_E_TIMEOUT);
    else /* llvmpipe works while commands are recorded */
        assert_true(code == 0 || code == SPL_E_TIMEOUT);
    assert_int_equal(spl_gpu_begin(gpu, NULL), code == 0 ? 0 : SPL_E_DEVICE_LOST);
    if (code == 0)
        run(gpu);
    spl_gpu_buffer_destroy(gpu, work);
    close_checked(gpu);
}

static void loss_is_survived(void **state)
{
    (void)state;
    for (int round = 0; round < 3; round++) {
        struct spl_gpu *gpu = open_checked();
        struct spl_gpu_buffer *work = buffer(gpu, SPL_GPU_DEVICE, 1 << 20);
        struct spl_error err = {0};
        uint64_t before, after;
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        spl_gpu_fill(gpu, work, 0, 1 << 20, 1);
        assert_int_equal(spl_gpu_submit(gpu, &before, NULL), 0);
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        spl_gpu_fill(gpu, work, 0, 1 << 20, 2);
        spl_gpu_inject_loss(gpu, 0);
        assert_int_equal(spl_gpu_submit(gpu, &after, &err), SPL_E_DEVICE_LOST);
        assert_non_null(strstr(err.message, spl_gpu_get_device(gpu)->name));
        assert_int_equal(spl_gpu_wait(gpu, before, SPL_NEVER, NULL), SPL_E_DEVICE_LOST);
        spl_gpu_buffer_destroy(gpu, work);
        close_checked(gpu);
    }
}

/* Whatever allocation fails while opening, the error is told and nothing stays behind. */
static void opening_survives_refused_memory(void **state)
{
    (void)state;
    int refused = 0;
    for (long n = 1; n <= 16; n++) {
        struct spl_gpu *gpu;
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int code = spl_gpu_open(&(struct spl_gpu_options){.device = device, .cache_dir = ""}, &gpu, &err);
        spl_memory_fail_after(0);
        if (code == 0) {
            close_checked(gpu);
            continue;
        }
        refused++;
        assert_null(gpu);
        assert_int_equal(code, SPL_E_NO_DEVICE);
        assert_true(err.message[0]);
    }
    assert_true(refused >= 5); /* the device, its buffers, the self-test's */
}

static void two_devices_on_one_thread(void **state)
{
    (void)state;
    struct spl_gpu *gpus[2] = {open_checked(), open_checked()};
    struct spl_gpu_buffer *downs[2];
    for (uint32_t i = 0; i < 2; i++)
        downs[i] = buffer(gpus[i], SPL_GPU_READBACK, 256);
    for (uint32_t i = 0; i < 2; i++)
        assert_int_equal(spl_gpu_begin(gpus[i], NULL), 0);
    spl_gpu_list(NULL, 0); /* listing does not disturb what is open */
    for (uint32_t i = 0; i < 2; i++)
        spl_gpu_fill(gpus[i], downs[i], 0, 256, 100 + i);
    for (uint32_t i = 0; i < 2; i++)
        run(gpus[i]);
    for (uint32_t i = 0; i < 2; i++) {
        assert_int_equal(((uint32_t *)spl_gpu_buffer_map(downs[i]))[63], 100 + i);
        spl_gpu_buffer_destroy(gpus[i], downs[i]);
    }
    close_checked(gpus[0]);
    close_checked(gpus[1]);
}

static long resident_kib(void)
{
    long pages = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%ld %ld", &pages, &resident) != 2)
        resident = 0;
    if (file)
        fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

static size_t open_files(void)
{
    size_t count = 0;
    for (int fd = 0; fd < 1024; fd++)
        count += lseek(fd, 0, SEEK_CUR) >= 0;
    return count;
}

/* Growth per round is asked of the rounds after the drivers have warmed up. */
static void reopening_does_not_grow(void **state)
{
    (void)state;
    enum { rounds = 20, warm = 5 };
    long before = 0;
    size_t files = 0;
    for (int round = 0; round < rounds; round++) {
        if (round == warm) {
            before = resident_kib();
            files = open_files();
        }
        struct spl_gpu *gpu = open_with((struct spl_gpu_options){.cache_dir = ""});
        struct spl_gpu_buffer *work = buffer(gpu, SPL_GPU_DEVICE, 32 << 20);
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        spl_gpu_fill(gpu, work, 0, 32 << 20, 1);
        run(gpu);
        spl_gpu_buffer_destroy(gpu, work);
        close_checked(gpu);
    }
    long grown = resident_kib() - before;
    print_message("%d rounds grew by %ld KiB\n", rounds - warm, grown);
    assert_true(grown < 16 << 10); /* half of one round's buffer */
    assert_int_equal(open_files(), files);
}

/* The cache survives files that are not one, and its own being cut short. */
static void pipeline_cache_is_only_a_cache(void **state)
{
    (void)state;
    char folder[] = "/tmp/splatd-test-XXXXXX", nested[64], command[256];
    assert_non_null(mkdtemp(folder));
    snprintf(nested, sizeof nested, "%s/a/b", folder);
    spl_gpu_close(open_with((struct spl_gpu_options){.cache_dir = nested}));
    static const char *const damage[] = {
        "truncate -s 7 %s/*", "dd if=/dev/urandom of=$(ls %s/*) bs=4k count=1 status=none", "truncate -s 0 %s/*"};
    for (size_t i = 0; i < sizeof damage / sizeof *damage && !strcmp(device, "vulkan"); i++) {
        char broken[128];
        snprintf(broken, sizeof broken, damage[i], nested);
        assert_int_equal(system(broken), 0);
        spl_gpu_close(open_with((struct spl_gpu_options){.cache_dir = nested, .debug = true}));
    }
    spl_gpu_close(open_with((struct spl_gpu_options){.cache_dir = "/proc/nowhere"}));
    snprintf(command, sizeof command, "test -z \"$(find %s -name '*.[0-9]*' -size 0)\" && rm -r %s", folder, folder);
    assert_int_equal(system(command), 0);
}

static void kernels_without_opengl_flavour_are_unsupported(void **state)
{
    (void)state;
    struct spl_gpu *gpu = open_checked();
    struct spl_gpu_kernel *kernel;
    struct spl_error err = {0};
    if (!strcmp(device, "egl")) {
        assert_int_equal(spl_gpu_kernel_create(gpu, "selftest64", NULL, 0, &kernel, &err), SPL_E_UNSUPPORTED);
        assert_non_null(strstr(err.message, "selftest64"));
    }
    close_checked(gpu);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_what_it_opens),
        cmocka_unit_test(refuses_devices_by_reason),
        cmocka_unit_test(limits_are_sane),
        cmocka_unit_test(fill_and_copy_match),
        cmocka_unit_test(dispatch_matches_c),
        cmocka_unit_test(dispatch_with_64_bit_atomics_matches_c),
        cmocka_unit_test(kernels_without_opengl_flavour_are_unsupported),
        cmocka_unit_test(lists_run_in_order),
        cmocka_unit_test(timestamps_grow),
        cmocka_unit_test(deadline_of_zero),
        cmocka_unit_test(loss_is_survived),
        cmocka_unit_test(opening_survives_refused_memory),
        cmocka_unit_test(two_devices_on_one_thread),
        cmocka_unit_test(reopening_does_not_grow),
        cmocka_unit_test(pipeline_cache_is_only_a_cache),
    };
    device = getenv("SPLATD_TEST_DEVICE");
    if (!device)
        device = "vulkan";
    struct spl_device_info devices[32];
    size_t count = spl_gpu_list(devices, 32);
    for (size_t i = 0; i < count && i < 32; i++)
        if (!strcmp(devices[i].backend, device) && !devices[i].unusable[0])
            return cmocka_run_group_tests(tests, NULL, NULL);
    printf("no usable %s device\n", device);
    return 77;
}
