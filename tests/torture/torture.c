// Many external failures: allocations, file operations, SIGKILL at any moment, and resource limits. Each command of a table is run first without a failure,
// then with it. In all cases: no signal ends the program; a successful run writes the same bytes as without the failure; a failed run gives the reason in one
// message; the old file or the new one is complete; no unfinished file is left.
// usage: torture SELDINGER FAILING_CALLS.so heap|files|kills|limits [N [SEED]] [VERB...]
//   N      cases per command, evenly over all calls that can fail (kills: in total), default 8; from 100 on also of the larger commands.
//          0: all, of the small commands
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#ifdef SELDINGER_RENDER
#define HAS_PICTURES true
#else
#define HAS_PICTURES false
#endif

// --- the commands ---

enum { LARGE = 1, WINDOW = 2, CLOCKED = 4, CONTINUE = 8, DRAWS = 16 };
typedef struct Case {
    const char *command;   // IN/: the folder of inputs; the command runs in an empty folder
    const char *outputs; // names of the files that it writes; older versions of them exist before
    const char *uses;    // inputs that are copied to its folder
    int traits;          // WINDOW: needs a display. CLOCKED: its output depends on the clock. CONTINUE: continues without the failed part, and reports it.
                           // DRAWS: pictures
} Case;

static const Case cases[] = {
    {"synth capsule -o t.h5 --points 30", "t.h5", "", 0},
    {"synth capsule -o t.stl --cell-mm 0.5", "t.stl", "", 0},
    {"synth capsule -o t.nrrd --voxel-mm 0.8 --threads 1", "t.nrrd", "", 0},
    {"segment IN/arc.nrrd --start 0,0,0 -o t.h5 --threads 1 --quiet", "t.h5", "", 0},
    {"import --surface IN/capsule.stl --centerline IN/line.swc -o t.h5", "t.h5", "", CLOCKED},
    {"import --surface IN/capsule.stl -o t.h5", "t.h5", "", CLOCKED},
    {"fit IN/capsule.h5 -o t.h5 --threads 1 --quiet", "t.h5", "", 0},
    {"fit IN/capsule.h5 -o t.h5 --preset local --threads 1 --quiet", "t.h5", "", 0},
    {"query IN/model.h5 --points IN/points.csv -o t.csv --threads 1", "t.csv", "", 0},
    {"export IN/model.h5 -o t.stl", "t.stl", "", 0},
    {"export IN/model.h5 -o t.vtp", "t.vtp", "", 0},
    {"export IN/run.h5 -o t.csv", "t.csv", "", 0},
    {"export IN/tools.h5 -o t.pvd", "t.pvd", "", 0},
    {"info IN/model.h5 --json", "", "", 0},
    {"info IN/run.h5 --json", "", "", 0},
    {"info IN/arc.nrrd --json", "", "", 0},
    {"info IN/capsule.stl --json", "", "", 0},
    {"run IN/scene.yaml --record t.h5 --final t.csv", "t.h5 t.csv", "", 0},
    {"run IN/tools.yaml --record t.h5 --final t.csv --score u.json", "t.h5 t.csv u.json", "", 0},
    {"check IN/check", "", "", 0},
    {"check check --update", "check/scene.golden.csv", "check", 0},
    {"replay IN/tools.h5 --verify", "", "", 0},
    {"replay IN/run.h5 --scene t", "", "", 0},
    {"report run.h5 --quiet", "run.html", "run.h5", CONTINUE},
    {"devices", "", "", CONTINUE},
    {"nav IN/scene.yaml --sessions s --duration-s 0.5 --size 640x480 --quiet", "", "", WINDOW | CLOCKED | CONTINUE},
    {"run IN/scene.yaml --duration-s 30 --record t.h5 --final t.csv --quiet", "t.h5 t.csv", "", LARGE},
    {"run IN/scene.yaml --picture t.png --quiet", "t.png", "", LARGE | DRAWS},
    {"segment IN/tree.nrrd --start 0,0,0 -o t.h5 --threads 1 --quiet", "t.h5", "", LARGE},
    {"import --surface IN/y.stl -o t.h5 --threads 1", "t.h5", "", LARGE},
    {"fit IN/tree.h5 -o t.h5 --threads 1 --quiet", "t.h5", "", LARGE},
    {"fit IN/tree.h5 -o t.h5 --preset local --threads 1 --quiet", "t.h5", "", LARGE},
    {"fit IN/tree-model.h5 --measure --json -", "", "", LARGE},
    {"info IN/tree-model.h5 --report t.html", "t.html", "", LARGE},
    {"info IN/tree-model.h5 --junctions t.png", "t.png", "", LARGE | DRAWS},
    {"export IN/tree-model.h5 -o t.ply", "t.ply", "", LARGE},
    {"export IN/tree-model.h5 -o t.mrk.json", "t.mrk.json", "", LARGE},
    {"export IN/tree-model.h5 -o t.swc", "t.swc", "", LARGE},
    {"synth tree --branches 5 --sacs 1 -o t.h5", "t.h5", "", LARGE},
    {"synth capsule --measure IN/model.h5 --json t.json", "t.json", "", LARGE},
    {"replay IN/run.h5 --picture t.png --size 320x240 --quiet", "t.png", "", LARGE | DRAWS},
};
enum { CASES = sizeof cases / sizeof *cases };

