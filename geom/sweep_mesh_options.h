// Options of the mesh of a swept model, for sweep_mesh.h and its parts.
#ifndef SELDINGER_GEOM_SWEEP_MESH_OPTIONS_H
#define SELDINGER_GEOM_SWEEP_MESH_OPTIONS_H

#include "geom/sweep_field.h"

typedef struct SweepMeshOptions {
    int around;              // edges around a section, 6 … 256, default 24: edges are about a quarter of the local radius
    double edge_mm;          // > 0: length of all edges instead (at least 6 around a section); default 0
    bool flat_ends;          // branches end flat at their last section instead of with a dome; default false
    int isa;                 // as LimVesselOptions.isa; default 0
} SweepMeshOptions;

// Whether the sections of a segment may carry rings: each ray from the curve meets the contour once.
bool sweep_mesh_carries_rings(const SweepField *field, int segment);

#endif
