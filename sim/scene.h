// A scene: YAML text to options in internal units. docs/scene-format.md specifies the format; all faults of a file are reported in one pass. Reads
// the scene file and its script, but not volumes or models: sim/open_vessel.h opens the vessel.
#ifndef SELDINGER_SIM_SCENE_H
#define SELDINGER_SIM_SCENE_H

#include "geom/geom.h"
#include "input/input.h"
#include "sim/exercise.h"
#include "sim/tip_shaping.h"
#include "sim/verify.h"
#include "solver/solver.h"

typedef enum { SOURCE_MODEL, SOURCE_SHAPE, SOURCE_TUBE, SOURCE_PLANE, SOURCE_MESH, SOURCE_NONE } VesselSourceKind;
// `contact:` of the vessel, `--contact` on the command line.
// lim: the wall of a fitted model of either type; shapes and tubes are fitted with shared blobs. lim_blend, lim_switch: local models only, with neighbours
// blended, or with one model per point as in the paper. sweep: the swept model of a file, or fitted to a shape or tube.
typedef enum {
    CONTACT_LIM,
    CONTACT_MESH,
    CONTACT_TUBE,
    CONTACT_SMOOTH_MESH,
    CONTACT_FLAT_MESH,
    CONTACT_GRID,
    CONTACT_LIM_BLEND,
    CONTACT_LIM_SWITCH,
    CONTACT_SWEEP,           // the swept models follow in the order of SectionKind
    CONTACT_RASTER,
    CONTACT_RBF,
    CONTACT_PAS,
    CONTACT_COUNT
} ContactKind;
static inline bool contact_is_local(ContactKind contact) { return contact == CONTACT_LIM_BLEND || contact == CONTACT_LIM_SWITCH; }
static inline bool contact_is_swept(ContactKind contact) { return contact >= CONTACT_SWEEP && contact <= CONTACT_PAS; }
static inline SectionKind contact_section(ContactKind contact) { return (SectionKind)(contact - CONTACT_SWEEP); }
static inline bool contact_is_fitted(ContactKind contact) { return contact == CONTACT_LIM || contact_is_swept(contact) || contact_is_local(contact); }
extern const char *const contact_name[CONTACT_COUNT + 1];  // as written in files; NULL at the end

typedef struct SceneTarget {
    char name[64];
    Vec3 point;
    double radius;
} SceneTarget;

typedef enum { TOOL_GUIDE_CATHETER, TOOL_CATHETER, TOOL_MICROCATHETER, TOOL_WIRE, TOOL_KIND_COUNT } ToolKind;
extern const char *const tool_kind_name[TOOL_KIND_COUNT + 1];      // as written in files; NULL at the end

typedef enum { CORE_STEEL, CORE_NITINOL, CORE_COUNT } ToolCore;
extern const char *const tool_core_name[CORE_COUNT + 1];           // as written in files; NULL at the end

typedef struct SceneTool {
    char name[TOOL_NAME_SIZE];   // prefix of its script columns; no dot, comma or space
    char title[80];              // name of the device, "" if not given; truncated if too long
    ToolKind kind;
    ToolCore core;               // of a wire: steel keeps a bend shaped by hand, nitinol does not
    TipShaping tip;              // how its tip was shaped (included in the sections of `wire`); length 0: not shaped …
    TipShaped tip_shaped;        // … and the shaping steps
    WireOptions wire;            // as read, including `inserted`; scene_tool_wire adds its start. Fixes and loads are the first tool's
    double friction_inside;      // Coulomb coefficient of its lumen against the tool within
    double marker_length, marker_attenuation;    // [mm], [1/mm] of the radio-opaque marker at the tip; length 0: none
    char *device_path;           // the device file of its keys; NULL: none
} SceneTool;

typedef struct SceneExchange {
    int tool;                // tool that it may replace
    SceneTool device;        // its name is that tool's
} SceneExchange;

