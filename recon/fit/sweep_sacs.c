// A sac's own tree: its nodes with their points, and for each link to a vessel a stub without points, so that the neck opens into the lumen. A stub is thin: at
// the vessel's far wall the sac's field has to be lower than the vessel's by twice the blend's width, or the blend would widen the vessel there.
#include "recon/fit/sweep_sacs.h"

#include "recon/fit/field_fit.h"

#include <stdlib.h>
#include <string.h>

static const double THIN = 0.4, THICK = 0.8;     // [the vessel's radii] of a stub; thicker than THIN only where the link would not be lumen otherwise

typedef struct Extract {
    const VesselTree *tree;
    VesselTree *sac;
    int32_t *node;           // (sac's nodes) node of the tree
    int *at;                 // (N) node of the sac's tree, -1: none
    int count;
    int64_t points;
} Extract;

static bool is_sac(const VesselTree *tree, int node) { return node >= 0 && tree->kind[node] == NODE_ANEURYSM; }

static int add_node(Extract *e, int node, int parent)
{
    const VesselTree *tree = e->tree;
    SEL_ASSERT(parent < e->count, "parents come before children");
    int at = e->count++;
    e->sac->center[at] = tree->center[node];
    e->sac->radius[at] = tree->radius[node];
    e->sac->direction[at] = tree->direction[node];
    e->sac->height[at] = tree->height[node];
    e->sac->kind[at] = tree->kind[node];
    e->sac->parent[at] = parent;
    e->node[at] = node;
    return at;
}

static void add_stub(Extract *e, int vessel, int sac, int parent)
{
    double r = e->tree->radius[vessel], needed = 1.01 * vec3_distance(e->tree->center[vessel], e->tree->center[sac]) / 1.5 - e->tree->radius[sac];
    int at = add_node(e, vessel, parent);
    e->sac->radius[at] = fmax(THIN * r, fmin(THICK * r, needed));
    e->sac->point_offset[at + 1] = e->points;
}

static void extract(Extract *e)
{
    const VesselTree *tree = e->tree;
    for (int i = 0; i < tree->node_count; i++) {
        int parent = tree->parent[i];
        if (is_sac(tree, i)) {
            if (!is_sac(tree, parent)) {
                add_stub(e, parent, i, e->count > 0 ? 0 : -1);
                e->at[i] = add_node(e, i, e->count - 1);
            } else {
                e->at[i] = add_node(e, i, e->at[parent]);
            }
            size_t points = (size_t)(tree->point_offset[i + 1] - tree->point_offset[i]);
            memcpy(e->sac->point + e->points, tree->point + tree->point_offset[i], points * sizeof(Vec3));
            e->points += (int64_t)points;
            e->sac->point_offset[e->at[i] + 1] = e->points;
        } else if (is_sac(tree, parent)) {
            add_stub(e, i, parent, e->at[parent]);
        }
    }
}

static VesselTree *fit_blobs(const VesselTree *sac, const SweepFitOptions *options, Faults *faults)
{
    FieldFitOptions blobs = field_fit_default_options();
    blobs.voxel_mm = options->voxel_mm;
    blobs.threads = options->threads;
    return field_fit(sac, &blobs, NULL, faults);
}

bool sweep_sacs_fit(const VesselTree *tree, const SweepFitOptions *options, SweepModel *model, Faults *faults)
{
    int nodes = 0;
    int64_t points = 0;
    for (int i = 0; i < tree->node_count; i++) {
        bool own = is_sac(tree, i);
        nodes += own + (own != is_sac(tree, tree->parent[i]) && i > 0);
        points += own ? tree->point_offset[i + 1] - tree->point_offset[i] : 0;
    }
    if (points < 4)
        return true;
    Extract e = {.tree = tree,
                 .sac = vessel_tree_create(nodes, points, 0),
                 .node = malloc((size_t)nodes * sizeof *e.node),
                 .at = malloc((size_t)tree->node_count * sizeof *e.at)};
    bool good = e.sac && e.node && e.at;
    if (good) {
        extract(&e);
        SEL_ASSERT(e.count == nodes && e.points == points, "all nodes of sacs and their links were counted");
        good = vessel_tree_link(e.sac);
    }
    if (!good)
        faults_add(faults, "fit", 0, 0, "not enough memory for the sacs");
    else
        good = (model->sac = fit_blobs(e.sac, options, faults)) != NULL;
    vessel_tree_free(e.sac);
    free(e.at);
    if (good) {
        model->sac_node = e.node;
        model->sac->point_count = 0;         // they are the tree's
        memset(model->sac->point_offset, 0, ((size_t)nodes + 1) * sizeof *model->sac->point_offset);
        memset(model->sac->error, 0, (size_t)nodes * sizeof *model->sac->error);
        for (int i = 0; i < nodes; i++)      // the blend's width goes by the vessel's radius
            model->sac->radius[i] = tree->radius[e.node[i]];
        if (!vessel_tree_link(model->sac)) {
            faults_add(faults, "fit", 0, 0, "not enough memory for the sacs");
            good = false;
        }
    } else {
        free(e.node);
    }
    return good;
}
