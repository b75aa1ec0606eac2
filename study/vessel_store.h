// Open vessels, shared by the runs of a process: each is opened once and only read afterwards. Thread-safe.
#ifndef SELDINGER_STUDY_VESSEL_STORE_H
#define SELDINGER_STUDY_VESSEL_STORE_H

#include "sim/sim.h"

#include <pthread.h>

typedef struct VesselStore VesselStore;

// `files` is held while a vessel is opened, because the HDF5 library is not thread-safe. Never NULL.
VesselStore *vessel_store_create(pthread_mutex_t *files);
// The open vessel of a scene; `vessel_store_give` when the run is over. NULL with faults. At most 16 vessels that nobody uses are kept.
const OpenVessel *vessel_store_take(VesselStore *store, const Scene *scene, Faults *faults);
void vessel_store_give(VesselStore *store, const OpenVessel *open);
void vessel_store_free(VesselStore *store);      // NULL is allowed

#endif
