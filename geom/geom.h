// geom: shapes. Vectors, vessel trees, blobby fields, triangle meshes, and the one interface through which the solver sees a vessel (vessel.h).
// Uses base only; sees no file, device, clock or OpenGL. Lengths mm, angles rad.
#ifndef SELDINGER_GEOM_GEOM_H
#define SELDINGER_GEOM_GEOM_H

#include "geom/linear.h"
#include "geom/similarity.h"
#include "geom/random.h"

// trees of nodes, with or without a model of the wall
#include "geom/vessel_tree.h"
#include "geom/blobby.h"
#include "geom/blob_flood.h"
#include "geom/power_blocks.h"
#include "geom/power_walk.h"

// the swept model: branches with cross-sections along them
#include "geom/sweep_model.h"
#include "geom/stretch_list.h"
#include "geom/sweep_terms.h"
#include "geom/sweep_field.h"
#include "geom/sweep_contour.h"
#include "geom/sweep_section.h"

// vessels: the wall as the solver queries it
#include "geom/vessel.h"
#include "geom/grid_vessel.h"
#include "geom/mesh_vessel.h"
#include "geom/sweep_vessel.h"
#include "geom/tube_mesh.h"

// the wall of any model, as seen from a node
#include "geom/model_field.h"

// surfaces as triangles
#include "geom/isosurface.h"
#include "geom/tree_surface.h"
#include "geom/sweep_mesh.h"
#include "geom/model_mesh.h"
#include "geom/mesh_closure.h"
#include "geom/mesh_decimate.h"
#include "geom/morton_order.h"
#include "geom/surface_parts.h"

// what a tool can reach, and likely defects of the model
#include "geom/ghost_lumens.h"
#include "geom/reach.h"
#include "geom/vessel_branches.h"
#include "geom/vessel_findings.h"

// swept models
#include "geom/section.h"
#include "geom/section_row.h"

#endif
