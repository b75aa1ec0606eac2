#define _GNU_SOURCE
#include "cli/child_verb.h"

#include "base/base.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

// In the child: its messages go to `output` too; it ends with this program.
static void become(char *const *arguments, int output)
{
    char program[PATH_MAX];
    if (process_code_file(program, sizeof program) && prctl(PR_SET_PDEATHSIG, SIGTERM) == 0 && dup2(output, STDERR_FILENO) >= 0)
        execv(program, arguments);
    _exit(127);
}

// Reads what the child says, passes it on, and keeps the end of it.
static void listen(int input, char message[CHILD_MESSAGE])
{
    char bytes[256];
    size_t used = 0;
    for (ssize_t count; (count = read(input, bytes, sizeof bytes)) > 0 || (count < 0 && errno == EINTR);) {
        if (count < 0)
            continue;
        fwrite(bytes, 1, (size_t)count, stderr);
        size_t kept = used + (size_t)count < CHILD_MESSAGE ? used : CHILD_MESSAGE - 1 - (size_t)count;
        memmove(message, message + used - kept, kept);
        memcpy(message + kept, bytes, (size_t)count);
        used = kept + (size_t)count;
    }
    message[used] = 0;
}

bool child_verb_run(const char *verb, const StartState *state, char message[CHILD_MESSAGE])
{
    char *arguments[7] = {(char *)(size_t) "seldinger", (char *)(size_t)verb, (char *)(size_t)state->path};
    int pipes[2], status = 0, count = 3;
    const bool steers = !strcmp(verb, "nav") || !strcmp(verb, "case");
    message[0] = 0;
    if (steers && state->trainee[0])
        arguments[count++] = (char *)(size_t) "--trainee", arguments[count++] = (char *)(size_t)state->trainee;
    if (steers && state->is_examination)
        arguments[count++] = (char *)(size_t) "--examination";
    if (pipe2(pipes, O_CLOEXEC) != 0)
        return false;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0)
        become(arguments, pipes[1]);
    close(pipes[1]);
    if (child > 0) {
        listen(pipes[0], message);
        while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
        }
    }
    close(pipes[0]);
    if (child < 0 || (WIFEXITED(status) && WEXITSTATUS(status) == 127)) {
        snprintf(message, CHILD_MESSAGE, "%s could not be started: the program's file was removed or replaced, or there is not enough memory", verb);
        fprintf(stderr, "seldinger: %s\n", message);
    } else if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_DONE && !message[0] && !strcmp(verb, "report")) {
        const char *dot = strrchr(state->path, '.');
        const int stem = dot ? (int)(dot - state->path) : (int)strlen(state->path);
        snprintf(message, CHILD_MESSAGE, "The report: %.*s.html", stem < 400 ? stem : 400, state->path);
    }
    return child < 0 || WIFEXITED(status);
}
