// Which run is next, and what has come back: the manager of a sweep. Thread-safe. Memory: one bit for each run.
#ifndef SELDINGER_STUDY_QUEUE_H
#define SELDINGER_STUDY_QUEUE_H

#include "study/journal.h"
#include "study/one_run.h"

typedef struct Queue Queue;

typedef struct QueueState {
    int64_t runs, finished, before;      // all; finished, with those of earlier calls; those of earlier calls
    int64_t count[RUN_STATUS_COUNT];     // of the finished
    int64_t damaged;         // lines of the journal that are not sound; their runs are repeated
    double elapsed_s;
    bool is_broken;          // a result or recording could not be written: no run is given out any more
} QueueState;

// Reads the journal. `journal`, `stop` (a flag that ends the sweep, may be NULL) and `faults` must outlive the queue.
Queue *queue_create(int64_t runs, Journal *journal, const volatile sig_atomic_t *stop, Faults *faults);
void queue_free(Queue *queue);       // NULL is allowed
// The next run without a result, -1 if there is none or the sweep is to stop.
int64_t queue_take(Queue *queue);
// The result of a run that was taken. `line` NULL: it was stopped.
void queue_finish(Queue *queue, const char *line);
void queue_break(Queue *queue, const char *file, const char *why);   // a run could not be done here
QueueState queue_state(Queue *queue);
// Waits until the number of finished runs changes, at most `seconds`.
void queue_wait(Queue *queue, double seconds);

#endif
