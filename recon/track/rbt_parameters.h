// The parameters of the tracking. rbt_paper_parameters() returns the paper's values. The defaults differ where the paper's values never get past a giant
// aneurysm or a symmetric bifurcation. rbt_parameter_table gives name, range and meaning for trace files and --help.
#ifndef SELDINGER_RECON_TRACK_RBT_PARAMETERS_H
#define SELDINGER_RECON_TRACK_RBT_PARAMETERS_H

#include "geom/geom.h"
#include "recon/track/rbt_watch.h"

#include <stdbool.h>
#include <stddef.h>

enum { RBT_MAX_RETRIES = 8 };

typedef struct RbtRegion {   // a ball; for a cut only its centre is used
    Vec3 center;             // [mm] or voxels
    bool is_voxel;
    double radius;           // [mm]
    int line, column;        // position in the trace file, for faults
} RbtRegion;

typedef struct RbtParameters {
    // the paper's parameters, table 1 and section 3
    double p_inl;            // inlier rate above which a cylinder is valid
    double r_t;              // inlier threshold, as a fraction of the predicted radius
    double n_r;              // rays: 42, 162, 642 or 2562
    double n_d;              // axis directions: half as many as vertices: 21, 81 or 321
    double n_p;              // samples along a ray
    double n_min, n_max;     // least and largest number of RANSAC trials for a direction
    double s;                // step in half heights, eq. (1)
    double ray_length;       // in predicted radii
    double height_share;     // fraction of the inliers that a node's height encloses
    double back_step;        // a centre closer than this many radii to the centreline tracked before is a step back
    double relaxed;          // if no cylinder is valid, the best one is accepted if its inlier rate is above relaxed * p_inl
    double powell;           // 1: refine by Powell's method (NLopt's PRAXIS; refused without NLopt), 0: by Gauss-Newton (same minimum)
    // our extensions
    double r_t_voxels;       // lower bound of the inlier threshold, in voxels
    double r_t_second;       // inlier threshold of the second attempt, as a fraction of the radius; 0: no second attempt
    double refits;           // number of times that the consensus is selected again with the refined axis, and refitted
    double retry_steps[RBT_MAX_RETRIES];   // after a failed step, multiples of the step that are tried from the last good node
    int retry_count;
    double retry_radius;     // after a longer step, largest relative change of the radius
    double retry_contrast;   // after a longer step, least contrast as a fraction of the branch's
    double ray_smoothing_voxels;   // moving average along the ray
    double ray_edge;         // rays whose fall per voxel is below this fraction of the brightness range are discarded
    double contrast;         // least contrast of a node, as a fraction of the mean of its last eight predecessors
    double turn_deg;         // [deg] largest turn of the axis within two radii of path; 180: no limit (vessels never turn sharply, lost tracking does)
    double look_ahead;       // if a branch widens or ends, search the lumen this many radii ahead for its continuation; 0: never
    double overlap;          // a branch ends where its centre is closer than this many radii to the centre of another branch's node
    double max_length_mm;    // [mm] largest length of a branch
    double bone_hu;          // [HU] of a CT: connected voxels above it are bone, which is left out (ct_soft_tissue()); 0: nothing is
    double aneurysm_rays;    // number of rays from each centre of an aneurysm: 162, 642 or 2562
    double aneurysm_reach_mm;    // [mm] length of these rays
    double seed;             // seed of the random numbers
    // automatic tracking of the whole tree from the first start
    double automatic;        // 1: also search for branches and aneurysms without a seed
    double find_aneurysms;   // 1: also search for aneurysms
    double residue;          // contrast of a vessel's border as a fraction of its parent's, tried after one half
    // the ostia, where branches leave their parents
    double ostia;            // 1: measure links in the image, then add nodes to them or refuse them; 0: leave them as tracked
    // corrections from the trace file; the arrays belong to the owner of the parameters
    const RbtRegion *forbid; // regions that are not searched and contain no node centres
    int forbid_count;
    const RbtRegion *cut;    // the branch nearest to each point is cut there; its subtree is removed
    int cut_count;
    const RbtRegion *until;  // points that the tracking does not pass: the tree ends there
    int until_count;
    const RbtRegion *rival;  // `not`: points in excluded vessels, which are tracked too, compete for the lumen and are then removed
    int rival_count;
    const RbtWatch *watch;   // of the tracking; NULL: none. Owned by the caller
} RbtParameters;

RbtParameters rbt_default_parameters(void);
RbtParameters rbt_paper_parameters(void);

typedef struct RbtParameterName {
    const char *name;        // key in the trace file
    size_t offset;           // offset of the field in RbtParameters
    double least, most;
    bool is_whole;
    const char *meaning;
} RbtParameterName;
extern const RbtParameterName rbt_parameter_table[];
extern const int rbt_parameter_count;
// Returns one "name: value" per line, for the tree file, with the volume's voxel size first (the fit's target depends on it). The caller frees it.
char *rbt_parameters_text(const RbtParameters *parameters, double voxel_mm);

// Returns a line for each parameter with its meaning, our default and the paper's value. The caller frees it.
char *rbt_parameters_help(void);

#endif
