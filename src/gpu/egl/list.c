/* EGL displays and contexts: one device of EGL_EXT_device_enumeration after the other, or Mesa's surfaceless platform
 * where devices cannot be enumerated; never a window system. Usable is what gives a core OpenGL 4.5 context without a
 * surface and takes SPIR-V. Displays are never terminated: EGL hands the same one to everybody in the process. */
#include "gpu/egl/gl.h"

#include <stdio.h>
#include <string.h>

enum { DEVICES_MAX = 32 };

/* A token of GL_EXT_memory_object that glcorearb.h does not hold. */
enum { DEVICE_UUID_EXT = 0x9597 };

static bool in_list(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = list; at && (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return true;
    return false;
}

static int egl_fail(struct spl_error *err, const char *what)
{
    static const char *const names[] = {"success", "not initialised", "bad access", "out of memory", "bad attribute",
                                        "bad config", "bad context", "bad current surface", "bad display",
                                        "bad match", "bad native pixmap", "bad native window", "bad parameter",
                                        "bad surface", "context lost"};
    EGLint code = eglGetError();
    if (code >= EGL_SUCCESS && code <= EGL_CONTEXT_LOST)
        return spl_fail(err, SPL_E_NO_DEVICE, "egl: %s: %s", what, names[code - EGL_SUCCESS]);
    return spl_fail(err, SPL_E_NO_DEVICE, "egl: %s: 0x%x", what, code);
}

bool gl_use(const struct gl_gpu *gpu)
{
    return eglGetCurrentContext() == gpu->context ||
           eglMakeCurrent(gpu->display, EGL_NO_SURFACE, EGL_NO_SURFACE, gpu->context);
}

bool gl_has_extension(const struct gl_functions *gl, const char *name)
{
    GLint count = 0;
    gl->GetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; i++)
        if (!strcmp((const char *)gl->GetStringi(GL_EXTENSIONS, (GLuint)i), name))
            return true;
    return false;
}

/* The index-th display, EGL_NO_DISPLAY with an error when it cannot be had; false past the end. */
static bool get_display(uint32_t index, EGLDisplay *out, struct spl_error *err)
{
    const char *extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    PFNEGLGETPLATFORMDISPLAYEXTPROC get =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    PFNEGLQUERYDEVICESEXTPROC query = (PFNEGLQUERYDEVICESEXTPROC)eglGetProcAddress("eglQueryDevicesEXT");
    EGLDeviceEXT devices[DEVICES_MAX];
    EGLint count = 0;
    *out = EGL_NO_DISPLAY;
    if (in_list(extensions, "EGL_EXT_platform_device") && query && query(DEVICES_MAX, devices, &count) && count > 0) {
        if (index >= (uint32_t)count)
            return false;
        *out = get(EGL_PLATFORM_DEVICE_EXT, devices[index], NULL);
    } else if (index > 0) {
        return false;
    } else if (in_list(extensions, "EGL_MESA_platform_surfaceless") && get) {
        *out = get(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    } else {
        spl_fail(err, SPL_E_NO_DEVICE, "egl: neither devices nor a surfaceless platform; no driver is installed "
                                       "(Debian: libegl-mesa0)");
        return true;
    }
    if (*out == EGL_NO_DISPLAY)
        egl_fail(err, "no display");
    return true;
}

static EGLContext create_context(EGLDisplay display, bool debug)
{
    /* A context that is told of resets where the driver can; the rest of the backend copes either way. */
    EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 5,
                           EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                           EGL_CONTEXT_OPENGL_DEBUG, debug,
                           EGL_CONTEXT_OPENGL_ROBUST_ACCESS, EGL_TRUE,
                           EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET,
                           EGL_NONE};
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context == EGL_NO_CONTEXT) {
        attributes[8] = EGL_NONE;
        context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    }
    return context;
}