typedef struct Scene {
    char *path;              // of the YAML file
    char *text;              // its full text, as read
    VesselSourceKind source;
    char *model_path;        // SOURCE_MODEL: resolved against the scene's folder
    char shape_name[64];     // SOURCE_SHAPE: name …
    int shape_option_count;  // … and its other keys as text, checked by the synth code
    char (*shape_option)[2][64];
    TubeOptions tube;        // SOURCE_TUBE (pieces and points owned by the scene)
    char *tube_points_path;  // its polyline's file; NULL if it has none
    Vec3 plane_point, plane_normal;
    char *mesh_path;         // SOURCE_MESH: resolved against the scene's folder
    double mesh_scale;       // factor from its coordinates to mm; 0: not given, they are in mm
    double mesh_cell;        // [mm] cell edge of a mesh or grid made from another source; 0: chosen from the vessel
    ContactKind contact;
    double friction;
    WireOptions wire;        // of the first tool; sections, fixes and loads are owned by the scene. Options of the command line change it here
    int tool_count;          // 1 to 4, outermost first; with `wire:` one named "wire"
    SceneTool tool[TOOLS_MOST];
    bool inlet_is_root;      // sheath `inlet: root`: start and direction come from vessel->inlet
    ContactOptions contact_options;
    SelfContactMode self_contact;
    bool follows_touch;              // contact points follow the actual place of contact (StepperOptions)
    double dt;               // [ms]
    Script *script;          // NULL: none
    char *script_path;       // NULL if inline or none
    int exchange_count;      // devices that may replace one of `tool`; the script's exchange column refers to them by their order under that tool
    SceneExchange *exchange;
    int target_count;
    SceneTarget *target;
    double marker_length, marker_attenuation;   // [mm], [1/mm] of the first tool's marker
    Vec3 patient_anterior, patient_superior;     // unit, perpendicular, in the model's frame; zero: not given
    double lao, cra;         // [deg] of the C-arm at the start
    int anatomy_segment;     // 1 + the index in patient_segment (sim/patient_landmarks.h) of what the vessel is; 0: not given
    bool has_anatomy_fit;    // landmarks place the vessel in the patient:
    Similarity anatomy_fit;  // from the body's frame to the model's
    char *anatomy_path;      // volume whose bone and soft tissue lie behind the vessel in fluoroscopy; NULL: a plain head
    Exercise *exercise;      // the trainee's exercise; NULL: none
    VerifyPlan verify;       // what `seldinger check` measures; case_count 0: nothing
} Scene;

// `text` need not be NUL-terminated; `path` is used in messages and to resolve relative paths. NULL with faults.
Scene *scene_parse(const char *text, size_t length, const char *path, Faults *faults);
Scene *scene_load(const char *path, Faults *faults);     // of a folder (sim/case_make.h): its scene.yaml
void scene_free(Scene *scene);
// The kind of the device that a device file (`text`, of `length` bytes) describes. False with faults.
bool scene_device_kind(const char *text, size_t length, const char *path, ToolKind *kind, Faults *faults);
// A tool's current options: scene->wire for the first; for the others their own, with start, direction, normal, sheath and gravity of scene->wire
// (which `inlet: root` sets late).
WireOptions scene_tool_wire(const Scene *scene, int tool);
WireOptions scene_placed_wire(const Scene *scene, const WireOptions *own);
// Device `which` of tool `tool`, counted as in scripts: 0 as the scene has it, 1, 2, … under its `exchange:`. NULL if there is none.
const SceneTool *scene_device(const Scene *scene, int tool, int which);
WireOptions scene_device_wire(const Scene *scene, int tool, int which);
int scene_device_count(const Scene *scene, int tool);      // 1 if it cannot be exchanged
int scene_most_nodes(const Scene *scene, int tool);        // of the device with most nodes
ToolNames scene_tool_names(const Scene *scene);      // as scripts know them; lives as long as the scene
// Replaces its script by a file's. NULL: the file is only checked. False with faults.
bool scene_use_script(Scene *scene, const char *path, Faults *faults);
// [1/mm] X-ray attenuation of a tool or device at arc length s from its proximal end.
double scene_tool_attenuation(const Scene *scene, int tool, double s);
double scene_device_attenuation(const Scene *scene, int tool, int which, double s);
double scene_device_marker(const Scene *scene, int tool, int which);       // [mm] length of its marker, 0: none
// The file that the vessel is read from, a model or a mesh; NULL if it needs none.
static inline const char *scene_needed_file(const Scene *scene) { return scene->source == SOURCE_MODEL ? scene->model_path : scene->mesh_path; }

#endif
