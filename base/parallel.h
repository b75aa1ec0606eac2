// Parallel loop for offline jobs: calls job(context, index) for index 0 … count-1 on `threads` threads (0: one per processor), in unspecified order.
// Each job writes only to its own index, so results do not depend on the number of threads. `progress` may be NULL; it is called from the calling thread every
// 50 ms with
// the number of finished jobs.
#ifndef SELDINGER_BASE_PARALLEL_H
#define SELDINGER_BASE_PARALLEL_H

typedef void (*ProgressFunction)(void *context, long done, long total);
typedef struct Progress {
    ProgressFunction call;
    void *context;
} Progress;

void parallel_for(int threads, long count, void (*job)(void *context, long index), void *context, const Progress *progress);

#endif
