// What the tests of sweeps share. Include after tests/folder.h and tests/cli/program.h.
#ifndef SELDINGER_TESTS_CLI_SWEEP_FILES_H
#define SELDINGER_TESTS_CLI_SWEEP_FILES_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

// Open MPI frees not all that it allocates.
static const char mpirun[] = "ASAN_OPTIONS=$ASAN_OPTIONS:detect_leaks=0 mpirun --allow-run-as-root --oversubscribe --mca btl_vader_single_copy_mechanism none";

static inline void skip_without_mpirun(void)
{
    if (access(SELDINGER_PLUGIN, R_OK) == 0 && system("mpirun --version >/dev/null 2>&1") == 0)
        return;
    print_message("skipped: mpirun is not installed, or this build has no seldinger-mpi.so\n");
    skip();
}

static inline void put_scene_of_tube(void)
{
    char *scene = text_of(SOURCE_DIR "/scenes/sweep/tube-scene.yaml");
    put("tube-scene.yaml", scene);
    free(scene);
}

// Runs the program, which must refuse its input with a message that contains `words`.
static inline void refused(const char *arguments, const char *words)
{
    int code = run_in("", arguments);
    if (code != 2 || !strstr(output, words))
        fail_msg("`%s` ended with %d and printed: %s(expected 2 and '%s')", arguments, code, output, words);
}

static inline void same_file(const char *a, const char *b)
{
    char *x = text_of(in_folder(a)), *y = text_of(in_folder(b));
    if (strcmp(x, y) != 0)
        fail_msg("%s and %s differ", a, b);
    free(x);
    free(y);
}

// 0 if the file does not exist.
static inline int lines_of(const char *name)
{
    if (access(in_folder(name), R_OK) != 0)
        return 0;
    char *text = text_of(in_folder(name));
    int lines = 0;
    for (const char *c = text; *c; c++)
        lines += *c == '\n';
    free(text);
    return lines;
}

static inline void pause_ms(long ms) { nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL); }

#endif
