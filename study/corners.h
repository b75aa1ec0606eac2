// Tries a study's scenes at the ends of its ranges before any run, so that values which cannot be simulated are refused at their place in the specification.
#ifndef SELDINGER_STUDY_CORNERS_H
#define SELDINGER_STUDY_CORNERS_H

#include "study/open_study.h"

// Reads the scenes with both ends of each range and each listed value: in all combinations if there are at most CORNERS_MOST, else so that each value and each
// pair of ends occurs. Adds a fault for each value, or set of keys, that the scene refuses. `seen` gets each scene that is valid.
enum { CORNERS_MOST = 1000 };
void corners_try(OpenStudy *open, void (*seen)(OpenStudy *open, const Scene *scene), Faults *faults);

#endif
