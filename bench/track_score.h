// Compares a tracked tree with the true one, branch by branch, with the labels of Kerrien et al. 2017, section 5.2.2, Table 2. In the paper experts assigned the
// labels; here they follow from the truth. A branch is a part of a true vessel between two bifurcations, or between a bifurcation and an end C_f:
//   ST  C_f was reached (within two radii) and four fifths of the branch are covered
//   PS  C_f was not reached, and the tracking stayed inside
//   WT  not tracked (less than a tenth), or attached to a vessel from which it does not branch off
//   KV, KB, KA, LB   tracked partly and then lost into a vessel, bone or aneurysm in contact, or into the background
//   BT  lost by turning back into the same vessel
// Spurious vessels (leaks from the side of a correctly tracked branch, vessels where there are none) are counted separately, with the same labels. A tip may be
// exceeded by two radii, where the paper also clips. Sacs captured as aneurysms are not vessels and are not judged.
#ifndef SELDINGER_BENCH_TRACK_SCORE_H
#define SELDINGER_BENCH_TRACK_SCORE_H

#include "recon/phantom/phantom.h"

typedef enum TrackLabel { TRACK_ST, TRACK_PS, TRACK_WT, TRACK_KV, TRACK_KB, TRACK_KA, TRACK_LB, TRACK_BT, TRACK_LABELS } TrackLabel;
extern const char *const track_label_name[TRACK_LABELS];

typedef struct TrackTruth {
    const VesselTree *tree;      // as made by shape_sample: nodes half a radius apart; points are not used
    const VesselTree *neighbour; // visible vessels that do not belong to the tree, or NULL
    int block_count;             // bone
    const ShapeBlock *block;
    double voxel_mm;             // voxel size; a centre up to 0.5 voxels outside still counts as inside
    double blur_mm;              // b, standard deviation of the total blur of the image
} TrackTruth;

typedef struct TrackBranch {
    int first_node, last_node;   // of the true tree: the bifurcation (or root) at its start and the bifurcation (or tip) at its end
    double radius;               // [mm] mean
    double length, covered;      // [mm] true length, and tracked length
    double skip;                 // [mm] unscored part of its length, two radii: at the bifurcation, or before the start in the root's branch
    TrackLabel label;
    bool hangs_wrong;            // it was tracked, but attached to a vessel from which it does not branch off
} TrackBranch;

typedef struct TrackSample {     // a tracked node inside a branch, two radii away from bifurcations and tips
    int branch;
    double center;               // [mm] distance of its centre to the true centreline
    double radius;               // [mm] its radius less the expected one, R - b^2 / (2 R) (docs/references.md) …
    double radius_exact;         // … and less blurred_edge_of(R, b), which is also valid if b is not small compared with R
    double true_radius;
} TrackSample;

typedef struct TrackScore {
    int branch_count;
    TrackBranch *branch;
    int sample_count;
    TrackSample *sample;
    int invented[TRACK_LABELS];      // KV, KB, KA, LB, BT: runs of at least two radii outside the true tree
    double invented_mm[TRACK_LABELS];
    int links, background_links;     // links between vessel nodes of the tracked tree, and the number of these that leave the lumen
    int wrong_attachments;           // links between places that are far apart in the true tree
    int false_sacs;                  // aneurysm nodes outside all vessels and sacs
    double true_mm, covered_mm, tracked_mm;
} TrackScore;

// False if out of memory. `tracked` may be NULL: nothing was tracked.
bool track_score(const TrackTruth *truth, const VesselTree *tracked, TrackScore *out);
void track_score_free(TrackScore *score);

#endif
