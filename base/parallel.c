#include "base/parallel.h"

#include "base/heap.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <time.h>
#include <unistd.h>

typedef struct Pool {
    atomic_long next, done;
    long count;
    void (*job)(void *, long);
    void *context;
    bool is_tried;           // the calling thread is within heap_try() …
    atomic_size_t lacking;   // … and what broke off a thread of this pool [bytes]; 0: nothing did
} Pool;

static void do_jobs(void *argument)
{
    Pool *pool = argument;
    for (long index; (index = atomic_fetch_add(&pool->next, 1)) < pool->count;) {
        pool->job(pool->context, index);
        atomic_fetch_add(&pool->done, 1);
    }
}

// A jump cannot leave its thread: the calling one breaks off for all of them.
static void *work(void *argument)
{
    Pool *pool = argument;
    size_t lacking = 0;
    if (!pool->is_tried)
        do_jobs(pool);
    else if (!heap_try(do_jobs, pool, &lacking)) {
        atomic_store(&pool->next, pool->count);
        atomic_store(&pool->lacking, lacking);
    }
    return NULL;
}

int parallel_thread_count(int threads)
{
    if (threads <= 0)
        threads = (int)sysconf(_SC_NPROCESSORS_ONLN);
    return threads < 1 ? 1 : threads > PARALLEL_THREADS_MOST ? PARALLEL_THREADS_MOST : threads;
}

void parallel_for(int threads, long count, void (*job)(void *, long), void *context, const Progress *progress)
{
    Pool pool = {.count = count, .job = job, .context = context, .is_tried = heap_is_tried()};
    pthread_t thread[PARALLEL_THREADS_MOST];
    int wanted = parallel_thread_count(threads), started = 0;
    if (wanted > count)
        wanted = count > 0 ? (int)count : 1;
    // with progress the calling thread monitors; otherwise it works too
    int extra = progress && progress->call ? wanted : wanted - 1;
    while (started < extra && pthread_create(&thread[started], NULL, work, &pool) == 0)
        started++;
    if (progress && progress->call && started > 0) {
        for (long done; (done = atomic_load(&pool.done)) < count && atomic_load(&pool.lacking) == 0;) {
            progress->call(progress->context, done, count);
            nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
        }
    } else {
        work(&pool);
    }
    for (int i = 0; i < started; i++)
        pthread_join(thread[i], NULL);
    if (atomic_load(&pool.lacking) > 0)
        heap_is_empty(atomic_load(&pool.lacking), __FILE__);
    if (progress && progress->call)
        progress->call(progress->context, count, count);
}
