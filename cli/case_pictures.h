// Draws the missing small pictures of cases (render/case_picture.h) in a process of low priority, so that nothing that it does can hold up or end the window.
#ifndef SELDINGER_CLI_CASE_PICTURES_H
#define SELDINGER_CLI_CASE_PICTURES_H

#include "sim/sim.h"

#include <sys/types.h>

// Call before the first window: a process with a window and its threads cannot be copied. Returns 0 if no process was started.
pid_t case_pictures_begin(const Shelf *shelf);
// Stops or continues the work, so that it does not disturb a session.
void case_pictures_pause(pid_t worker, bool is_paused);
void case_pictures_end(pid_t worker);

#endif
