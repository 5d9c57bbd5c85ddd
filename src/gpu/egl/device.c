/* Opening and closing an OpenGL device, and the backend's table. Owned by the thread that opens it. */
#include "gpu/egl/gl.h"

#include <stdlib.h>

#include "base/memory.h"

/* Tokens of GL_NVX_gpu_memory_info and GL_ATI_meminfo; memory is in KiB. */
enum { DEDICATED_VIDMEM_NVX = 0x9047, VBO_FREE_MEMORY_ATI = 0x87FB };

static void gl_close(struct spl_gpu *base)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    if (gpu->ready) {
        gl_use(gpu);
        gl_frames_finish(gpu);
    }
    gl_context_close(gpu);
    free(gpu);
}

static void APIENTRY on_message(GLenum source, GLenum type, GLuint id, GLenum severity, GLsizei length,
                                const GLchar *message, const void *context)
{
    (void)source;
    (void)id;
    (void)length;
    (void)context;
    if (severity == GL_DEBUG_SEVERITY_NOTIFICATION || type == GL_DEBUG_TYPE_PERFORMANCE ||
        type == GL_DEBUG_TYPE_OTHER)
        return;
    spl_gpu_complain("egl", type == GL_DEBUG_TYPE_ERROR, message);
}

static void read_limits(struct gl_gpu *gpu)
{
    /* OpenGL has no limit to ask for; 2 GiB is what every driver seen so far takes. */
    static const uint64_t buffer_bytes = UINT64_C(1) << 31;
    const struct gl_functions *gl = &gpu->gl;
    struct spl_gpu_limits *limits = &gpu->base.limits;
    GLint values[4] = {0}, workgroups = 0, bits = 0, texels = 0;
    GLint64 binding = 0;
    if (gpu->base.info.software)
        limits->memory_bytes = spl_gpu_host_memory();
    else if (gl_has_extension(gl, "GL_NVX_gpu_memory_info"))
        gl->GetIntegerv(DEDICATED_VIDMEM_NVX, values);
    else if (gl_has_extension(gl, "GL_ATI_meminfo"))
        gl->GetIntegerv(VBO_FREE_MEMORY_ATI, values);
    if (values[0] > 0)
        limits->memory_bytes = (uint64_t)values[0] << 10;
    if (!limits->memory_bytes) /* graphics within the processor share its memory */
        limits->memory_bytes = spl_gpu_host_memory() / 2;
    gl->GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &binding);
    gl->GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    gl->GetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &workgroups);
    gl->GetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
    limits->buffer_bytes = buffer_bytes;
    uint64_t texel_bytes = UINT64_C(4) * (uint32_t)texels;
    limits->binding_bytes = (uint64_t)binding < texel_bytes ? (uint64_t)binding : texel_bytes;
    limits->workgroups = (uint32_t)workgroups;
    limits->timestamps = bits > 0;
}

static int gl_open(uint32_t index, const struct spl_gpu_options *options, struct spl_gpu **out, struct spl_error *err)
{
    struct spl_error failure = {0};
    struct gl_gpu *gpu = spl_alloc(1, sizeof *gpu, err);
    if (!gpu)
        return SPL_E_NOMEM;
    gpu->base.backend = &spl_gpu_egl;
    if (!gl_context_open(index, options->debug, gpu, &failure))
        spl_fail(&failure, SPL_E_NO_DEVICE, "egl: device %u has gone", index);
    if (!failure.code) {
        if (options->debug) {
            gpu->gl.Enable(GL_DEBUG_OUTPUT);
            gpu->gl.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
            gpu->gl.DebugMessageCallback(on_message, NULL);
        }
        read_limits(gpu);
        gl_frames_init(gpu);
        gpu->ready = true;
    }
    if (failure.code) {
        gl_close(&gpu->base);
        return spl_fail(err, failure.code, "%s", failure.message);
    }
    *out = &gpu->base;
    return 0;
}

const struct spl_gpu_backend spl_gpu_egl = {
    .name = "egl",
    .list = gl_list,
    .open = gl_open,
    .close = gl_close,
    .buffer_create = gl_buffer_create,
    .buffer_destroy = gl_buffer_destroy,
    .kernel_create = gl_kernel_create,
    .kernel_destroy = gl_kernel_destroy,
    .begin = gl_begin,
    .dispatch = gl_dispatch,
    .barrier = gl_barrier,
    .copy = gl_copy,
    .fill = gl_fill,
    .timestamp = gl_timestamp,
    .submit = gl_submit,
    .wait = gl_wait,
    .read_timestamps = gl_read_timestamps,
};
