// What a reader of an angiogram looks for, as candidates: narrow places, wide places, sacs. Measured on the tree's radii and points; a candidate is a
// place to look at, not a diagnosis.
//
// The reference radius at a place is the mean of two medians: of the radii 2 to 8 branch radii (the branch's median) upstream, and downstream, along
// the branch, at least three nodes each. No reference near a branch's ends, nor where it still runs inside the vessel it springs from. Radii
// are first smoothed by the median of three neighbours. A narrow place is also narrower than either median by half as much, a wide one wider: so what
// stands beside a wide place is not called narrow.
#ifndef SELDINGER_GEOM_VESSEL_FINDINGS_H
#define SELDINGER_GEOM_VESSEL_FINDINGS_H

#include "geom/vessel_branches.h"

typedef enum { FINDING_STENOSIS, FINDING_DILATATION, FINDING_ANEURYSM } FindingKind;

typedef struct Finding {
    FindingKind kind;
    int branch;              // index, -1: none (a sac that hangs on no branch)
    int node;                // the narrowest, the widest, or the sac's first node
    double along;            // [mm] way along the branch; of a sac: of the node it hangs on
    double length;           // [mm] of the run of nodes beyond the bound; of a sac 0
    double radius;           // [mm] there (smoothed); of a sac its largest node's
    double reference;        // [mm] of a sac: the radius of the vessel it hangs on
    double degree;           // [%] of a stenosis: 100 (1 - radius / reference); of a dilatation 100 (radius / reference - 1)
    double extent;           // [mm] sac: largest distance between its points; else 0
    double neck;             // [mm] sac: width of its narrowest section towards the vessel, by area, on its model; NaN: not known
} Finding;

typedef struct FindingOptions {
    double narrow;           // a stenosis is below this part of the reference, default 0.7
    double wide;             // a dilatation is above it, default 1.5
} FindingOptions;
FindingOptions finding_default_options(void);

// The findings by branch and way along it, sacs last; *count of them. NULL where memory lacks (and *count 0); free() it.
Finding *vessel_findings(const VesselTree *tree, const VesselBranches *branches, const FindingOptions *options, int *count);

#endif
