// The three views of the trainer, fluoroscopy, 3D and angioscopy, drawn where a layout says: for the window, and off screen for pictures and videos.
// Needs a current OpenGL 3.3 context, the same in every call; one thread. Lengths in mm.
#ifndef SELDINGER_RENDER_VIEWS_H
#define SELDINGER_RENDER_VIEWS_H

#include "render/angioscope.h"
#include "render/fluoroscope.h"
#include "render/panel.h"
#include "render/vessel_scene.h"

typedef struct Views Views;

typedef struct ViewsOptions {        // borrowed during create, except scene, vessel and tree, which must outlive the views
    const Scene *scene;
    const Vessel *vessel;            // NULL: none
    const VesselTree *tree;          // NULL: the vessel has no tree
    const TriangleMesh *mesh;        // the wall, NULL: none
    const Pose *pose;                // any pose of the scene's tools, for numbers of nodes and arc lengths
    int anatomy_size[3];             // a volume behind the vessel, see FluoroscopeOptions; value NULL: none
    Vec3 anatomy_origin, anatomy_axis[3];
    const float *anatomy_value;
    PatientAxes patient;             // the vessel's place in the patient is that of the scene's `anatomy:`
} ViewsOptions;

// Returns NULL with a reason. Otherwise `message` is empty or says what is missing in the pictures.
Views *views_create(const ViewsOptions *options, char *message, size_t capacity);
void views_destroy(Views *views);

typedef struct ViewsFrame {
    const Pose *pose;
    const XrayControl *xray;
    const float *contrast;           // (N of the tree), NULL: none
    const float *filling;            // (nodes of all tools) filling of their lumens with contrast agent, NULL: none
    uint32_t pulse;                  // number of X-ray pulses so far
    const FluoroscopePast *past;     // NULL: fluoroscopy shows the pulses as they come. Otherwise it shows what these pulses leave, whatever was drawn before
    const VesselSceneLook *look;
    int scope_tool;                  // tool from whose tip angioscopy looks, 1 to 4; 0: the one that reaches furthest
    bool leaves_surroundings;        // of the views: does not clear what lies outside them
    const XrayControl *second;       // controls of the second plane; NULL: the second image of the layout, if any, is the reference
    bool is_still;                   // an independent picture: nothing is reused from the previous frame
    bool is_repeat;                  // the views show the same as in the previous frame, with the same layout: those kept are not drawn again
} ViewsFrame;

// Draws each view of the layout (secondary views in turn, from the second picture on) into `framebuffer`, with a dark background between them.
void views_draw(Views *views, const ViewsFrame *frame, const PanelLayout *layout, int width, int height, unsigned framebuffer);
// The X-ray image as shown now becomes the reference image.
void views_take_reference(Views *views, const Pose *pose);
XrayControl views_reference(const Views *views);     // the controls with which it was taken
// Keeps the views within a time budget: they are drawn at a share of the screen's resolution and enlarged. `most_ms` [CPU ms] of a picture with its panels; 0
// (default): the screen's resolution. Independent pictures (is_still) and those of a recording (past) always have it.
#define DRAWING_BUDGET_MS 26.0       // of a window with 30 pictures a second
void views_set_budget(Views *views, double most_ms);
void views_spend(Views *views, double ms);       // the cost of the last picture, for the next ones
// Side of the X-ray image as drawn last, and on the screen [pixel]; screen pixels per drawn pixel of a view.
void views_xray_sides(const Views *views, int *drawn, int *shown);
double views_enlargement(const Views *views, PanelView view);
const VesselScene *views_scene(const Views *views);
Fluoroscope *views_fluoroscope(Views *views);

#endif
