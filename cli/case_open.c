#include "cli/case_open.h"

#include "cli/child_verb.h"
#include "cli/user_settings.h"
#include "cli/file_kind.h"
#include "cli/start.h"

#include <stdio.h>
#include <stdlib.h>

bool case_can_open(const char *path) { return start_is_possible() && !case_is_there(path) && file_kind(path) == FILE_VOLUME; }

int case_open(const CaseWindowOptions *options, const char *trainee, bool is_examination, Faults *faults)
{
    char steer[PATH_MAX];
    cli_use_settings();
    if (!case_window_run(options, steer, sizeof steer, faults))
        return EXIT_BAD_INPUT;
    if (!steer[0])
        return EXIT_DONE;
    printf("%s\n", steer);
    static StartState state;
    char message[CHILD_MESSAGE];
    snprintf(state.path, sizeof state.path, "%s", steer);
    snprintf(state.trainee, sizeof state.trainee, "%s", trainee);
    state.is_examination = is_examination;
    child_verb_run("nav", &state, message);
    return EXIT_DONE;
}
