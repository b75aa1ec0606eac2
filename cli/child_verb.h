// Runs a verb of this program in a process of its own: a window at a time, and what goes wrong in one does not end the other.
#ifndef SELDINGER_CLI_CHILD_VERB_H
#define SELDINGER_CLI_CHILD_VERB_H

#include "render/render.h"

enum { CHILD_MESSAGE = 600 };

// Runs a verb for state->path, until it ends. Its last messages, or how it ended, go to `message`. Returns false if a signal ended it, as the user ends a program.
bool child_verb_run(const char *verb, const StartState *state, char message[CHILD_MESSAGE]);

#endif
