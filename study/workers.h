// Threads that take runs from a queue, and its progress on a terminal.
#ifndef SELDINGER_STUDY_WORKERS_H
#define SELDINGER_STUDY_WORKERS_H

#include "study/queue.h"

typedef struct Workers Workers;

// `threads` 0: one for each processor. `recordings` as for one_run().
Workers *workers_start(OpenStudy *open, Queue *queue, int threads, const char *recordings, const volatile sig_atomic_t *stop);
int workers_busy(Workers *workers);  // threads that have not ended: they end when the queue gives no run
void workers_join(Workers *workers); // waits and frees

// Draws one line on standard error: runs, rate, time left.
void sweep_progress(const QueueState *state);

#endif
