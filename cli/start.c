#define _GNU_SOURCE
#include "cli/start.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "render/render.h"
#include "sim/sim.h"

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

enum { MESSAGE = 600 };

bool start_is_possible(void)
{
    const char *x = getenv("DISPLAY"), *wayland = getenv("WAYLAND_DISPLAY");
    return (x && *x) || (wayland && *wayland);
}

// The exercises, beside the program in its build folder or where the package puts them; false if there are none.
static bool exercises_folder(char out[PATH_MAX])
{
    static const char *const places[] = {"../../scenes/exercises", "../share/seldinger/scenes/exercises"};
    char path[PATH_MAX];
    for (int i = 0; i < 2; i++)
        if (process_beside(places[i], path, sizeof path) && realpath(path, out))
            return true;
    return false;
}

// The file that keeps the last folder from one start to the next; NULL if there is no cache.
static char *last_folder_file(void)
{
    char cache[PATH_MAX];
    return folders_cache(cache, sizeof cache) && folders_create(cache) ? text_file_in(cache, "last-folder") : NULL;
}

static void recall_folder(StartState *state)
{
    static Faults ignored;
    size_t length;
    char *file = last_folder_file(), *text = file && access(file, R_OK) == 0 ? whole_file_read_most(file, sizeof state->folder - 1, &length, &ignored) : NULL;
    const char *home = getenv("HOME");
    snprintf(state->folder, sizeof state->folder, "%s", text && access(text, R_OK | X_OK) == 0 ? text : home && *home ? home : "/");
    free(text);
    free(file);
}

static void keep_folder(const StartState *state)
{
    static Faults ignored;
    char *file = last_folder_file();
    if (file)
        whole_file_write(file, state->folder, strlen(state->folder), &ignored);
    free(file);
}

// In the child: its messages go to `output` too; it ends with this program.
static void become(char *const *arguments, int output)
{
    char program[PATH_MAX];
    if (process_code_file(program, sizeof program) && prctl(PR_SET_PDEATHSIG, SIGTERM) == 0 && dup2(output, STDERR_FILENO) >= 0)
        execv(program, arguments);
    _exit(127);
}

// Reads what the child says, passes it on, and keeps the end of it.
static void listen(int input, char message[MESSAGE])
{
    char bytes[256];
    size_t used = 0;
    for (ssize_t count; (count = read(input, bytes, sizeof bytes)) > 0 || (count < 0 && errno == EINTR);) {
        if (count < 0)
            continue;
        fwrite(bytes, 1, (size_t)count, stderr);
        size_t kept = used + (size_t)count < MESSAGE ? used : MESSAGE - 1 - (size_t)count;
        memmove(message, message + used - kept, kept);
        memcpy(message + kept, bytes, (size_t)count);
        used = kept + (size_t)count;
    }
    message[used] = 0;
}

// Runs a verb. Its last messages, or how it ended, go to `message`. Returns false if a signal ended it, as the user ends a program.
static bool run_verb_of(const char *verb, const StartState *state, char message[MESSAGE])
{
    char *arguments[7] = {(char *)(size_t) "seldinger", (char *)(size_t)verb, (char *)(size_t)state->path};
    int pipes[2], status = 0, count = 3;
    const bool steers = !strcmp(verb, "nav");
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
    if (child < 0 || (WIFEXITED(status) && WEXITSTATUS(status) == 127))
        snprintf(message, MESSAGE, "%s could not be started", verb);
    else if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_DONE && !message[0] && !strcmp(verb, "report"))
        snprintf(message, MESSAGE, "The report is the .html file beside %.400s", state->path);
    return child < 0 || WIFEXITED(status);
}

void start_steer(const char *path)
{
    static StartState state;
    char message[MESSAGE];
    snprintf(state.path, sizeof state.path, "%s", path);
    run_verb_of("nav", &state, message);
}

// A volume becomes a case first.
static const char *verb_for(StartChoice choice, const char *path)
{
    static const char *const verb[] = {[START_STEER] = "nav", [START_REPLAY] = "replay", [START_REPORT] = "report"};
    return choice == START_STEER && !case_is_there(path) && file_kind(path) == FILE_VOLUME ? "case" : verb[choice];
}

int start_run(void)
{
    static Faults faults;
    static StartState state;
    char exercises[PATH_MAX], cache[PATH_MAX] = "", sessions[4096], message[MESSAGE] = "";
    char *cases = folders_cache(cache, sizeof cache) ? text_file_in(cache, "cases") : NULL;
    const char *folder[] = {exercises_folder(exercises) ? exercises : NULL, cases};
    bool goes_on = session_folder(NULL, sessions, sizeof sessions, &faults);
    recall_folder(&state);
    while (goes_on) {
        Shelf shelf;
        StartOptions options = {.shelf = &shelf, .message = message, .width = 1280, .height = 720};
        if (!shelf_read(&shelf, folder, 2, sessions))
            faults_add(&faults, "seldinger", 0, 0, "out of memory for the list of cases");
        StartChoice choice = faults.count == 0 ? start_window_run(&options, &state, &faults) : START_LEAVE;
        shelf_free(&shelf);
        keep_folder(&state);
        goes_on = choice != START_LEAVE && run_verb_of(verb_for(choice, state.path), &state, message);
    }
    free(cases);
    static char text[(FAULTS_CAPACITY + 1) * FAULT_LENGTH];
    faults_print(&faults, text, sizeof text);
    fputs(text, stderr);
    return faults.count == 0 ? EXIT_DONE : EXIT_BAD_INPUT;
}
