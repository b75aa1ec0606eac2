#define _GNU_SOURCE
#include "cli/start.h"

#include "base/base.h"
#include "cli/case_pictures.h"
#include "cli/child_verb.h"
#include "cli/file_kind.h"
#include "cli/user_settings.h"
#include "render/render.h"
#include "sim/sim.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool start_is_possible(void)
{
    const char *x = getenv("DISPLAY"), *wayland = getenv("WAYLAND_DISPLAY");
    return (x && *x) || (wayland && *wayland);
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
    char exercises[PATH_MAX], data[PATH_MAX] = "", sessions[4096], message[CHILD_MESSAGE] = "";
    char *cases = folders_data(data, sizeof data) ? text_file_in(data, "cases") : NULL;
    const char *folder[] = {process_scenes("exercises", exercises) ? exercises : NULL, cases};
    bool goes_on = session_folder(NULL, sessions, sizeof sessions, &faults);
    pid_t pictures = -1;
    recall_folder(&state);
    cli_use_settings();
    while (goes_on) {
        Shelf shelf;
        StartOptions options = {.shelf = &shelf, .message = message, .width = 1280, .height = 720};
        if (!shelf_read(&shelf, folder, 2, sessions))
            faults_add(&faults, "seldinger", 0, 0, "out of memory for the list of cases");
        if (pictures < 0)
            pictures = case_pictures_begin(&shelf);
        StartChoice choice = faults.count == 0 ? start_window_run(&options, &state, &faults) : START_LEAVE;
        shelf_free(&shelf);
        keep_folder(&state);
        case_pictures_pause(pictures, true);
        goes_on = choice != START_LEAVE && child_verb_run(verb_for(choice, state.path), &state, message);
        case_pictures_pause(pictures, false);
    }
    case_pictures_end(pictures);
    free(cases);
    static char text[(FAULTS_CAPACITY + 1) * FAULT_LENGTH];
    faults_print(&faults, text, sizeof text);
    fputs(text, stderr);
    return faults.count == 0 ? EXIT_DONE : EXIT_BAD_INPUT;
}
