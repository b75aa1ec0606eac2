// The parameters of the tracking. The paper's values are rbt_paper_parameters(). The defaults differ where the paper's values never get past a giant
// aneurysm or a symmetric bifurcation; each field says so. rbt_parameter_table lists name, range and default for trace files and --help.
#ifndef SELDINGER_RECON_TRACK_RBT_PARAMETERS_H
#define SELDINGER_RECON_TRACK_RBT_PARAMETERS_H

#include "geom/geom.h"

#include <stdbool.h>
#include <stddef.h>

enum { RBT_MAX_RETRIES = 8 };

typedef struct RbtRegion {   // a ball; only the centre for a cut
    Vec3 center;             // [mm] or voxels
    bool is_voxel;
    double radius;           // [mm]
    int line, column;        // in the trace file, for faults
} RbtRegion;

typedef struct RbtParameters {
    // the paper's parameters, table 1 and section 3
    double p_inl;            // inlier rate above which a cylinder is valid
    double r_t;              // inlier threshold, as a share of the predicted radius
    double n_r;              // rays: 42, 162, 642 or 2562
    double n_d;              // axis directions: half as many as vertices: 21, 81 or 321
    double n_p;              // samples along a ray
    double n_min, n_max;     // RANSAC trials for a direction, least and most
    double s;                // step in half heights, eq. (1)
    double ray_length;       // in predicted radii
    double height_share;     // of the inliers that the height encompasses
    double back_step;        // a centre closer to the former centreline than this many radii is a step back
    double relaxed;          // where no direction is valid, the best one is, above relaxed * p_inl
    double powell;           // 1: refine by Powell's method (NLopt's PRAXIS; refused without NLopt), 0: by Gauss-Newton (same minimum)
    // our extensions
    double r_t_voxels;       // inlier threshold is at least this many voxels
    double r_t_second;       // threshold (share of the radius) of the second try; 0: none
    double refits;           // times that the consensus is selected again with the refined axis, and refitted
    double retry_steps[RBT_MAX_RETRIES];   // multiples of the step that are tried from the last good node when a step fails …
    int retry_count;
    double retry_radius;     // … and then the radius may change by this share only …
    double retry_contrast;   // … and the contrast must be this share of the branch's
    double ray_smoothing_voxels;   // moving average along the ray
    double ray_edge;         // rays whose fall per voxel is below this share of the brightness range are discarded
    double contrast;         // least contrast of a node as a share of the mean of its last eight predecessors
    double turn_deg;         // largest turn of the axis within two radii of path; 180: any (vessels never turn sharply, lost tracking does)
    double look_ahead;       // where a branch widens or ends, search the lumen this many radii ahead for its continuation; 0: never
    double overlap;          // a branch ends where its centre is closer than this many radii to the centre of another branch's node
    double max_length_mm;    // of a branch
    double aneurysm_rays;    // from each centre of an aneurysm: 162, 642 or 2562
    double aneurysm_reach_mm;    // their length
    double seed;             // of the random numbers
    // the whole tree from the first start
    double automatic;        // 1: also search for branches and aneurysms without a seed
    double find_aneurysms;   // 1: also search for aneurysms
    double residue;          // contrast of a vessel's border as a share of its parent's, tried after one half
    // where branches leave their parents
    double ostia;            // 1: measure links in the image, then give them nodes or refuse them; 0: leave them as tracked
    // corrections from the trace; owned by the owner of the parameters
    const RbtRegion *forbid; // regions without node centres, not searched either
    int forbid_count;
    const RbtRegion *cut;    // the branch nearest to each point is cut there, with its subtree
    int cut_count;
    const RbtRegion *until;  // points that the tracking does not pass: the tree ends there
    int until_count;
    const RbtRegion *rival;  // `not`: points in excluded vessels; these are tracked too, compete for the lumen and are then left out
    int rival_count;
} RbtParameters;

RbtParameters rbt_default_parameters(void);
RbtParameters rbt_paper_parameters(void);

typedef struct RbtParameterName {
    const char *name;        // in the trace file
    size_t offset;           // of the field, in RbtParameters
    double least, most;
    bool is_whole;
    const char *meaning;
} RbtParameterName;
extern const RbtParameterName rbt_parameter_table[];
extern const int rbt_parameter_count;
// One "name: value" per line, for the tree file, the volume's voxel size first (the fit's target depends on it); the caller frees it.
char *rbt_parameters_text(const RbtParameters *parameters, double voxel_mm);

// A line for each parameter with its meaning, our default and the paper's; to be freed.
char *rbt_parameters_help(void);

#endif
