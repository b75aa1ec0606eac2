// Options, and the check that every caller makes first. The pictures are drawn in picture_run.c, picture_tree.c, picture_fit.c and picture_series.c.
#include "render/picture.h"

#include "render/gl_context.h"

PictureOptions picture_default_options(void) { return (PictureOptions){.width = 1600, .height = 1000, .inset = true, .worst_count = 9, .arrows = true}; }

bool picture_available(char *message, size_t capacity)
{
    GlContext *context = gl_context_create(message, capacity);
    gl_context_destroy(context);
    return context != NULL;
}
