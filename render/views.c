#include "render/views.h"

#include "geom/mesh_decimate.h"
#include "render/message.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

// The wall while camera or C-arm turn: this many triangles are drawn in time without a GPU (DESIGN section 8).
enum { COARSE_TRIANGLES = 25000 };

struct Views {
    Fluoroscope *fluoroscope;
    VesselScene *scene;
    Angioscope *angioscope;
};

static Fluoroscope *create_fluoroscope(const ViewsOptions *options, char *message, size_t capacity)
{
    int nodes = options->pose->node_count;
    double *radius = calloc((size_t)nodes, sizeof *radius), *attenuation = calloc((size_t)nodes, sizeof *attenuation);
    FluoroscopeOptions fluoroscope = fluoroscope_default_options();
    Fluoroscope *made = NULL;
    for (int i = 0; radius && attenuation && i < nodes; i++) {
        radius[i] = options->pose->node[i].radius;
        attenuation[i] = scene_attenuation(options->scene, options->pose->node[i].s);
    }
    if (radius && attenuation) {
        fluoroscope.vessel = options->mesh;
        fluoroscope.tree = options->tree;
        fluoroscope.node_count = nodes;
        fluoroscope.radius = radius;
        fluoroscope.attenuation = attenuation;
        fluoroscope.anatomy_value = options->anatomy_value;
        memcpy(fluoroscope.anatomy_size, options->anatomy_size, sizeof fluoroscope.anatomy_size);
        memcpy(fluoroscope.anatomy_axis, options->anatomy_axis, sizeof fluoroscope.anatomy_axis);
        fluoroscope.anatomy_origin = options->anatomy_origin;
        fluoroscope.patient = options->patient;
        made = fluoroscope_create(&fluoroscope, message, capacity);
    } else {
        message_fail(message, capacity, "no memory for the views");
    }
    free(radius);
    free(attenuation);
    return made;
}

Views *views_create(const ViewsOptions *options, char *message, size_t capacity)
{
    Views *views = calloc(1, sizeof *views);
    TriangleMesh *coarse = options->mesh ? mesh_decimate(options->mesh, COARSE_TRIANGLES, HUGE_VAL) : NULL;
    const Scene *scene = options->scene;
    VesselSceneOptions shown = {.vessel = options->mesh, .coarse = coarse, .tree = options->tree, .target_count = scene->target_count,
                                .target = scene->target, .has_entry = scene->wire.has_sheath, .entry = scene->wire.start,
                                .entry_direction = scene->wire.direction};
    bool good = views && (views->scene = vessel_scene_create(&shown, message, capacity)) &&
                (views->angioscope = angioscope_create(options->mesh, options->vessel, options->tree, message, capacity)) &&
                (views->fluoroscope = create_fluoroscope(options, message, capacity));
    triangle_mesh_free(coarse);
    if (good)
        return views;
    views_destroy(views);
    return NULL;
}

void views_destroy(Views *views)
{
    if (!views)
        return;
    fluoroscope_destroy(views->fluoroscope);
    vessel_scene_destroy(views->scene);
    angioscope_destroy(views->angioscope);
    free(views);
}

void views_draw(Views *views, const ViewsFrame *frame, const PanelLayout *layout, int width, int height, unsigned framebuffer)
{
    ViewPort port[VIEW_COUNT];
    for (int i = 0; i < VIEW_COUNT; i++) {
        port[i] = layout->view[i];
        port[i].framebuffer = framebuffer;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width, height);
    glDisable(GL_SCISSOR_TEST);
    glClearColor(0.03F, 0.035F, 0.045F, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (port[VIEW_FLUOROSCOPY].width > 0) {
        FluoroscopeFrame xray = {.pose = frame->pose, .xray = *frame->xray, .contrast = frame->contrast, .pulse = frame->pulse};
        fluoroscope_draw(views->fluoroscope, &xray, port[VIEW_FLUOROSCOPY]);
    }
    if (port[VIEW_3D].width > 0)
        vessel_scene_draw(views->scene, frame->pose, frame->look, port[VIEW_3D]);
    if (port[VIEW_ANGIOSCOPY].width > 0)
        angioscope_draw(views->angioscope, frame->pose, port[VIEW_ANGIOSCOPY]);
}

const VesselScene *views_scene(const Views *views) { return views->scene; }
Fluoroscope *views_fluoroscope(Views *views) { return views->fluoroscope; }
