// RANSAC-based tracking: from a volume and a few start points to a vessel tree of cylinders (C, r, d, h), each with its points on the wall.
// Kerrien et al. 2017, section 3. Lengths mm, in the volume's frame. A run repeats bit for bit: random numbers come from `seed` and the branch's number
// alone, and threads only share out the aneurysms' rays.
//
// The paper's values are rbt_paper_parameters(). The default ones differ where the paper's never get past a giant aneurysm or a symmetric
// bifurcation: each field says so. The fields are listed by name, range and default in rbt_parameter_table, which the trace file and --help read.
#ifndef SELDINGER_RECON_TRACK_RBT_TRACK_H
#define SELDINGER_RECON_TRACK_RBT_TRACK_H

#include "base/parallel.h"
#include "geom/vessel_tree.h"
#include "recon/track/ransac_cylinder.h"
#include "recon/volume/volume.h"

#include <stdint.h>

enum { RBT_MAX_RETRIES = 8 };

typedef struct RbtRegion {   // a ball; for a cut only its centre counts
    Vec3 center;             // [mm] or voxels
    bool is_voxel;
    double radius;           // [mm]
    int line, column;        // in the trace file, for faults
} RbtRegion;

typedef struct RbtParameters {
    // the paper's, table 1 and section 3
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
    double powell;           // 1: refine by Powell's method (NLopt's PRAXIS), 0: by Gauss-Newton (same minimum)
    // the mends
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
    double turn_deg;         // the axis may turn by this much within two radii of way; 180: any turn (a vessel does not, a lost tracking does)
    double look_ahead;       // where a branch swells or ends, the lumen is searched this many radii ahead for a vessel that goes on; 0: never
    double overlap;          // a branch ends where its centre is closer than this many radii to the centre of another branch's node
    double max_length_mm;    // of a branch
    double aneurysm_rays;    // from each centre of an aneurysm: 162, 642 or 2562
    double aneurysm_reach_mm;// their length
    double seed;             // of the random numbers
    // the whole tree from the first start
    double automatic;        // 1: branches and aneurysms that no seed names are looked for
    double find_aneurysms;   // 1: so are aneurysms
    double residue;          // a vessel's border is looked for at this share of the contrast of the vessel it leaves, after a half of it
    // where branches leave their parents
    double ostia;            // 1: links are measured in the image and get nodes, or are refused; 0: they stay as tracked
    // corrections by the trace; the owner of the parameters owns them
    const RbtRegion *forbid; // no centre of a node lies in these, nor does the search go through them
    int forbid_count;
    const RbtRegion *cut;    // the branch nearest to each is cut from there on, with what hangs on it
    int cut_count;
    const RbtRegion *until;  // points in vessels that the tracking does not pass: the tree ends there
    int until_count;
    const RbtRegion *rival;  // `not`: points in vessels that are not wanted; these are tracked too, compete for the lumen and are left out
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
// "name: value" a line, for the tree file, the volume's voxel size first (the fit's target depends on it); to be freed.
char *rbt_parameters_text(const RbtParameters *parameters, double voxel_mm);

typedef struct RbtSeed {     // where a branch starts
    Vec3 start, toward;      // [mm] or voxels
    bool start_is_voxel, toward_is_voxel, has_toward;
    double radius;           // [mm]; 0: the parent's; the first branch's is estimated
    int line, column;        // in the trace file, for faults
    char name[32];           // for reports; may be empty
} RbtSeed;

typedef struct RbtAneurysm { // points inside a sac, the first one anywhere in it
    int center_count;
    Vec3 *center;            // [mm] or voxels
    bool is_voxel;
    int line, column;
    char name[32];
} RbtAneurysm;

typedef struct RbtBranchReport {
    int first_node, node_count;    // nodes of a branch follow each other
    double length;           // [mm] of its centreline
    double inlier_rate, inlier_rate_min;   // mean and least over the nodes
    int relaxed_count;       // nodes below p_inl
    int retried_count;       // nodes that took a longer step
    int junction_count;      // nodes in openings where no cylinder fits (their inlier rate is the share of rays that meet a near wall)
    int link_count;          // nodes between the parent's axis and the first one that was tracked; in the counts and the length, in no mean
    bool is_aneurysm;
    bool is_found;           // by the program, no seed named it
    int parent, order;       // number of the branch that it hangs on, -1: none; 1 for the first, one more than its parent's
    double radius;           // [mm] mean over its nodes, of a sac over its centres
    Vec3 center;             // [mm] of its last node; of a sac, the middle of its widest ball
    char name[32];           // the seed's or the aneurysm's
    char end[96];            // why it ended
} RbtBranchReport;

// What the image says of a link between a branch and its parent: the darkest place of the best path, as a share of the child's contrast.
typedef enum RbtSupport {
    RBT_SUPPORTED,           // at least a half: it has nodes, none further from the next than the sum of their radii
    RBT_DOUBTFUL,            // at least a quarter: the same, to be looked at
    RBT_REFUSED,             // less: the branch was dropped with what hung on it
    RBT_KEPT                 // less, but the trace names the branch: it stays, its link has no nodes, and no tool passes
} RbtSupport;

typedef struct RbtJunction {
    int branch, parent;      // numbers in the report; -1: dropped
    bool is_inner;           // no junction but a gap within the branch
    bool is_moved;           // it hangs on another parent than at first, which the image did not support
    Vec3 place;              // [mm] where the link leaves the parent's lumen; of one without a path, its middle
    double length;           // [mm] of the link, from the parent's axis to the first node that was tracked
    double share;            // 0 … 1
    RbtSupport support;
    int node_count, point_count;   // on the link
    int dropped_nodes;       // with a refused one …
    double dropped_mm;       // … and their length
} RbtJunction;

typedef enum RbtDoubt {      // what makes a result doubtful
    RBT_DRIFT,               // [mm] the click's distance from the axis of the vessel that was found; limit: its radius
    RBT_INLIERS,             // share of the edge points on the cylinder at the start, at the root or over the first branch
    RBT_RADIUS,              // [mm] against the volume's least extent
    RBT_SHAPE,               // share of its contrast that the wall of the start has on its brightest sides
    RBT_NOISE,               // contrast in standard errors or in standard deviations of the noise
    RBT_BACKGROUND,          // [grey values] by which it changes beside the first branch; limit: its contrast
    RBT_LENGTH,              // [radii] of the first branch
    RBT_DOUBTS
} RbtDoubt;
extern const char *const rbt_doubt_name[RBT_DOUBTS];

enum { RBT_MAX_WARNINGS = 12 };
typedef struct RbtWarning {
    RbtDoubt kind;
    double measured, limit;
    char text[240];          // what was measured, what is usual, what may help
} RbtWarning;

typedef struct RbtStartCheck {
    Vec3 click;              // [mm] what was given …
    Cylinder cylinder;       // … and what was found
    double drift;            // [mm] from the click to its axis
    double inlier_rate;
    double noise;            // [grey values] standard deviation of a voxel of the volume
    double contrast;         // [grey values] of the inside against what is beside it
    double certainty;        // contrast in standard errors; HUGE_VAL without noise
    double smoothing_mm;     // standard deviation of the Gaussian that the tracked copy was blurred with; 0: none
    int warning_count;
    RbtWarning warning[RBT_MAX_WARNINGS];
} RbtStartCheck;

typedef struct RbtLoop {     // the tree format has none: the branch ends where it meets the other
    Vec3 place;              // [mm] of its end
    int branch, meets;       // numbers in the report; may be the same
    double length;           // [mm] once around, by the centrelines
} RbtLoop;

typedef struct RbtReport {
    int branch_count;
    RbtBranchReport *branch; // in the order of the tree's nodes: one a seed, those found, one an aneurysm
    int junction_count;
    RbtJunction *junction;   // none with `ostia` 0
    char start[256];         // what was estimated at the first start, and which end is the root; empty: it was given
    RbtStartCheck check;
    int loop_count;
    RbtLoop *loop;           // where a branch's end meets another branch of the tree
    int left_out_count;      // branches of the vessels that `not` names …
    double left_out_length;  // … and their length [mm]
} RbtReport;
void rbt_report_free(RbtReport *report);

// Seeds first to last, then the aneurysms. The first seed gives the root and its direction (toward). Without a direction the
// vessel is tracked both ways from it, and one of its ends becomes the root (rbt_start.h). A further one is projected to the tree tracked so far
// (section 3.3) unless it has a `toward`: then it is tracked from its start in both directions, back to the parent. NULL with faults (`path` is the trace
// file's) when a seed is unfit or nothing could be tracked from it; a branch that just ends early is no fault. `report` may be NULL.
VesselTree *rbt_track(const Volume *volume, const RbtParameters *parameters, const RbtSeed *seed, int seed_count, const RbtAneurysm *aneurysm,
                      int aneurysm_count, int threads, const Progress *progress, RbtReport *report, const char *path, Faults *faults);

#endif
