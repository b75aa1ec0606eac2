#include "study/queue_model.h"

#include "base/base.h"

#include <math.h>
#include <stdlib.h>

// A heap of ranks by the time at which their question reaches the manager.
typedef struct Asking {
    double at_s;
    int rank;
} Asking;

static bool is_before(Asking a, Asking b) { return a.at_s < b.at_s || (a.at_s == b.at_s && a.rank < b.rank); }

static void sink(Asking *heap, int count, int at)
{
    for (int child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && is_before(heap[child + 1], heap[child]))
            child++;
        if (!is_before(heap[child], heap[at]))
            return;
        Asking kept = heap[at];
        heap[at] = heap[child];
        heap[child] = kept;
    }
}

QueueForecast queue_forecast(const QueueModel *model)
{
    QueueForecast forecast = {0};
    Asking *heap = HEAP_ZEROED((size_t)model->ranks, sizeof *heap);
    double free_s = 0, work_s = 0, busy_s = 0, waited_s = 0;
    for (int i = 0; i < model->ranks; i++)
        heap[i].rank = i;
    for (int64_t run = 0; run < model->runs; run++) {
        // the rank that asks first gets the run
        double begin = fmax(heap[0].at_s, free_s), link = heap[0].rank == 0 ? 0 : model->message_s;
        free_s = begin + model->service_s;
        busy_s += model->service_s;
        waited_s += free_s - heap[0].at_s + 2 * link;
        double run_s = model->run_s[run % model->measured];
        work_s += run_s;
        heap[0].at_s = free_s + run_s + 2 * link;
        forecast.wall_s = fmax(forecast.wall_s, heap[0].at_s);
        sink(heap, model->ranks, 0);
    }
    free(heap);
    if (forecast.wall_s > 0) {
        forecast.efficiency = work_s / (model->ranks * forecast.wall_s);
        forecast.manager_share = busy_s / forecast.wall_s;
        forecast.results_a_second = (double)model->runs / forecast.wall_s;
        forecast.wait_s = waited_s / (double)model->runs;
    }
    return forecast;
}
