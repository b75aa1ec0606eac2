// Shared by the tests of the live views: a context with a canvas, a tool's pose, pixels.
#ifndef SELDINGER_TESTS_RENDER_VIEW_STAGE_H
#define SELDINGER_TESTS_RENDER_VIEW_STAGE_H

#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/picture.h"
#include "render/tool_look.h"
#include "render/view_port.h"
#include "sim/pose.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>
#include <epoxy/gl.h>

enum { STAGE_WIDTH = 400, STAGE_HEIGHT = 300 };
typedef uint8_t StagePixels[STAGE_HEIGHT][STAGE_WIDTH][3];

typedef struct ViewStage {
    GlContext *context;
    GlCanvas canvas;
    ViewPort port;             // all of it
} ViewStage;

// False without EGL: skip the test then.
static inline bool stage_open(ViewStage *stage)
{
    char message[256] = "";
    *stage = (ViewStage){.context = gl_context_create(message, sizeof message)};
    if (!stage->context) {
        print_message("no EGL: %s\n", message);
        return false;
    }
    assert_true(gl_canvas_create(&stage->canvas, STAGE_WIDTH, STAGE_HEIGHT, 1, message, sizeof message));
    stage->port = (ViewPort){stage->canvas.framebuffer, 0, 0, STAGE_WIDTH, STAGE_HEIGHT};
    return true;
}

static inline void stage_close(ViewStage *stage)
{
    assert_int_equal(glGetError(), GL_NO_ERROR);
    gl_canvas_destroy(&stage->canvas);
    gl_context_destroy(stage->context);
}

static inline void stage_clear(const ViewStage *stage, float red, float green, float blue)
{
    const float color[3] = {red, green, blue};
    gl_canvas_begin(&stage->canvas, color);
}

static inline void stage_read(const ViewStage *stage, StagePixels pixels) { gl_canvas_read(&stage->canvas, &pixels[0][0][0]); }

static inline int pixel_difference(const uint8_t *a, const uint8_t *b)
{
    int most = 0;
    for (int c = 0; c < 3; c++)
        most = abs(a[c] - b[c]) > most ? abs(a[c] - b[c]) : most;
    return most;
}

static inline int count_different(StagePixels a, StagePixels b, int more_than)
{
    int count = 0;
    for (int y = 0; y < STAGE_HEIGHT; y++)
        for (int x = 0; x < STAGE_WIDTH; x++)
            count += pixel_difference(a[y][x], b[y][x]) > more_than;
    return count;
}

// A straight tool along the unit vector `along`, with its frames' y axes along `up`; free, in open space, without force.
static inline Pose *straight_pose(int count, Vec3 from, Vec3 along, Vec3 up, double spacing, double radius)
{
    Pose *pose = pose_create(count, 1, &count);
    assert_non_null(pose);
    Mat3 axes = mat3_from_columns(along, up, vec3_cross(along, up));
    for (int i = 0; i < count; i++) {
        pose->position[i] = vec3_add_scaled(from, spacing * i, along);
        pose->quaternion[i] = quat_from_mat3(&axes);
        pose->node[i] = (NodeReport){.s = spacing * i, .radius = radius, .gap = HUGE_VAL, .vessel_node = -1};
    }
    pose->inserted_mm = spacing * count;
    pose->xray = xray_default_control();
    pose_fill_single_tool(pose);
    return pose;
}

// Two straight tools along x from 0: a catheter to x = `catheter`, a wire in it to x = `wire`, which may be shorter; nodes every `spacing`. The catheter
// touches the wall over its whole length.
static inline Pose *coaxial_pose(double catheter, double wire, double spacing, double catheter_radius, double wire_radius)
{
    const double tip[2] = {catheter, wire}, radius[2] = {catheter_radius, wire_radius};
    int nodes[2] = {(int)ceil(catheter / spacing) + 1, (int)ceil(wire / spacing) + 1},
        shared = nodes[0] + (wire > catheter ? (int)ceil((wire - catheter) / spacing) : 0);
    Pose *pose = pose_create(shared, 2, nodes);
    assert_non_null(pose);
    Mat3 axes = mat3_from_columns(vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1));
    for (int k = 0; k < 2; k++) {
        for (int j = 0; j < nodes[k]; j++) {
            double x = tip[k] * j / (nodes[k] - 1);
            pose->tool[k].node[j] =
                (ToolNode){.s = x, .position = vec3(x, 0, 0), .orientation = quat_from_mat3(&axes), .radius = radius[k], .carrier = x > tip[0] ? 1 : 0};
        }
        pose->tool[k].inserted_mm = tip[k];
    }
    for (int i = 0; i < shared; i++) {
        bool is_wire = i >= nodes[0];
        double x = is_wire ? catheter + (wire - catheter) * (i - nodes[0] + 1) / (shared - nodes[0]) : catheter * i / (nodes[0] - 1);
        pose->position[i] = vec3(x, 0, 0);
        pose->quaternion[i] = quat_from_mat3(&axes);
        pose->node[i] = (NodeReport){.s = x, .radius = radius[is_wire], .gap = HUGE_VAL, .vessel_node = -1};
    }
    pose->inserted_mm = catheter;
    pose->xray = xray_default_control();
    return pose;
}

// The appearance of these two: blue and white.
typedef struct CoaxialLooks {
    TubeStretch stretch[2];
    ToolLooks looks;
} CoaxialLooks;
static inline void coaxial_looks(CoaxialLooks *c, double catheter_radius, double lumen, double wire_radius)
{
    c->stretch[0] = (TubeStretch){.end = HUGE_VAL, .radius = catheter_radius, .lumen = lumen, .attenuation = 0.5};
    c->stretch[1] = (TubeStretch){.end = HUGE_VAL, .radius = wire_radius, .attenuation = 0.5};
    c->looks = (ToolLooks){
        .count = 2,
        .tool = {{"catheter", {0, 90, 255, 255}, {0, 90, 255, 255}, 1, &c->stretch[0]}, {"wire", {250, 250, 250, 255}, {10, 10, 10, 255}, 1, &c->stretch[1]}}};
}

static inline double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static inline int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

#endif
