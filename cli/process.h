// How a program of ours begins and ends: its streams, stack and signals, and what it leaves behind when it is stopped.
#ifndef SELDINGER_CLI_PROCESS_H
#define SELDINGER_CLI_PROCESS_H

#include <stdbool.h>
#include <stddef.h>

// From main(): sets the process up, calls `call` and returns its exit code. EXIT_BAD_INPUT where the stack is too small.
int process_run(int argc, char **argv, int (*call)(int argc, char **argv));
// The handler of a signal that ends the program: no unfinished file is left.
void process_stop(int signal_number);
// The path of the program `name` in this program's own folder, there or not. False where this program's path cannot be had or is too long.
bool process_beside(const char *name, char *path, size_t capacity);

#endif
