#include "study/ranks.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef SELDINGER_PLUGINS
#define SELDINGER_PLUGINS "../lib/seldinger"
#endif
static const char plugin[] = "seldinger-mpi.so";

// Messages. From rank 0: BEGIN and the heading, a run's number, END. To rank 0: ASK and the heading, ASK alone after a run that was stopped, a result (a line of
// JSON), or FAIL and a reason.
static const char begin_word[] = "begin ", end_word[] = "end", ask_word[] = "ask", fail_word[] = "fail ";

// --- the plug-in ---

bool ranks_are_given(void)
{
    const char *size = getenv("OMPI_COMM_WORLD_SIZE");
    return size && atoi(size) > 1;
}

// Beside the program (in the build folder), or where the package puts it.
static const RankLink *load(Faults *faults)
{
    char path[PATH_MAX], installed[PATH_MAX];
    bool known = process_beside(plugin, path, sizeof path) && process_beside(SELDINGER_PLUGINS "/seldinger-mpi.so", installed, sizeof installed);
    const char *file = known && access(path, R_OK) == 0 ? path : known && access(installed, R_OK) == 0 ? installed : NULL;
    if (!file) {
        faults_add(
            faults, "seldinger sweep", 0, 0,
            "mpirun started %s processes, but %s is not installed; install the package seldinger-mpi (or build with libopenmpi-dev), or leave out mpirun",
            getenv("OMPI_COMM_WORLD_SIZE"), plugin);
        return NULL;
    }
    // Open MPI loads parts of its own that look for its symbols
    void *library = dlopen(file, RTLD_NOW | RTLD_GLOBAL);
    const RankLink *link = library ? dlsym(library, "seldinger_rank_link") : NULL;
    if (!link)
        faults_add(faults, file, 0, 0, "cannot be loaded: %.300s", dlerror());
    else if (link->version != RANK_LINK_VERSION)
        faults_add(faults, file, 0, 0, "is of another version of the program; install both from the same package");
    return link && link->version == RANK_LINK_VERSION ? link : NULL;
}

bool ranks_begin(Ranks *ranks, Faults *faults)
{
    *ranks = (Ranks){.count = 1};
    if (!ranks_are_given())
        return true;
    ranks->link = load(faults);
    if (ranks->link && ranks->link->begin(&ranks->rank, &ranks->count))
        return true;
    if (ranks->link)
        faults_add(faults, "seldinger sweep", 0, 0, "MPI cannot be started");
    ranks->link = NULL;
    return false;
}

void ranks_end(Ranks *ranks)
{
    if (ranks->link)
        ranks->link->end();
    ranks->link = NULL;
}

// --- rank 0 ---

static char *joined(const char *first, const char *second)
{
    size_t a = strlen(first), b = strlen(second);
    char *text = HEAP_ZEROED(a + b + 1, 1);
    memcpy(text, first, a);
    memcpy(text + a, second, b);
    return text;
}

void ranks_start(const Ranks *ranks, bool good, const char *heading)
{
    char *text = good ? joined(begin_word, heading) : HEAP_TEXT(end_word);
    for (int to = 1; to < ranks->count; to++)
        ranks->link->send(to, text);
    free(text);
}

struct RankHost {
    const Ranks *ranks;
    Queue *queue;
    int at_work;             // ranks that were not told to end
};

RankHost *rank_host_create(const Ranks *ranks, Queue *queue)
{
    RankHost *host = HEAP_ZEROED(1, sizeof *host);
    *host = (RankHost){ranks, queue, ranks->count - 1};
    return host;
}

static void answer(RankHost *host, int from)
{
    char text[32];
    int64_t run = queue_take(host->queue);
    if (run < 0)
        host->at_work--;
    snprintf(text, sizeof text, "%lld", (long long)run);
    host->ranks->link->send(from, run < 0 ? end_word : text);
}

bool rank_host_serve(RankHost *host)
{
    int from;
    for (char *text; host->at_work > 0 && (text = host->ranks->link->receive(false, &from)); free(text)) {
        if (!strncmp(text, fail_word, strlen(fail_word))) {
            queue_break(host->queue, "seldinger sweep", text + strlen(fail_word));
            host->at_work--;
            continue;
        }
        if (strcmp(text, ask_word) != 0)
            queue_finish(host->queue, text);
        answer(host, from);
    }
    return host->at_work > 0;
}

void rank_host_free(RankHost *host) { free(host); }

// --- other ranks ---

static int fail(const Ranks *ranks, const char *why)
{
    char text[FAULT_LENGTH + 40];
    snprintf(text, sizeof text, "%srank %d: %.480s", fail_word, ranks->rank, why);
    ranks->link->send(0, text);
    return EXIT_BAD_INPUT;
}

int ranks_work(const Ranks *ranks, OpenStudy *open, const char *heading, const char *why, const char *recordings, const volatile sig_atomic_t *stop)
{
    int from;
    Faults *faults = HEAP_ZEROED(1, sizeof *faults);
    char *text = ranks->link->receive(true, &from), *line = NULL;
    bool begins = !strncmp(text, begin_word, strlen(begin_word)), is_same = begins && heading && !strcmp(text + strlen(begin_word), heading);
    free(text);
    int code = EXIT_DONE;
    if (begins && !is_same)
        code = fail(ranks, heading ? "its program, specification or scene files are not those of rank 0; every node must have the same" : why);
    for (bool ends = !is_same; !ends;) {
        ranks->link->send(0, line ? line : ask_word);
        free(line);
        line = NULL;
        text = ranks->link->receive(true, &from);
        ends = !strcmp(text, end_word);
        if (!ends)
            line = one_run(open, strtoll(text, NULL, 10), recordings, stop, faults);
        free(text);
        if (faults->count > 0) {
            code = fail(ranks, faults->text[0]);
            ends = true;
        }
    }
    free(line);
    free(faults);
    return code;
}
