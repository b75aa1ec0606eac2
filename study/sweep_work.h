// The runs of a sweep on this machine's threads and, as rank 0, on the other ranks.
#ifndef SELDINGER_STUDY_SWEEP_WORK_H
#define SELDINGER_STUDY_SWEEP_WORK_H

#include "study/ranks.h"
#include "study/workers.h"

// Returns when the queue is empty or the sweep was stopped. `threads` 0: all cores; with several ranks, one. `recordings` as for one_run(). `shows_progress`:
// draws it on standard error.
void sweep_work(OpenStudy *open, Queue *queue, const Ranks *ranks, int threads, const char *recordings, const volatile sig_atomic_t *stop, bool shows_progress);

#endif
