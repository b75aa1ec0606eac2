// Finds the best path through the image between a vessel and its parent, and the darkest place on it. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_LINK_PATH_H
#define SELDINGER_RECON_TRACK_RBT_LINK_PATH_H

#include "recon/track/link_lattice.h"
#include "recon/track/rbt_tracker.h"

typedef struct LinkLight {   // brightness scale of the child: 0 is the background beside it, 1 its lumen
    double inside, outside;
} LinkLight;

// Measures it as medians over the first nodes of the vessel that begins at `node`.
LinkLight rbt_link_light(const Track *tree, const Tracker *t, int node);
// Finds the path from the parent's axis to the child's first node, within `beside` [mm] of the straight line. Returns false if out of memory.
bool rbt_link_path(const Tracker *t, Vec3 from, Vec3 to, double beside, const LinkLight *light, LinkPath *out);
// Finds the cheapest path through the image from the child `node` to any vessel or aneurysm outside its subtree, within `reach` [mm], with a brightness of at
// least `least` throughout and outside the tubes of the child's subtree. `hangs[i]`: node i belongs to the child's subtree. `met` receives the node reached.
// Without a path out->count is 0. Returns false if out of memory.
bool rbt_link_search(const Tracker *t, int node, const bool *hangs, double reach, double least, const LinkLight *light, LinkPath *out, int *met);

#endif
