#define _GNU_SOURCE   // RTLD_NEXT
// Detects memory that threads of a software driver write after the main thread freed it: Mesa 22.3.6's llvmpipe frees a fence that it sees signalled without
// taking the fence's lock, while the thread that signalled it still has to unlock it. Draws many small pictures, fills freed blocks of the size of a fence with
// zeros, and counts the blocks that changed before they were given back (an unlock decrements the number of the lock's users).
//     test_software_fences [SECONDS]                      as the program draws: 0 changed
//     LP_NUM_THREADS=1 test_software_fences [SECONDS]     with a thread of the driver's: thousands in ten seconds
#include "render/gl_context.h"

#include <dlfcn.h>
#include <epoxy/gl.h>
#include <malloc.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { FENCE_LEAST = 96, FENCE_MOST = 152, KEPT = 4096, SIDE = 16 };

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// ---- freed blocks of a fence's size are kept for a while, filled with zeros, and checked before they are given back

extern void __libc_free(void *block);   // NOLINT: glibc's own name

static unsigned char *kept[KEPT];
static long freed, changed;
static pthread_mutex_t keeping = PTHREAD_MUTEX_INITIALIZER;

void free(void *block)
{
    const size_t size = block ? malloc_usable_size(block) : 0;
    if (size < FENCE_LEAST || size > FENCE_MOST) {
        __libc_free(block);
        return;
    }
    pthread_mutex_lock(&keeping);
    unsigned char **place = &kept[freed++ % KEPT], *oldest = *place;
    *place = memset(block, 0, size);
    bool is_changed = false;
    for (size_t i = 0; oldest && i < malloc_usable_size(oldest); i++)
        is_changed |= oldest[i] != 0;
    changed += is_changed;
    pthread_mutex_unlock(&keeping);
    __libc_free(oldest);
}

// ---- a driver's thread may be preempted before any unlock: some of them are delayed there

static pthread_t main_thread;
static bool is_drawing;

int pthread_mutex_unlock(pthread_mutex_t *mutex)
{
    static int (*unlock)(pthread_mutex_t *);
    static _Thread_local unsigned unlocked;
    if (!unlock)
        *(void **)&unlock = dlsym(RTLD_NEXT, "pthread_mutex_unlock");   // POSIX requires that object and function pointers have the same representation
    if (is_drawing && !pthread_equal(pthread_self(), main_thread) && unlocked++ % 64 == 0)
        nanosleep(&(struct timespec){0, 100000}, NULL);
    return unlock(mutex);
}

int main(int argc, char **argv)
{
    const double seconds = argc > 1 ? atof(argv[1]) : 3;
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        fprintf(stderr, "%s\n", message);
        return 77;
    }
    GLuint frame, color;
    glGenTextures(1, &color);
    glBindTexture(GL_TEXTURE_2D, color);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, SIDE, SIDE, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glGenFramebuffers(1, &frame);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, 0);
    glViewport(0, 0, SIDE, SIDE);

    main_thread = pthread_self();
    is_drawing = true;
    long pictures = 0;
    const double begin = now_s();
    for (; now_s() - begin < seconds; pictures++) {
        glClearColor((float)(pictures % 7) / 7, 0, 0, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        glFlush();
    }
    printf("%s, LP_NUM_THREADS %s: %ld pictures in %.0f s, %ld of %ld blocks written to after they were freed\n", gl_context_renderer(context),
           getenv("LP_NUM_THREADS") ? getenv("LP_NUM_THREADS") : "not set", pictures, now_s() - begin, changed, freed);
    glDeleteFramebuffers(1, &frame);
    glDeleteTextures(1, &color);
    gl_context_destroy(context);
    return changed > 0;
}
