// Scenes: a vessel, one to four tools, the place where they enter, and a script of the hand. From a file (docs/scene-format.md), from text, or built in code.
// A scene is immutable; any number of simulators may share it.
#ifndef SELDINGER_PUBLIC_SCENE_H
#define SELDINGER_PUBLIC_SCENE_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SEL_TOOLS_MOST = 4 };

// The command of one hand. Tool names are defined in the scene.
typedef struct SelCommand {
    double push_mm_s;            // > 0 into the patient; -1000 to 1000
    double twist_deg_s;          // right-handed about the direction of advance; -36000 to 36000
    int released;                // 1: no hand holds the tool, only the friction of its valve
    int device;                  // the device requested: 0 the tool itself, 1, 2, … those of its `exchange:`
} SelCommand;

// The commands of all hands, the outermost tool first. All zero: every tool is held still.
typedef struct SelHand {
    SelCommand tool[SEL_TOOLS_MOST];
    double contrast_ml_s;        // contrast agent, 0 to 50 …
    int contrast_tool;           // … through this tool, 1 the outermost; 0: none
} SelHand;

// All zero.
static inline SelHand sel_hand_still(void)
{
    static SelHand still;
    return still;
}

// --- a scene in code ---

typedef enum SelVesselSource {
    SEL_VESSEL_NONE = 0,         // no wall
    SEL_VESSEL_SHAPE = 1,        // a synthetic shape by name, fitted once and kept in the user's cache ($SELDINGER_CACHE or ~/.cache/seldinger)
    SEL_VESSEL_MODEL = 2,        // a model file, as sel_tree_save() writes one
    SEL_VESSEL_MESH = 3,         // a surface file: STL, PLY, OBJ or VTP
    SEL_VESSEL_TUBE = 4,         // an exact tube along lines and arcs
    SEL_VESSEL_PLANE = 5         // a half space
} SelVesselSource;

// A piece of a tube: a line where angle_deg is 0, else an arc.
typedef struct SelPiece {
    double length_mm;            // of a line, > 0
    double radius_mm;            // of an arc, greater than the tube's
    double angle_deg;            // of an arc, > 0
    double plane_deg;            // of an arc: its plane is first rotated by this about the tangent
} SelPiece;

typedef struct SelVesselOptions {
    size_t size;
    SelVesselSource source;
    const char *name;            // of a shape ("phantom"), or the path of a model or mesh, relative to the scene's path
    const char *contact;         // "lim", "mesh", "tube", "grid", …; NULL: the usual one for the source
    double friction;             // Coulomb coefficient of wall and tool, 0 to 10; default 0
    double start_mm[3];          // tube: where it begins; plane: a point on it
    double direction[3];         // tube: its first tangent; default x
    double normal[3];            // tube: direction towards which arcs turn; plane: into the lumen; default y
    double radius_mm;            // tube: of the lumen, > 0
    int has_closed_ends;         // tube: 1: hemispheres; 0 (default): open ends
    int piece_count;             // tube
    const SelPiece *piece;
} SelVesselOptions;

// A part of a tool with one cross-section.
typedef struct SelSection {
    double length_mm;            // > 0
    double diameter_mm;          // > 0
    double inner_diameter_mm;    // 0: solid
    double young_modulus_gpa;    // > 0
    double poisson_ratio;        // -0.99 to 0.5; metals: 0.3
    double density_g_cm3;        // > 0; nitinol: 6.45
    double rest_curvature_1_mm;  // 0: straight at rest
    double rest_plane_deg;       // direction of the rest curvature, about the tool
} SelSection;

typedef enum SelToolKind { SEL_WIRE = 0, SEL_MICROCATHETER = 1, SEL_CATHETER = 2, SEL_GUIDE_CATHETER = 3 } SelToolKind;

// Numbers below 0 mean the defaults of the scene format.
typedef struct SelToolOptions {
    size_t size;
    SelToolKind kind;            // default: wire
    const char *name;            // at most 31 letters without dot, comma or space; NULL: "tool1", "tool2", …
    const char *device;          // a device file, relative to the scene's path, for the values not given here; NULL: none
    int section_count;           // proximal to distal; 0: the device's
    const SelSection *section;
    double length_mm;            // shortens or lengthens the first section
    double inserted_mm;          // length beyond the sheath at the start; default: that of the tool around it; the outermost 0
    int elements;                // 1 to 10000
    double damping_mass_1_s, damping_stiffness_s;    // Rayleigh damping; give both or neither
    double hand_limit_n;         // push or pull at which the hand slips; 0: never
    double valve_n;              // friction of the valve that holds the tool while no hand does
    double friction_inside;      // Coulomb coefficient of its lumen with the tool within
} SelToolOptions;

typedef struct SelTarget {
    const char *name;
    double point_mm[3];
    double radius_mm;
} SelTarget;

// The commands of the hands from t_s until the next row. The last row ends the script.
typedef struct SelScriptRow {
    double t_s;
    SelCommand tool[SEL_TOOLS_MOST];
} SelScriptRow;

typedef struct SelSceneOptions {
    size_t size;
    const char *path;            // used in messages, and relative files are looked for in its folder; default "scene.yaml". It is not read
    const SelVesselOptions *vessel;      // NULL: no wall
    int tool_count;              // 1 to 4, the outermost first
    const SelToolOptions *tool;
    int is_at_inlet;             // 1 (default): the sheath's mouth lies at the inlet of the vessel; 0: at …
    double entry_mm[3];          // … this point, …
    double direction[3];         // … and points there; default x
    double step_ms;              // default 1
    int row_count;               // of the script; default none
    const SelScriptRow *row;
    int target_count;
    const SelTarget *target;
} SelSceneOptions;

