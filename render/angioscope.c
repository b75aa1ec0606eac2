#include "render/angioscope.h"

#include "render/message.h"

#include <epoxy/gl.h>
#include <stdlib.h>

struct Angioscope {
    const Vessel *vessel;
    const VesselTree *tree;
};

Angioscope *angioscope_create(const TriangleMesh *mesh, const Vessel *vessel, const VesselTree *tree, char *message, size_t capacity)
{
    (void)mesh;
    Angioscope *scope = calloc(1, sizeof *scope);
    if (!scope) {
        message_fail(message, capacity, "not enough memory for angioscopy");
        return NULL;
    }
    scope->vessel = vessel;
    scope->tree = tree;
    return scope;
}

void angioscope_destroy(Angioscope *scope) { free(scope); }

bool angioscope_view(const Angioscope *scope, const Pose *pose, AngioscopeView *view)
{
    (void)scope;
    if (!pose || pose->node_count < 2 || !vec3_is_finite(pose->position[pose->node_count - 1]))
        return false;
    Quat q = pose->quaternion[pose->node_count - 1];
    *view = (AngioscopeView){.eye = pose->position[pose->node_count - 1], .up = quat_rotate(q, vec3(0, 1, 0)), .forward = quat_rotate(q, vec3(1, 0, 0)),
                             .half_angle_tan = 1};
    view->right = vec3_cross(view->forward, view->up);
    return true;
}

void angioscope_draw(Angioscope *scope, const Pose *pose, ViewPort port)
{
    (void)scope;
    (void)pose;
    glBindFramebuffer(GL_FRAMEBUFFER, port.framebuffer);
    glEnable(GL_SCISSOR_TEST);
    glScissor(port.x, port.y, port.width, port.height);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glClearColor(0.02f, 0.01f, 0.01f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
}
