// The plug-in seldinger-mpi.so: messages between ranks by MPI (Open MPI). It waits with pauses, because MPI_Recv of Open MPI keeps a core busy, on which a
// simulation could run.
#include "study/ranks.h"

#include <mpi.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { TAG = 19 };
static const long pause_ns = 100000;

static bool begin(int *rank, int *count)
{
    int provided;
    // other threads of a rank simulate and do not call MPI
    return MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided) == MPI_SUCCESS && provided >= MPI_THREAD_FUNNELED &&
           MPI_Comm_rank(MPI_COMM_WORLD, rank) == MPI_SUCCESS && MPI_Comm_size(MPI_COMM_WORLD, count) == MPI_SUCCESS;
}

static bool send(int to, const char *text) { return MPI_Send(text, (int)strlen(text) + 1, MPI_CHAR, to, TAG, MPI_COMM_WORLD) == MPI_SUCCESS; }

static char *receive(bool waits, int *from)
{
    int is_there = 0, length;
    MPI_Status status;
    while (MPI_Iprobe(MPI_ANY_SOURCE, TAG, MPI_COMM_WORLD, &is_there, &status) == MPI_SUCCESS && !is_there && waits)
        nanosleep(&(struct timespec){.tv_nsec = pause_ns}, NULL);
    if (!is_there)
        return NULL;
    MPI_Get_count(&status, MPI_CHAR, &length);
    char *text = calloc((size_t)length + 1, 1);
    *from = status.MPI_SOURCE;
    if (!text)
        MPI_Abort(MPI_COMM_WORLD, 2);
    MPI_Recv(text, length, MPI_CHAR, *from, TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return text;
}

static void end(void) { MPI_Finalize(); }

extern const RankLink seldinger_rank_link __attribute__((visibility("default")));
const RankLink seldinger_rank_link = {RANK_LINK_VERSION, begin, send, receive, end};
