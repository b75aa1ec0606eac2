// The threads wait between two steps. In a step each takes the next simulator that nobody has begun, so a slow one delays no others; simulators share only their
// scenes, which do not change, so states do not depend on which thread takes what.
#include "seldinger/batch.h"

#include "base/base.h"
#include "sim/library/simulator.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

enum { COUNT_MOST = 1000000 };

struct SelBatch {
    SelContext *context;
    int count;
    SelSimulator **simulator; // (count), each with its own context: they report errors at the same time
    SelBatchRow *row;         // (count)
    bool has_hashes;
    // the step
    const SelHand *hand;      // NULL: rows only
    const unsigned char *skip;
    int steps;
    atomic_int next;          // simulator that nobody has begun
    atomic_int failed;        // the lowest simulator whose step failed; count: none
    // the threads
    pthread_mutex_t lock;
    pthread_cond_t begins, ends;
    unsigned long turn;       // of the step …
    int busy;                 // … and threads still at it
    bool is_over;
    int thread_count;         // without the caller's
    pthread_t thread[PARALLEL_THREADS_MOST];
    pid_t process;            // a forked child has no threads
};

void sel_batch_options_init(SelBatchOptions *options, size_t size)
{
    SelBatchOptions own = {.keeps_score = 1};
    result_give(options, size, &own, sizeof own);
}

// --- the work ---

static void read_row(const SelBatch *b, int i)
{
    SelSimulator *s = b->simulator[i];
    SelBatchRow *row = &b->row[i];
    SelReport report;
    sel_simulator_report(s, &report, sizeof report);
    *row = (SelBatchRow){.time_s = sel_simulator_time_s(s),
                         .wall_force_max_n = report.wall_force_max_n,
                         .wall_force_sum_n = report.wall_force_sum_n,
                         .penetration_mm = report.penetration_mm,
                         .target_mm = HUGE_VAL,
                         .hash = b->has_hashes ? sel_simulator_hash(s) : 0,
                         .flags = report.flags,
                         .flags_ever = report.flags_ever,
                         .contacts = report.contacts};
    for (int k = 0; k < SEL_TOOLS_MOST; k++) {
        row->push_n[k] = report.push_n[k], row->torque_n_mm[k] = report.torque_n_mm[k];
        row->inserted_mm[k] = report.inserted_mm[k], row->turned_deg[k] = report.turned_deg[k];
    }
    sel_simulator_tip(s, s->scene->scene->tool_count - 1, row->tip_mm);
    if (s->scene->scene->target_count > 0) {
        const WireState *state = simulator_state(s->simulator);
        row->target_mm = vec3_distance(state->position[state->node_count - 1], s->scene->scene->target[0].point);
        row->is_reached = simulator_targets(s->simulator)[0].reached;
    }
}

static void note_failure(SelBatch *b, int i)
{
    int lowest = atomic_load(&b->failed);
    while (i < lowest && !atomic_compare_exchange_weak(&b->failed, &lowest, i))
        continue;
}

static void do_share(SelBatch *b)
{
    for (int i; (i = atomic_fetch_add(&b->next, 1)) < b->count;) {
        bool is_stepped = b->hand && !(b->skip && b->skip[i]);
        if (is_stepped && sel_simulator_repeat(b->simulator[i], &b->hand[i], b->steps) != SEL_OK)
            note_failure(b, i);
        if (is_stepped || !b->hand)
            read_row(b, i);
    }
}

static void *work(void *argument)
{
    SelBatch *b = argument;
    pthread_mutex_lock(&b->lock);
    for (unsigned long done = 0;;) {
        while (b->turn == done && !b->is_over)
            pthread_cond_wait(&b->begins, &b->lock);
        if (b->is_over)
            break;
        done = b->turn;
        pthread_mutex_unlock(&b->lock);
        do_share(b);
        pthread_mutex_lock(&b->lock);
        if (--b->busy == 0)
            pthread_cond_signal(&b->ends);
    }
    pthread_mutex_unlock(&b->lock);
    return NULL;
}

static void do_all(SelBatch *b, const SelHand *hand, int steps, const unsigned char *skip)
{
    bool has_threads = b->thread_count > 0 && getpid() == b->process;
    b->hand = hand, b->steps = steps, b->skip = skip;
    atomic_store(&b->next, 0);
    atomic_store(&b->failed, b->count);
    if (has_threads) {
        pthread_mutex_lock(&b->lock);
        b->busy = b->thread_count;
        b->turn++;
        pthread_cond_broadcast(&b->begins);
        pthread_mutex_unlock(&b->lock);
    }
    do_share(b);
    if (!has_threads)
        return;
    pthread_mutex_lock(&b->lock);
    while (b->busy > 0)
        pthread_cond_wait(&b->ends, &b->lock);
    pthread_mutex_unlock(&b->lock);
}

// --- life ---

static void stop_threads(SelBatch *b)
{
    pthread_mutex_lock(&b->lock);
    b->is_over = true;
    pthread_cond_broadcast(&b->begins);
    pthread_mutex_unlock(&b->lock);
    for (int i = 0; i < b->thread_count; i++)
        pthread_join(b->thread[i], NULL);
    pthread_mutex_destroy(&b->lock);
    pthread_cond_destroy(&b->begins);
    pthread_cond_destroy(&b->ends);
}

