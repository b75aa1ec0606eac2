#define _GNU_SOURCE   // pthread_setattr_default_np
#include "base/process.h"

#include "base/heap.h"
#include "base/part_file.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

// The exit status is that of the signal: 130 in a shell for SIGINT.
void process_stop(int number)
{
    part_files_remove();
    static const char message[] = "\nstopped; no unfinished file is left\n";
    ssize_t written = write(STDERR_FILENO, message, sizeof message - 1);
    (void)written;
    signal(number, SIG_DFL);
    raise(number);
}

static volatile sig_atomic_t stop_requested;

static void request_stop(int number)
{
    // a second signal ends the program at once
    if (stop_requested)
        process_stop(number);
    stop_requested = 1;
}

const volatile sig_atomic_t *process_stop_in_order(void)
{
    struct sigaction stop = {.sa_handler = request_stop, .sa_flags = SA_RESTART};
    sigaction(SIGINT, &stop, NULL);
    sigaction(SIGTERM, &stop, NULL);
    return &stop_requested;
}

static void install_stop(int number)
{
    struct sigaction former;
    // signals ignored by the shell for a background job stay ignored
    if (sigaction(number, NULL, &former) == 0 && former.sa_handler != SIG_IGN)
        sigaction(number, &(struct sigaction){.sa_handler = process_stop, .sa_flags = (int)SA_RESETHAND}, NULL);
}

static int exit_code = EXIT_DONE;

// Registered with atexit(). Some file systems report only on close that they are full. EBADF is not an error: a standard output that was closed from
// the start has lost no written data.
static void check_output(void)
{
    bool lost = fflush(stdout) != 0 || ferror(stdout);
    errno = 0;
    lost = (fclose(stdout) != 0 && errno != EBADF) || lost;
    if (!lost)
        return;
    fprintf(stderr, "-: cannot write to standard output (disk full?)\n");
    _exit(exit_code != EXIT_DONE ? exit_code : EXIT_BAD_INPUT);
}

// Opens /dev/null for each closed standard stream, with the opposite access mode so that reading and writing still fail. Otherwise the next file opened would
// get the descriptor of a standard stream and receive printed text.
static void fill_standard_streams(void)
{
    for (int i = 0; i < 3; i++)
        if (fcntl(i, F_GETFD) < 0 && open("/dev/null", i == 0 ? O_WRONLY : O_RDONLY) != i)
            _exit(EXIT_BAD_INPUT);
}

// Sets the usual stack limit of 8 MB for all threads: with a smaller one the program may crash during a computation.
static bool take_stack(void)
{
    enum { USUAL = 8 << 20, LEAST = 1 << 20 };
    struct rlimit stack;
    pthread_attr_t thread;
    if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= USUAL)      // RLIM_INFINITY is the largest value
        return true;
    stack.rlim_cur = stack.rlim_max < USUAL ? stack.rlim_max : USUAL;
    if (stack.rlim_cur < LEAST || setrlimit(RLIMIT_STACK, &stack) != 0) {
        fprintf(stderr, "seldinger: the stack limit is %ld kB; expected at least %d kB (`ulimit -s`)\n", (long)(stack.rlim_cur >> 10), LEAST >> 10);
        return false;
    }
    if (pthread_attr_init(&thread) == 0) {
        if (pthread_attr_setstacksize(&thread, (size_t)stack.rlim_cur) == 0)
            pthread_setattr_default_np(&thread);
        pthread_attr_destroy(&thread);
    }
    return true;
}

// Without this hook cJSON silently drops items if out of memory.
static void *json_memory(size_t bytes) { return HEAP_ZEROED(bytes, 1); }

int process_run(int argc, char **argv, int (*call)(int argc, char **argv))
{
    cJSON_InitHooks(&(cJSON_Hooks){.malloc_fn = json_memory, .free_fn = free});
    fill_standard_streams();
    if (!take_stack())
        return EXIT_BAD_INPUT;
    install_stop(SIGINT);
    install_stop(SIGTERM);
    install_stop(SIGHUP);
    // exceeding the file-size limit then makes write() fail with a message, and no partial file remains
    sigaction(SIGXFSZ, &(struct sigaction){.sa_handler = SIG_IGN}, NULL);
    atexit(check_output);
    exit_code = call(argc, argv);
    return exit_code;
}
