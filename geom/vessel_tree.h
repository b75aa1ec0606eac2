// The vascular tree: centreline nodes with local point sets (RBT) and, once fitted, an implicit wall: one field of shared blobs, or a local blobby
// model for each node (LIM). Kerrien et al. 2017, sections 3.1 and 4.5. Lengths mm, in the frame of the volume the tree came from.
//
// A shared blob belongs to one node (its owner) and has compact support. Which nodes see it follows from the tree alone (vessel_tree_link): the flood from
// its owner over near nodes whose power cells meet its support. Where two near cells meet, a blob that only one of their nodes sees is therefore zero, so
// that the wall is the same from both sides; and vessels that touch without being near in the tree never see each other's blobs.
//
// One tree owns all its arrays. Parents stand before children; the root is node 0 with parent -1. A tree that was made or
// loaded is read-only afterwards and may be shared by threads.
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
    double *blob_amplitude;  // (B) of shared blobs, of either sign; NULL: local models
    int64_t *blob_offset;    // (N+1) node i owns blobs [offset[i], offset[i+1])
    double *error;           // (N) [mm] 90th percentile of Taubin's distance of the node's points
    double iso_level;        // T: 0.1 of local models, 1 of shared blobs

    int *neighbour_offset;   // (N+1) derived: parent and children of each node …
    int *neighbour;          // … in one list of 2 (N-1) entries, parent first, children by index
    int *near_offset;        // (N+1) derived: the nodes to which a tool point of node i may move, …
    int *near;               // … nearest by links first: see vessel_tree_link
    int64_t *seen_offset;    // (N+1) derived, of shared blobs: node i sees …
    int32_t *seen;           // … the blobs seen[seen_offset[i] … seen_offset[i+1]-1], in ascending order. NULL with local models
} VesselTree;

// Allocates all arrays for the counts (all zeroed, offsets included, iso_level 0.1). NULL where memory or a count is unfit.
// `blob_count` 0 gives a tree without model: blob arrays and error exist with size 0 (blob_offset all zero).
VesselTree *vessel_tree_create(int node_count, int64_t point_count, int64_t blob_count);
// The same for a field of shared blobs: with amplitudes, iso_level 1.
VesselTree *vessel_tree_create_shared(int node_count, int64_t point_count, int64_t blob_count);
void vessel_tree_free(VesselTree *tree);
// Checks everything the comments above promise (finite numbers, offsets monotone and closed, parents before children, one
// root, unit directions to 1e-6, radii and widths positive). Adds one fault per broken rule with the first offending index.
bool vessel_tree_validate(const VesselTree *tree, const char *file, Faults *faults);
// Fills the neighbour lists; call once after parents, centres and radii are set. False where there is no memory.
// Near is wider than the paper's neighbours (6.2.1), which stall where a sac or a side branch opens over several nodes: a point at the far lip of
// a mouth would have to pass nodes that are worse. Node j is near node i where their centres are closer than 1.5 (r_i + r_j) and the way
// through the tree is shorter than 3 (r_i + r_j): the nodes of a wide mouth are near those of the vessel that it opens into although the way leads
// about its rim, and what lies between two limbs of a hairpin is for the one field of both to say. Local models know nothing of each other's walls: theirs
// are 1.2 and 1.5 (a vessel that turns back on itself needs pi times its radius, so kissing walls stay apart), with a sac's node 1.5 and 2 (on the
// phantom a tip slid out of the sac on the model of a node beside its neck).
// Near is mutual, and complete: only where a tree has so many nodes in one place that the lists would not fit are these distances cut, for all alike.
// Of shared blobs it makes the lists of who sees which, too.
bool vessel_tree_link(VesselTree *tree);
// Whether the root is an end through which a tool comes in: neither does the tree go on upstream of it, nor do the root's own points close it
// over, as those of a blind end do.
bool vessel_tree_root_is_open(const VesselTree *tree);
// [mm] of its vessels' centrelines; the links within and into sacs are none.
double vessel_tree_length(const VesselTree *tree);
static inline bool vessel_tree_is_model(const VesselTree *tree) { return tree->blob_count > 0; }
static inline bool vessel_tree_is_shared(const VesselTree *tree) { return tree->blob_amplitude != NULL; }

#endif
