// The open vessels of all scenes of the process: a vessel that is opened again is shared, as it does not change. Thread-safe.
#ifndef SELDINGER_SIM_VESSEL_CACHE_H
#define SELDINGER_SIM_VESSEL_CACHE_H

#include "sim/open_vessel.h"

typedef struct SharedVessel SharedVessel;

// Opens the scene's vessel, or shares an open one that was opened from the same keys of a scene and from files that have not changed since (device, number, size
// and times). Returns NULL with faults. Whoever reads other files meanwhile must exclude this call: the HDF5 library may be used by one thread at a time.
SharedVessel *vessel_cache_open(const Scene *scene, const OpenVesselOptions *options, Faults *faults);
const OpenVessel *shared_vessel(const SharedVessel *shared);
// Of the vessels that no scene needs, the `idle_most` used last stay open; tubes and planes only if they were fitted. NULL is allowed.
void vessel_cache_release(SharedVessel *shared, int idle_most);
// Closes all vessels that no scene needs.
void vessel_cache_forget(void);

#endif
