// Inputs of the tracking other than the volume, and its report on the tree. Lengths in mm.
#ifndef SELDINGER_RECON_TRACK_RBT_REPORT_H
#define SELDINGER_RECON_TRACK_RBT_REPORT_H

#include "recon/track/ransac_cylinder.h"

#include <stdbool.h>

typedef struct RbtSeed {     // where a branch starts
    Vec3 start, toward;      // [mm] or voxels
    bool start_is_voxel, toward_is_voxel, has_toward;
    double radius;           // [mm]; 0: the parent's radius; for the first branch it is estimated
    int line, column;        // position in the trace file, for faults
    char name[32];           // for reports; may be empty
} RbtSeed;

typedef struct RbtAneurysm { // points inside a sac; the first may be anywhere in it
    int center_count;
    Vec3 *center;            // [mm] or voxels
    bool is_voxel;
    int line, column;
    char name[32];
} RbtAneurysm;

typedef struct RbtBranchReport {
    int first_node, node_count;    // nodes of a branch follow each other
    double length;           // [mm] of its centreline
    double inlier_rate, inlier_rate_min;   // mean and smallest over the nodes
    int relaxed_count;       // nodes with an inlier rate below p_inl
    int retried_count;       // nodes reached by a longer step
    int junction_count;      // nodes in openings where no cylinder fits (their inlier rate is the fraction of rays that hit a wall nearby)
    int link_count;          // nodes between the parent's axis and the first tracked node; included in counts and length, not in means
    bool is_aneurysm;
    bool is_found;           // found by the program, without a seed
    int parent, order;       // number of the parent branch, -1: none; order: 1 for the first branch, else the parent's plus one
    double radius;           // [mm] mean over its nodes; of a sac, over its centres
    Vec3 center;             // [mm] centre of its last node; of a sac, of its widest ball
    char name[32];           // name of its seed or aneurysm
    char end[96];            // reason why it ended
} RbtBranchReport;

// How well the image supports the link between a branch and its parent: the brightness of the darkest place on the best path, as a fraction of the child's
// contrast.
typedef enum RbtSupport {
    RBT_SUPPORTED,           // at least a half: the link has nodes, none further from the next than the sum of their radii
    RBT_DOUBTFUL,            // at least a quarter: treated like a supported one, but should be checked by the user
    RBT_REFUSED,             // less: the branch was removed with its subtree
    RBT_KEPT                 // less, but the trace file gives the branch: it stays without nodes on its link, so no tool can enter it
} RbtSupport;

typedef struct RbtJunction {
    int branch, parent;      // numbers in the report; -1: removed
    bool is_inner;           // a gap within the branch, not a junction
    bool is_moved;           // attached to another parent, because the image did not support the first one
    Vec3 place;              // [mm] where the link leaves the parent's lumen; without a path, the link's middle
    double length;           // [mm] length of the link, from the parent's axis to the first tracked node
    double share;            // brightness of the darkest place, 0 … 1
    RbtSupport support;
    int node_count, point_count;   // number of nodes and points on the link
    int dropped_nodes;       // nodes removed with a refused link …
    double dropped_mm;       // … and their length
} RbtJunction;

typedef enum RbtDoubt {      // reasons to doubt a result
    RBT_DRIFT,               // [mm] distance of the click from the axis of the vessel found; limit: its radius
    RBT_INLIERS,             // fraction of the edge points on the cylinder: at the start, at the root or over the first branch
    RBT_RADIUS,              // [mm] radius; limit from the volume's smallest extent
    RBT_SHAPE,               // fraction of its contrast that the tube at the start has towards its brightest sides
    RBT_NOISE,               // contrast, in standard errors or in standard deviations of the noise
    RBT_BACKGROUND,          // [grey values] change of the background beside the first branch; limit: its contrast
    RBT_LENGTH,              // length of the first branch, in radii
    RBT_SAC,                 // [mm] radius of the sac in which the start lies; limit: that of the vessel beside it, from where the tree was tracked
    RBT_DOUBTS
} RbtDoubt;
extern const char *const rbt_doubt_name[RBT_DOUBTS];

enum { RBT_MAX_WARNINGS = 12 };
typedef struct RbtWarning {
    RbtDoubt kind;
    double measured, limit;
    char text[300];          // the measured value, the usual limit, and advice
} RbtWarning;

typedef struct RbtStartCheck {
    Vec3 click;              // [mm] the given point
    Cylinder cylinder;       // the vessel found
    double drift;            // [mm] distance from the click to the cylinder's axis
    double inlier_rate;
    double noise;            // [grey values] standard deviation of the noise of a voxel
    double contrast;         // [grey values] brightness inside minus brightness beside the tube
    double certainty;        // contrast in standard errors; HUGE_VAL without noise
    double smoothing_mm;     // [mm] standard deviation of the Gaussian that smoothed the tracked copy; 0: not smoothed
    int warning_count;
    RbtWarning warning[RBT_MAX_WARNINGS];
} RbtStartCheck;

typedef struct RbtLoop {     // the tree format cannot store loops: the branch ends where it touches the other
    Vec3 place;              // [mm] end of the branch
    int branch, meets;       // numbers in the report of the branch that ends and of the one it touches; may be the same
    double length;           // [mm] circumference along the centrelines
} RbtLoop;

typedef struct RbtReport {
    int branch_count;
    RbtBranchReport *branch; // in the order of the tree's nodes: the given branches, those found, the aneurysms
    int junction_count;
    RbtJunction *junction;   // empty with `ostia` 0
    char start[256];         // description of the estimate at the first start, with the end chosen as the root; empty if the start was given
    RbtStartCheck check;
    int loop_count;
    RbtLoop *loop;           // places where a branch's end touches another branch of the tree
    int left_out_count;      // number of removed branches of vessels excluded by `not` …
    double left_out_length;  // … and their length [mm]
} RbtReport;
void rbt_report_free(RbtReport *report);

#endif
