// Reconstruction: from an angiogram to a vessel tree (tracked from a point) and to a model of the wall (fit).
// These are offline computations: they use several threads and take seconds to minutes. Their results do not depend on the number of threads.
#ifndef SELDINGER_PUBLIC_RECON_H
#define SELDINGER_PUBLIC_RECON_H

#include "base.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

// --- volumes ---

typedef struct SelVolume SelVolume;

// Reads NRRD, MetaImage, NIfTI-1 or DICOM (a folder or a file), by content. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_volume_open(SelContext *context, const char *path, SelVolume **volume);
// Copies values from memory, x fastest. origin_mm: centre of voxel (0,0,0); axis_mm: steps from voxel to voxel along x, y and z.
// Errors: SEL_ERROR_ARGUMENT (sizes below 1, more than 2^31 voxels, axes in one plane, values that are not finite), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_volume_create(SelContext *context, const int size[3], const double origin_mm[3], const double axis_mm[3][3], const float *value,
                                    SelVolume **volume);
SEL_API void sel_volume_destroy(SelVolume *volume);
SEL_API SelStatus sel_volume_size(const SelVolume *volume, int size[3]);
SEL_API double sel_volume_voxel_mm(const SelVolume *volume);             // mean edge of a voxel

// --- trees and models ---

// Centreline nodes with points on the wall; after a fit, also a model of the wall.
typedef struct SelTree SelTree;

typedef struct SelSegmentOptions {
    size_t size;
    double start_mm[3];          // a point in a vessel: the whole tree is tracked from it …
    const char *trace;           // … or the path of a trace file (`seldinger segment --help`); NULL (default): start_mm
    int until_count;             // points, xyz one after the other, at which the tree ends; default none
    const double *until_mm;
    int not_count;               // points in unwanted vessels; default none
    const double *not_mm;
    double seed;                 // seed of the random numbers, a whole number; < 0 (default): 1, or the trace's
    int threads;                 // 0 (default): all cores
} SelSegmentOptions;
SEL_API void sel_segment_options_init(SelSegmentOptions *options, size_t size);
static inline SelSegmentOptions sel_segment_defaults(void)
{
    SelSegmentOptions options;
    sel_segment_options_init(&options, sizeof options);
    return options;
}

// Tracks the vessels of a volume. Doubts about the result are reported by the context's message callback.
// Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT (the start lies in no vessel, or the trace is wrong), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_segment(SelContext *context, const SelVolume *volume, const SelSegmentOptions *options, SelTree **tree);

typedef struct SelFitOptions {
    size_t size;
    double target_mm;            // largest distance wanted between points and wall; 0 (default): chosen from the voxels
    double voxel_mm;             // of the angiogram; < 0 (default): the tree's value, 0: unknown
    double edge_blur_mm;         // blur that has moved the points inwards; < 0 (default): the tree's value, 0: none
    int threads;                 // 0 (default): all cores
} SelFitOptions;
SEL_API void sel_fit_options_init(SelFitOptions *options, size_t size);
static inline SelFitOptions sel_fit_defaults(void)
{
    SelFitOptions options;
    sel_fit_options_init(&options, sizeof options);
    return options;
}

// Fits a wall to a tree's points and returns a new tree with a model. `options` may be NULL.
// Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT (too few points), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_fit(SelContext *context, const SelTree *tree, const SelFitOptions *options, SelTree **model);

// The tree of a surface in mm (STL, PLY, OBJ or VTP), as `seldinger import` makes it: with `count` files of centrelines with radii (.vtp, .mrk.json or .swc), or
// with centrelines found from the surface if there are none; `centreline` may then be NULL. Defects of the mesh that were repaired are notes.
// Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_import_surface(SelContext *context, const char *surface, int count, const char *const *centreline, SelTree **tree);

// Trees and models as files. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT or SEL_ERROR_OUTPUT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_tree_open(SelContext *context, const char *path, SelTree **tree);
SEL_API SelStatus sel_tree_save(SelContext *context, const SelTree *tree, const char *path);
SEL_API void sel_tree_destroy(SelTree *tree);

SEL_API int sel_tree_node_count(const SelTree *tree);
SEL_API int64_t sel_tree_point_count(const SelTree *tree);
// The points on the wall, (points, 3) [mm], those of a node one after the other. Error: SEL_ERROR_ARGUMENT.
SEL_API SelStatus sel_tree_points(const SelTree *tree, double *point_mm);
SEL_API int sel_tree_is_model(const SelTree *tree);                      // 1: it has a model of the wall
SEL_API SelStatus sel_tree_node(const SelTree *tree, int index, SelTreeNode *node);
// As sel_scene_query(), for a model. Error: SEL_ERROR_STATE (the tree has no model).
SEL_API SelStatus sel_tree_query(SelContext *context, const SelTree *tree, int count, const double *point_mm, double *gap_mm, double *normal);

#ifdef __cplusplus
}
#endif

#endif
