#include "study/queue.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct Queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    QueueState state;
    int64_t next;
    unsigned char *done;     // (runs) bits
    double begin_s;
    Journal *journal;
    const volatile sig_atomic_t *stop;
    Faults *faults;
};

static bool is_done(const Queue *queue, int64_t run) { return queue->done[run >> 3] >> (run & 7) & 1; }

static RunStatus status_of(const char *line)
{
    static const char key[] = "\"status\":\"";
    const char *at = strstr(line, key);
    for (int i = 0; at && i < RUN_STATUS_COUNT; i++)
        if (!strncmp(at + sizeof key - 1, run_status_name[i], strlen(run_status_name[i])))
            return (RunStatus)i;
    return RUN_FAILED;
}

static void mark(void *context, int64_t run, const char *text, int64_t offset)
{
    (void)offset;
    Queue *queue = context;
    if (is_done(queue, run))
        return;
    queue->done[run >> 3] = (unsigned char)(queue->done[run >> 3] | 1 << (run & 7));
    queue->state.finished++;
    queue->state.count[status_of(text)]++;
}

Queue *queue_create(int64_t runs, Journal *journal, const volatile sig_atomic_t *stop, Faults *faults)
{
    Queue *queue = HEAP_ZEROED(1, sizeof *queue);
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->changed, NULL);
    queue->done = HEAP_ZEROED((size_t)runs / 8 + 1, 1);
    queue->state.runs = runs;
    queue->journal = journal;
    queue->stop = stop;
    queue->faults = faults;
    queue->state.damaged = journal_read(journal, mark, queue);
    queue->state.before = queue->state.finished;
    queue->begin_s = clock_s(CLOCK_MONOTONIC);
    return queue;
}

void queue_free(Queue *queue)
{
    if (!queue)
        return;
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->lock);
    free(queue->done);
    free(queue);
}

int64_t queue_take(Queue *queue)
{
    int64_t run = -1;
    pthread_mutex_lock(&queue->lock);
    while (queue->next < queue->state.runs && is_done(queue, queue->next))
        queue->next++;
    if (queue->next < queue->state.runs && !queue->state.is_broken && !(queue->stop && *queue->stop))
        run = queue->next++;
    pthread_mutex_unlock(&queue->lock);
    return run;
}

void queue_finish(Queue *queue, const char *line)
{
    if (!line)
        return;
    pthread_mutex_lock(&queue->lock);
    if (!queue->state.is_broken && journal_add(queue->journal, line, queue->faults))
        mark(queue, strtoll(line + strlen("{\"run\":"), NULL, 10), line, 0);
    else
        queue->state.is_broken = true;
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
}

void queue_break(Queue *queue, const char *file, const char *why)
{
    pthread_mutex_lock(&queue->lock);
    if (!queue->state.is_broken)
        faults_add(queue->faults, file, 0, 0, "%.400s", why);
    queue->state.is_broken = true;
    pthread_mutex_unlock(&queue->lock);
}

QueueState queue_state(Queue *queue)
{
    pthread_mutex_lock(&queue->lock);
    QueueState state = queue->state;
    pthread_mutex_unlock(&queue->lock);
    state.elapsed_s = clock_s(CLOCK_MONOTONIC) - queue->begin_s;
    return state;
}

void queue_wait(Queue *queue, double seconds)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    int64_t ns = until.tv_nsec + (int64_t)(seconds * 1e9);
    until.tv_sec += (time_t)(ns / 1000000000);
    until.tv_nsec = (long)(ns % 1000000000);
    pthread_mutex_lock(&queue->lock);
    pthread_cond_timedwait(&queue->changed, &queue->lock, &until);
    pthread_mutex_unlock(&queue->lock);
}
