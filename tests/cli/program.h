// Runs the program in the test's folder (tests/folder.h). Standard output and standard error go to `output`.
#ifndef SELDINGER_TESTS_CLI_PROGRAM_H
#define SELDINGER_TESTS_CLI_PROGRAM_H

#include <stdio.h>
#include <sys/wait.h>

static char output[1 << 16];

// Runs `BEFORE seldinger ARGUMENTS`. Returns the exit code, or -signal if a signal ended it.
static inline int run_in(const char *before, const char *arguments)
{
    char command[2000];
    snprintf(command, sizeof command, "cd '%s' && %s %s %s 2>&1", folder, before, SELDINGER_PROGRAM, arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t length = fread(output, 1, sizeof output - 1, pipe);
    output[length] = 0;
    int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

#endif
