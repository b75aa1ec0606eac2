// A session that was cut off (the program was killed, the power failed): its recording is whole up to the last flush and says who practised and when; the
// session file, with the score, is made by simulating it again.
#ifndef SELDINGER_CLI_RECOVER_H
#define SELDINGER_CLI_RECOVER_H

#include "base/faults.h"

#include <stdbool.h>

// Writes the session file beside a recording. `progress` (may be NULL) is called with the part that is done, now and then. False with faults: also where
// this program comes to other states than the recording holds.
bool recover_session(const char *recording, void (*progress)(void *context, double part), void *context, Faults *faults);

#endif
