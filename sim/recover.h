// A session that was cut off (the program was killed, the power failed): its recording is whole up to the last flush and says who practised and when; the
// session file, with the score, is made by simulating it again.
#ifndef SELDINGER_SIM_RECOVER_H
#define SELDINGER_SIM_RECOVER_H

#include "sim/open_vessel.h"

// Writes the session file beside a recording. `options`: how its vessel is opened. `progress` (may be NULL) is called with the part that is done, now and then. False with faults: also where
// this program comes to other states than the recording holds.
bool recover_session(const char *recording, const OpenVesselOptions *options, void (*progress)(void *context, double part), void *context, Faults *faults);

#endif