SEL_API void sel_vessel_options_init(SelVesselOptions *options, size_t size);
SEL_API void sel_tool_options_init(SelToolOptions *options, size_t size);
SEL_API void sel_scene_options_init(SelSceneOptions *options, size_t size);
static inline SelVesselOptions sel_vessel_defaults(void)
{
    SelVesselOptions options;
    sel_vessel_options_init(&options, sizeof options);
    return options;
}
static inline SelToolOptions sel_tool_defaults(void)
{
    SelToolOptions options;
    sel_tool_options_init(&options, sizeof options);
    return options;
}
static inline SelSceneOptions sel_scene_defaults(void)
{
    SelSceneOptions options;
    sel_scene_options_init(&options, sizeof options);
    return options;
}

// --- opening ---

typedef struct SelScene SelScene;

typedef struct SelOpenOptions {
    size_t size;
    const char *contact;         // instead of the scene's own; NULL (default): the scene's
    const char *script;          // path of a script (CSV) instead of the scene's own; NULL (default): the scene's
    int threads;                 // threads of a fit; 0 (default): all cores. The result does not depend on it
} SelOpenOptions;
SEL_API void sel_open_options_init(SelOpenOptions *options, size_t size);
static inline SelOpenOptions sel_open_defaults(void)
{
    SelOpenOptions options;
    sel_open_options_init(&options, sizeof options);
    return options;
}

// Reads a scene and opens its vessel, which may take seconds if a shape has to be fitted. `options` may be NULL.
// Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT (all faults with line and column), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_scene_open(SelContext *context, const char *path, const SelOpenOptions *options, SelScene **scene);
// The same for text of `length` bytes; `path` is used in messages, and relative files are looked for in its folder.
SEL_API SelStatus sel_scene_parse(SelContext *context, const char *text, size_t length, const char *path, const SelOpenOptions *options, SelScene **scene);
// The same for a structure, which is written as a scene's text and then read: so the same rules hold, and recordings of it can be replayed. Rigs, rest shapes,
// exercises and exchanges have no structure here: use sel_scene_parse().
SEL_API SelStatus sel_scene_build(SelContext *context, const SelSceneOptions *scene_options, const SelOpenOptions *options, SelScene **scene);
SEL_API void sel_scene_destroy(SelScene *scene);
// Scenes of one vessel share it, and the last four vessels that no scene needs stay open, so that opening a scene again takes milliseconds. A file that has
// changed is read again. This closes those that no scene needs.
SEL_API void sel_vessels_forget(void);

// --- reading ---

SEL_API const char *sel_scene_text(const SelScene *scene);               // YAML; lives as long as the scene
SEL_API double sel_scene_step_s(const SelScene *scene);                  // [s] duration of a simulation step
SEL_API double sel_scene_script_s(const SelScene *scene);                // [s] duration of the script; 0: there is none
SEL_API int sel_scene_tool_count(const SelScene *scene);
SEL_API const char *sel_scene_tool_name(const SelScene *scene, int tool);        // "wire" of a scene with one unnamed tool; NULL: no such tool
// Where the tools enter: the sheath's mouth and the unit direction of advance.
SEL_API SelStatus sel_scene_entry(const SelScene *scene, double point_mm[3], double direction[3]);
// The view that the scene's `fluoroscopy:` asks for: angles of the C-arm, and the patient's axes as unit vectors; without it 0, 0 and those of LPS.
SEL_API SelStatus sel_scene_view(const SelScene *scene, double *lao_deg, double *cra_deg, double anterior[3], double superior[3]);
// A target of the scene; its name lives as long as the scene. Error: SEL_ERROR_ARGUMENT (no such target).
SEL_API int sel_scene_target_count(const SelScene *scene);
SEL_API SelStatus sel_scene_target(const SelScene *scene, int index, SelTarget *target);
// For each of `count` points, xyz one after the other: the distance to the wall [mm], positive in the lumen, infinite beyond an open end, and the unit normal
// into the lumen (zero where there is none). Far outside the wall the result depends on the contact: a grid is limited to its lattice's depth. `normal` may be
// NULL. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_STATE (the scene has no wall), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_scene_query(SelContext *context, const SelScene *scene, int count, const double *point_mm, double *gap_mm, double *normal);

// A node of the vessels' centrelines.
typedef struct SelTreeNode {
    double center_mm[3];
    double direction[3]; // unit, from the parent towards the children
    double radius_mm;
    int parent; // index of an earlier node; -1: the root
    int is_aneurysm;
} SelTreeNode;
// The centrelines of a vessel that is a model or a shape; 0 nodes of any other. Error: SEL_ERROR_ARGUMENT (no such node).
SEL_API int sel_scene_node_count(const SelScene *scene);
SEL_API SelStatus sel_scene_node(const SelScene *scene, int index, SelTreeNode *node);

// --- other values ---

// The text of a scene with another value of a key, the rest as it is. `key` has names and indices from the root, such as "vessel.shape.seed" or
// "targets.0.point_mm"; `value` is one line of YAML, such as "7" or "[1, 0, 0]". The key's last name may be missing: then it is added. Free the text with
// sel_free(). Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT (there is no such key, or the value is not YAML), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_scene_text_with(SelContext *context, const char *text, const char *key, const char *value, char **changed);

#ifdef __cplusplus
}
#endif

#endif
