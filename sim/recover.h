// Recovers an interrupted session (the program was killed, the power failed): its recording is complete up to the last flush and stores trainee and
// date; the session file, with the score, is made by simulating it again.
#ifndef SELDINGER_SIM_RECOVER_H
#define SELDINGER_SIM_RECOVER_H

#include "sim/open_vessel.h"

// Writes the session file next to a recording. `options`: how its vessel is opened. `progress` (may be NULL) is called from time to time with the fraction
// done. Returns false with faults, also if this program does not reproduce the recorded states.
bool recover_session(const char *recording, const OpenVesselOptions *options, void (*progress)(void *context, double part), void *context, Faults *faults);

#endif
