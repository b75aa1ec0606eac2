// Puts the user's settings in force: keys, speeds, size of letters.
#ifndef SELDINGER_RENDER_SETTINGS_IN_FORCE_H
#define SELDINGER_RENDER_SETTINGS_IN_FORCE_H

#include "render/settings.h"

// For all windows of this process. Call before a window opens, or from the thread of the windows.
void settings_put_in_force(const Settings *settings);

#endif
