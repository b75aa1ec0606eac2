#include "render/views.h"

#include "geom/geom.h"
#include "render/gl_canvas.h"
#include "render/gl_enlarger.h"
#include "render/message.h"
#include "render/time_budget.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

// Triangles of the wall at rest, and while camera or C-arm turn: what llvmpipe can draw in time (docs/design.md, "Fluoroscopy").
enum { FINE_TRIANGLES = 90000, COARSE_TRIANGLES = 25000 };

struct Views {
    ToolLooks tools;
    Fluoroscope *fluoroscope, *second;       // second: NULL until it is needed
    XrayControl second_xray;         // of the reference
    bool second_is_plane;            // it last showed the second plane
    VesselScene *scene;
    Angioscope *angioscope;
    GlCanvas kept[VIEW_COUNT];       // of views that are not drawn straight into the port; zeroed: not yet made
    bool is_kept[VIEW_COUNT];        // it has been drawn
    GlEnlarger enlarger[VIEW_COUNT];
    ViewPort port[VIEW_COUNT];       // as shown last
    int drawn_side[VIEW_COUNT];      // shorter side as drawn last
    TimeBudget budget;
    long frames;
    bool has_shown;                  // a picture with a view
};

static const float surroundings[3] = {0.03F, 0.035F, 0.045F};

static Fluoroscope *create_fluoroscope(const Views *views, const ViewsOptions *options, const TriangleMesh *mesh, char *message, size_t capacity)
{
    FluoroscopeOptions fluoroscope = fluoroscope_default_options();
    fluoroscope.vessel = mesh;
    fluoroscope.tree = options->tree;
    fluoroscope.tools = &views->tools;
    fluoroscope.pose = options->pose;
    fluoroscope.sheath = sheath_look_make(options->scene, &views->tools);
    fluoroscope.anatomy_value = options->anatomy_value;
    memcpy(fluoroscope.anatomy_size, options->anatomy_size, sizeof fluoroscope.anatomy_size);
    memcpy(fluoroscope.anatomy_axis, options->anatomy_axis, sizeof fluoroscope.anatomy_axis);
    fluoroscope.anatomy_origin = options->anatomy_origin;
    fluoroscope.patient = options->patient;
    fluoroscope.segment = options->scene->anatomy_segment;
    fluoroscope.has_place = options->scene->has_anatomy_fit;
    fluoroscope.place = options->scene->anatomy_fit;
    return fluoroscope_create(&fluoroscope, message, capacity);
}

Views *views_create(const ViewsOptions *options, char *message, size_t capacity)
{
    Views *views = calloc(1, sizeof *views);
    bool is_large = options->mesh && options->mesh->triangle_count > FINE_TRIANGLES;
    TriangleMesh *fine = is_large ? cached_decimation(options->mesh, FINE_TRIANGLES) : NULL;
    const TriangleMesh *mesh = fine ? fine : options->mesh;
    TriangleMesh *coarse = mesh ? cached_decimation(mesh, COARSE_TRIANGLES) : NULL;
    const Scene *scene = options->scene;
    VesselSceneOptions shown = {.vessel = mesh,
                                .coarse = coarse,
                                .tree = options->tree,
                                .tools = views ? &views->tools : NULL,
                                .target_count = scene->target_count,
                                .target = scene->target,
                                .has_entry = scene->wire.has_sheath,
                                .entry = scene->wire.start,
                                .entry_direction = scene->wire.direction};
    if (!mesh) {
        shown.frame_count = options->pose->node_count;
        shown.frame = options->pose->position;
    }
    bool good = views && (tool_looks_make(&views->tools, scene) || message_fail(message, capacity, "out of memory for the views")) &&
                (views->scene = vessel_scene_create(&shown, message, capacity)) &&
                (views->angioscope = angioscope_create(mesh, options->vessel, options->tree, message, capacity)) &&
                (views->fluoroscope = create_fluoroscope(views, options, mesh, message, capacity));
    triangle_mesh_free(fine);
    triangle_mesh_free(coarse);
    if (good) {
        angioscope_set_tools(views->angioscope, &views->tools);
        angioscope_set_sheath(views->angioscope, sheath_look_make(scene, &views->tools));
        return views;
    }
    views_destroy(views);
    return NULL;
}

