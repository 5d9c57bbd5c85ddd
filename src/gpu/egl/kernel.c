/* Programs from SPIR-V (GL_ARB_gl_spirv). Vulkan ignores specialisation constants that a kernel does not declare,
 * OpenGL refuses them, so the declared ones are looked up in the code first. Owned by the device's thread. */
#include "gpu/egl/gl.h"

#include <stdlib.h>

#include "base/memory.h"

enum { SPIRV_HEADER_WORDS = 5, OP_DECORATE = 71, DECORATION_SPEC_ID = 1 };

/* Bit i: the code declares the constant with id i. */
static uint32_t declared_constants(const uint32_t *words, size_t count)
{
    uint32_t found = 0;
    for (size_t at = SPIRV_HEADER_WORDS, length; at < count; at += length) {
        length = words[at] >> 16;
        if (!length)
            break;
        if ((words[at] & 0xffff) == OP_DECORATE && length == 4 && words[at + 2] == DECORATION_SPEC_ID &&
            words[at + 3] < SPL_GPU_CONSTANTS_MAX)
            found |= 1u << words[at + 3];
    }
    return found;
}

int gl_kernel_create(struct spl_gpu *base, const struct spl_gpu_code *code, const uint32_t *constants,
                     size_t constant_count, struct spl_gpu_kernel **out, struct spl_error *err)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    const struct gl_functions *gl = &gpu->gl;
    if (!code->opengl.begin)
        return spl_fail(err, SPL_E_UNSUPPORTED, "egl: kernel '%s' needs 64 bit atomics, which OpenGL lacks",
                        code->name);
    struct gl_kernel *kernel = spl_alloc(1, sizeof *kernel, err);
    if (!kernel)
        return SPL_E_NOMEM;
    const size_t words = (size_t)(code->opengl.end - code->opengl.begin);
    uint32_t declared = declared_constants(code->opengl.begin, words);
    GLuint ids[SPL_GPU_CONSTANTS_MAX], values[SPL_GPU_CONSTANTS_MAX], count = 0;
    for (uint32_t i = 0; i < constant_count; i++) {
        if (declared >> i & 1) {
            ids[count] = i;
            values[count++] = constants[i];
        }
    }
    gl_use(gpu);
    char log[256] = "";
    GLint done = GL_FALSE;
    GLuint shader = gl->CreateShader(GL_COMPUTE_SHADER);
    gl->ShaderBinary(1, &shader, GL_SHADER_BINARY_FORMAT_SPIR_V, code->opengl.begin, (GLsizei)(4 * words));
    gl->SpecializeShader(shader, "main", count, ids, values);
    gl->GetShaderiv(shader, GL_COMPILE_STATUS, &done);
    if (done) {
        kernel->program = gl->CreateProgram();
        gl->AttachShader(kernel->program, shader);
        gl->LinkProgram(kernel->program);
        gl->GetProgramiv(kernel->program, GL_LINK_STATUS, &done);
        gl->GetProgramInfoLog(kernel->program, sizeof log, NULL, log);
    } else {
        gl->GetShaderInfoLog(shader, sizeof log, NULL, log);
    }
    gl->DeleteShader(shader);
    GLenum error = gl->GetError();
    if (!done || error != GL_NO_ERROR) {
        gl_kernel_destroy(base, &kernel->base);
        return spl_fail(err, SPL_E_UNSUPPORTED, "egl: kernel '%s' was refused: %s (GL error 0x%x)", code->name, log,
                        error);
    }
    *out = &kernel->base;
    return 0;
}

void gl_kernel_destroy(struct spl_gpu *base, struct spl_gpu_kernel *base_kernel)
{
    struct gl_gpu *gpu = (struct gl_gpu *)base;
    struct gl_kernel *kernel = (struct gl_kernel *)base_kernel;
    gl_use(gpu);
    gpu->gl.DeleteProgram(kernel->program);
    free(kernel);
}
