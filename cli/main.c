// seldinger: the table of verbs and what the verbs share.
#define _GNU_SOURCE   // the stack of all threads
#include "cli/cli.h"

#include "base/part_file.h"
#include "base/heap.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static const struct Verb {
    const char *name;
    VerbFunction *call;
    const char *arguments, *does;
} verbs[] = {
    {"run", verb_run, "SCENE", "runs a scene headless: summary, final state, recording, picture"},
#ifdef SELDINGER_RENDER
    {"nav", verb_nav, "SCENE", "the trainer: a window, keys and devices steer the tool, sessions are recorded and scored"},
#endif
    {"check", verb_check, "PATH...", "runs every scene that has a golden tool path and compares"},
    {"segment", verb_segment, "VOLUME --start X,Y,Z -o TREE.h5", "RBT: an angiogram, from one click or --trace F.yaml, to a tree of nodes with local points"},
    {"import", verb_import, "--surface F -o TREE.h5", "the same tree from a surface, with centrelines or alone"},
    {"fit", verb_fit, "TREE.h5 -o MODEL.h5", "LIM: a local blobby model for each node"},
    {"synth", verb_synth, "SHAPE -o F", "synthetic shapes with known truth"},
    {"query", verb_query, "MODEL.h5 --points F.csv -o F.csv", "field, gradient and distance of a model at points"},
    {"export", verb_export, "FILE -o OUT", "surface, centreline or recording for other programs"},
    {"info", verb_info, "FILE", "what a file is and its figures"},
    {"replay", verb_replay, "REC.h5 [--verify]", "a recording shown, simulated again and compared, or made into a scene"},
    {"report", verb_report, "SESSION.json|REC.h5", "a page about a trainee's session: points, errors, plots, path, earlier sessions; HTML or PDF"},
    {"devices", verb_devices, "", "what is plugged in, what of it drives the tool, and why the rest does not"},
    {"bench", verb_bench, "TABLE", "step, fit, track, peer, collision, drawing, wall: timed, each row in the same run; torture: random runs"},
};
enum { VERB_COUNT = sizeof verbs / sizeof verbs[0] };

static void print_help(FILE *out)
{
    fprintf(out, "Usage: seldinger VERB ARGUMENTS\n\nSeldinger %s, a catheter navigation simulator for training and research, not a medical device.\n\n",
            SELDINGER_VERSION);
    for (int i = 0; i < VERB_COUNT; i++)
        fprintf(out, "  %-8s %-34s %s\n", verbs[i].name, verbs[i].arguments, verbs[i].does);
    fprintf(out, "\n`seldinger VERB --help` explains every option with its unit and default.\n"
                 "Exit codes: 0 done; 1 a comparison failed; 2 wrong usage or bad input; 3 the simulation could not be trusted.\n"
                 "Stopped by the user (SIGINT, SIGTERM, SIGHUP) a verb leaves no unfinished file and ends by that signal (130, 143 or 129); `run` ends in order.\n");
}

// What is written is whole or not there (base/part_file.h); the exit status is the signal's, 130 in a shell for SIGINT.
void cli_stop(int number)
{
    part_files_remove();
    static const char message[] = "\nstopped; no unfinished file is left\n";
    ssize_t said = write(STDERR_FILENO, message, sizeof message - 1);
    (void)said;
    signal(number, SIG_DFL);
    raise(number);
}

static void install_stop(int number)
{
    struct sigaction former;
    // what a shell has a job in the background ignore stays ignored
    if (sigaction(number, NULL, &former) == 0 && former.sa_handler != SIG_IGN)
        sigaction(number, &(struct sigaction){.sa_handler = cli_stop, .sa_flags = (int)SA_RESETHAND}, NULL);
}

static int call_verb(int argc, char **argv)
{
    if (argc < 2) {
        print_help(stderr);
        return EXIT_BAD_INPUT;
    }
    if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) {
        print_help(stdout);
        return EXIT_DONE;
    }
    if (!strcmp(argv[1], "--version")) {
        printf("seldinger %s\n", SELDINGER_VERSION);
        return EXIT_DONE;
    }
    for (int i = 0; i < VERB_COUNT; i++) {
        if (strcmp(argv[1], verbs[i].name))
            continue;
        char name[64];
        snprintf(name, sizeof name, "seldinger %s", verbs[i].name);
        argv[1] = name;
        return verbs[i].call(argc - 1, argv + 1);
    }
    fprintf(stderr, "seldinger: no verb '%s'; valid:", argv[1]);
    for (int i = 0; i < VERB_COUNT; i++)
        fprintf(stderr, " %s", verbs[i].name);
    fprintf(stderr, "\n");
    return EXIT_BAD_INPUT;
}

