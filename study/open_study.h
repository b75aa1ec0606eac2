// A specification with the scenes and files that it needs, read and checked once: what the runs of a process share.
#ifndef SELDINGER_STUDY_OPEN_STUDY_H
#define SELDINGER_STUDY_OPEN_STUDY_H

#include "sim/sim.h"
#include "study/spec.h"

#include <cJSON.h>
#include <pthread.h>

enum { IDLE_VESSELS_MOST = 16 };         // kept open while no run needs them

typedef struct OpenStudy {
    const Study *study;      // must outlive this
    int scene_count;
    char **scene_path, **scene_text;     // (scene_count)
    pthread_mutex_t files;   // held by whoever uses the HDF5 library: a vessel is opened, a recording is written
    cJSON *inputs;           // path and SHA-256 of each file that the runs depend on, in the order in which they were met
} OpenStudy;

// Reads the scenes and tries the ends of the ranges and the listed values in them (corners.h), so that one pass reports what is wrong, at its place in the
// specification. NULL with faults.
OpenStudy *open_study(const Study *study, Faults *faults);
void open_study_close(OpenStudy *open);      // NULL is allowed
// The text of one of its scenes; NULL if it is none of them.
const char *open_study_scene_text(const OpenStudy *open, const char *path);

// The open vessel of a run's scene; vessel_cache_release() when the run is over. NULL with faults. Thread-safe.
SharedVessel *open_study_vessel(OpenStudy *open, const Scene *scene, Faults *faults);

// What the results are of, the first line of the journal: program, version, specification and files by their checksums. The caller deletes it.
cJSON *open_study_heading(const OpenStudy *open);

#endif
