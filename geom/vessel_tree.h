// The vascular tree: centreline nodes with local point sets (RBT) and, once fitted, an implicit wall: one field of shared blobs, or a local blobby
// model for each node (LIM). Kerrien et al. 2017, sections 3.1 and 4.5. Lengths mm, in the frame of the volume the tree came from.
//
// A shared blob belongs to one node (its owner) and has compact support. Which nodes see it (add it to their field) follows from the tree alone
// (vessel_tree_link): a flood from its owner over near nodes whose power cells meet its support. So at the border between two near cells, a blob that only one
// of the two nodes sees is zero, and the wall is the same from both sides; and vessels that touch without being near in the tree never see each other's blobs.
//
// A tree owns all its arrays. Parents come before children; the root is node 0 with parent -1. After creation or loading a tree is read-only and may be shared
// by threads.
#ifndef SELDINGER_GEOM_VESSEL_TREE_H
#define SELDINGER_GEOM_VESSEL_TREE_H

#include "base/base.h"
#include "geom/linear.h"

#include <stdbool.h>
#include <stdint.h>

enum { NODE_VESSEL = 0, NODE_ANEURYSM = 1 };

typedef struct VesselTree {
    int node_count;          // N
    Vec3 *center;            // (N)
    double *radius;          // (N) [mm] > 0
    Vec3 *direction;         // (N) unit, from parent towards children
    double *height;          // (N) [mm] >= 0, extent of the cylinder along direction
    int32_t *parent;         // (N) -1 at the root, else < own index
    uint8_t *kind;           // (N) NODE_VESSEL or NODE_ANEURYSM

    int64_t point_count;     // P
    Vec3 *point;             // (P) on the vessel's surface
    int64_t *point_offset;   // (N+1) node i owns points [offset[i], offset[i+1])

    int64_t blob_count;      // B, 0 until fitted
    Vec3 *blob_center;       // (B)
    double *blob_width;      // (B) [mm] > 0: rho of a local blob, radius of support R of a shared one
    double *blob_amplitude;  // (B) of shared blobs, of either sign; NULL for local models
    int64_t *blob_offset;    // (N+1) node i owns blobs [offset[i], offset[i+1])
    double *error;           // (N) [mm] 90th percentile of Taubin's distance of the node's points
    double iso_level;        // T: 0.1 for local models, 1 for shared blobs

    int *neighbour_offset;   // (N+1) derived: parent and children of each node …
    int *neighbour;          // … in one list of 2 (N-1) entries, parent first, children by index
    int *near_offset;        // (N+1) derived: the nodes to which a tool point of node i may move …
    int *near;               // … ordered by distance along the links: see vessel_tree_link
    int64_t *seen_offset;    // (N+1) derived, for shared blobs: node i sees …
    int32_t *seen;           // … the blobs seen[seen_offset[i] … seen_offset[i+1]-1], in ascending order. NULL for local models
} VesselTree;

// Allocates all arrays for the counts (all zeroed, offsets included; iso_level 0.1). `blob_count` 0 gives a tree without model: the blob arrays and error have
// size 0 (blob_offset all zero). Returns NULL if a count is out of range or if out of memory.
VesselTree *vessel_tree_create(int node_count, int64_t point_count, int64_t blob_count);
// The same for a field of shared blobs: with amplitudes, iso_level 1.
VesselTree *vessel_tree_create_shared(int node_count, int64_t point_count, int64_t blob_count);
void vessel_tree_free(VesselTree *tree);
// Checks the properties stated above (finite numbers, offsets monotone and complete, parents before children, one root, unit directions to 1e-6, radii and
// widths positive). Adds one fault per broken rule, with the first offending index.
bool vessel_tree_validate(const VesselTree *tree, const char *file, Faults *faults);
// Fills the neighbour and near lists, and for shared blobs the `seen` lists; call once after parents, centres and radii are set. Returns false if out of
// memory.
// "Near" is wider than the paper's neighbours (6.2.1), with which tracking stalls where a sac or a side branch opens over several nodes: a point at the far lip
// of the mouth would have to pass through worse nodes. Node j is near node i if their centres are closer than 1.5 (r_i + r_j) and the path through the tree is
// shorter than 3 (r_i + r_j): so the nodes of a wide mouth are near those of the vessel that it opens into, although the path leads around its rim. Between two
// limbs of a hairpin both see one field, which decides.
// Local models know nothing of each other's walls: for them the factors are 1.2 and 1.5 (a vessel that turns back on itself needs pi times its radius, so
// touching walls stay separate), and 1.5 and 2 with a sac's node (on the phantom a tip slid out of the sac on the model of a node beside its neck).
// Near is mutual. It is complete, except that these distances are reduced for all nodes alike if the tree has so many nodes in one place that the lists would
// not fit.
bool vessel_tree_link(VesselTree *tree);
// Returns whether the root is an open end through which a tool enters: the tree does not continue upstream of it, and its own points do not close over it, as
// those of a blind end do.
bool vessel_tree_root_is_open(const VesselTree *tree);
// A linked copy of a tree without a model whose root is `node`, an end of a vessel. The links on the way from the old root turn round. NULL if out of memory.
VesselTree *vessel_tree_with_root(const VesselTree *tree, int node);
// [mm] total length of the vessels' centrelines; links within and into sacs do not count.
double vessel_tree_length(const VesselTree *tree);
static inline bool vessel_tree_is_model(const VesselTree *tree) { return tree->blob_count > 0; }
static inline bool vessel_tree_is_shared(const VesselTree *tree) { return tree->blob_amplitude != NULL; }

#endif
