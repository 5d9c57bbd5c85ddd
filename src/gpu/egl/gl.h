/* The EGL/OpenGL backend's own structs; private to src/gpu/egl. */
#ifndef SPL_GPU_EGL_GL_H
#define SPL_GPU_EGL_GL_H

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>

#include "base/clock.h"
#include "gpu/backend.h"

/* Every entry point that is used: FUNCTION(type, name without "gl"). All of them are core in OpenGL 4.5. */
#define GL_FUNCTIONS                                                                                                   \
    FUNCTION(PFNGLATTACHSHADERPROC, AttachShader)                                                                      \
    FUNCTION(PFNGLBINDBUFFERPROC, BindBuffer)                                                                          \
    FUNCTION(PFNGLBINDBUFFERRANGEPROC, BindBufferRange)                                                                \
    FUNCTION(PFNGLBINDIMAGETEXTUREPROC, BindImageTexture)                                                              \
    FUNCTION(PFNGLCLEARNAMEDBUFFERSUBDATAPROC, ClearNamedBufferSubData)                                                \
    FUNCTION(PFNGLCLIENTWAITSYNCPROC, ClientWaitSync)                                                                  \
    FUNCTION(PFNGLCOPYNAMEDBUFFERSUBDATAPROC, CopyNamedBufferSubData)                                                  \
    FUNCTION(PFNGLCREATEBUFFERSPROC, CreateBuffers)                                                                    \
    FUNCTION(PFNGLCREATEPROGRAMPROC, CreateProgram)                                                                    \
    FUNCTION(PFNGLCREATEQUERIESPROC, CreateQueries)                                                                    \
    FUNCTION(PFNGLCREATESHADERPROC, CreateShader)                                                                      \
    FUNCTION(PFNGLCREATETEXTURESPROC, CreateTextures)                                                                  \
    FUNCTION(PFNGLDEBUGMESSAGECALLBACKPROC, DebugMessageCallback)                                                      \
    FUNCTION(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                                                                    \
    FUNCTION(PFNGLDELETEPROGRAMPROC, DeleteProgram)                                                                    \
    FUNCTION(PFNGLDELETEQUERIESPROC, DeleteQueries)                                                                    \
    FUNCTION(PFNGLDELETESHADERPROC, DeleteShader)                                                                      \
    FUNCTION(PFNGLDELETESYNCPROC, DeleteSync)                                                                          \
    FUNCTION(PFNGLDELETETEXTURESPROC, DeleteTextures)                                                                  \
    FUNCTION(PFNGLDISPATCHCOMPUTEPROC, DispatchCompute)                                                                \
    FUNCTION(PFNGLENABLEPROC, Enable)                                                                                  \
    FUNCTION(PFNGLFENCESYNCPROC, FenceSync)                                                                            \
    FUNCTION(PFNGLFLUSHPROC, Flush)                                                                                    \
    FUNCTION(PFNGLGETERRORPROC, GetError)                                                                              \
    FUNCTION(PFNGLGETGRAPHICSRESETSTATUSPROC, GetGraphicsResetStatus)                                                  \
    FUNCTION(PFNGLGETINTEGER64VPROC, GetInteger64v)                                                                    \
    FUNCTION(PFNGLGETINTEGERI_VPROC, GetIntegeri_v)                                                                    \
    FUNCTION(PFNGLGETINTEGERVPROC, GetIntegerv)                                                                        \
    FUNCTION(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)                                                            \
    FUNCTION(PFNGLGETPROGRAMIVPROC, GetProgramiv)                                                                      \
    FUNCTION(PFNGLGETQUERYIVPROC, GetQueryiv)                                                                          \
    FUNCTION(PFNGLGETQUERYOBJECTUI64VPROC, GetQueryObjectui64v)                                                        \
    FUNCTION(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)                                                              \
    FUNCTION(PFNGLGETSHADERIVPROC, GetShaderiv)                                                                        \
    FUNCTION(PFNGLGETSTRINGIPROC, GetStringi)                                                                          \
    FUNCTION(PFNGLGETSTRINGPROC, GetString)                                                                            \
    FUNCTION(PFNGLLINKPROGRAMPROC, LinkProgram)                                                                        \
    FUNCTION(PFNGLMAPNAMEDBUFFERRANGEPROC, MapNamedBufferRange)                                                        \
    FUNCTION(PFNGLMEMORYBARRIERPROC, MemoryBarrier)                                                                    \
    FUNCTION(PFNGLNAMEDBUFFERSTORAGEPROC, NamedBufferStorage)                                                          \
    FUNCTION(PFNGLQUERYCOUNTERPROC, QueryCounter)                                                                      \
    FUNCTION(PFNGLSHADERBINARYPROC, ShaderBinary)                                                                      \
    FUNCTION(PFNGLTEXTUREBUFFERPROC, TextureBuffer)                                                                    \
    FUNCTION(PFNGLUSEPROGRAMPROC, UseProgram)

struct gl_functions {
#define FUNCTION(type, name) type name;
    GL_FUNCTIONS
#undef FUNCTION
    PFNGLSPECIALIZESHADERPROC SpecializeShader; /* of GL_ARB_gl_spirv */
};

struct gl_list {
    GLsync sync;                  /* of the last list, NULL once it is known to have ended */
    GLuint queries[SPL_GPU_TIMESTAMPS_MAX];
    uint32_t written;             /* bit per timestamp slot */
};

/* A buffer full of one word, from which GPUs fill others. */
enum { GL_PATTERNS = 2, GL_PATTERN_BYTES = 4 << 20 };
struct gl_pattern {
    GLuint name;                  /* 0 = not made yet */
    uint32_t word;
};

struct gl_gpu {
    struct spl_gpu base;          /* first */
    struct gl_functions gl;
    EGLDisplay display;           /* lives as long as the process: EGL hands out one per device */
    EGLContext context;
    struct gl_list list;          /* being recorded, or running */
    struct gl_pattern patterns[GL_PATTERNS];
    uint64_t ended;               /* largest ticket known to have ended */
    bool ready;                   /* there is something to finish */
};

struct gl_buffer {
    struct spl_gpu_buffer base;   /* first */
    GLuint name, texels;          /* texels: a buffer texture of its words */
};

struct gl_kernel {
    struct spl_gpu_kernel base;   /* first */
    GLuint program;
};

/* list.c. Fills display, context and functions of `gpu` for the index-th device and makes the context current, or fails
 * with the reason; false only past the end. */
bool gl_context_open(uint32_t index, bool debug, struct gl_gpu *gpu, struct spl_error *err);
void gl_context_close(struct gl_gpu *gpu);
/* Makes the device's context current on this thread, which several devices may share. Where that fails (the context is
 * lost) commands go nowhere, which submit reports. */
bool gl_use(const struct gl_gpu *gpu);
bool gl_has_extension(const struct gl_functions *gl, const char *name);
size_t gl_list(struct spl_device_info *devices, size_t capacity);

/* buffer.c */
int gl_buffer_create(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                     struct spl_error *err);
void gl_buffer_destroy(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer);

/* kernel.c */
int gl_kernel_create(struct spl_gpu *gpu, const struct spl_gpu_code *code, const uint32_t *constants,
                     size_t constant_count, struct spl_gpu_kernel **out, struct spl_error *err);
void gl_kernel_destroy(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel);

/* frame.c */
void gl_frames_init(struct gl_gpu *gpu);
void gl_frames_finish(struct gl_gpu *gpu);
int gl_begin(struct spl_gpu *gpu, struct spl_error *err);
void gl_dispatch(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel, const struct spl_gpu_arguments *arguments,
                 uint32_t workgroups);
void gl_barrier(struct spl_gpu *gpu);
void gl_copy(struct spl_gpu *gpu, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
             uint64_t to_offset, uint64_t bytes);
void gl_fill(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word);
void gl_timestamp(struct spl_gpu *gpu, uint32_t slot);
int gl_submit(struct spl_gpu *gpu, uint64_t ticket, struct spl_error *err);
int gl_wait(struct spl_gpu *gpu, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err);
void gl_read_timestamps(struct spl_gpu *gpu);

#endif