static const char scene[] = "seldinger: 1\n"
                            "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 20}, {arc: "
                            "{radius_mm: 15, angle_deg: 40}}]}, friction: 0.1}\n"
                            "wire: {elements: 12, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
                            "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 15}\n"
                            "script: [[0, 50, 90], [0.03, 0, 0]]\n";
static const char tools[] =
    "seldinger: 1\n"
    "vessel: {model: model.h5, friction: 0.1}\n"
    "tools:\n"
    "  - {name: catheter, kind: catheter, elements: 8, inserted_mm: 2, sections: [{length_mm: 20, diameter_mm: 1, inner_diameter_mm: 0.8, "
    "young_modulus_gpa: 1}]}\n"
    "  - {name: wire, kind: wire, elements: 8, inserted_mm: 3, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "sheath: {inlet: root}\n"
    "script: [[0, 5, 0], [0.02, 0, 0]]\n";

static const char *const inputs[] = {"synth arc -o arc.nrrd --voxel-mm 0.4 --threads 1",
                                     "synth capsule -o capsule.h5 --points 30",
                                     "synth capsule -o capsule.stl --cell-mm 0.5",
                                     "fit capsule.h5 -o model.h5 --threads 1",
                                     "export model.h5 -o line.swc",
                                     "run scene.yaml --record run.h5",
                                     "run tools.yaml --record tools.h5",
                                     "check check/scene.yaml --update",
                                     NULL};
static const char *const large_inputs[] = {"synth tree --branches 5 --sacs 1 -o tree.nrrd --voxel-mm 0.5 --threads 1", "synth y -o y.stl --cell-mm 0.5",
                                           "segment tree.nrrd --start 0,0,0 -o tree.h5 --threads 1", "fit tree.h5 -o tree-model.h5 --threads 1", NULL};

// --- small tools ---

static char here[PATH_MAX], program[PATH_MAX], calls[PATH_MAX];
static const char former[] = "what was here before\n";
static const char *part;
static long cases_run, faults;
static uint64_t state = 1;

static void give_up(const char *what, const char *name)
{
    fprintf(stderr, "torture: %s%s\n", what, name);
    exit(2);
}

static uint64_t below(uint64_t count)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return state % count;
}

static const char *in(const char *folder, const char *name)
{
    static char path[8][PATH_MAX];
    static int turn;
    turn = (turn + 1) % 8;
    snprintf(path[turn], PATH_MAX, "%.1000s/%s/%.1000s", here, folder, name);
    return path[turn];
}

static void put(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    if (!file || fputs(text, file) < 0 || fclose(file) != 0)
        give_up("cannot write ", path);
}

static char *text_of(const char *path, size_t *length)
{
    int file = open(path, O_RDONLY);
    struct stat status;
    if (file < 0 || fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        if (file >= 0)
            close(file);
        return NULL;
    }
    char *text = malloc((size_t)status.st_size + 1);
    ssize_t got = text ? read(file, text, (size_t)status.st_size) : -1;
    close(file);
    if (got != status.st_size)
        give_up("cannot read ", path);
    text[got] = 0;
    *length = (size_t)got;
    return text;
}

static bool is_same(const char *a, const char *b)
{
    size_t n, m;
    char *one = text_of(a, &n), *other = text_of(b, &m);
    bool same = one && other && n == m && memcmp(one, other, n) == 0;
    free(one);
    free(other);
    return same;
}

// The old file: the text above, or an input that was copied.
static bool is_former(const char *name)
{
    size_t length;
    char *text = text_of(in("work", name), &length);
    bool same = text && (!strcmp(text, former) || is_same(in("work", name), in("in", name)));
    free(text);
    return same;
}

