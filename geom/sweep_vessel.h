// Contact with a swept model (sweep_model.h): the closest point of its wall.
#ifndef SELDINGER_GEOM_SWEEP_VESSEL_H
#define SELDINGER_GEOM_SWEEP_VESSEL_H

#include "geom/sweep_model.h"
#include "geom/vessel.h"

// Borrows the model, which is valid (sweep_model_validate) and must outlive the vessel unchanged. A hit's node is the knot_node (or sac_node) nearest to the
// foot. Upstream of the first branch's open start the wall continues as a cylinder (VESSEL_BEYOND). Returns NULL if out of memory.
Vessel *sweep_vessel_create(const SweepModel *model);
// isa: as LimVesselOptions.isa.
Vessel *sweep_vessel_create_with(const SweepModel *model, int isa);

#endif
