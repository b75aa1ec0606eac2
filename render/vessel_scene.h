// The live 3D view: a translucent vessel; the tools inside it, coloured by wall force, with their near wall cut away where another tool lies inside; the active
// local model
// at the tip as a wireframe (Kerrien 2017, Fig. 10); wall forces as arrows; the mouth of the sheath; targets as wire spheres. Lengths mm, forces N. Needs a
// current GL
// context (3.3 core), always the same one; all calls from that context's thread.
//
// Drawing: the walls nearest to the eye, outer and inner faces, are two layers kept as textures and redrawn only when camera, view size or section
// plane change. A frame shows their composition; moving objects are drawn over it as seen through the layer of the outer faces or, if they lie behind
// another vessel, through that too. While the layers change from frame to frame they use the coarser mesh, if given, without antialiasing; the full
// mesh is drawn in the first frame and after four frames without change.
#ifndef SELDINGER_RENDER_VESSEL_SCENE_H
#define SELDINGER_RENDER_VESSEL_SCENE_H

#include "geom/geom.h"
#include "render/color_map.h"
#include "render/vessel_scene_camera.h"
#include "render/tool_look.h"
#include "render/view_port.h"
#include "sim/sim.h"

typedef struct VesselScene VesselScene;

typedef struct VesselSceneOptions {    // all borrowed: must outlive the scene, except the meshes, which are copied
    const TriangleMesh *vessel;        // NULL: none (rigs, free wires)
    const TriangleMesh *coarse;        // of the same surface, used while the camera turns (mesh_decimate to 25,000); NULL: `vessel`
    const VesselTree *tree;            // NULL, or without model: no wireframe at the tip
    const ToolLooks *tools;            // NULL: one solid tool
    int target_count;
    const SceneTarget *target;         // (target_count)
    bool has_entry;                    // a sheath …
    Vec3 entry, entry_direction;       // … its mouth, and the unit direction into the vessel
    int frame_count;                   // further points that the first view must contain, …
    const Vec3 *frame;                 // … (frame_count) the nodes of a free wire if there is no vessel; read only by create
} VesselSceneOptions;

typedef struct VesselSceneLook {
    FreeCamera camera;
    bool show_model;                   // the local model at the tip
    bool show_arrows;                  // wall forces
    bool show_targets;
    bool section;                      // a clipping plane removes the part of the vessel on the side of its normal
    bool section_at_tip;               // the plane passes through the tip, else through a fixed point, …
    Vec3 section_through;              // … this one if it is finite (default: NAN), else the middle of the scene, …
    double section_offset_mm;          // … moved this far along its normal
    Vec3 section_normal;               // zero: towards the eye, as the camera turns
    bool follow_tip;                   // keeps the tip in the middle third of the view, overriding camera.focus
    bool full_detail;                  // never use the coarser mesh: for off-screen pictures and films
    double force_full_scale_n;         // top of the colour map, and the force of an arrow of full length
    double font_scale;                 // for line widths, 1 for 96 dpi
} VesselSceneLook;
// Defaults: the camera shows the whole scene, face on; arrows and targets shown; 0.5 N; no section.
VesselSceneLook vessel_scene_default_look(const VesselScene *scene);

// Returns NULL with a reason: mesh with indices out of range or numbers that are not finite, out of memory, or shaders that do not compile.
VesselScene *vessel_scene_create(const VesselSceneOptions *options, char *message, size_t capacity);
void vessel_scene_destroy(VesselScene *scene);
// Draws into the whole rectangle of the port. `pose` NULL: no tool. Nodes that are not finite are skipped.
void vessel_scene_draw(VesselScene *scene, const Pose *pose, const VesselSceneLook *look, ViewPort port);

// --- contents of the last draw, for labels and legends; pixels from the upper left corner of the view, x right, y down ---
typedef enum { LABEL_TARGET, LABEL_SHEATH, LABEL_TIP } VesselSceneLabelKind;
typedef struct VesselSceneLabel {
    VesselSceneLabelKind kind;
    const char *name;                  // name of the target; "sheath"; for a tip the name of its tool, or "tip" if there is only one tool
    double x, y;                       // of its centre
    double radius;                     // [pixel] of the object drawn there: a label begins outside
    bool is_in_view;
    double distance_mm;                // LABEL_TARGET: from the tip; else 0. NaN if there is no tip
} VesselSceneLabel;
// Fills at most `capacity` labels; returns their number.
int vessel_scene_labels(const VesselScene *scene, VesselSceneLabel *label, int capacity);
// A bar of a round length (1, 2 or 5 times a power of ten), not longer than `most_pixels`.
typedef struct ScaleBar {
    double length_mm, pixels;
} ScaleBar;
ScaleBar vessel_scene_scale_bar(const VesselScene *scene, double most_pixels);
// Colour of a wall force: the tool's own colour at zero force, then the sequential map from purple to yellow; yellow at full scale and above.
Color vessel_scene_force_color(double force_n, double full_scale_n, Color without);
// The projection and the camera that were used (with follow_tip, the focus that was found): for projecting points, and for continuing when following ends.
// The most distal tip; false if none was drawn.
bool vessel_scene_tip(const VesselScene *scene, Vec3 *tip);
const Camera *vessel_scene_projection(const VesselScene *scene);
FreeCamera vessel_scene_camera(const VesselScene *scene);
// Number of draws so far that had to redraw the layers.
long vessel_scene_layer_draws(const VesselScene *scene);

#endif