static void shell(const char *format, ...)
{
    char command[3 * PATH_MAX];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(command, sizeof command, format, arguments);
    va_end(arguments);
    if (system(command) != 0)
        give_up("cannot run ", command);
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// --- one run ---

typedef struct Disturbance {
    long heap, file;
    const char *mode, *error, *list;
    double patience_s;
    double kill_s;               // 0: not killed
    void (*limit)(long value);   // called in the process, before the program starts
    long value;
} Disturbance;

enum { MOST_WORDS = 32, SIGNALLED = 1000, LATE = 2000, PATIENCE_S = 300 };

static void set_number(const char *name, long number)
{
    char text[32];
    snprintf(text, sizeof text, "%ld", number);
    setenv(name, text, 1);
}

static void become(const char *folder, const char *command, int complain, const Disturbance *disturbance)
{
    static char text[4000], word[MOST_WORDS][PATH_MAX];
    char *argument[MOST_WORDS + 2] = {program};
    int count = 1;
    snprintf(text, sizeof text, "%s", command);
    for (char *at = strtok(text, " "); at && count <= MOST_WORDS; at = strtok(NULL, " ")) {
        if (!strncmp(at, "IN/", 3))
            snprintf(word[count - 1], PATH_MAX, "%.1000s/in/%.1000s", here, at + 3);
        else
            snprintf(word[count - 1], PATH_MAX, "%.1000s", at);
        argument[count] = word[count - 1];
        count++;
    }
    setpgid(0, 0);
    int zero = open("/dev/null", O_RDONLY), said = open(in(".", "said"), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (chdir(folder) != 0 || dup2(zero, 0) != 0 || dup2(said, 1) != 1 || dup2(complain, 2) != 2)
        _exit(126);
    for (int i = 3; i < 20; i++)
        close(i);
    if (disturbance) {
        setenv("FAIL_LOG", in(".", "log"), 1);
        char all[PATH_MAX + 2];
        snprintf(all, sizeof all, "%s/", here);
        setenv("FAIL_FOLDER", all, 1);
        set_number("FAIL_HEAP", disturbance->heap);
        set_number("FAIL_FILE", disturbance->file);
        if (disturbance->mode)
            setenv("FAIL_MODE", disturbance->mode, 1);
        if (disturbance->list)
            setenv("FAIL_LIST", disturbance->list, 1);
        if (disturbance->error)
            setenv("FAIL_ERROR", disturbance->error, 1);
        if (!disturbance->kill_s && !disturbance->limit)
            setenv("LD_PRELOAD", calls, 1);
        if (disturbance->limit)
            disturbance->limit(disturbance->value);
    }
    execv(program, argument);
    _exit(125);
}

// Through a pipe, so that limits of files do not apply to messages.
static void keep_complaints(int from)
{
    static char text[1 << 16];
    ssize_t length = read(from, text, sizeof text - 1);
    text[length > 0 ? length : 0] = 0;
    close(from);
    put(in(".", "complained"), text);
}

// The exit code; SIGNALLED and its signal; LATE.
static int run(const char *folder, const char *command, const Disturbance *disturbance)
{
    sigset_t child;
    int status, complaints[2];
    sigemptyset(&child);
    sigaddset(&child, SIGCHLD);
    sigprocmask(SIG_BLOCK, &child, NULL);
    fflush(NULL);
    pid_t process = pipe2(complaints, O_CLOEXEC) == 0 ? fork() : -1;
    if (process < 0)
        give_up("cannot start a process", "");
    if (process == 0) {
        sigprocmask(SIG_UNBLOCK, &child, NULL);
        become(folder, command, complaints[1], disturbance);
    }
    close(complaints[1]);
    bool is_killed = disturbance && disturbance->kill_s > 0, is_late = false;
    double until = now_s() + (is_killed ? disturbance->kill_s : disturbance && disturbance->patience_s ? disturbance->patience_s : PATIENCE_S);
    while (waitpid(process, &status, WNOHANG) == 0) {
        double rest = until - now_s();
        if (rest <= 0) {
            is_late = true;
            kill(process, SIGKILL);
            waitpid(process, &status, 0);
            break;
        }
        sigtimedwait(&child, NULL, &(struct timespec){.tv_sec = (time_t)rest, .tv_nsec = (long)((rest - (double)(time_t)rest) * 1e9)});
    }
    kill(-process, SIGKILL);
    keep_complaints(complaints[0]);
    return is_late ? LATE : WIFSIGNALED(status) ? SIGNALLED + WTERMSIG(status) : WEXITSTATUS(status);
}

static int run_quietly(const char *folder, const char *command)
{
    shell("cd '%s' && mv said said.kept && mv complained complained.kept", here);
    int code = run(folder, command, NULL);
    shell("cd '%s' && mv said said.after && mv complained complained.after && mv said.kept said && mv complained.kept complained", here);
    return code;
}

static bool has_name(const char *names, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = names; (at = strstr(at, name)); at += length)
        if ((at == names || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return true;
    return false;
}

static int remove_entry(const char *path, const struct stat *status, int kind, struct FTW *where)
{
    (void)status, (void)kind;
    return where->level > 0 ? remove(path) : 0;
}

static void prepare(const Case *c)
{
    nftw(in("work", ""), remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    if (c->uses[0])
        shell("cp -rp '%s' '%s'", in("in", c->uses), in("work", ""));
    char names[400];
    snprintf(names, sizeof names, "%s", c->outputs);
    for (char *name = strtok(names, " "); name; name = strtok(NULL, " "))
        if (access(in("work", name), F_OK) != 0)
            put(in("work", name), former);
}

static int attempt(const Case *c, const Disturbance *disturbance)
{
    prepare(c);
    unlink(in(".", "log"));
    return run(in("work", ""), c->command, disturbance);
}

// --- the files after a run ---

typedef struct Left {
    const Case *c;
    bool killed, failed;
    char what[300];
} Left;
static Left left;

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n >= m && !strcmp(text + n - m, end);
}

static bool is_unfinished(const char *name)
{
    const char *at = strstr(name, ".part-");
    return at && strlen(at) == 18;
}

static bool is_readable(const char *name)
{
    char command[300];
    if (ends_with(name, ".h5") && !(left.c->traits & WINDOW)) {
        snprintf(command, sizeof command, "export %.200s -o %s/read.csv", name, here);
        return run_quietly(in("work", ""), command) == 0;
    }
    snprintf(command, sizeof command, "report %.200s --html %s/read.html", name, here);
    return (ends_with(name, ".json") || ends_with(name, ".h5")) && run_quietly(in("work", ""), command) == 0;
}

static int judge_file(const char *path, const struct stat *status, int kind, struct FTW *where)
{
    (void)status, (void)where;
    const char *name = path + strlen(in("work", ""));
    if (kind != FTW_F || left.what[0] || is_same(path, in("reference", name)))
        return 0;
    bool is_recording = ends_with(name, ".h5") && (!strncmp(left.c->command, "run", 3) || left.c->traits & WINDOW);
    bool is_extra = !strcmp(name, "recorded.csv") || !strcmp(name, "run.json");      // a recording's first part, a session file before its page
    if (is_unfinished(name)                                  ? left.killed
        : is_extra && left.failed                            ? true
        : has_name(left.c->outputs, name) && is_former(name) ? left.failed
        : is_recording || left.c->traits & WINDOW            ? is_readable(name)
                                                             : false)
        return 0;
    snprintf(left.what, sizeof left.what, "left %.200s", name);
    return 0;
}

// NULL, or a description of the error in the files.
static const char *odd_file(const Case *c, bool failed, bool killed)
{
    char names[400];
    left = (Left){.c = c, .killed = killed, .failed = failed};
    nftw(in("work", ""), judge_file, 16, FTW_PHYS);
    snprintf(names, sizeof names, "%s", c->outputs);
    for (char *name = strtok(names, " "); name; name = strtok(NULL, " "))
        if (access(in("work", name), F_OK) != 0 && !left.what[0])
            snprintf(left.what, sizeof left.what, "left no %s", name);
    return left.what[0] ? left.what : NULL;
}

// Recordings are compared by content: the layout of the file depends on the clock.
static void make_comparable(const Case *c)
{
    bool is_recording = !strncmp(c->command, "run", 3) && has_name(c->outputs, "t.h5");
    if (is_recording && !is_former("t.h5") && run_quietly(in("work", ""), "export t.h5 -o recorded.csv") == 0)
        put(in("work", "t.h5"), former);
}

static int lines_of(const char *path, char *text, size_t room)
{
    size_t length;
    int lines = 0;
    char *whole = text_of(path, &length);
    for (size_t i = 0; whole && i < length; i++)
        lines += whole[i] == '\n';
    snprintf(text, room, "%s", whole ? whole : "");
    free(whole);
    return lines;
}

static void fault(const Case *c, const char *how, const char *format, ...)
{
    char log[300], said[2000];
    va_list arguments;
    faults++;
    lines_of(in(".", "log"), log, sizeof log);
    lines_of(in(".", "complained"), said, sizeof said);
    log[strcspn(log, "\n")] = 0;
    printf("FAULT %s: ", c->command);
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    printf(" (%s%s%s)\n%s%s%.300s\n", how, strncmp(log, "failed", 6) ? "" : ", ", strncmp(log, "failed", 6) ? "" : log, said[0] ? "    it says: " : "", said,
           said[0] ? "" : "    it says nothing");
    if (getenv("KEEP_TORTURED"))
        shell("rm -rf /tmp/tortured && cp -r '%s' /tmp/tortured", here);
}

// The file of the failed call, whose name the message must contain; "" if it is not known.
static void failed_file(char *name, size_t room)
{
    char log[1200], path[1000] = "";
    lines_of(in(".", "log"), log, sizeof log);
    name[0] = 0;
    if (sscanf(log, "failed %*s %999[^\n]", path) != 1 || strstr(log, "failed allocation"))
        return;
    char *cut = strstr(path, ".part-"), *slash;
    if (cut)
        *cut = 0;
    slash = strrchr(path, '/');
    snprintf(name, room, "%s", ends_with(path, "/said") ? "-" : slash ? slash + 1 : path);
}

static bool said_differs;    // the output of this command differs in each run

// Judges a run with a failure. `bad`: the required exit code of a failed run; -1: any.
static void judge(const Case *c, int code, int bad, bool one_message, const char *how)
{
    cases_run++;
    make_comparable(c);
    char said[2000], name[300];
    int lines = lines_of(in(".", "complained"), said, sizeof said);
    const char *odd = odd_file(c, code != 0, false);
    failed_file(name, sizeof name);
    if (code >= SIGNALLED)
        fault(c, how, code == LATE ? "takes too long" : "ends by signal %d", code - SIGNALLED);
    else if (odd && !(code == 0 && c->traits & CONTINUE && lines > 0))
        fault(c, how, "ends with %d, %s", code, odd);
    else if (code == 0 && !said_differs && !(c->traits & CONTINUE) && !is_same(in(".", "said"), in(".", "reference-said")))
        fault(c, how, "ends with 0 and says something else");
    else if (code != 0 && bad >= 0 && code != bad &&
             !(code == 3 && (c->traits & WINDOW || strstr(said, "recording stopped") || strstr(said, "cannot be written") || strstr(said, "cannot write to"))))
        fault(c, how, "ends with %d, not %d", code, bad);
    else if (code != 0 && (lines == 0 || (one_message && lines != 1 && !(c->traits & WINDOW))))      // graphics drivers print messages of their own
        fault(c, how, "ends with %d and %d messages", code, lines);
    else if (code != 0 && one_message && name[0] && !strstr(said, name))
        fault(c, how, "ends with %d and does not name %s", code, name);
}

typedef struct Reference {
    long heap, file;        // calls
    long *place;            // first calls of places
    int places;
    double took_s;
} Reference;

static int order(const void *a, const void *b)
{
    long x = *(const long *)a, y = *(const long *)b;
    return (x > y) - (x < y);
}

static void read_log(Reference *reference)
{
    enum { MOST = 4096 };
    static long places[MOST];
    char line[200];
    FILE *file = fopen(in(".", "log"), "r");
    reference->places = 0;
    reference->place = places;
    reference->heap = reference->file = 0;
    while (file && fgets(line, sizeof line, file)) {
        long first;
        sscanf(line, "calls %ld %ld", &reference->heap, &reference->file);
        if (reference->places < MOST && sscanf(line, "place %ld", &first) == 1)
            places[reference->places++] = first;
    }
    if (file)
        fclose(file);
    qsort(places, (size_t)reference->places, sizeof *places, order);
}

// Two runs without a failure. False if they cannot be compared.
static bool make_reference(const Case *c, Reference *reference, const char *mode)
{
    bool watched = !strcmp(part, "heap") || !strcmp(part, "files");
    Disturbance none = {.mode = mode};
    for (int turn = 0; turn < 2; turn++) {
        double from = now_s();
        int code = attempt(c, watched ? &none : NULL);
        reference->took_s = now_s() - from;
        if (code != 0) {
            char said[300];
            lines_of(in(".", "complained"), said, sizeof said);
            if (mode && code == 77) {
                printf("skipped: system calls cannot be trapped here\n");
                exit(77);
            }
            printf("FAULT %s: ends with %d undisturbed: %s\n", c->command, code, said);
            return false;
        }
        make_comparable(c);
        if (turn == 0) {
            read_log(reference);
            shell("cd '%s' && rm -rf reference && cp -r work reference && cp said reference-said", here);
        }
    }
    const char *odd = odd_file(c, false, false);
    said_differs = c->traits & CLOCKED || !is_same(in(".", "said"), in(".", "reference-said"));
    if (!odd)
        return true;
    printf("FAULT %s: writes something else each time, %s\n", c->command, odd);
    return false;
}

// --- the parts ---

static long wanted;     // cases of each command; 0: all

// A window takes a second of processor time: in ctest only a quarter of the cases.
static long wanted_of(const Case *c, long total)
{
    long share = c->traits & WINDOW && wanted < 100 ? (wanted + 3) / 4 : wanted;
    return wanted == 0 || share > total ? total : share;
}

static void judge_allocation(const Case *c, int code, long number)
{
    char how[60];
    snprintf(how, sizeof how, "allocation %ld", number);
    judge(c, code, 2, true, how);
}

// Takes the files of one of the processes of FAIL_LIST as those of a run.
static void take_fork(long number, const char *place)
{
    static const char *const name[] = {"work", "said", "complained"};
    char text[100], fork_name[60];
    nftw(in("work", ""), remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    rmdir(in("work", ""));
    for (int i = 0; i < 3; i++) {
        snprintf(fork_name, sizeof fork_name, "forks/%ld/%s", number, name[i]);
        if (rename(in(".", fork_name), in(".", name[i])) != 0)
            give_up("cannot restore ", fork_name);
    }
    snprintf(fork_name, sizeof fork_name, "forks/%ld", number);
    rmdir(in(".", fork_name));
    snprintf(text, sizeof text, "failed allocation %s\n", place);
    put(in(".", "log"), text);
}

// The cases that fail in forked processes; clears their numbers.
static void torture_forks(const Case *c, long *number, long count)
{
    FILE *list = fopen(in(".", "list"), "w");
    for (long i = 0; list && i < count; i++)
        fprintf(list, "%ld\n", number[i]);
    if (!list || fclose(list) != 0)
        give_up("cannot write ", in(".", "list"));
    shell("rm -rf '%s/forks' && mkdir '%s/forks'", here, here);
    attempt(c, &(Disturbance){.list = in(".", "list"), .patience_s = 24 * 3600});
    shell("mv '%s/log' '%s/log.forks'", here, here);
    FILE *log = fopen(in(".", "log.forks"), "r");
    char line[200], place[40];
    long at, i = 0;
    int status;
    while (log && fgets(line, sizeof line, log)) {
        if (sscanf(line, "fork %ld %d %39s", &at, &status, place) != 3)
            continue;
        take_fork(at, place);
        judge_allocation(c, !WIFSIGNALED(status) ? WEXITSTATUS(status) : WTERMSIG(status) == SIGALRM ? LATE : SIGNALLED + WTERMSIG(status), at);
        while (i < count && number[i] < at)
            i++;
        if (i < count && number[i] == at)
            number[i] = 0;
    }
    if (log)
        fclose(log);
}

// Half of them at the first call of a place, spread over the places, half spread over all calls.
static long torture_heap(const Case *c, const Reference *reference)
{
    long count = wanted_of(c, reference->heap), of_places = count == reference->heap ? 0 : (count + 1) / 2;
    of_places = of_places > reference->places ? reference->places : of_places;
    long *number = malloc((size_t)(count + 1) * sizeof *number), rest = count - of_places;
    if (!number)
        give_up("no memory", "");
    for (long i = 0; i < count; i++)
        number[i] = i < of_places ? reference->place[i * reference->places / of_places] : (i - of_places) * reference->heap / rest + 1;
    qsort(number, (size_t)count, sizeof *number, order);
    torture_forks(c, number, count);
    for (long i = 0; i < count; i++)
        if (number[i] && (i == 0 || number[i] != number[i - 1]))
            judge_allocation(c, attempt(c, &(Disturbance){.heap = number[i]}), number[i]);
    free(number);
    return count;
}

static long torture_files(const Case *c, const Reference *reference)
{
    static const Disturbance modes[] = {
        {.mode = "once", .error = "5"}, {.mode = "full", .error = "28"}, {.mode = "gone", .error = "5"}, {.mode = "short"}, {.mode = "interrupted"}};
    long done = 0;
    for (int m = 0; m < 5; m++) {
        bool each = m < 3;
        long count = each ? wanted_of(c, reference->file) : 1;
        for (long i = 0; i < count; i++) {
            Disturbance one = modes[m];
            char how[60];
            one.file = each ? i * reference->file / count + 1 : 0;
            snprintf(how, sizeof how, "%s %ld", one.mode, one.file);
            int code = attempt(c, &one);
            judge(c, code, -1, m == 0, how);
            if (!each && code != 0)
                fault(c, how, "is not harmless");
            done++;
        }
    }
    return done;
}

static void judge_killed(const Case *c, const char *how)
{
    cases_run++;
    const char *odd = odd_file(c, true, true);
    if (odd)
        fault(c, how, "%s", odd);
    if (has_name(c->outputs, "t.h5") && !strncmp(c->command, "run", 3) && !is_former("t.h5") && run_quietly(in("work", ""), "report t.h5 --quiet") != 0) {
        char words[300];
        lines_of(in(".", "complained.after"), words, sizeof words);
        fault(c, how, "a recording of which no report can be made: %s", words);
    }
}

static long torture_by_kills(const Case *c, const Reference *reference, int turn, int turns)
{
    long count = wanted * (turn + 1) / turns - wanted * turn / turns;
    for (long i = 0; i < count; i++) {
        Disturbance one = {.kill_s = 1e-4 + 1.1 * reference->took_s * (double)below(1000000) / 1e6};
        char how[60];
        snprintf(how, sizeof how, "SIGKILL after %.4f s of %.4f", one.kill_s, reference->took_s);
        attempt(c, &one);
        judge_killed(c, how);
    }
    return count;
}

// --- limits ---

static void set_limit(__rlimit_resource_t what, long value) { setrlimit(what, &(struct rlimit){(rlim_t)value, (rlim_t)value}); }
static void soft_stack(long value)
{
    struct rlimit stack;
    getrlimit(RLIMIT_STACK, &stack);
    stack.rlim_cur = (rlim_t)value;
    setrlimit(RLIMIT_STACK, &stack);
}
static void hard_stack(long value) { set_limit(RLIMIT_STACK, value); }
static void address_space(long value) { set_limit(RLIMIT_AS, value); }
static void open_files(long value) { set_limit(RLIMIT_NOFILE, value); }
static void file_size(long value) { set_limit(RLIMIT_FSIZE, value); }
static void closed(long value)
{
    for (int i = 0; i < 3; i++)
        if (value >> i & 1)
            close(i);
}
static void without_home(long value)
{
    (void)value;
    setenv("TMPDIR", "/nonexistent/tmp", 1);
    setenv("HOME", "/nonexistent/home", 1);
    setenv("XDG_RUNTIME_DIR", "/nonexistent/run", 1);
    setenv("XDG_DATA_HOME", "/nonexistent/data", 1);
    setenv("SELDINGER_CACHE", "/nonexistent/cache", 1);
}
static void read_only(long value)
{
    (void)value;
    if (chmod(".", 0555) != 0 || (getuid() == 0 && setuid(65534) != 0))
        _exit(124);
}

static const struct Limit {
    const char *name;
    void (*set)(long value);
    long from, to, factor;   // values from..to, each the previous one times factor; 0: plus one
    bool keeps_quiet;        // standard error is closed
} limits[] = {
    {"closed descriptors", closed, 1, 7, 0, true},      {"soft stack", soft_stack, 32 << 10, 512 << 10, 2, false},
    {"stack", hard_stack, 64 << 10, 1 << 20, 2, false}, {"address space", address_space, 32 << 20, 2L << 30, 0, false},
    {"open files", open_files, 3, 20, 0, false},        {"file size", file_size, 1, 256 << 10, 4, false},
    {"no home", without_home, 0, 0, 0, false},          {"read-only folder", read_only, 0, 0, 0, false},
};

static long next_value(const struct Limit *limit, long value)
{
    return limit->factor ? value * limit->factor : limit->set == address_space ? value + value / 50 : value + 1;
}

static long torture_by_limits(const Case *c, const Reference *reference)
{
    (void)reference;
    long done = 0;
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) {
        const struct Limit *limit = &limits[i];
        if (c->traits & WINDOW && limit->set == address_space)
            continue;        // the graphics drivers need much memory and crash without it
        long values = 0, skipped;
        for (long v = limit->from; v <= limit->to; v = next_value(limit, v))
            values++;
        skipped = values / wanted_of(c, values);
        long turn = (long)below((uint64_t)skipped);
        for (long v = limit->from; v <= limit->to; v = next_value(limit, v), turn++) {
            if (turn % skipped)
                continue;
            Disturbance one = {.limit = limit->set, .value = v};
            char how[60], said[2000];
            snprintf(how, sizeof how, "%s %ld", limit->name, v);
            int code = attempt(c, &one);
            chmod(in("work", ""), 0755);
            done++;
            lines_of(in(".", "complained"), said, sizeof said);
            if (limit->keeps_quiet && v & 4)
                put(in(".", "complained"), "closed\n");
            // the loader, before the program begins
            if (code == 127 && strstr(said, "error while loading shared libraries"))
                cases_run++;
            else
                judge(c, code, -1, limit->set == address_space, how);
        }
    }
    return done;
}

// --- main ---

static void begin_window(void)
{
    int said[2];
    char number[16] = ":";
    if (!HAS_PICTURES || system("command -v Xvfb >/dev/null 2>&1") != 0 || pipe(said) != 0)
        return;
    pid_t server = fork();
    if (server == 0) {
        char descriptor[16];
        snprintf(descriptor, sizeof descriptor, "%d", said[1]);
        if (!freopen("/dev/null", "w", stderr))
            _exit(1);
        execlp("Xvfb", "Xvfb", "-displayfd", descriptor, "-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset", (char *)NULL);
        _exit(1);
    }
    close(said[1]);
    ssize_t length = read(said[0], number + 1, sizeof number - 2);
    close(said[0]);
    if (server < 0 || length <= 0)
        return;
    number[strcspn(number, "\n")] = 0;
    setenv("DISPLAY", number, 1);
    set_number("TORTURE_SERVER", server);
}

static void clean_up(void)
{
    const char *server = getenv("TORTURE_SERVER");
    if (server)
        kill((pid_t)atol(server), SIGTERM);
    char command[PATH_MAX + 20];
    snprintf(command, sizeof command, "rm -rf '%.4000s'", here);
    if (here[0] && system(command) != 0)
        fprintf(stderr, "torture: %s stays\n", here);
}

static void stop(int number) { exit(128 + number); }      // removes the folder and the display

static void make_inputs(const char *const *input)
{
    for (; *input; input++)
        if (run(in("in", ""), *input, NULL) != 0)
            give_up("cannot make the inputs: seldinger ", *input);
}

static bool is_chosen(const Case *c, char *const *verb)
{
    if (c->traits & LARGE && wanted < 100)
        return false;
    if ((c->traits & WINDOW && !getenv("TORTURE_SERVER")) || (c->traits & DRAWS && !HAS_PICTURES))
        return false;
    size_t length = strcspn(c->command, " ");
    bool chosen = !*verb;
    for (; *verb; verb++)
        chosen |= strlen(*verb) == length && !strncmp(*verb, c->command, length);
    return chosen;
}

int main(int argc, char **argv)
{
    if (argc < 4)
        give_up("usage: torture SELDINGER FAILING_CALLS.so heap|files|kills|limits [N [SEED]] [VERB...]", "");
    part = argv[3];
    char **verb = argv + 4;
    wanted = *verb && **verb >= '0' && **verb <= '9' ? atol(*verb++) : 8;
    state = *verb && **verb >= '0' && **verb <= '9' ? strtoull(*verb++, NULL, 10) + 1 : 1;
    state *= 0x9E3779B97F4A7C15ULL;
    // in memory if possible, where fsync does not wait
    snprintf(here, sizeof here, "%s/seldinger-torture-XXXXXX", access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp");
    if (!mkdtemp(here) || chmod(here, 0755) != 0 || !realpath(argv[1], program) || !realpath(argv[2], calls))
        give_up("cannot make a folder, or no such program: ", argv[1]);
    atexit(clean_up);
    signal(SIGINT, stop);
    signal(SIGTERM, stop);
    shell("cd '%s' && mkdir in work cache in/check && cp '%s' seldinger && cp '%s' calls.so", here, program, calls);
    snprintf(program, sizeof program, "%s", in(".", "seldinger"));
    snprintf(calls, sizeof calls, "%s", in(".", "calls.so"));
    setenv("SELDINGER_CACHE", in("cache", ""), 1);
    setenv("LC_ALL", "C", 1);
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    put(in("in", "scene.yaml"), scene);
    put(in("in", "check/scene.yaml"), scene);
    put(in("in", "tools.yaml"), tools);
    put(in("in", "points.csv"), "x_mm,y_mm,z_mm\n0,0,0\n1,0.2,0\n");
    make_inputs(inputs);
    if (wanted >= 100)
        make_inputs(large_inputs);
    begin_window();

    printf("%-80s %11s %7s %7s\n", "command", "calls", "cases", "faults");
    const Case *chosen[CASES];
    int count = 0;
    for (int i = 0; i < CASES; i++)
        if (is_chosen(&cases[i], verb))
            chosen[count++] = &cases[i];
    for (int i = 0; i < count; i++) {
        const Case *c = chosen[i];
        Reference reference;
        long before = faults, done;
        if (!make_reference(c, &reference, !strcmp(part, "files") ? "once" : NULL)) {
            faults++;
            continue;
        }
        done = !strcmp(part, "heap")    ? torture_heap(c, &reference)
               : !strcmp(part, "files") ? torture_files(c, &reference)
               : !strcmp(part, "kills") ? torture_by_kills(c, &reference, i, count)
                                        : torture_by_limits(c, &reference);
        printf("%-80s %11ld %7ld %7ld\n", c->command, !strcmp(part, "files") ? reference.file : reference.heap, done, faults - before);
        fflush(stdout);
    }
    printf("torture %s: %ld cases, %ld found\n", part, cases_run, faults);
    return faults == 0 ? 0 : 1;
}
