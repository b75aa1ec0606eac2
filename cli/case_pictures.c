#include "cli/case_pictures.h"

#include "cli/cli.h"
#include "render/render.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static int draw_one(const char *path, const char *file)
{
    static Faults faults;
    OpenVessel open = {0};
    Scene *scene = scene_load(path, &faults);
    bool good = scene && cli_open_scene(scene, 1, true, &open, &faults) && case_picture_draw(file, scene, &open, &faults);
    return good ? EXIT_DONE : EXIT_BAD_INPUT;
}

// Each picture in its own process: a scene that cannot be drawn costs only its own picture.
static void draw_all(const Shelf *shelf)
{
    for (int i = 0; i < shelf->case_count; i++) {
        const ShelfCase *c = &shelf->cases[i];
        char *file = c->missing[0] ? NULL : case_picture_file(c->path);
        pid_t child = file && access(file, F_OK) != 0 ? fork() : -1;
        if (child == 0)
            _exit(prctl(PR_SET_PDEATHSIG, SIGTERM) == 0 ? draw_one(c->path, file) : EXIT_BAD_INPUT);
        if (child > 0)
            waitpid(child, NULL, 0);
        free(file);
    }
}

pid_t case_pictures_begin(const Shelf *shelf)
{
    fflush(NULL);
    pid_t worker = fork();
    if (worker != 0)
        return worker > 0 ? worker : 0;
    int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
    bool is_ready =
        setpgid(0, 0) == 0 && prctl(PR_SET_PDEATHSIG, SIGTERM) == 0 && nowhere >= 0 && dup2(nowhere, STDERR_FILENO) >= 0 && dup2(nowhere, STDOUT_FILENO) >= 0;
    setpriority(PRIO_PROCESS, 0, 5);
    if (is_ready)
        draw_all(shelf);
    _exit(EXIT_DONE);
}

void case_pictures_pause(pid_t worker, bool is_paused)
{
    if (worker > 0)
        kill(-worker, is_paused ? SIGSTOP : SIGCONT);
}

void case_pictures_end(pid_t worker)
{
    if (worker <= 0)
        return;
    kill(-worker, SIGTERM);      // unfinished files are removed
    waitpid(worker, NULL, 0);
}
