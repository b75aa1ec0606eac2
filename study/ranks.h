// A sweep on several processes under mpirun: rank 0 hands out the runs, keeps the journal, and works itself; each other rank asks for a run, simulates it and
// sends its result with the next question. The program does not need MPI: the messages are in a plug-in (study/mpi_link.c), which is loaded where mpirun started
// the process.
#ifndef SELDINGER_STUDY_RANKS_H
#define SELDINGER_STUDY_RANKS_H

#include "study/queue.h"

#include <stddef.h>

// What the plug-in exports as `seldinger_rank_link`. Called from one thread.
enum { RANK_LINK_VERSION = 1 };
typedef struct RankLink {
    int version;             // RANK_LINK_VERSION
    bool (*begin)(int *rank, int *count);
    bool (*send)(int to, const char *text);              // NUL-terminated
    // The next message, which the caller frees; NULL if there is none and `waits` is false.
    char *(*receive)(bool waits, int *from);
    void (*end)(void);       // all ranks call it
} RankLink;

typedef struct Ranks {
    int rank, count;         // 0 of 1 without mpirun
    const RankLink *link;    // NULL without mpirun
} Ranks;

// Whether mpirun started this process together with others.
bool ranks_are_given(void);
// Joins the other ranks, if there are any. False with a fault: no plug-in, or MPI fails.
bool ranks_begin(Ranks *ranks, Faults *faults);
void ranks_end(Ranks *ranks);

// Rank 0: tells all ranks to begin, or, `good` false, to end. `heading`: the journal's first line, which must be the same on all ranks.
void ranks_start(const Ranks *ranks, bool good, const char *heading);
// Rank 0: answers the messages that have come. True while ranks are at work.
typedef struct RankHost RankHost;
RankHost *rank_host_create(const Ranks *ranks, Queue *queue);
bool rank_host_serve(RankHost *host);
void rank_host_free(RankHost *host); // NULL is allowed
// Another rank: works until rank 0 has no more runs. `heading` NULL: this rank cannot work, for the reason `why`. Returns an exit code.
int ranks_work(const Ranks *ranks, OpenStudy *open, const char *heading, const char *why, const char *recordings, const volatile sig_atomic_t *stop);

#endif
