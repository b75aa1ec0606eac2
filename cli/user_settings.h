// The user's settings and device maps, for the verbs that open a window.
#ifndef SELDINGER_CLI_USER_SETTINGS_H
#define SELDINGER_CLI_USER_SETTINGS_H

#include "input/input.h"

// Loads the user's language and settings and puts them in force for the windows that open afterwards. Faults are printed to standard error, and the rest applies.
#ifdef SELDINGER_RENDER
void cli_use_settings(void);
#else
static inline void cli_use_settings(void) {}
#endif
// Loads the user's own device maps (input/own_maps.h), at most `most`, and returns their number. Files with faults are named on standard error and left
// out.
int cli_own_maps(DeviceMap **map, int most);

#endif
