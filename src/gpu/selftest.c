/* The self-test at open: a small kernel touches storage buffers and texels, every field of the shared structs, every
 * specialisation constant and each kind of atomic that our kernels use, and each word it writes is compared with what C
 * says. A driver that miscompiles or lays out differently is refused here, with the first wrong word, instead of
 * rendering nonsense.
 */
#include "gpu/backend.h"

#include <inttypes.h>
#include <string.h>

#include "base/clock.h"
#include "shared.h"

/* The kernel's storage buffers in the order of their numbers; the first four are read. */
enum place { FRAME, ENTRIES, CHUNKS, PAGE, DEPTH, SUMS, OUTPUT, IDS, PLACES };
static const enum spl_resource resources[PLACES] = {SPL_RESOURCE_FRAME,  SPL_RESOURCE_ENTRIES, SPL_RESOURCE_CHUNKS,
                                                    SPL_RESOURCE_PAGE,   SPL_RESOURCE_DEPTH,   SPL_RESOURCE_SUMS,
                                                    SPL_RESOURCE_OUTPUT, SPL_RESOURCE_IDS};

enum {
    N = 1000, /* not a multiple of the workgroup: the last one is partly idle */
    FRAME_WORDS = sizeof(struct spl_frame_params) / 4,
    CHUNK_WORDS = sizeof(struct spl_draw_chunk) / 4,
    OUTPUT_WORDS = SPL_GPU_CONSTANTS_MAX + FRAME_WORDS + CHUNK_WORDS,
    INPUTS = PAGE + 1,
    REGION = 4096 /* bytes per binding, at least 4 N */
};
_Static_assert((int)PAGE == SPL_SELFTEST_PAGE, "where the shader looks for it");
_Static_assert(4 * N <= REGION && 4 * OUTPUT_WORDS <= REGION, "each binding fits its region");

static const uint32_t constants[SPL_GPU_CONSTANTS_MAX] = {3, 1, 4, 1, 5, 9, 0x80000001u, 0xffffffffu};

/* Bit patterns of ordinary floats, all different, so that no float path may change them. */
static uint32_t pattern(uint32_t i)
{
    return 0x3f800000u + i * 7919u;
}

static uint32_t draw_value(uint32_t i)
{
    return (i * 2654435761u) >> 8; /* 24 bits: exact as a float */
}

/* What the kernel leaves in `place`, which is zero before (the nearest depth all ones). */
static void expect(enum place place, bool atomics_64, uint32_t *words)
{
    uint64_t nearest = UINT64_MAX;
    for (uint32_t i = 0; i < N; i++) {
        uint32_t value = draw_value(i);
        uint64_t key = (uint64_t)value << 32 | i;
        float f = (float)value * 0.5f + 0.25f;
        if (place == SUMS)
            memcpy(&words[i], &f, 4);
        if (place == IDS)
            words[i] = i;
        if (place != DEPTH)
            continue;
        nearest = key < nearest ? key : nearest;
        if (atomics_64) {
            memcpy(words, &nearest, 8);
        } else {
            words[0] = (uint32_t)(nearest >> 32);
            words[1] = value > words[1] ? value : words[1];
            words[2] += value;
            words[3] |= ~pattern(i);
        }
    }
    if (place == OUTPUT) {
        memcpy(words, constants, sizeof constants);
        for (uint32_t i = 0; i < FRAME_WORDS + CHUNK_WORDS; i++)
            words[SPL_GPU_CONSTANTS_MAX + i] = pattern(i);
    }
}

static void fill_inputs(uint8_t *map)
{
    uint32_t *frame = (uint32_t *)map, *chunk = (uint32_t *)(map + CHUNKS * REGION) + CHUNK_WORDS;
    uint32_t *draw = (uint32_t *)(map + ENTRIES * REGION), *page = (uint32_t *)(map + PAGE * REGION);
    memset(map, 0, (size_t)INPUTS * REGION);
    for (uint32_t i = 0; i < FRAME_WORDS; i++)
        frame[i] = pattern(i);
    for (uint32_t i = 0; i < CHUNK_WORDS; i++)
        chunk[i] = pattern(FRAME_WORDS + i);
    for (uint32_t i = 0; i < N; i++) {
        draw[i] = draw_value(i);
        page[i] = pattern(i);
    }
}

