// Options of the swept model's mesh (sweep_mesh.h).
#ifndef SELDINGER_GEOM_SWEEP_MESH_OPTIONS_H
#define SELDINGER_GEOM_SWEEP_MESH_OPTIONS_H

#include <stdbool.h>

typedef struct SweepMeshOptions {
    int around;              // edges around a section, 6 … 256, default 24: edges are about a quarter of the local radius
    double edge_mm;          // > 0: length of all edges instead (at least 6 around a section); default 0
    bool flat_ends;          // branches end flat at their last section instead of with a dome; default false
    int isa;                 // as LimVesselOptions.isa; default 0
} SweepMeshOptions;

#endif
