// The tracker that Kerrien et al. 2017, 5.2, compare RBT with: multiple hypothesis template tracking (Friman et al. 2010, Medical Image Analysis 14,
// 160-171), as far as it is publicly described (the papers; MeVisLab's TubularTracking module, whose fields and defaults are quoted below). From a
// start, a direction and a radius, a template (mht_template.h) is predicted one step ahead along the axis, or in a fan of directions, and fitted; its
// score is the t statistic of its contrast. Lengths mm, in the volume's frame. Nothing is random: a run repeats bit for bit.
//
// A single hypothesis goes straight on and is fitted: it ends where the score falls below `termination`. With several, the predictions whose scores
// are local maxima over the fan are fitted, each is followed `search_depth` steps ahead, and the step is taken towards the path of best mean score.
//
// Two sets of values. mht_paper_parameters() is what Kerrien et al. ran (5.2.3), the rest being the module's defaults. mht_default_parameters() is
// the same method at its best on our volumes, for a fair comparison. Chosen on three random trees of 35 vessels (noise 5 and 15 % of the contrast,
// fused neighbours among them) and the phantom, each vessel tracked alone from a true start, not on any angiogram:
//   step 0.5 r: no fewer vessels reach their end than with 0.1 r, in a fifth of the steps; the centre lags less in curves.
//   window 4 r: 5 r reaches no more and is off by a quarter more in curves; with 3 r one vessel in twenty fewer is reached.
//   termination 5 and contrast 0.5: a fit finds a t of 3 in noise, and past a vessel's end its window still holds the tube. With 3 and 0
//   every track went on into the background (in Kerrien's table 2: 8.9 %); with these, none. own_overlap: prevents endless circling in an aneurysm.
// Tried and rejected: radius_max 2 (hops into wider neighbours: a tenth fewer reach their end); several hypotheses, three deep in a fan of 60 degrees
// (a tenth fewer, ten times as slow). Kerrien et al. left these out, too.
#ifndef SELDINGER_BENCH_MHT_TRACK_H
#define SELDINGER_BENCH_MHT_TRACK_H

#include "recon/track/rbt_track.h"

typedef struct MhtParameters {
    // the method's own
    double step;             // in radii
    double window;           // sigma across the vessel in radii, of weights exp(-x^2 / sigma^2)
    double radius_min, radius_max;   // in radii of the branch's start; never below half a voxel
    double radius_change;    // most from a step to the next, as a share
    double max_angle_deg;    // most between the axes of a step and the next, and half the fan's opening
    int search_angles;       // predictions to either side of straight on, in two planes: (2 n + 1)^2 of them; 0: straight on alone
    int search_depth;        // steps that are looked ahead; 1: the single hypothesis, with search_angles 0
    double pruning;          // least score of a prediction and of its fit, where there is more than one …
    double termination;      // … and least mean score of the path
    int max_steps;           // of a branch
    double max_length_mm;    // of a branch
    // ours
    double contrast;         // least contrast of a node as a share of the mean of its last eight predecessors'; 0: any
    double overlap;          // a branch ends where its centre is closer than this many radii to the centre of another branch's node …
    double own_overlap;      // … or of its own, four radii of return path; 0: never
} MhtParameters;

MhtParameters mht_default_parameters(void);
MhtParameters mht_paper_parameters(void);

// As rbt_track: the first seed gives the root and its direction, further ones start beside the parent or, with a `toward`, at their own point and run
// both ways; where the return path misses its parent it is joined where it came nearest, and its rest is a limb there. Nodes carry 16 points on the
// template's circle and are as high as a step is long. `threads` is not used: a branch is one chain of steps. In the report the inlier rates and
// counts of retries are 0. NULL with faults if a seed is unsuitable or its first template does not score.
VesselTree *mht_track(const Volume *volume, const MhtParameters *parameters, const RbtSeed *seed, int seed_count, int threads, const Progress *progress,
                      RbtReport *report, const char *path, Faults *faults);

#endif
