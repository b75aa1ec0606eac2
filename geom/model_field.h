// The wall of a model as it is seen from a node, for reports, figures and pictures, whatever the model is made of: local models or shared blobs, which are seen
// from the nodes of their tree, or curves with sections (sweep_model.h). (Contact has vessel.h.)
//
// A swept model is seen from nodes of its own, because edits draw and cut branches, of which the file's tree knows nothing: along each branch's curve 0.75 mean
// radii apart, linked at the forks of the model, and the nodes of its sacs. Each of the file's data points belongs to the one of these nodes to which it walks.
// So all that works on a tree (power_walk.h, vessel_branches.h, reach.h) works on either kind. Lengths mm.
#ifndef SELDINGER_GEOM_MODEL_FIELD_H
#define SELDINGER_GEOM_MODEL_FIELD_H

#include "geom/blobby.h"
#include "geom/sweep_field.h"
#include "geom/vessel.h"

typedef struct ModelField {
    const VesselTree *tree;          // the nodes (N); `error` is the 90th percentile of the distance of their points
    const SweepModel *swept;         // NULL: the tree's blobs, and all below is NULL
    SweepField *field;
    VesselTree *own;         // `tree` of a swept model
    SweepPlace *place;       // (N)
    int32_t *file_node;      // (N) the node of the file's tree that is nearest along the branch
    int *first_node;         // (branches + 1) nodes of the branches, in the order of t; then those of the sacs
    int64_t left_out;        // points that belong to no node, or lie further than half a radius from the wall: another vessel's, or outliers
} ModelField;

// Borrows the tree. Needs no model_field_free.
static inline ModelField model_field_of_blobs(const VesselTree *tree) { return (ModelField){.tree = tree}; }
// `tree`: that of the file, borrowed only during the call; the model is borrowed until model_field_free. Returns false if out of memory.
bool model_field_of_sweep(const VesselTree *tree, const SweepModel *model, ModelField *out);
void model_field_free(ModelField *field);

// Whether there is a wall at all: a swept model or blobs.
static inline bool model_field_exists(const ModelField *m) { return m->swept || (m->tree && vessel_tree_is_model(m->tree)); }
// The number of a node in the model's file, for people.
static inline int model_field_file_node(const ModelField *m, int node) { return m->swept && node >= 0 ? m->file_node[node] : node; }
// The node at t on a branch of the swept model, or of a node of its sacs (branch -1).
int model_field_node_at(const ModelField *field, SweepPlace place);
// Whether the root is an open end at which the field closes, so that the lumen upstream of it is that of its plane. (A swept model's field continues there.)
static inline bool model_field_closes_root(const ModelField *m) { return !m->swept && vessel_tree_root_is_open(m->tree); }

// The field at x as seen from a node, > 0 inside; only near the wall is it nearly a distance. `gradient` may be NULL.
double model_field_at(const ModelField *field, int node, Vec3 x, Vec3 *gradient);
// f / |grad f| [mm]: near the wall the signed distance (Taubin). NAN if the node sees no wall.
double model_field_distance(const ModelField *field, int node, Vec3 x);
// The point of the wall closest to x, as seen from a node. `start` as in blobby_project.
SurfacePoint model_field_project(const ModelField *field, int node, Vec3 x, Vec3 start);
// Contact with the model. Borrows it. The `node` of a query's memory is that of the file. NULL if out of memory, or if there is no wall.
Vessel *model_field_vessel(const ModelField *field);

#endif