void views_destroy(Views *views)
{
    if (!views)
        return;
    fluoroscope_destroy(views->second);
    fluoroscope_destroy(views->fluoroscope);
    vessel_scene_destroy(views->scene);
    angioscope_destroy(views->angioscope);
    tool_looks_free(&views->tools);
    for (int i = 0; i < VIEW_COUNT; i++) {
        gl_canvas_destroy(&views->kept[i]);
        gl_enlarger_destroy(&views->enlarger[i]);
    }
    free(views);
}

static void draw_view(Views *views, PanelView view, const ViewsFrame *frame, ViewPort port)
{
    if (view == VIEW_FLUOROSCOPY && frame->past) {
        fluoroscope_recall(views->fluoroscope, frame->past, port, false);
    } else if (view == VIEW_FLUOROSCOPY) {
        FluoroscopeFrame xray = {.pose = frame->pose, .xray = *frame->xray, .contrast = frame->contrast, .filling = frame->filling, .pulse = frame->pulse};
        fluoroscope_draw(views->fluoroscope, &xray, port);
    } else if (view == VIEW_3D) {
        vessel_scene_draw(views->scene, frame->pose, frame->look, port);
    } else {
        angioscope_set_full_detail(views->angioscope, frame->is_still);
        angioscope_draw(views->angioscope, frame->pose, frame->scope_tool - 1, port);
    }
}

static int scaled(int pixels, double share) { return (int)fmax(1, round(pixels * share)); }

// Draws into a picture of its own, which is then copied or enlarged into the port. A secondary view is redrawn in every second frame, the two alternately,
// because users do not look at both at once.
static void draw_kept(Views *views, PanelView view, const ViewsFrame *frame, ViewPort port, bool is_main, double share)
{
    GlCanvas *kept = &views->kept[view];
    int width = scaled(port.width, share), height = scaled(port.height, share);
    bool fits = kept->width == width && kept->height == height;
    if (!fits) {
        gl_canvas_destroy(kept);
        if (!gl_canvas_create(kept, width, height, 1, NULL, 0)) {
            *kept = (GlCanvas){0};
            draw_view(views, view, frame, port);
            return;
        }
    }
    const bool is_turn = is_main || (views->frames + (int)view) % 2 == 0, is_due = is_turn && !(frame->is_repeat && views->is_kept[view]);
    // a secondary view takes up to 0.3 s when it is drawn first, so the first picture comes without it
    if (!views->has_shown && !is_main && !frame->is_still) {
        gl_canvas_begin(kept, surroundings);
    } else if (!fits || frame->is_still || is_due) {
        draw_view(views, view, frame, (ViewPort){kept->framebuffer, 0, 0, width, height});
        views->is_kept[view] = true;
    }
    views->drawn_side[view] = width < height ? width : height;
    bool is_same = width == port.width && height == port.height;
    if (!is_same && gl_enlarge(&views->enlarger[view], kept->framebuffer, width, height, port))
        return;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, kept->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, port.framebuffer);
    glBlitFramebuffer(0, 0, width, height, port.x, port.y, port.x + port.width, port.y + port.height, GL_COLOR_BUFFER_BIT, is_same ? GL_NEAREST : GL_LINEAR);
}

static void clear_box(int x, int y, int width, int height)
{
    glScissor(x, y, width, height);
    glClear(GL_COLOR_BUFFER_BIT);
}