static int compare(const struct spl_gpu *gpu, const char *name, bool atomics_64, const uint8_t *map,
                   struct spl_error *err)
{
    for (uint32_t place = INPUTS; place < PLACES; place++) {
        uint32_t want[REGION / 4] = {0};
        const uint32_t *got = (const uint32_t *)(map + (place - INPUTS) * REGION);
        expect((enum place)place, atomics_64, want);
        for (uint32_t i = 0; i < REGION / 4; i++)
            if (got[i] != want[i])
                return spl_fail(err, SPL_E_NO_DEVICE,
                                "self-test '%s' failed on device '%s' (%s): word %u of binding %u is 0x%08" PRIx32
                                ", not 0x%08" PRIx32 "; its driver is not usable",
                                name, gpu->info.name, gpu->info.driver, i, place, got[i], want[i]);
    }
    return 0;
}

static int run(struct spl_gpu *gpu, const char *name, bool atomics_64, struct spl_error *err)
{
    const uint64_t outputs = (PLACES - INPUTS) * REGION;
    struct spl_gpu_buffer *input = NULL, *device = NULL, *readback = NULL;
    struct spl_gpu_kernel *kernel = NULL;
    uint64_t ticket;
    int code;
    if ((code = spl_gpu_buffer_create(gpu, SPL_GPU_UPLOAD, INPUTS * REGION, &input, err)) < 0 ||
        (code = spl_gpu_buffer_create(gpu, SPL_GPU_DEVICE, outputs, &device, err)) < 0 ||
        (code = spl_gpu_buffer_create(gpu, SPL_GPU_READBACK, outputs, &readback, err)) < 0 ||
        (code = spl_gpu_kernel_create(gpu, name, constants, SPL_GPU_CONSTANTS_MAX, &kernel, err)) < 0 ||
        (code = spl_gpu_begin(gpu, err)) < 0)
        goto done;
    fill_inputs(spl_gpu_buffer_map(input));
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT] = {0};
    for (uint32_t i = 0; i < PLACES; i++)
        bindings[resources[i]] = (struct spl_gpu_binding){
            .buffer = i < INPUTS ? input : device, .offset = (i < INPUTS ? i : i - INPUTS) * REGION, .bytes = REGION};
    bindings[SPL_RESOURCE_ENTRIES].bytes = 4 * N; /* the kernel takes its count from the range */
    spl_gpu_fill(gpu, device, 0, outputs, 0);
    spl_gpu_barrier(gpu);
    spl_gpu_fill(gpu, device, (DEPTH - INPUTS) * REGION, atomics_64 ? 8 : 4, SPL_NOTHING);
    spl_gpu_barrier(gpu);
    spl_gpu_dispatch(gpu, kernel, bindings, (N + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    spl_gpu_barrier(gpu);
    spl_gpu_copy(gpu, device, 0, readback, 0, outputs);
    if ((code = spl_gpu_submit(gpu, &ticket, err)) < 0 ||
        (code = spl_gpu_wait(gpu, ticket, spl_now_ns() + spl_gpu_patience_ns(gpu), err)) < 0)
        goto done;
    code = compare(gpu, name, atomics_64, spl_gpu_buffer_map(readback), err);
done:
    spl_gpu_kernel_destroy(gpu, kernel);
    spl_gpu_buffer_destroy(gpu, readback);
    spl_gpu_buffer_destroy(gpu, device);
    spl_gpu_buffer_destroy(gpu, input);
    return code;
}

int spl_gpu_selftest(struct spl_gpu *gpu, struct spl_error *err)
{
    int code = run(gpu, "selftest", false, err);
    return code < 0 || !gpu->limits.atomics_64 ? code : run(gpu, "selftest64", true, err);
}
