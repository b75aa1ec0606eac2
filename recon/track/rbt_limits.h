// Where the wanted tree ends: points that the tracking must not pass (`until`), and excluded vessels (`not`), which compete with it for the lumen.
// Not in Kerrien et al. 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_LIMITS_H
#define SELDINGER_RECON_TRACK_RBT_LIMITS_H

#include "recon/track/rbt_tracker.h"

// A disc across the vessel at each point of `until`, one and a half of its radii wide, to t->stop. `start`: the first start [mm], which none may
// hold. False with a fault, or without one if memory runs out.
bool rbt_place_stops(Tracker *t, Vec3 start, const char *path, Faults *faults);
// Tracks the vessel at a point of `not` both ways and divides the lumen that it shares with the first branch, whose start is `start`: where one
// passes both points, at its narrowest place between them; else the one that runs into the other ends there. The rest of it stays in the tree as
// branch `number`, with a root of its own. False with a fault, or out of memory (t->out_of_memory).
bool rbt_add_rival(Tracker *t, const RbtRegion *point, Vec3 start, int number, const char *path, Faults *faults);
// Drops all nodes whose root is not the first node; *branches and *length [mm] receive the amount. False: out of memory.
bool rbt_drop_rivals(Tracker *t, int *branches, double *length);

#endif
