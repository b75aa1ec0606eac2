// Finds where a vessel continues beyond a place where no cylinder fits: an aneurysm or a wide bifurcation. Not in Kerrien et al. 2017; used when a
// branch ends or widens.
#ifndef SELDINGER_RECON_TRACK_RBT_EXITS_H
#define SELDINGER_RECON_TRACK_RBT_EXITS_H

#include "recon/volume/volume.h"

enum { RBT_EXIT_PLACES = 6 };
typedef struct RbtExit {
    int count;               // places down the tube, from where it leaves the wide part
    Vec3 center[RBT_EXIT_PLACES], direction[RBT_EXIT_PLACES];
    double radius;           // [mm] from the area of its cross-section
} RbtExit;

typedef struct RbtBlock {    // a ball of the path tracked so far: not entered (near the start: not behind it)
    Vec3 center;
    double radius;
} RbtBlock;

// Tubes that leave the lumen (brighter than `level`) around `start` within the path length `reach` [mm], widest first; returns their number, at most
// `capacity`. `radius` is the vessel's at the start, `direction` its axis: the balls of `block` are not entered.
int rbt_find_exits(const Volume *volume, Vec3 start, Vec3 direction, double radius, double reach, double level, const RbtBlock *block, int block_count,
                   RbtExit *out, int capacity);

#endif
