// The open vessels of all scenes of the process: a vessel that is opened again is shared, as it does not change. Thread-safe.
#ifndef SELDINGER_SIM_LIBRARY_VESSEL_CACHE_H
#define SELDINGER_SIM_LIBRARY_VESSEL_CACHE_H

#include "sim/open_vessel.h"

typedef struct SharedVessel SharedVessel;

// Opens the scene's vessel, or shares an open one: of the same shape with the same options, or of a model or mesh file that has not changed since (device,
// number, size and times), for the same contact. Returns NULL with faults. Other vessels are opened each time.
SharedVessel *vessel_cache_open(const Scene *scene, const OpenVesselOptions *options, Faults *faults);
const OpenVessel *shared_vessel(const SharedVessel *shared);
// The last few that no scene needs stay open. NULL is allowed.
void vessel_cache_release(SharedVessel *shared);

#endif
