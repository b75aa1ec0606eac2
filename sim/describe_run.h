// Figures of a recording, a scene or a script as JSON, for `info`.
#ifndef SELDINGER_SIM_DESCRIBE_RUN_H
#define SELDINGER_SIM_DESCRIBE_RUN_H

#include "base/base.h"

#include <cJSON.h>

// Adds the figures of a file to `object`; returns false with faults.
bool describe_recording(cJSON *object, const char *path, Faults *faults);
bool describe_scene(cJSON *object, const char *path, Faults *faults);
bool describe_script(cJSON *object, const char *path, Faults *faults);

#endif
