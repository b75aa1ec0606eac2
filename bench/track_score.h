// A tracked tree against the true one, branch by branch, with the labels of Kerrien et al. 2017, section 5.2.2, Table 2. There, experts judged; here
// the truth decides. A branch is a stretch of true vessel between two bifurcations, or a bifurcation and an end C_f:
//   ST  C_f was reached (within two radii) and four fifths of the branch are covered
//   PS  not reached, and the tracking stayed inside
//   WT  nothing of it was tracked (less than a tenth), or it hangs on a vessel that it does not come from
//   KV, KB, KA, LB   tracked to some point and then lost into a vessel, bone or aneurysm in contact, or into the background
//   BT  lost by turning back into the same vessel
// Spurious vessels (leaks off the side of a correctly followed branch, vessels where there are none) are counted separately, by the same kinds. A tip
// may be overrun by two radii: the paper clips there too. Sacs captured as aneurysms are not vessels and are not judged.
#ifndef SELDINGER_BENCH_TRACK_SCORE_H
#define SELDINGER_BENCH_TRACK_SCORE_H

#include "recon/phantom/phantom.h"

typedef enum TrackLabel { TRACK_ST, TRACK_PS, TRACK_WT, TRACK_KV, TRACK_KB, TRACK_KA, TRACK_LB, TRACK_BT, TRACK_LABELS } TrackLabel;
extern const char *const track_label_name[TRACK_LABELS];

typedef struct TrackTruth {
    const VesselTree *tree;      // as shape_sample makes it: nodes half a radius apart; points are not looked at
    const VesselTree *neighbour; // visible vessels that do not belong to the tree, or NULL
    int block_count;             // bone
    const ShapeBlock *block;
    double voxel_mm;             // a centre may lie this share of a voxel outside and still count as inside: 0.5
    double blur_mm;              // b, standard deviation of the total blur of the image
} TrackTruth;

typedef struct TrackBranch {
    int first_node, last_node;   // of the true tree: the bifurcation (or root) where it begins and the one (or tip) where it ends
    double radius;               // [mm] mean
    double length, covered;      // [mm] true length, and how much of it was tracked
    double skip;                 // [mm] of its length that is not scored, two radii: the bifurcation's, or before the start in the root's branch
    TrackLabel label;
    bool hangs_wrong;            // it was tracked, but attached to a vessel that it does not come from
} TrackBranch;

typedef struct TrackSample {     // of a tracked node inside a branch, two radii away from bifurcations and tips
    int branch;
    double center;               // [mm] distance of its centre to the true centreline
    double radius;               // [mm] its radius less the one expected, R - b^2 / (2 R) (docs/references.md) …
    double radius_exact;         // … and less blurred_edge_of(R, b), which also holds where b is not small against R
    double true_radius;
} TrackSample;

typedef struct TrackScore {
    int branch_count;
    TrackBranch *branch;
    int sample_count;
    TrackSample *sample;
    int invented[TRACK_LABELS];      // KV, KB, KA, LB, BT: runs of at least two radii that are not in the truth
    double invented_mm[TRACK_LABELS];
    int links, background_links;     // of the tracked tree between vessel nodes, and those of them that leave the lumen
    int wrong_attachments;           // links between places that are far apart in the true tree
    int false_sacs;                  // aneurysm nodes outside all vessels and sacs
    double true_mm, covered_mm, tracked_mm;
} TrackScore;

// False if out of memory. `tracked` may be NULL: nothing was tracked.
bool track_score(const TrackTruth *truth, const VesselTree *tracked, TrackScore *out);
void track_score_free(TrackScore *score);

#endif
