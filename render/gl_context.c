// EGL_PLATFORM_SURFACELESS_MESA needs no surface at all: everything is drawn into framebuffer objects.
//
// There is one display per process, which stays open until the process ends: eglTerminate would also end other contexts, and it unloads the
// driver, which leaks some memory of LLVM each time and takes 50 ms to load again.
#include "render/gl_context.h"

#include "render/message.h"
#include "render/software_driver.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdlib.h>

struct GlContext {
    EGLDisplay display;
    EGLContext context;
    EGLDisplay previous_display;
    EGLContext previous_context;
    EGLSurface previous_draw, previous_read;
};

// epoxy opens these libraries at its first call and ends the process if one is missing.
static bool has_libraries(char *message, size_t capacity)
{
    if (!dlopen("libEGL.so.1", RTLD_LAZY))
        return message_fail(message, capacity, "EGL is missing (%s); install libegl1, libegl-mesa0 and libgl1-mesa-dri", dlerror());
    if (!dlopen("libOpenGL.so.0", RTLD_LAZY) && !dlopen("libGL.so.1", RTLD_LAZY))
        return message_fail(message, capacity, "OpenGL is missing (%s); install libopengl0 and libgl1-mesa-dri", dlerror());
    return true;     // they stay open: epoxy uses them
}

static EGLDisplay open_display(char *message, size_t capacity)
{
    // epoxy aborts on a missing function, so check for the extension before calling it
    const char *extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!extensions || !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base") ||
        !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
        message_fail(message, capacity, "no surfaceless EGL; install libegl-mesa0 and libgl1-mesa-dri");
        return EGL_NO_DISPLAY;
    }
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL)) {
        message_fail(message, capacity, "cannot initialise EGL's surfaceless display (error 0x%x); install libgl1-mesa-dri", (unsigned)eglGetError());
        return EGL_NO_DISPLAY;
    }
    return display;
}

static bool make_context(GlContext *context, char *message, size_t capacity)
{
    if (!eglBindAPI(EGL_OPENGL_API))
        return message_fail(message, capacity, "EGL has no desktop OpenGL; install libgl1-mesa-dri");
    // a GLES-only EGL has no config for desktop GL; surfaceless contexts need no surface type
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, EGL_DONT_CARE, EGL_NONE};
    EGLConfig config = NULL;
    EGLint count = 0;
    if (!eglChooseConfig(context->display, wanted, &config, 1, &count) || count < 1)
        return message_fail(message, capacity, "EGL has no configuration for desktop OpenGL");
    const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context->context = eglCreateContext(context->display, config, EGL_NO_CONTEXT, version);
    if (context->context == EGL_NO_CONTEXT)
        return message_fail(message, capacity, "no OpenGL 3.3 core context (EGL error 0x%x)", (unsigned)eglGetError());
    if (!eglMakeCurrent(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, context->context)) {
        eglDestroyContext(context->display, context->context);
        return message_fail(message, capacity, "the OpenGL context cannot be made current (EGL error 0x%x)", (unsigned)eglGetError());
    }
    return true;
}

GlContext *gl_context_create(char *message, size_t capacity)
{
    GlContext *context = calloc(1, sizeof *context);
    if (!context) {
        message_fail(message, capacity, "out of memory for a picture");
        return NULL;
    }
    software_driver_without_threads();
    if (!has_libraries(message, capacity)) {
        free(context);
        return NULL;
    }
    context->previous_display = eglGetCurrentDisplay();
    context->previous_context = eglGetCurrentContext();
    context->previous_draw = eglGetCurrentSurface(EGL_DRAW);
    context->previous_read = eglGetCurrentSurface(EGL_READ);
    context->display = open_display(message, capacity);
    if (context->display == EGL_NO_DISPLAY || !make_context(context, message, capacity)) {
        free(context);
        return NULL;
    }
    return context;
}

void gl_context_destroy(GlContext *context)
{
    if (!context)
        return;
    eglMakeCurrent(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(context->display, context->context);
    if (context->previous_context != EGL_NO_CONTEXT)
        eglMakeCurrent(context->previous_display, context->previous_draw, context->previous_read, context->previous_context);
    free(context);
}

const char *gl_context_renderer(const GlContext *context)
{
    (void)context;
    return (const char *)glGetString(GL_RENDERER);
}
