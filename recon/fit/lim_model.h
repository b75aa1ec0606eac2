// One local blobby model, fitted to the points about a node. Kerrien et al. 2017, section 4 (lim_fit.h: of a whole tree).
#ifndef SELDINGER_RECON_FIT_LIM_MODEL_H
#define SELDINGER_RECON_FIT_LIM_MODEL_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct LimFitOptions {
    // Table 1 of the paper by name
    double alpha;            // weight of the Lennard-Jones cohesion E_c; paper 1e-5, default 0: its repulsion kills twins
    double beta;             // weight of the curvature E_a [mm^4]; paper 1e-3. By default a factor instead, with 1e-4 for 1: E_a then weighs the
                             // noise's variance times r^2, both found from the points; 0: no smoothing
    double s;                // repulsive distance of E_c in widths, 2
    double iso_level;        // T [mm], 0.1; where neither voxel_mm nor target_mm is given, times the mean radius of the nodes
    int max_blobs;           // N_s, 100
    double target_mm;        // t_g [mm]; 0: max(0.5 voxel, min(0.2 r, 1.5 voxels)), without a voxel 0.08 r, half of it near aneurysms; paper 0.3
    // what the paper fixes in its text
    int topological_distance;   // points are concatenated up to this many steps along the tree, 2
    int max_loops;           // centre-width loops per optimisation; paper 5, default 2
    int line_searches;       // Polak-Ribiere steps per loop; paper 20 (not said there), default 4
    // departures from the paper; the paper preset turns them off
    double voxel_mm;         // for the automatic target, 0.2; 0: unknown (for example, a tree from a mesh)
    bool weigh_distance;     // weigh E_d by mean g^2 / g_i^2: distances instead of field values; and points beyond the node's cell less
    bool project_points;     // measure points beyond the target by projection, not by Taubin's one step
    bool sweep_all_blobs;    // a short pass over all blobs after each split
    int give_up_splits;      // stop when this many splits bring nothing, twice as many before t_g is met; 0: never. 3; 1 in the second pass
    bool extend_inlet;       // repeat the root's points outwards, so that the vessel is tubular through the inlet plane
    bool guard_shape;        // no constriction on the centreline, no ghost lobes away from the points
    bool agree;              // a second fit of each model, from the first, to its points and to what the models around agree on (recon/fit/lim_agree.h)
    int max_points;          // a node's points are thinned evenly to this many for speed, 300, five times as many near an aneurysm; paper 1500
    int threads;             // 0: all cores
} LimFitOptions;

// Input of one local model: points, the node's tube, and data for the guards. Blobs are written to center, width (capacity max_blobs). Returns the
// number of blobs, 0 if out of memory. At least 4 points.
typedef struct LimTube {     // a piece of the tree's lumen: a cone between two spheres
    Vec3 a, b;
    double radius_a, radius_b;
} LimTube;
typedef struct LimFitTask {
    int point_count;
    const Vec3 *point;       // (point_count)
    const float *weight;     // (point_count) of the points in E_d with weigh_distance, mean 1; NULL: all the same
    Vec3 center, direction;  // the node's; direction unit
    double radius;           // > 0
    int guard_count;         // used with guard_shape only
    const Vec3 *guard;       // (guard_count) points known to be in the lumen (clearance > 0) or outside (< 0), with …
    const double *clearance; // … the least distance from the wall that they should have [mm]
    int tube_count;          // used with guard_shape: blobs stay in these tubes (0: anywhere)
    const LimTube *tube;     // (tube_count)
    int start_count;         // 0: the paper's pair on either side of the centre; else start from these blobs
    const Vec3 *start;       // (start_count) centres …
    const double *start_radius;   // … and the radii of their spheres
    int retry_count;         // if the first attempt stops far from the target, another starts from these; the better one is kept
    const Vec3 *retry;       // (retry_count); 0: no second attempt
    const double *retry_radius;
} LimFitTask;
int lim_fit_model(const LimFitTask *task, const LimFitOptions *options, Vec3 *center, double *width);
// Width of two co-centred blobs that together keep the level set of value `level` of one blob (half the width where level >= width).
double lim_split_width(double width, double level);

#endif
