// Parallel-for of the offline jobs: calls job(context, index) for index 0 … count-1 on `threads` threads (0: all cores), in no order.
// Jobs write to their own index, so results do not depend on the number of threads. `progress` may be NULL; it is called from the
// calling thread about ten times a second with the number of jobs done.
#ifndef SELDINGER_BASE_PARALLEL_H
#define SELDINGER_BASE_PARALLEL_H

typedef void (*ProgressFunction)(void *context, long done, long total);
typedef struct Progress {
    ProgressFunction call;
    void *context;
} Progress;

void parallel_for(int threads, long count, void (*job)(void *context, long index), void *context, const Progress *progress);

#endif
