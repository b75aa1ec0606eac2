// Start and end of the programs of this project: streams, stack, signals, and removal of unfinished files.
#ifndef SELDINGER_BASE_PROCESS_H
#define SELDINGER_BASE_PROCESS_H

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>

// Exit codes. EXIT_UNTRUSTED: the result of the simulation cannot be trusted.
enum { EXIT_DONE = 0, EXIT_DIFFERENT = 1, EXIT_BAD_INPUT = 2, EXIT_UNTRUSTED = 3 };

// Called from main(): sets the process up, runs `call` and returns its exit code. Returns EXIT_BAD_INPUT if the stack limit is too low.
int process_run(int argc, char **argv, int (*call)(int argc, char **argv));
// Handler of terminating signals: removes unfinished files, then ends the process by the same signal.
void process_stop(int signal_number);
// From now on SIGINT and SIGTERM request an orderly end: the returned flag becomes 1. A second signal calls process_stop().
const volatile sig_atomic_t *process_stop_in_order(void);
// For a child process that reads input that may crash it: silences standard error, forbids writing files and core dumps, and ends the child by a signal after
// this much
// processor time or wall-clock time [s].
void process_be_expendable(unsigned processor_s, unsigned wall_s);
// The path of the program `name` in the folder of the running program, whether it exists or not. If it is not there and this code is in a library: in the
// folder `bin`
// beside the library's folder or beside its parent. False if the path of the running program is unknown or the result is too long.
bool process_beside(const char *name, char *path, size_t capacity);
// The folder `name` of scenes/ that belongs to the running program: in the source tree around its build folder, or where the package puts it. False if there is
// none. `path` has PATH_MAX characters.
bool process_scenes(const char *name, char *path);
// The file that this code was loaded from: the program, or the library that contains it. False if unknown.
bool process_code_file(char *path, size_t capacity);
// Identifies the content of that file, in hexadecimal digits: its GNU build ID, or its SHA-256 if it was linked without one. False if unknown; `id` is then "".
enum { PROCESS_CODE_ID = 65 };
bool process_code_id(char id[PROCESS_CODE_ID]);

#endif
