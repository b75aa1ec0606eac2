// Pictures drawn off screen, each a PNG: a run, moments of a run, projections of an angiogram with the tree, a fit, time series.
//
// Plain arrays in, a file out. Lengths mm, forces N, torques N mm, times s (names include the unit if it is not mm). Arrays are borrowed and only read.
// Every function creates and destroys its own GL context (EGL, surfaceless, no X needed). One call at a time per process. The same input gives the same bytes
// on the same machine.
//
// Each function returns true, or false with one line in `message` (which may be NULL): EGL or OpenGL 3.3 is not available (report it and continue: a missing
// picture should not make a run fail), the input contains nothing to draw or numbers that are not finite, or the file cannot be written (it is written to a
// temporary file and renamed, so an older picture is preserved).
#ifndef SELDINGER_RENDER_PICTURE_H
#define SELDINGER_RENDER_PICTURE_H

#include "geom/geom.h"
#include "render/tool_look.h"
#include "sim/sim.h"

typedef struct PictureOptions {
    int width, height;         // [pixel] 64 to 8192; default 1600 x 1000; projections and moments reduce the height to what they need
    const char *title;         // beginning of the title line, default NULL: none
    Vec3 view;                 // direction from the eye into the scene; zero (default): face on, along the axis of least extent
    Vec3 up;                   // direction that points up on paper; zero (default): the coordinate axis best seen from there, z before y before x
    Vec3 focus;                // the large view shows a sphere around this point …
    double focus_radius;       // … of this radius [mm]; 0 (default): all of vessel and targets, and of the tool if there is no vessel
    bool inset;                // close-up of the tip in a corner; default true
    double inset_radius;       // [mm] radius of the sphere shown by the close-up; 0 (default): chosen from the lumen (4 to 12 mm)
    double force_full_scale;   // [N] top of the colour map of wall force; 0 (default): the largest force shown, rounded up
    double distance_full_scale; // [mm] ends of the diverging map of `picture_of_fit`; 0 (default): the 98th percentile of |distance|, rounded up
    int worst_count;           // `picture_of_fit`: close-ups of the local models with the largest error; 0 to 12, default 9
    bool arrows;               // wall forces as arrows; default true
} PictureOptions;
PictureOptions picture_default_options(void);

// --- a run ---
typedef struct PictureScene {
    const TriangleMesh *vessel; // NULL: no vessel drawn (rigs, planes)
    int target_count;
    const SceneTarget *target; // wire spheres with names
    bool has_entry;            // a sheath: its mouth is marked; the tool behind it is drawn grey
    Vec3 entry;
} PictureScene;

typedef struct PictureTool {   // the tool at one moment
    int node_count;            // M >= 2
    const Vec3 *position;      // (M) proximal to distal
    const double *radius;      // (M) [mm] of the tool at each node
    const Vec3 *force;         // (M) [N] force of the wall on each node; NULL: none
    int first_free_node;       // the nodes before it lie in the sheath (0: all free)
    double time_s;
    double inserted_mm;
    double push_force_n;       // at the proximal end
    double torque_n_mm;
    const char *label;         // a caption of this moment ("past the neck"), or NULL
    const Pose *pose;          // with several tools: all of them; the nodes above are those of the shared centreline. NULL: one tool
    const ToolLooks *looks;    // of the pose's tools
} PictureTool;

// Draws a large view of the vessel (translucent) with the tool (coloured by wall force), arrows, targets, scale bar, legend, and a close-up of the tip. With
// several tools, the near half of a tool is cut away where another lies inside; the legend lists the tools with their reaction forces.
bool picture_of_run(const char *path, const PictureOptions *options, const PictureScene *scene, const PictureTool *tool, char *message, size_t capacity);
// Draws up to 6 moments side by side, with the same camera and colour scale.
bool picture_of_moments(const char *path, const PictureOptions *options, const PictureScene *scene, int tool_count, const PictureTool *tool, char *message,
                        size_t capacity);

