// Inputs of the tracking besides the volume, and its report on the tree. Lengths mm.
#ifndef SELDINGER_RECON_TRACK_RBT_REPORT_H
#define SELDINGER_RECON_TRACK_RBT_REPORT_H

#include "recon/track/ransac_cylinder.h"

#include <stdbool.h>

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
    bool is_found;           // found by the program, without a seed
    int parent, order;       // number of the parent branch, -1: none; order: 1 for the first, one more than the parent's
    double radius;           // [mm] mean over its nodes, of a sac over its centres
    Vec3 center;             // [mm] of its last node; of a sac, the middle of its widest ball
    char name[32];           // the seed's or the aneurysm's
    char end[96];            // why it ended
} RbtBranchReport;

// How well the image supports the link between a branch and its parent: the darkest place of the best path, as a share of the child's contrast.
typedef enum RbtSupport {
    RBT_SUPPORTED,           // at least a half: it has nodes, none further from the next than the sum of their radii
    RBT_DOUBTFUL,            // at least a quarter: the same, but should be checked
    RBT_REFUSED,             // less: the branch was dropped with its subtree
    RBT_KEPT                 // less, but the trace names the branch: it stays without nodes on its link, so no tool passes
} RbtSupport;

typedef struct RbtJunction {
    int branch, parent;      // numbers in the report; -1: dropped
    bool is_inner;           // not a junction but a gap within the branch
    bool is_moved;           // attached to another parent, because the image did not support the first one
    Vec3 place;              // [mm] where the link leaves the parent's lumen; of one without a path, its middle
    double length;           // [mm] of the link, from the parent's axis to the first node that was tracked
    double share;            // 0 … 1
    RbtSupport support;
    int node_count, point_count;   // on the link
    int dropped_nodes;       // with a refused one …
    double dropped_mm;       // … and their length
} RbtJunction;

typedef enum RbtDoubt {      // reasons to doubt a result
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
    char text[240];          // the measured value, the usual limit, and advice
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

typedef struct RbtLoop {     // the tree format cannot store loops: the branch ends where it meets the other
    Vec3 place;              // [mm] of its end
    int branch, meets;       // numbers in the report; may be the same
    double length;           // [mm] circumference along the centrelines
} RbtLoop;

typedef struct RbtReport {
    int branch_count;
    RbtBranchReport *branch; // in the order of the tree's nodes: one a seed, those found, one an aneurysm
    int junction_count;
    RbtJunction *junction;   // none with `ostia` 0
    char start[256];         // what was estimated at the first start, and which end is the root; empty if given
    RbtStartCheck check;
    int loop_count;
    RbtLoop *loop;           // where a branch's end meets another branch of the tree
    int left_out_count;      // branches of the vessels excluded by `not` …
    double left_out_length;  // … and their length [mm]
} RbtReport;
void rbt_report_free(RbtReport *report);

#endif