static int load_functions(struct gl_functions *gl, struct spl_error *err)
{
#define FUNCTION(type, name)                                                                                           \
    if (!(gl->name = (type)eglGetProcAddress("gl" #name)))                                                             \
        return spl_fail(err, SPL_E_NO_DEVICE, "egl: the driver lacks gl" #name);
    GL_FUNCTIONS
#undef FUNCTION
    if (!gl_has_extension(gl, "GL_ARB_gl_spirv"))
        return spl_fail(err, SPL_E_NO_DEVICE, "egl: it lacks GL_ARB_gl_spirv");
    gl->SpecializeShader = (PFNGLSPECIALIZESHADERPROC)eglGetProcAddress("glSpecializeShaderARB");
    return gl->SpecializeShader ? 0 : spl_fail(err, SPL_E_NO_DEVICE, "egl: it lacks glSpecializeShaderARB");
}

static bool is_software(const char *renderer)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "swrast", "SWR", "Software Rasterizer"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strstr(renderer, names[i]))
            return true;
    return false;
}

static void describe(struct gl_gpu *gpu)
{
    const struct gl_functions *gl = &gpu->gl;
    struct spl_device_info *info = &gpu->base.info;
    const char *renderer = (const char *)gl->GetString(GL_RENDERER);
    snprintf(info->name, sizeof info->name, "%s", renderer);
    snprintf(info->driver, sizeof info->driver, "%.100s, OpenGL %.100s", (const char *)gl->GetString(GL_VENDOR),
             (const char *)gl->GetString(GL_VERSION));
    info->software = is_software(renderer);
    void (*get_bytes)(GLenum, GLuint, GLubyte *) =
        (void (*)(GLenum, GLuint, GLubyte *))eglGetProcAddress("glGetUnsignedBytei_vEXT");
    if (get_bytes && gl_has_extension(gl, "GL_EXT_memory_object"))
        get_bytes(DEVICE_UUID_EXT, 0, info->uuid);
}

bool gl_context_open(uint32_t index, bool debug, struct gl_gpu *gpu, struct spl_error *err)
{
    gpu->base.info = (struct spl_device_info){.backend = "egl", .index = index, .name = "none"};
    if (!get_display(index, &gpu->display, err))
        return false;
    if (gpu->display == EGL_NO_DISPLAY)
        return true;
    EGLint major, minor;
    if (!eglInitialize(gpu->display, &major, &minor)) {
        egl_fail(err, "no display");
        return true;
    }
    const char *extensions = eglQueryString(gpu->display, EGL_EXTENSIONS);
    static const char *const needed[] = {"EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context"};
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
        if (!in_list(extensions, needed[i])) {
            spl_fail(err, SPL_E_NO_DEVICE, "egl: it lacks %s", needed[i]);
            return true;
        }
    if (!eglBindAPI(EGL_OPENGL_API) || (gpu->context = create_context(gpu->display, debug)) == EGL_NO_CONTEXT ||
        !eglMakeCurrent(gpu->display, EGL_NO_SURFACE, EGL_NO_SURFACE, gpu->context))
        egl_fail(err, "no core OpenGL 4.5 context");
    else if (load_functions(&gpu->gl, err) >= 0)
        describe(gpu);
    return true;
}

void gl_context_close(struct gl_gpu *gpu)
{
    if (gpu->context == EGL_NO_CONTEXT)
        return;
    if (eglGetCurrentContext() == gpu->context)
        eglMakeCurrent(gpu->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(gpu->display, gpu->context);
}

size_t gl_list(struct spl_device_info *devices, size_t capacity)
{
    EGLDisplay display = eglGetCurrentDisplay();
    EGLContext context = eglGetCurrentContext();
    size_t count = 0;
    for (;; count++) {
        struct gl_gpu gpu = {.display = EGL_NO_DISPLAY, .context = EGL_NO_CONTEXT};
        struct spl_error err = {0};
        if (!gl_context_open((uint32_t)count, false, &gpu, &err))
            break;
        gl_context_close(&gpu);
        snprintf(gpu.base.info.unusable, sizeof gpu.base.info.unusable, "%.*s", SPL_DEVICE_NAME_MAX - 1, err.message);
        if (count < capacity)
            devices[count] = gpu.base.info;
    }
    if (context != EGL_NO_CONTEXT)
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context);
    return count;
}
