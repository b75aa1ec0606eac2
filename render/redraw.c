#include "render/redraw.h"

#include <stdlib.h>
#include <string.h>

enum { TRAIL = 10 };
static const double least_mm = 0.02;     // below a pixel unless the view is magnified far

void redraw_free(Redraw *redraw)
{
    free(redraw->node);
    *redraw = (Redraw){0};
}

static bool has_input(const Redraw *redraw, const WindowInput *input)
{
    bool moved = fabs(input->mouse_x - redraw->mouse_x) + fabs(input->mouse_y - redraw->mouse_y) > 0;
    return input->event_count > 0 || moved || input->mouse_buttons != 0 || redraw->mouse_buttons != 0 || input->close != WINDOW_OPEN ||
           input->width != redraw->width || input->height != redraw->height || input->has_focus != redraw->has_focus;
}

static bool has_moved(const Redraw *redraw, const Pose *pose)
{
    if (!pose)
        return redraw->node_count > 0;
    if (pose->node_count != redraw->node_count)
        return true;
    for (int i = 0; i < pose->node_count; i++)
        if (!(vec3_distance(pose->position[i], redraw->node[i]) <= least_mm))
            return true;
    return false;
}

static void take_pose(Redraw *redraw, const Pose *pose)
{
    int count = pose ? pose->node_count : 0;
    if (count > redraw->capacity) {
        Vec3 *grown = realloc(redraw->node, (size_t)count * sizeof *grown);
        redraw->node = grown ? grown : redraw->node;
        redraw->capacity = grown ? count : redraw->capacity;
    }
    redraw->node_count = count <= redraw->capacity ? count : 0;
    if (redraw->node_count > 0)
        memcpy(redraw->node, pose->position, (size_t)redraw->node_count * sizeof *redraw->node);
}

bool redraw_is_due(Redraw *redraw, const WindowInput *input, const Pose *pose, uint64_t settings, double now_s, double refresh_s)
{
    bool is_new = !redraw->has_picture || has_input(redraw, input) || settings != redraw->settings || has_moved(redraw, pose);
    bool is_due = is_new || redraw->trail > 0 || now_s - redraw->drawn_s >= refresh_s;
    if (!is_due)
        return false;
    redraw->is_repeat = !is_new && redraw->trail == 0;
    redraw->trail = is_new ? TRAIL : redraw->trail > 0 ? redraw->trail - 1 : 0;
    redraw->has_picture = true;
    redraw->drawn_s = now_s;
    redraw->mouse_x = input->mouse_x;
    redraw->mouse_y = input->mouse_y;
    redraw->mouse_buttons = input->mouse_buttons;
    redraw->width = input->width;
    redraw->height = input->height;
    redraw->has_focus = input->has_focus;
    redraw->settings = settings;
    if (!redraw->is_repeat)      // else a slow movement would never add up
        take_pose(redraw, pose);
    return true;
}

uint64_t redraw_hash(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < count; i++)
        hash = (hash ^ byte[i]) * 1099511628211u + 1469598103934665603u;
    return hash;
}
