// How a sweep would grow on more ranks: a queue simulated with the measured times of the runs and of the manager's work for a result.
#ifndef SELDINGER_STUDY_QUEUE_MODEL_H
#define SELDINGER_STUDY_QUEUE_MODEL_H

#include <stdint.h>

typedef struct QueueModel {
    int64_t runs, measured;
    const double *run_s;     // (measured) processor time of each; further runs take these times again, in turn
    double service_s;        // the manager's, for each result
    double message_s;        // of a message between ranks
    int ranks;               // rank 0 works too, beside its service
} QueueModel;

typedef struct QueueForecast {
    double wall_s, efficiency;       // sum of run_s / (ranks * wall_s)
    double manager_share;    // of the time in which the manager serves
    double results_a_second;
    double wait_s;           // mean wait of a rank for its next run
} QueueForecast;

// Runs are given out in their order to whichever rank asks first; the manager answers one question at a time, in the order in which they come.
QueueForecast queue_forecast(const QueueModel *model);

#endif
