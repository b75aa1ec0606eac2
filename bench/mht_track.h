// The tracker with which Kerrien et al. 2017, 5.2, compare RBT: multiple hypothesis template tracking (Friman et al. 2010, Medical Image Analysis 14,
// 160-171), as far as it is published (the papers; MeVisLab's TubularTracking module, whose fields and defaults are quoted below). From a
// start, a direction and a radius, a template (mht_template.h) is predicted one step ahead along the axis, or in a fan of directions, and fitted; its
// score is the t statistic of its contrast. Lengths mm, in the volume's frame. Nothing is random: a run repeats bit for bit.
//
// A single hypothesis goes straight on and is fitted: it ends where the score falls below `termination`. With several, the predictions whose scores
// are local maxima over the fan are fitted, each is followed `search_depth` steps ahead, and the step is taken towards the path of best mean score.
//
// There are two sets of parameters. mht_paper_parameters() are those of Kerrien et al. (5.2.3), the rest being the module's defaults. mht_default_parameters()
// give the best results of the method on our volumes, for a fair comparison. Chosen on three random trees of 35 vessels (noise 5 and 15 % of the contrast,
// fused neighbours among them) and the phantom, each vessel tracked alone from a true start, not on any angiogram:
//   step 0.5 r: as many vessels are tracked to their end as with 0.1 r, in a fifth of the steps; the centre lags less in curves.
//   window 4 r: with 5 r no more vessels are tracked to their end, and the error in curves is a quarter larger; with 3 r one vessel in twenty fewer.
//   termination 5 and contrast 0.5: a fit finds a t of 3 in noise, and beyond the end of a vessel its window still contains the tube. With 3 and 0 every track
//   continued into the background (in Kerrien's table 2: 8.9 %); with these, none. own_overlap: prevents endless circling in an aneurysm.
// Tried and rejected: radius_max 2 (tracks jump to wider neighbours: a tenth fewer reach their end); several hypotheses, three deep in a fan of 60 degrees
// (a tenth fewer, ten times as slow). Kerrien et al. did not use these either.
#ifndef SELDINGER_BENCH_MHT_TRACK_H
#define SELDINGER_BENCH_MHT_TRACK_H

#include "recon/track/rbt_track.h"

typedef struct MhtParameters {
    // parameters of the published method
    double step;             // in radii
    double window;           // sigma across the vessel in radii, of weights exp(-x^2 / sigma^2)
    double radius_min, radius_max;   // in radii of the branch's start; never below half a voxel
    double radius_change;    // largest relative change from a step to the next
    double max_angle_deg;    // largest angle between the axes of successive steps, and half the opening angle of the fan
    int search_angles;       // n predictions to either side of straight on, in two planes: (2 n + 1)^2 in total; 0: only straight on
    int search_depth;        // number of steps ahead; 1 with search_angles 0: a single hypothesis
    double pruning;          // lowest score of a prediction and of its fit, if there is more than one …
    double termination;      // … and lowest mean score of the path
    int max_steps;           // of a branch
    double max_length_mm;    // of a branch
    // our own parameters
    double contrast;         // lowest contrast of a node as a fraction of the mean contrast of its last eight predecessors; 0: any
    double overlap;          // a branch ends where its centre is closer than this many radii to the centre of another branch's node …
    double own_overlap;      // … or to the centre of one of its own nodes at least four radii of path earlier; 0: never
} MhtParameters;

MhtParameters mht_default_parameters(void);
MhtParameters mht_paper_parameters(void);

// As rbt_track: the first seed gives the root and its direction. Further seeds start beside the parent or, with a `toward`, at their own point and are tracked
// in both directions; a return path that misses its parent is joined where it was nearest, and its rest becomes a limb there. Nodes have 16 points on the
// template's circle, and their height is the length of a step. `threads` is not used: a branch is one chain of steps. In the report the inlier rates and
// counts of retries are 0. NULL with faults if a seed is unsuitable or the score of its first template is too low.
VesselTree *mht_track(const Volume *volume, const MhtParameters *parameters, const RbtSeed *seed, int seed_count, int threads, const Progress *progress,
                      RbtReport *report, const char *path, Faults *faults);

#endif
