// Start and end of our programs: streams, stack, signals, and removal of unfinished files.
#ifndef SELDINGER_BASE_PROCESS_H
#define SELDINGER_BASE_PROCESS_H

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>

// Exit codes. EXIT_UNTRUSTED: the simulation cannot be trusted.
enum { EXIT_DONE = 0, EXIT_DIFFERENT = 1, EXIT_BAD_INPUT = 2, EXIT_UNTRUSTED = 3 };

// From main(): sets the process up, calls `call` and returns its exit code. EXIT_BAD_INPUT if the stack is too small.
int process_run(int argc, char **argv, int (*call)(int argc, char **argv));
// Handler of terminating signals: removes unfinished files.
void process_stop(int signal_number);
// From now on SIGINT and SIGTERM ask the program to end in order: what is returned becomes 1. A second one is process_stop().
const volatile sig_atomic_t *process_stop_in_order(void);
// From a child process that reads what may break it: it says nothing on standard error, writes no file and no core, and ends by a signal after so much time.
void process_be_expendable(unsigned processor_s, unsigned wall_s);
// The path of the program `name` in this program's own folder, there or not; in a library, where it is not there, that in `bin` beside the library's folder or
// the one above it. False where this program's path cannot be had or is too long.
bool process_beside(const char *name, char *path, size_t capacity);
// The file that this code was loaded from: the program, or the library where it is one. False where that cannot be had.
bool process_code_file(char *path, size_t capacity);

#endif