static int exit_code = EXIT_DONE;

// However the program ends (argp's --help ends it by itself). Some file systems tell only at the end that they are full; a standard output that was
// closed from the start has lost nothing that was not written.
static void check_output(void)
{
    bool lost = fflush(stdout) != 0 || ferror(stdout);
    errno = 0;
    lost = (fclose(stdout) != 0 && errno != EBADF) || lost;
    if (!lost)
        return;
    fprintf(stderr, "-: standard output cannot be written to its end; a place with free space\n");
    _exit(exit_code != EXIT_DONE ? exit_code : EXIT_BAD_INPUT);
}

// The number of a standard stream that is closed would be the next file's, which then got what is printed. Reading and writing fail as before.
static void fill_standard_streams(void)
{
    for (int i = 0; i < 3; i++)
        if (fcntl(i, F_GETFD) < 0 && open("/dev/null", i == 0 ? O_WRONLY : O_RDONLY) != i)
            _exit(EXIT_BAD_INPUT);
}

// What is usual, for all threads: with less a program ends by a signal in the middle of its work.
static bool take_stack(void)
{
    enum { USUAL = 8 << 20, LEAST = 1 << 20 };
    struct rlimit stack;
    pthread_attr_t thread;
    if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= USUAL)      // RLIM_INFINITY is the largest of all
        return true;
    stack.rlim_cur = stack.rlim_max < USUAL ? stack.rlim_max : USUAL;
    if (stack.rlim_cur < LEAST || setrlimit(RLIMIT_STACK, &stack) != 0) {
        fprintf(stderr, "seldinger: the stack may have %ld kB; at least %d are needed (`ulimit -s`)\n", (long)(stack.rlim_cur >> 10), LEAST >> 10);
        return false;
    }
    if (pthread_attr_init(&thread) == 0) {
        if (pthread_attr_setstacksize(&thread, (size_t)stack.rlim_cur) == 0)
            pthread_setattr_default_np(&thread);
        pthread_attr_destroy(&thread);
    }
    return true;
}

// The library's JSON is otherwise silently without what it had no memory for.
static void *json_memory(size_t bytes) { return HEAP_ZEROED(bytes, 1); }

int main(int argc, char **argv)
{
    cJSON_InitHooks(&(cJSON_Hooks){.malloc_fn = json_memory, .free_fn = free});
    fill_standard_streams();
    if (!take_stack())
        return EXIT_BAD_INPUT;
    install_stop(SIGINT);
    install_stop(SIGTERM);
    install_stop(SIGHUP);
    // a file-size limit is then a failed write with a message, and no part of a file is left
    sigaction(SIGXFSZ, &(struct sigaction){.sa_handler = SIG_IGN}, NULL);
    atexit(check_output);
    exit_code = call_verb(argc, argv);
    return exit_code;
}

void cli_notes(FILE *out, const char *path, const char *text)
{
    while (*text) {
        size_t n = strcspn(text, "\n");
        fprintf(out, "%s: %.*s\n", path, (int)n, text);
        text += n + (text[n] == '\n');
    }
}

int cli_bad_input(const Faults *faults)
{
    static char text[(FAULTS_CAPACITY + 1) * FAULT_LENGTH];
    faults_print(faults, text, sizeof text);
    fputs(text, stderr);
    return EXIT_BAD_INPUT;
}

static void draw_bar(void *context, long done, long total)
{
    ProgressBar *bar = context;
    enum { WIDTH = 40 };
    int filled = total > 0 ? (int)(done * WIDTH / total) : WIDTH;
    fprintf(stderr, "\r%s [%.*s%.*s] %ld/%ld", bar->label, filled, "########################################", WIDTH - filled,
            "                                        ", done, total);
    if (done >= total)
        fputc('\n', stderr);
}

Progress progress_bar(ProgressBar *bar, const char *label, bool quiet)
{
    bar->label = label;
    bar->shown = !quiet && isatty(STDERR_FILENO);
    return (Progress){.call = bar->shown ? draw_bar : NULL, .context = bar};
}
