// Fits one local blobby model to the points around a node. Kerrien et al. 2017, section 4 (lim_fit.h fits a whole tree).
#ifndef SELDINGER_RECON_FIT_LIM_MODEL_H
#define SELDINGER_RECON_FIT_LIM_MODEL_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct LimFitOptions {
    // parameters of the paper's Table 1, by name
    double alpha;            // weight of the Lennard-Jones cohesion E_c; paper 1e-5, default 0, because its repulsion destroys new blobs
    double beta;             // weight of the curvature E_a [mm^4]; paper 1e-3. By default a factor, where 1e-4 means 1: E_a is then weighted by
                             // the variance of the noise times r^2, both estimated from the points; 0: no smoothing
    double s;                // repulsive distance of E_c in widths; default 2
    double iso_level;        // T [mm], default 0.1; if neither voxel_mm nor target_mm is given, it is multiplied by the mean radius of the nodes
    int max_blobs;           // N_s, default 100
    double target_mm;        // t_g [mm]; 0: max(0.5 voxel, min(0.2 r, 1.5 voxels)), or 0.08 r without a voxel size; half of it near aneurysms; paper 0.3
    // parameters that the paper gives in its text
    int topological_distance;   // points are concatenated up to this many steps along the tree; default 2
    int max_loops;           // centre-width loops per optimisation; paper 5, default 2
    int line_searches;       // Polak-Ribiere steps per loop; paper 20 (our choice, it gives none), default 4
    // departures from the paper; the paper preset turns them off
    double voxel_mm;         // [mm] voxel size for the automatic target, default 0.2; 0: unknown (for example, a tree from a mesh)
    bool weigh_distance;     // weight E_d by mean g^2 / g_i^2: distances instead of field values; points outside the node's cell count less
    bool project_points;     // measure points beyond the target by projection, not by one Taubin step
    bool sweep_all_blobs;    // make a short pass over all blobs after each split
    int give_up_splits;      // stop when this many splits bring no gain, twice as many before t_g is reached; 0: never; default 3, 1 in the second pass
    bool extend_inlet;       // repeat the root's points outwards, so that the vessel is tubular through the inlet plane
    bool guard_shape;        // prevent constrictions on the centreline, and ghost lobes away from the points
    bool agree;              // fit each model a second time, from the first, to its points and to the wall on which the models around it agree (lim_agree.h)
    int max_points;          // a node's points are thinned evenly to this many for speed; default 300, five times as many near an aneurysm; paper 1500
    int threads;             // 0: all cores
} LimFitOptions;

// Input of one local model: points, the node's tube, and data for the guards. Blobs are written to `center` and `width` (capacity max_blobs). Returns the
// number of blobs, or 0 if out of memory. Needs at least 4 points.
typedef struct LimTube {     // a piece of the tree's lumen: a cone between two spheres
    Vec3 a, b;
    double radius_a, radius_b;
} LimTube;
typedef struct LimFitTask {
    int point_count;
    const Vec3 *point;       // (point_count)
    const float *weight;     // (point_count) weights of the points in E_d with weigh_distance, mean 1; NULL: all equal
    Vec3 center, direction;  // centre [mm] and unit direction of the node
    double radius;           // [mm] > 0
    int guard_count;         // used with guard_shape only
    const Vec3 *guard;       // (guard_count) points known to be in the lumen (clearance > 0) or outside (< 0)
    const double *clearance; // (guard_count) [mm] the distance from the wall that they must have at least
    int tube_count;          // used with guard_shape: blobs stay in these tubes (0: anywhere)
    const LimTube *tube;     // (tube_count)
    int start_count;         // 0: start from the paper's pair of blobs on either side of the centre; else from these blobs
    const Vec3 *start;       // (start_count) centres
    const double *start_radius;   // (start_count) radii of their spheres
    int retry_count;         // if the first attempt stops far from the target, start again from these blobs and keep the better fit; 0: never
    const Vec3 *retry;       // (retry_count)
    const double *retry_radius;
} LimFitTask;
int lim_fit_model(const LimFitTask *task, const LimFitOptions *options, Vec3 *center, double *width);
// Returns the width of two concentric blobs that together keep the level set of value `level` of one blob (half the width if level >= width).
double lim_split_width(double width, double level);

#endif