// --- an angiogram and its tree ---
typedef struct PictureProjection {
    int width, height;
    const float *value;        // (height, width), row 0 is drawn at the bottom
    Vec3 origin;               // centre of pixel (0, 0); any depth along the projection
    Vec3 across, up;           // steps from pixel to pixel and from row to row [mm]; dot products with them give the pixel of a point
    const char *across_name, *up_name;   // "x", "-y"; NULL: none
} PictureProjection;

typedef struct PicturePolyline {
    int count;
    const Vec3 *point;         // (count) in space; drawn over each projection
    const double *radius;      // (count) [mm]; NULL: only the centreline, else also the outline of the tube, faint
    int color;                 // index into the qualitative map, any value >= 0
} PicturePolyline;

typedef struct PictureMark {
    Vec3 point;
    const char *label;         // NULL: none
} PictureMark;

// Draws the same from a voxel grid (layout of recon's Volume: value (size[2], size[1], size[0]), voxel (i,j,k) at origin + i axis[0] + …) and a tree:
// three maximum-intensity projections, branches coloured by their order (vessel_branches.h). `tree` may be NULL. Without marks the root of the tree is marked.
bool picture_of_tree(const char *path, const PictureOptions *options, const int size[3], Vec3 origin, const Vec3 axis[3], const float *value, float low,
                     float high, const VesselTree *tree, int mark_count, const PictureMark *mark, char *message, size_t capacity);

// --- a fit ---
// Draws the fitted surface, coloured by the signed distance of the data (blue: outside the model, red: inside), a histogram, and slices through the
// worst nodes with blobs, if there are any, contour and points. `distance` (points of model->tree) [mm]: signed distance of each point to the wall that its node
// sees, > 0 inside; NULL: Taubin's distance is computed here. `mesh` (geom/model_mesh.h) may be NULL (only points).
bool picture_of_fit(const char *path, const PictureOptions *options, const ModelField *model, const TriangleMesh *mesh, const double *distance, char *message,
                    size_t capacity);

// Draws the surface of the model with each vertex coloured by `error` (mesh->vertex_count) [mm] (geom/tree_surface.h: signed distance of the nearest data
// point,
// > 0 inside; NaN grey), and a histogram of the d_a of the nodes (model->tree->error) in voxels with the class limits of the paper's Table 4: half, one, two.
bool picture_of_error(const char *path, const PictureOptions *options, const ModelField *model, const TriangleMesh *mesh, const double *error, double voxel_mm,
                      char *message, size_t capacity);

// --- junctions ---
typedef struct PictureJunctions {
    const ModelField *model;
    int junction_count;
    const ReachJunction *junction;   // junctions of that model (geom/reach.h), in the order in which they are drawn
    double tool_radius;              // [mm] a smaller clearance is framed orange
    const ModelField *before;        // another model of the same vessels: each junction of both models side by side, in the same plane; NULL: none
    int size[3];                     // the voxel grid behind them, as in picture_of_tree; value NULL: none
    Vec3 origin, axis[3];
    const float *value;
} PictureJunctions;
// Draws a small section for each junction, 24 per page (12 with `before`), the first page at `path`, the next at NAME-2.png, …; `pages`: the number of pages.
bool picture_of_junctions(const char *path, const PictureOptions *options, const PictureJunctions *what, int *pages, char *message, size_t capacity);

// --- time series ---
typedef struct PictureLine {
    const char *label;
    const double *value;       // (count of the picture); values that are not finite leave a gap
} PictureLine;
typedef struct PicturePanel {
    const char *title;         // with the unit: "push force [N]"
    int line_count;
    const PictureLine *line;
    bool logarithmic;          // values <= 0 leave a gap
} PicturePanel;
typedef struct PictureEvent {  // a vertical line through all panels
    double time_s;
    const char *label;
} PictureEvent;

bool picture_of_series(const char *path, const PictureOptions *options, int count, const double *time_s, int panel_count, const PicturePanel *panel,
                       int event_count, const PictureEvent *event, char *message, size_t capacity);

#endif
