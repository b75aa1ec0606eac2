#include "study/workers.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct Workers {
    OpenStudy *open;
    Queue *queue;
    const char *recordings;
    const volatile sig_atomic_t *stop;
    atomic_int busy;
    int count;
    pthread_t thread[PARALLEL_THREADS_MOST];
};

static void *work(void *argument)
{
    Workers *workers = argument;
    Faults *faults = HEAP_ZEROED(1, sizeof *faults);
    for (int64_t run; (run = queue_take(workers->queue)) >= 0;) {
        faults_clear(faults);
        char *line = one_run(workers->open, run, workers->recordings, workers->stop, faults);
        if (faults->count > 0)
            queue_break(workers->queue, "seldinger sweep", faults->text[0]);
        queue_finish(workers->queue, line);
        free(line);
    }
    free(faults);
    atomic_fetch_sub(&workers->busy, 1);
    return NULL;
}

Workers *workers_start(OpenStudy *open, Queue *queue, int threads, const char *recordings, const volatile sig_atomic_t *stop)
{
    Workers *workers = HEAP_ZEROED(1, sizeof *workers);
    const int wanted = parallel_thread_count(threads);
    workers->open = open;
    workers->queue = queue;
    workers->recordings = recordings;
    workers->stop = stop;
    atomic_store(&workers->busy, wanted);
    while (workers->count < wanted && pthread_create(&workers->thread[workers->count], NULL, work, workers) == 0)
        workers->count++;
    atomic_fetch_sub(&workers->busy, wanted - workers->count);
    if (workers->count == 0) {       // no thread can be started: this one works
        atomic_store(&workers->busy, 1);
        work(workers);
    }
    return workers;
}

int workers_busy(Workers *workers) { return atomic_load(&workers->busy); }

void workers_join(Workers *workers)
{
    for (int i = 0; i < workers->count; i++)
        pthread_join(workers->thread[i], NULL);
    free(workers);
}

void sweep_progress(const QueueState *state)
{
    int64_t now = state->finished - state->before;
    double rate = state->elapsed_s > 0 ? (double)now / state->elapsed_s : 0, left = rate > 0 ? (double)(state->runs - state->finished) / rate : 0;
    fprintf(stderr, "\rsweep: %lld of %lld runs", (long long)state->finished, (long long)state->runs);
    if (now > 0)
        fprintf(stderr, ", %.3g a second, %.0f h %02.0f min %02.0f s left  ", rate, floor(left / 3600), floor(fmod(left, 3600) / 60), floor(fmod(left, 60)));
}