// Clears what neither views nor panels cover: the gaps beside the views. On a software renderer, clearing a large window takes as long as drawing a view.
static void clear_around(const PanelLayout *layout, int width, int height)
{
    const int gap = 2 * (int)ceil(2 * layout->scale);
    bool has_view = false;
    glViewport(0, 0, width, height);
    glClearColor(surroundings[0], surroundings[1], surroundings[2], 1);
    glEnable(GL_SCISSOR_TEST);
    for (int i = 0; i < VIEW_COUNT; i++) {
        const ViewPort *at = &layout->view[i];
        if (at->width <= 0 || at->height <= 0)
            continue;
        has_view = true;
        clear_box(at->x - gap, at->y - gap, at->width + 2 * gap, gap);
        clear_box(at->x - gap, at->y + at->height, at->width + 2 * gap, gap);
        clear_box(at->x - gap, at->y, gap, at->height);
        clear_box(at->x + at->width, at->y, gap, at->height);
    }
    if (!has_view)
        clear_box(0, 0, width, height);
    glDisable(GL_SCISSOR_TEST);
}

static bool has_second(Views *views, const Pose *pose)
{
    if (!views->second)
        views->second = fluoroscope_create_beside(views->fluoroscope, pose);
    return views->second != NULL;
}

void views_take_reference(Views *views, const Pose *pose)
{
    if (!has_second(views, pose))
        return;
    fluoroscope_take_picture(views->second, views->fluoroscope);
    views->second_xray = fluoroscope_state(views->fluoroscope).shown;
    views->second_xray.pedal = 0;
}

// In fluoroscopy of a recording there is no second image.
static void draw_second(Views *views, const ViewsFrame *frame, ViewPort port)
{
    if (frame->past || !has_second(views, frame->pose))
        return;
    if (frame->second && !views->second_is_plane)
        fluoroscope_forget(views->second);
    views->second_is_plane = frame->second != NULL;
    FluoroscopeFrame xray = {.pose = frame->pose,
                             .xray = frame->second ? *frame->second : views->second_xray,
                             .contrast = frame->contrast,
                             .filling = frame->filling,
                             .pulse = frame->pulse};
    fluoroscope_draw(views->second, &xray, port);
}

void views_draw(Views *views, const ViewsFrame *frame, const PanelLayout *layout, int width, int height, unsigned framebuffer)
{
    const double least_side = 480;           // [pixel] below which a coarser image saves little
    const ViewPort *main = &layout->view[layout->main];
    double share = frame->is_still || frame->past ? 1 : time_budget_share(&views->budget);
    share = fmin(1, fmax(share, least_side / fmax(1, main->width < main->height ? main->width : main->height)));
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width, height);
    if (!frame->leaves_surroundings)
        clear_around(layout, width, height);
    for (int i = 0; i < VIEW_COUNT; i++) {
        ViewPort port = layout->view[i];
        port.framebuffer = framebuffer;
        if (port.width <= 0 || port.height <= 0)
            continue;
        bool is_main = i == (int)layout->main || layout->main == VIEW_ALL;
        views->port[i] = port;
        views->drawn_side[i] = port.width < port.height ? port.width : port.height;
        if (is_main && share >= 1)
            draw_view(views, (PanelView)i, frame, port);
        else
            draw_kept(views, (PanelView)i, frame, port, is_main, share);
    }
    ViewPort second = layout->second;
    second.framebuffer = framebuffer;
    if (second.width > 0)
        draw_second(views, frame, second);
    views->frames++;
    views->has_shown |= main->width > 0;
}

XrayControl views_reference(const Views *views) { return views->second_xray; }

void views_set_budget(Views *views, double most_ms) { views->budget = (TimeBudget){.most_ms = most_ms}; }
void views_spend(Views *views, double ms) { time_budget_spend(&views->budget, ms); }

static int shown_side(const Views *views, PanelView view)
{
    const ViewPort *port = &views->port[view];
    return port->width < port->height ? port->width : port->height;
}

void views_xray_sides(const Views *views, int *drawn, int *shown)
{
    *drawn = views->drawn_side[VIEW_FLUOROSCOPY];
    *shown = shown_side(views, VIEW_FLUOROSCOPY);
}

double views_enlargement(const Views *views, PanelView view)
{
    return views->drawn_side[view] > 0 ? (double)shown_side(views, view) / views->drawn_side[view] : 1;
}

const VesselScene *views_scene(const Views *views) { return views->scene; }
Fluoroscope *views_fluoroscope(Views *views) { return views->fluoroscope; }
