// Parallel loop for offline jobs: calls job(context, index) for index 0 … count-1 on `threads` threads (0: one per processor), in unspecified order.
// Each job writes only to its own index, so results do not depend on the number of threads. `progress` may be NULL; it is called from the calling thread every
// 50 ms with
// the number of finished jobs.
#ifndef SELDINGER_BASE_PARALLEL_H
#define SELDINGER_BASE_PARALLEL_H

#include <stdbool.h>
#include <stddef.h>

typedef void (*ProgressFunction)(void *context, long done, long total);
typedef struct Progress {
    ProgressFunction call;
    void *context;
    bool (*is_stopped)(void *context);   // NULL: never. Asked often, from several threads; after true the work ends soon, with a fault
} Progress;
static inline bool progress_is_stopped(const Progress *progress) { return progress && progress->is_stopped && progress->is_stopped(progress->context); }

void parallel_for(int threads, long count, void (*job)(void *context, long index), void *context, const Progress *progress);

enum { PARALLEL_THREADS_MOST = 256 };
// How many threads `threads` stands for: 1 to PARALLEL_THREADS_MOST; 0: one per processor.
int parallel_thread_count(int threads);

#endif
