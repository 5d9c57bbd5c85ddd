/* Immutable buffer storage; host-visible buffers stay mapped, persistent and coherent. Owned by the device's thread. */
#include "gpu/egl/gl.h"

#include <inttypes.h>
#include <stdlib.h>

#include "base/memory.h"

int gl_buffer_create(struct spl_gpu *base, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                     struct spl_error *err)
{
    static const GLbitfield access[] = {[SPL_GPU_UPLOAD] = GL_MAP_WRITE_BIT, [SPL_GPU_READBACK] = GL_MAP_READ_BIT};
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    const struct gl_functions *gl = &gpu->gl;
    struct gl_buffer *buffer = spl_alloc(1, sizeof *buffer, err);
    if (!buffer)
        return SPL_E_NOMEM;
    GLbitfield flags = kind == SPL_GPU_DEVICE ? 0 : access[kind] | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    gl_use(gpu);
    gl->CreateBuffers(1, &buffer->name);
    gl->NamedBufferStorage(buffer->name, (GLsizeiptr)bytes, NULL,
                           flags | (kind == SPL_GPU_READBACK ? GL_CLIENT_STORAGE_BIT : 0));
    gl->CreateTextures(GL_TEXTURE_BUFFER, 1, &buffer->texels);
    gl->TextureBuffer(buffer->texels, GL_R32UI, buffer->name);
    GLenum error = gl->GetError();
    if (error == GL_NO_ERROR && flags) {
        buffer->base.map = gl->MapNamedBufferRange(buffer->name, 0, (GLsizeiptr)bytes, flags);
        error = gl->GetError();
    }
    if (error != GL_NO_ERROR) {
        gl_buffer_destroy(base, &buffer->base);
        return spl_fail(err, SPL_E_LIMIT, "egl: device '%s' refused %" PRIu64 " bytes beside the %" PRIu64
                        " bytes already taken (GL error 0x%x)", base->info.name, bytes, base->memory, error);
    }
    *out = &buffer->base;
    return 0;
}

void gl_buffer_destroy(struct spl_gpu *base, struct spl_gpu_buffer *base_buffer)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    struct gl_buffer *buffer = (struct gl_buffer *)base_buffer;
    gl_use(gpu);
    gpu->gl.DeleteTextures(1, &buffer->texels);
    gpu->gl.DeleteBuffers(1, &buffer->name);
    free(buffer);
}
