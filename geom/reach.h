// Computes which part of a model (model_field.h) a tool can reach from its inlet, from the field alone: along the centreline's links, starting at the root.
//
// Three floods. Point: the field is above 0 all along the link's line. Tool: a ball of the tool's radius is free all along the line. Aside: the ball may leave
// the line by up to `aside` times the lesser radius of the link's two nodes. The field at each place is that of the node to which a tool point there walks
// (power_walk.h), so vessels that touch do not open each other. Beyond the plane of an open root the lumen continues.
//
// A link longer than the sum of its nodes' radii ("apart") is not counted as lumen, because no data show a vessel there. It counts in no length; what lies
// beyond it does.
#ifndef SELDINGER_GEOM_REACH_H
#define SELDINGER_GEOM_REACH_H

#include "geom/model_field.h"

typedef enum { REACH_POINT, REACH_TOOL, REACH_ASIDE, REACH_MODES } ReachMode;

typedef struct ReachOptions {
    double tool_radius;      // [mm] > 0, default 0.18
    double aside;            // relative to the lesser radius of a link's nodes, 0 to 1, default 0.5
} ReachOptions;
ReachOptions reach_default_options(void);

typedef struct ReachStop {   // a link at which the flood REACH_ASIDE ends
    int node;                // the link leads from this node's parent to this node; the root: the inlet itself is blocked
    bool capped;             // the field is below 0 somewhere on the link's line; if false, the lumen is narrower than the tool
    bool apart;
    double clearance;        // [mm] least clearance on the line, at most four tool radii; < 0 if capped: minus the distance to lumen
    Vec3 place;              // location of the least clearance
    double lost;             // [mm] length of centreline beyond it that the tool does not reach, including the rest of the link
} ReachStop;
typedef struct ReachJunction {   // where a branch leaves another
    int parent, node;        // the node from which a branch springs, and the first node of the branch
    int last;                // the joining line continues to this node of the branch, clear of the parent's wall
    bool apart;
    double clearance;        // [mm] least clearance on the joining line, as above; at most the greater of the branch's first radius and twice the tool's radius
    Vec3 place;
} ReachJunction;

typedef struct Reach {
    ReachOptions options;
    int node_count;
    double length;           // [mm] of the vessels' centrelines, without apart links
    double reached[REACH_MODES];             // [mm] of `length` that each flood reaches
    float (*share)[REACH_MODES];             // (N) fraction of the link to node i that is reached, 0 to 1; the root: 1 if the inlet is open
    int stop_count;
    ReachStop *stop;         // ordered by `lost`, largest first
    int junction_count;
    ReachJunction *junction; // ordered by clearance, least first
    int capped, capped_apart;                // junctions with the field below 0 somewhere on the joining line; of these, those whose link is apart
    int narrow, narrow_apart;                // junctions with a clearance below the tool's radius, including the capped ones; of these, those whose link is
                                             // apart
    int apart_links, apart_open;             // links that are apart; of these, those with lumen all along, although no data show it
    double apart_length;     // [mm] of centreline beyond them
    int sac_nodes, sac_nodes_reached;        // nodes of aneurysms; of these, those that a point reaches
} Reach;

// Nodes are those of model->tree. Returns NULL if there is no model, if an option is out of range, or if out of memory. Takes about 0.1 ms of one core per node.
Reach *reach_create(const ModelField *model, const ReachOptions *options);
void reach_free(Reach *reach);

// The field at x for a tool point that comes from `node`, > 0 in the lumen; sets `node` to the node whose field it is.
double reach_field(const ModelField *model, Vec3 x, int *node);
static inline double reach_blob_field(const VesselTree *tree, Vec3 x, int *node)
{
    ModelField blobs = model_field_of_blobs(tree);
    return reach_field(&blobs, x, node);
}
// [mm] distance from x to the wall, > 0 inside, as met by a tool from `node`; limited to -most … most.
double reach_clearance(const ModelField *model, Vec3 x, int node, double most);
// The least clearance [mm] in model `in` along a junction's joining line in the nodes `of` of another model of the same vessels; at most `most`; its location in *place.
double reach_on_line(const VesselTree *of, const ReachJunction *junction, const ModelField *in, double most, Vec3 *place);
static inline bool reach_link_is_apart(const VesselTree *tree, int node)
{
    int parent = tree->parent[node];
    return parent >= 0 && tree->kind[node] == NODE_VESSEL && tree->kind[parent] == NODE_VESSEL &&
           vec3_distance(tree->center[node], tree->center[parent]) > tree->radius[node] + tree->radius[parent];
}

#endif
