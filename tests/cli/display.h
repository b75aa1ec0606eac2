// A virtual X server for tests of windows. Skipped by name if Xvfb or xdotool is not installed. Include after cmocka.h.
#ifndef SELDINGER_TESTS_CLI_DISPLAY_H
#define SELDINGER_TESTS_CLI_DISPLAY_H

#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static pid_t display_server;

// A shell command: the script of keys `%s` runs beside PROGRAM and ends with it, even if it still waits for a window: a script left behind would keep the output
// of the test open, and ctest would wait for its end. The exit code is PROGRAM's.
#define BY_HAND(program) "(%s) >hand.txt 2>&1 & H=$!; " program "; C=$?; kill $H 2>/dev/null; exit $C"

static inline bool is_installed(const char *program)
{
    char command[200];
    snprintf(command, sizeof command, "command -v %s >/dev/null 2>&1", program);
    return system(command) == 0;
}

// Xvfb finds a free display number and prints it; DISPLAY is then set. Returns 0 also if it is not installed.
static inline int display_start(void)
{
    int message[2];
    char number[16] = ":", display[32] = "-displayfd";
#ifdef KEEP_LIBRARIES
    // LeakSanitizer's reports are then about our code; it must accept not being the first library. Where a library that is loaded late has its
    // thread-local memory at a multiple of 4096 plus 16, LeakSanitizer takes what lies before it for a header of glibc 2.18 and crashes ("Tracer caught signal").
    setenv("LD_PRELOAD", KEEP_LIBRARIES, 1);
    setenv("ASAN_OPTIONS", "verify_asan_link_order=0:intercept_tls_get_addr=0", 1);
#endif
    setenv("XDG_CONFIG_HOME", "/nonexistent", 1);    // the settings of whoever runs the tests do not count
    if (!is_installed("Xvfb") || !is_installed("xdotool"))
        return 0;
    if (pipe(message) != 0)
        return 1;
    display_server = fork();
    if (display_server == 0) {
        char descriptor[16];
        snprintf(descriptor, sizeof descriptor, "%d", message[1]);
        if (!freopen("/dev/null", "w", stderr))
            _exit(1);
        execlp("Xvfb", "Xvfb", display, descriptor, "-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset", (char *)NULL);
        _exit(1);
    }
    close(message[1]);
    ssize_t length = read(message[0], number + 1, sizeof number - 2);
    close(message[0]);
    if (length <= 0)
        return 1;
    number[strcspn(number, "\n")] = 0;
    return setenv("DISPLAY", number, 1);
}

static inline void display_stop(void)
{
    if (display_server > 0) {
        kill(display_server, SIGTERM);
        waitpid(display_server, NULL, 0);
    }
}

static inline void need_display(void)
{
    if (display_server <= 0) {
        print_message("skipped: Xvfb or xdotool is not installed\n");
        skip();
    }
}

#endif
