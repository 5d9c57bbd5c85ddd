/* Recording, submission and waiting. OpenGL has no command lists of ours: commands go to the driver as they are
 * recorded, in order, and submit puts a fence behind them. Owned by the device's thread. */
#include "gpu/egl/gl.h"

#include <stdlib.h>

void gl_frames_init(struct gl_gpu *gpu)
{
    if (gpu->base.limits.timestamps)
        gpu->gl.CreateQueries(GL_TIMESTAMP, SPL_GPU_TIMESTAMPS_MAX, gpu->list.queries);
}

void gl_frames_finish(struct gl_gpu *gpu)
{
    gpu->gl.DeleteQueries(SPL_GPU_TIMESTAMPS_MAX, gpu->list.queries);
    gpu->gl.DeleteSync(gpu->list.sync);
    for (int i = 0; i < GL_PATTERNS; i++)
        gpu->gl.DeleteBuffers(1, &gpu->patterns[i].name);
}

static int check(struct gl_gpu *gpu, struct spl_error *err)
{
    if (!gl_use(gpu))
        return spl_fail(err, SPL_E_DEVICE_LOST, "egl: the context of device '%s' is gone", gpu->base.info.name);
    if (gpu->gl.GetGraphicsResetStatus() != GL_NO_ERROR)
        return spl_fail(err, SPL_E_DEVICE_LOST, "egl: device '%s' was reset", gpu->base.info.name);
    GLenum error = gpu->gl.GetError();
    if (error != GL_NO_ERROR)
        return spl_fail(err, SPL_E_DEVICE_LOST, "egl: device '%s' refused work (GL error 0x%x)", gpu->base.info.name,
                        error);
    return 0;
}

int gl_begin(struct spl_gpu *base, struct spl_error *err)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    gl_use(gpu);
    gpu->gl.DeleteSync(gpu->list.sync);
    gpu->list.sync = NULL;
    gpu->list.written = 0;
    return check(gpu, err);
}

void gl_dispatch(struct spl_gpu *base, struct spl_gpu_kernel *kernel, const struct spl_gpu_arguments *arguments,
                 uint32_t workgroups)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    gl_use(gpu);
    for (uint32_t i = 0; i < kernel->code->storages.count; i++) {
        const struct spl_gpu_binding *binding = &arguments->storage[i];
        gpu->gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, i, ((const struct gl_buffer *)binding->buffer)->name,
                                (GLintptr)binding->offset, (GLsizeiptr)binding->bytes);
    }
    for (uint32_t i = 0; i < kernel->code->texels.count; i++)
        gpu->gl.BindImageTexture(i, ((const struct gl_buffer *)arguments->texels[i])->texels, 0, GL_FALSE, 0,
                                 GL_READ_ONLY, GL_R32UI);
    gpu->gl.UseProgram(((struct gl_kernel *)kernel)->program);
    gpu->gl.DispatchCompute(workgroups, 1, 1);
}

void gl_barrier(struct spl_gpu *base)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    gl_use(gpu);
    gpu->gl.MemoryBarrier(GL_ALL_BARRIER_BITS);
}

void gl_copy(struct spl_gpu *base, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
             uint64_t to_offset, uint64_t bytes)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    gl_use(gpu);
    gpu->gl.CopyNamedBufferSubData(((struct gl_buffer *)from)->name, ((struct gl_buffer *)to)->name,
                                   (GLintptr)from_offset, (GLintptr)to_offset, (GLsizeiptr)bytes);
}

/* The buffer that is full of `word`; 0 where there is none. */
static GLuint get_pattern(struct gl_gpu *gpu, uint32_t word)
{
    for (int i = 0; i < GL_PATTERNS; i++) {
        struct gl_pattern *pattern = &gpu->patterns[i];
        if (!pattern->name) {
            uint32_t *words = malloc(GL_PATTERN_BYTES);
            for (size_t k = 0; words && k < GL_PATTERN_BYTES / sizeof *words; k++)
                words[k] = word;
            if (!words)
                return 0;
            gpu->gl.CreateBuffers(1, &pattern->name);
            gpu->gl.NamedBufferStorage(pattern->name, GL_PATTERN_BYTES, words, 0);
            pattern->word = word;
            free(words);
        }
        if (pattern->word == word)
            return pattern->name;
    }
    return 0;
}

/* A GPU's driver may clear on the processor (2.9 ms for the sums of 1280x720, where a copy takes microseconds). */
void gl_fill(struct spl_gpu *base, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    gl_use(gpu);
    const GLuint pattern = gpu->base.info.software || bytes < GL_PATTERN_BYTES / 16 ? 0 : get_pattern(gpu, word);
    for (uint64_t done = 0; pattern && done < bytes; done += GL_PATTERN_BYTES) {
        const uint64_t part = bytes - done < GL_PATTERN_BYTES ? bytes - done : GL_PATTERN_BYTES;
        gpu->gl.CopyNamedBufferSubData(pattern, ((struct gl_buffer *)buffer)->name, 0, (GLintptr)(offset + done),
                                       (GLsizeiptr)part);
    }
    if (pattern)
        return;
    gpu->gl.ClearNamedBufferSubData(((struct gl_buffer *)buffer)->name, GL_R32UI, (GLintptr)offset,
                                    (GLsizeiptr)bytes, GL_RED_INTEGER, GL_UNSIGNED_INT, &word);
}

void gl_timestamp(struct spl_gpu *base, uint32_t slot)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    if (gpu->list.written >> slot & 1)
        return; /* as in Vulkan, the first stays */
    gpu->list.written |= 1u << slot;
    gl_use(gpu);
    gpu->gl.QueryCounter(gpu->list.queries[slot], GL_TIMESTAMP);
}

int gl_submit(struct spl_gpu *base, uint64_t ticket, struct spl_error *err)
{
    (void)ticket;
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    gl_barrier(base);
    gpu->list.sync = gpu->gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    gpu->gl.Flush();
    int code = check(gpu, err);
    return code < 0 || gpu->list.sync ? code : spl_fail(err, SPL_E_DEVICE_LOST, "egl: no fence");
}

int gl_wait(struct spl_gpu *base, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    if (ticket <= gpu->ended)
        return 0;
    GLenum result = GL_WAIT_FAILED;
    if (gl_use(gpu))
        result = gpu->gl.ClientWaitSync(gpu->list.sync, GL_SYNC_FLUSH_COMMANDS_BIT,
                                        timeout_ns < INT64_MAX ? timeout_ns : INT64_MAX);
    if (result == GL_TIMEOUT_EXPIRED)
        return spl_fail(err, SPL_E_TIMEOUT, "device '%s' did not end its work in time", base->info.name);
    if (result != GL_ALREADY_SIGNALED && result != GL_CONDITION_SATISFIED) {
        int code = check(gpu, err);
        return code < 0 ? code : spl_fail(err, SPL_E_DEVICE_LOST, "egl: waiting failed");
    }
    gpu->ended = ticket;
    return 0;
}

void gl_read_timestamps(struct spl_gpu *base)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    const struct gl_list *list = &gpu->list;
    gl_use(gpu);
    for (uint32_t i = 0; i < SPL_GPU_TIMESTAMPS_MAX; i++) {
        GLuint64 ns = 0;
        if (!(list->written >> i & 1))
            continue;
        gpu->gl.GetQueryObjectui64v(list->queries[i], GL_QUERY_RESULT, &ns);
        base->timestamps_ns[i] = ns;
    }
}
