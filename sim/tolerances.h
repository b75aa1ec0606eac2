// The tolerances of `seldinger check`: how far a run may be from a golden run, by quantity. The key `check:` of a scene and files of --tolerances hold them:
//
//   position_mm: 1e-4
//   push_n: 0.01
//
// Absolute, in the unit of the name; each from 0 (the printed digits are the same) to its largest valid value.
#ifndef SELDINGER_SIM_TOLERANCES_H
#define SELDINGER_SIM_TOLERANCES_H

#include "base/base.h"

typedef enum {
    TOLERANCE_POSITION,
    TOLERANCE_INSERTED,
    TOLERANCE_PUSH,
    TOLERANCE_TORQUE,
    TOLERANCE_CONTACTS,
    TOLERANCE_WALL_FORCE,
    TOLERANCE_PENETRATION,
    TOLERANCE_TARGET_TIME,
    TOLERANCE_COUNT
} ToleranceQuantity;

typedef struct ToleranceInfo {
    const char *name;        // as written in files, with its unit
    const char *what;        // for readers
    double usual, most;      // default; largest valid value
} ToleranceInfo;
extern const ToleranceInfo tolerance_info[TOLERANCE_COUNT];

typedef struct Tolerances {
    bool given[TOLERANCE_COUNT];
    double value[TOLERANCE_COUNT];   // of those that are given
} Tolerances;

// Reads a map with some of the quantities. Faults have file, line and the valid range.
void tolerances_read(YamlValue value, Tolerances *tolerances);
// The same from a file that holds only this map. False with faults.
bool tolerances_load(const char *path, Tolerances *tolerances, Faults *faults);
// The tolerances under the key `check:` of a scene that was read without faults.
Tolerances tolerances_of_scene(const char *text);
// Fills what `strong` does not give from `weak`.
Tolerances tolerances_over(const Tolerances *strong, const Tolerances *weak);
// The value that is given, else the default.
double tolerance_of(const Tolerances *tolerances, ToleranceQuantity quantity);

#endif
