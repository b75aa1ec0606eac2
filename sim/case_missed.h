// What an angiogram shows as brightly as the tracked vessels, and the tree does not hold: other vessels, or bone.
#ifndef SELDINGER_SIM_CASE_MISSED_H
#define SELDINGER_SIM_CASE_MISSED_H

#include "geom/geom.h"
#include "recon/recon.h"

enum { MISSED_PARTS = 8 };
typedef struct MissedPart {  // voxels that touch each other
    Vec3 place;              // [mm] its brightest voxel
    double volume;           // [mm3]
} MissedPart;

typedef struct Missed {
    int count;               // parts, the largest first; parts of less than 64 voxels are left out
    MissedPart part[MISSED_PARTS];
    double held;             // 0 to 1: of the volume that is as bright, what the tree holds
} Missed;

// As bright: above half of the median contrast at the tree's centres to the median of the volume. Held: within a node's ball or between its centre and its
// points, and two voxels around them. Returns false if out of memory.
bool missed_find(const Volume *volume, const VesselTree *tree, Missed *missed);

#endif
