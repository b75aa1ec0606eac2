// seldinger without arguments: the start window.
#ifndef SELDINGER_CLI_START_H
#define SELDINGER_CLI_START_H

#include <stdbool.h>

bool start_is_possible(void);        // there is a display
// Shows the start window, runs the verb for each choice in a process of its own, and shows the window again, until the user leaves. Returns an exit code.
int start_run(void);

#endif
