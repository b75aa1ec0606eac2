// Candidate findings as in the reading of an angiogram: narrowings, widenings, sacs. Measured on the tree's radii and points; a candidate marks a place to
// examine and is not a diagnosis.
//
// The reference radius at a place is the mean of two medians, of the radii from 2 to 8 branch radii (the branch's median) upstream and downstream along the
// branch, with at least three nodes each. There is no reference near a branch's ends, nor where the branch still runs inside its parent vessel. Radii are first
// smoothed by the median of three neighbours. A narrowing must also lie below each of the two medians by half as much, a widening above each: so the vessel
// beside a widening is not called narrow.
#ifndef SELDINGER_GEOM_VESSEL_FINDINGS_H
#define SELDINGER_GEOM_VESSEL_FINDINGS_H

#include "geom/model_field.h"
#include "geom/vessel_branches.h"

typedef enum { FINDING_STENOSIS, FINDING_DILATATION, FINDING_ANEURYSM } FindingKind;

typedef struct Finding {
    FindingKind kind;
    int branch;              // index; -1: none (a sac that is connected to no branch)
    int node;                // the narrowest, the widest, or the sac's first node
    double along;            // [mm] arc length along the branch; for a sac, of the node it is connected to
    double length;           // [mm] of the run of nodes beyond the threshold; 0 for a sac
    double radius;           // [mm] at `node` (smoothed); for a sac, of its largest node
    double reference;        // [mm]; for a sac, the radius of the vessel it is connected to
    double degree;           // [%] of a stenosis: 100 (1 - radius / reference); of a dilatation 100 (radius / reference - 1)
    double extent;           // [mm] for a sac, the largest distance between its points; else 0
    double neck;             // [mm] for a sac, the width of its narrowest section (by area) towards the vessel, on its model; NaN: unknown
} Finding;

typedef struct FindingOptions {
    double narrow;           // a stenosis is below this fraction of the reference, default 0.7
    double wide;             // a dilatation is above this fraction, default 1.5
} FindingOptions;
FindingOptions finding_default_options(void);

// `branches` and nodes are those of model->tree, which need have no wall. Returns the findings ordered by branch and arc length, sacs last, and their number in *count; the caller frees the array. Returns NULL, with *count 0, if out
// of memory.
Finding *vessel_findings(const ModelField *model, const VesselBranches *branches, const FindingOptions *options, int *count);

#endif
