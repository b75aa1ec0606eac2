// Tries a study's scenes at the ends of its ranges before any run, so that values which cannot be simulated are refused at their place in the specification.
#ifndef SELDINGER_STUDY_CORNERS_H
#define SELDINGER_STUDY_CORNERS_H

#include "sim/sim.h"
#include "study/spec.h"

enum { CORNERS_MOST = 1000 };

typedef struct CornerScenes {
    const Study *study;
    const char *(*text_of)(void *context, const char *path);       // of one of the study's scenes
    void (*seen)(void *context, const Scene *scene);               // gets each scene that is valid
    void *context;
} CornerScenes;

// Reads the scenes with both ends of each range and each listed value: in all combinations if there are at most CORNERS_MOST, else so that each value and each
// pair of ends occurs. Adds a fault for each value, or set of keys, that the scene refuses.
void corners_try(const CornerScenes *scenes, Faults *faults);

#endif
