// Contact with a field of shared blobs: topological tracking by power distance, and the closest point of the wall of the blobs that the node sees.
#include "geom/blobby.h"
#include "geom/power_blocks.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"

#include <limits.h>
#include <stdlib.h>

typedef struct FieldVessel {
    Vessel vessel;           // first: a Vessel * to us is a FieldVessel *
    const VesselTree *tree;
    PowerBlocks blocks;      // for points without a node
} FieldVessel;

static int walk(const FieldVessel *field, Vec3 x, int from, int hops)
{
    bool known = from >= 0 && from < field->tree->node_count;
    return known ? power_walk(field->tree, x, from, hops) : power_blocks_nearest(&field->blocks, x);
}

static void field_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    const FieldVessel *field = (const FieldVessel *)vessel;
    (void)reach;
    for (int i = 0; i < count; i++) {
        int node = memory[i].node = walk(field, point[i], memory[i].node, 4);
        Blobby model = blobby_of(field->tree, node);
        SurfacePoint s = blobby_project(&model, point[i], memory[i].has_foot ? memory[i].foot : point[i]);
        if (memory[i].has_foot && (s.distance > 0) != (blobby_field(&model, point[i]) > 0))
            s = blobby_project(&model, point[i], point[i]);
        double gap = s.distance;
        hit[i] = (VesselHit){.gap = gap, .normal = s.normal, .hessian = s.shape, .node = node, .flags = s.converged ? 0 : VESSEL_UNSURE};
        memory[i].has_foot = s.converged;
        memory[i].foot = s.foot;
    }
}

static int field_locate(const Vessel *vessel, Vec3 point, int from) { return walk((const FieldVessel *)vessel, point, from, INT_MAX); }

static bool field_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const FieldVessel *field = (const FieldVessel *)vessel;
    *point = field->tree->center[0];
    *direction = field->tree->direction[0];
    return true;
}

static void field_destroy(Vessel *vessel)
{
    FieldVessel *field = (FieldVessel *)vessel;
    if (!field)
        return;
    power_blocks_free(&field->blocks);
    free(field);
}

Vessel *field_vessel_create(const VesselTree *tree)
{
    FieldVessel *field = tree && vessel_tree_is_shared(tree) && vessel_tree_is_model(tree) ? calloc(1, sizeof *field) : NULL;
    if (!field)
        return NULL;
    field->vessel = (Vessel){.kind = "field", .query = field_query, .locate = field_locate, .inlet = field_inlet, .destroy = field_destroy,
                             .primitives = tree->blob_count};
    field->tree = tree;
    if (!power_blocks_create(&field->blocks, tree)) {
        field_destroy(&field->vessel);
        return NULL;
    }
    return &field->vessel;
}

Vessel *model_vessel_create(const VesselTree *tree)
{
    return tree && vessel_tree_is_shared(tree) ? field_vessel_create(tree) : lim_vessel_create(tree);
}
