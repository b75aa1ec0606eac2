#include "study/sweep_work.h"

void sweep_work(OpenStudy *open, Queue *queue, const Ranks *ranks, int threads, const char *recordings, const volatile sig_atomic_t *stop, bool shows_progress)
{
    RankHost *host = ranks->count > 1 ? rank_host_create(ranks, queue) : NULL;
    Workers *workers = workers_start(open, queue, host ? 1 : threads, recordings, stop);
    double drawn = 0;
    for (bool others = host; others || workers_busy(workers) > 0;) {
        others = others && rank_host_serve(host);
        queue_wait(queue, host ? 1e-4 : 0.2);
        double now = clock_s(CLOCK_MONOTONIC);
        if (shows_progress && now - drawn > 0.5) {
            QueueState state = queue_state(queue);
            sweep_progress(&state);
            drawn = now;
        }
    }
    workers_join(workers);
    rank_host_free(host);
}