void sel_batch_destroy(SelBatch *b)
{
    if (!b)
        return;
    if (getpid() == b->process)
        stop_threads(b);
    for (int i = 0; b->simulator && i < b->count; i++)
        sel_simulator_destroy(b->simulator[i]);
    free(b->simulator);
    free(b->row);
    context_release(b->context);
    free(b);
}

// The faults of a simulator become the batch's, with its index.
static SelStatus pass_on(SelContext *context, const SelContext *from, int index, SelStatus status)
{
    faults_clear(&context->faults);
    for (int i = 0; i < sel_fault_count(from); i++)
        faults_add(&context->faults, "sel_batch", 0, 0, "simulator %d: %s", index, sel_fault(from, i));
    return status;
}

static SelStatus fill(SelContext *context, SelBatch *b, const SelScene *const *scene, const SelBatchOptions *options)
{
    SelSimulatorOptions how = sel_simulator_defaults();
    how.keeps_score = options->keeps_score;
    for (int i = 0; i < b->count; i++) {
        SelContext *own = NULL;
        SelStatus status = scene[i] ? sel_context_create(NULL, &own) : SEL_ERROR_ARGUMENT;
        if (status != SEL_OK)
            return context_refuse(context, status, "sel_batch_create", scene[i] ? "no memory for a context" : "a scene is NULL");
        status = sel_simulator_create(own, scene[i], &how, &b->simulator[i]);
        if (status != SEL_OK)
            pass_on(context, own, i, status);
        sel_context_destroy(own);        // the simulator holds it
        if (status != SEL_OK)
            return status;
    }
    return SEL_OK;
}

static SelBatch *new_batch(SelContext *context, int count)
{
    SelBatch *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    pthread_mutex_init(&b->lock, NULL);
    pthread_cond_init(&b->begins, NULL);
    pthread_cond_init(&b->ends, NULL);
    b->context = context_held(context);
    b->process = getpid();
    b->count = count;
    b->simulator = calloc((size_t)count, sizeof(SelSimulator *));
    b->row = calloc((size_t)count, sizeof *b->row);
    if (b->simulator && b->row)
        return b;
    sel_batch_destroy(b);
    return NULL;
}

// With fewer threads than wanted it is slower, no more.
static void start_threads(SelBatch *b, int threads)
{
    int wanted = parallel_thread_count(threads);
    if (wanted > b->count)
        wanted = b->count;
    while (b->thread_count < wanted - 1 && pthread_create(&b->thread[b->thread_count], NULL, work, b) == 0)
        b->thread_count++;
}

SelStatus sel_batch_create(SelContext *context, int count, const SelScene *const *scene, const SelBatchOptions *options, SelBatch **batch)
{
    SelBatchOptions own = {.keeps_score = 1};
    if (!context || !scene || !batch || count < 1 || count > COUNT_MOST)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, scene or batch is NULL, or count is not within 1 to 1000000");
    if (!options_take(&own, sizeof own, options) || own.threads < 0 || own.threads > PARALLEL_THREADS_MOST)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "the size of options is not set, or threads is not within 0 to 256");
    SelBatch *b = new_batch(context, count);
    if (!b)
        return context_refuse(context, SEL_ERROR_MEMORY, __func__, "no memory for the batch");
    SelStatus status = fill(context, b, scene, &own);
    if (status != SEL_OK) {
        sel_batch_destroy(b);
        return status;
    }
    start_threads(b, own.threads);
    sel_batch_refresh(b);
    *batch = b;
    return SEL_OK;
}

int sel_batch_count(const SelBatch *b) { return b ? b->count : 0; }

SelSimulator *sel_batch_simulator(SelBatch *b, int index) { return b && index >= 0 && index < b->count ? b->simulator[index] : NULL; }

const SelBatchRow *sel_batch_rows(const SelBatch *b) { return b ? b->row : NULL; }

SelStatus sel_batch_hashes(SelBatch *b, int are_wanted)
{
    if (!b)
        return SEL_ERROR_ARGUMENT;
    b->has_hashes = are_wanted != 0;
    return sel_batch_refresh(b);
}

// --- steps ---

SelStatus sel_batch_step(SelBatch *b, const SelHand *hand, int steps, const unsigned char *skip)
{
    if (!b || !hand || steps < 0)
        return context_refuse(b ? b->context : NULL, SEL_ERROR_ARGUMENT, __func__, "batch or hand is NULL, or steps is negative");
    for (int i = 0; i < b->count; i++) {
        const char *trouble = hand_trouble(&hand[i]);
        if (!trouble)
            continue;
        faults_clear(&b->context->faults);
        faults_add(&b->context->faults, __func__, 0, 0, "simulator %d: %s", i, trouble);
        return SEL_ERROR_ARGUMENT;
    }
    do_all(b, hand, steps, skip);
    int failed = atomic_load(&b->failed);
    return failed < b->count ? pass_on(b->context, b->simulator[failed]->context, failed, SEL_ERROR_OUTPUT) : SEL_OK;
}

SelStatus sel_batch_refresh(SelBatch *b)
{
    if (!b)
        return SEL_ERROR_ARGUMENT;
    do_all(b, NULL, 0, NULL);
    return SEL_OK;
}
