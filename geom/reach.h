// Which part of a fitted tree a tool can reach from its inlet, asked of the field alone: along the centreline's links, from the root on.
//
// Three floods. Point: the field is above 0 all along the line. Tool: a ball of the tool's radius is free all along the line. Aside: the ball may leave the
// line, by up to `aside` of the lesser radius of the link's two nodes. Each place is answered by the node to which a tool point there walks
// (power_walk.h), so vessels that kiss do not open each other. Beyond the plane of an open root the lumen goes on.
//
// A link longer than the sum of its nodes' radii is no lumen: nothing shows a vessel there ("apart"). It counts in no length; what hangs behind it does.
#ifndef SELDINGER_GEOM_REACH_H
#define SELDINGER_GEOM_REACH_H

#include "geom/vessel_tree.h"

typedef enum { REACH_POINT, REACH_TOOL, REACH_ASIDE, REACH_MODES } ReachMode;

typedef struct ReachOptions {
    double tool_radius;      // [mm] > 0, default 0.18
    double aside;            // of the lesser radius of a link's nodes, 0 to 1, default 0.5
} ReachOptions;
ReachOptions reach_default_options(void);

typedef struct ReachStop {   // a link on which the flood aside ends
    int node;                // the link leads from this node's parent to it; the root: the inlet itself is shut
    bool capped;             // the field is below 0 on its line; otherwise the lumen is narrower than the tool
    bool apart;
    double clearance;        // [mm] least on the line, < 0 where capped (how far it is to lumen); at most four tool radii
    Vec3 place;              // where that is
    double lost;             // [mm] of centreline behind it that the tool does not reach, the rest of the link included
} ReachStop;
typedef struct ReachJunction {   // where a branch leaves another
    int parent, node;        // a branch's first node, and the node that it springs from
    int last;                // the joining line goes on to this node of the branch, clear of the parent's wall
    bool apart;
    double clearance;        // [mm] least on the joining line, as above: at most the greater of the branch's first radius and twice the tool's
    Vec3 place;
} ReachJunction;

typedef struct Reach {
    ReachOptions options;
    int node_count;
    double length;           // [mm] of vessels' centrelines without links apart
    double reached[REACH_MODES];             // [mm] of it
    float (*share)[REACH_MODES];             // (N) part of the link to node i that is reached, 0 to 1; the root: 1 where the inlet is open
    int stop_count;
    ReachStop *stop;         // most lost first
    int junction_count;
    ReachJunction *junction; // least clearance first
    int capped, capped_apart;                // junctions with the field below 0 somewhere on the joining line; those whose link is apart
    int narrow, narrow_apart;                // with a clearance less than the tool's radius, capped ones included; those whose link is apart
    int apart_links, apart_open;             // and those of them with lumen all along, which nothing shows
    double apart_length;     // [mm] of what hangs behind them
    int sac_nodes, sac_nodes_reached;        // nodes of aneurysms; by a point
} Reach;

// NULL where the tree has no model, an option is out of range, or there is no memory. Costs some 0.1 ms of one core a node.
Reach *reach_create(const VesselTree *tree, const ReachOptions *options);
void reach_free(Reach *reach);

// What the field says at x for a tool point that comes from `node`; moves `node` on to the one that answers. > 0 in the lumen.
double reach_field(const VesselTree *tree, Vec3 x, int *node);
// [mm] distance from x to the wall as a tool from `node` meets it, > 0 inside; no more than `most`, no less than -most.
double reach_clearance(const VesselTree *tree, Vec3 x, int node, double most);
// The least clearance [mm] along a junction's joining line, a line of the tree `of`, in another model of the same vessels; at most `most`, at `place`.
double reach_on_line(const VesselTree *of, const ReachJunction *junction, const VesselTree *in, double most, Vec3 *place);
static inline bool reach_link_is_apart(const VesselTree *tree, int node)
{
    int parent = tree->parent[node];
    return parent >= 0 && tree->kind[node] == NODE_VESSEL && tree->kind[parent] == NODE_VESSEL &&
           vec3_distance(tree->center[node], tree->center[parent]) > tree->radius[node] + tree->radius[parent];
}

#endif
