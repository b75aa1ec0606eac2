#include "sim/case_builder.h"

#include "base/base.h"
#include "sim/clock.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

// What of the finished work stays when another trace is wanted.
typedef enum {
    KEPT_NOTHING,
    KEPT_TREE,               // as tracked
    KEPT_MODEL               // and as fitted
} Kept;

struct CaseBuilder {
    CaseOptions options;         // its trace is `trace`, its progress `watching`
    Progress watching;
    RbtWatch watch;
    pthread_t thread;
    atomic_bool stops;           // the work that is running
    pthread_mutex_t lock;        // of all below
    pthread_cond_t change;       // something is wanted, or the thread is idle
    bool quits, is_left, has_ended, is_wanted;
    Kept keeps;                  // of what is wanted: what its trace leaves as it is
    Kept held;                   // what `work` holds
    char *wanted;                // the trace that is wanted next; NULL with is_wanted: none
    char *trace;                 // of what runs; the thread's own
    char *title;                 // the trace of the case that is there, with the latest choices of its scene
    BuildProgress progress;
    RbtSeen *seen;
    int seen_count, seen_capacity;
    // written by the thread before the stage that lets the owner read them
    Volume *volume, *reduced;
    Volume *soft;                // of a CT
    float low, high;
    CaseWork work;
    ModelField wall;
    CaseMark mark[CASE_MARKS];
    int mark_count;
    TriangleMesh *mesh;
    Faults faults;
};

static bool is_stopped(void *context) { return atomic_load(&((CaseBuilder *)context)->stops); }

static void take_part(void *context, long done, long total)
{
    CaseBuilder *b = context;
    pthread_mutex_lock(&b->lock);
    b->progress.part = total > 0 ? (double)done / (double)total : 0;
    pthread_mutex_unlock(&b->lock);
}

static void take_seen(void *context, const RbtSeen *node, int count)
{
    CaseBuilder *b = context;
    pthread_mutex_lock(&b->lock);
    if (count > b->seen_capacity) {
        b->seen_capacity = 2 * count;
        b->seen = HEAP_GROWN(b->seen, (size_t)b->seen_capacity, sizeof *b->seen);
    }
    memcpy(b->seen, node, (size_t)count * sizeof *node);
    b->seen_count = count;
    b->progress.seen++;
    pthread_mutex_unlock(&b->lock);
}

static void note_time(CaseBuilder *b, double *time, double *begun)
{
    double now = clock_s(CLOCK_MONOTONIC);
    pthread_mutex_lock(&b->lock);
    *time = now - *begun;
    pthread_mutex_unlock(&b->lock);
    *begun = now;
}

static bool enter(CaseBuilder *b, BuildStage stage)
{
    pthread_mutex_lock(&b->lock);
    bool goes_on = !b->is_wanted && !b->quits;
    if (goes_on) {
        b->progress.stage = stage;
        b->progress.part = 0;
    }
    pthread_mutex_unlock(&b->lock);
    return goes_on;
}

static void fail(CaseBuilder *b)
{
    if (!enter(b, BUILD_FAILED))
        return;
    pthread_mutex_lock(&b->lock);
    snprintf(b->progress.message, sizeof b->progress.message, "%s", b->faults.count > 0 ? b->faults.text[0] : "out of memory");
    pthread_mutex_unlock(&b->lock);
}

static void forget_wall(CaseBuilder *b)
{
    triangle_mesh_free(b->mesh);
    b->mesh = NULL;
    b->mark_count = 0;
    model_field_free(&b->wall);
    b->wall = (ModelField){0};
    faults_clear(&b->faults);
}

static void forget_work(CaseBuilder *b)
{
    forget_wall(b);
    case_work_free(&b->work);
}

static void look(CaseBuilder *b)
{
    const double wire = 0.18;        // [mm] radius of the thinnest wire
    Missed missed;
    // bone is as bright as vessels and much larger: a CT is searched without it
    if (!missed_find(volume_has_ct_numbers(b->volume) ? b->reduced : b->volume, b->work.file.tree, &missed))
        missed = (Missed){.held = 1};
    int count = case_marks_find(&b->work, &b->wall, &missed, wire, b->options.words, b->mark);
    b->mark_count = count > 0 ? count : 0;
    pthread_mutex_lock(&b->lock);
    b->progress.held = missed.held;
    pthread_mutex_unlock(&b->lock);
    if (!is_stopped(b))
        b->mesh = triangle_mesh_of_model(&b->wall, 0);
}

static void show_tree(CaseBuilder *b)
{
    const VesselTree *tree = b->work.file.tree;
    RbtSeen *node = HEAP_ZEROED((size_t)tree->node_count, sizeof *node);
    for (int i = 0; i < tree->node_count; i++)
        node[i] = (RbtSeen){tree->center[i], tree->radius[i], tree->parent[i], tree->kind[i]};
    take_seen(b, node, tree->node_count);
    free(node);
}

// From the fitted model on.
static void build_wall(CaseBuilder *b, const CaseOptions *options, double begun)
{
    if (!case_work_edit(&b->work, options, &b->faults) || !case_work_wall(&b->work, &b->wall)) {
        fail(b);
        return;
    }
    if (!enter(b, BUILD_LOOKING))
        return;
    look(b);
    note_time(b, &b->progress.look_s, &begun);
    enter(b, BUILD_DONE);
}

static void hold(CaseBuilder *b, Kept held)
{
    pthread_mutex_lock(&b->lock);
    b->held = held;
    pthread_mutex_unlock(&b->lock);
}

static bool track(CaseBuilder *b, const CaseOptions *options)
{
    forget_work(b);
    return enter(b, BUILD_TRACKING) && case_work_track(&b->work, options, b->volume, &b->watch, &b->faults);
}

static void build(CaseBuilder *b, Kept kept)
{
    CaseOptions options = b->options;
    double begun = clock_s(CLOCK_MONOTONIC);
    BuildProgress *p = &b->progress;
    options.trace = b->trace;
    options.progress = &b->watching;
    if (kept > KEPT_NOTHING)
        forget_wall(b);
    if (kept > KEPT_NOTHING ? !case_work_choose(&b->work, &options, &b->faults) : !track(b, &options)) {
        fail(b);
        return;
    }
    if (kept == KEPT_MODEL) {
        build_wall(b, &options, begun);
        return;
    }
    if (kept == KEPT_NOTHING) {
        show_tree(b);
        note_time(b, &p->track_s, &begun);
        hold(b, KEPT_TREE);
    }
    if (!enter(b, BUILD_FITTING))
        return;
    if (!case_work_fit(&b->work, &options, &b->faults)) {
        fail(b);
        return;
    }
    note_time(b, &p->fit_s, &begun);
    hold(b, KEPT_MODEL);
    build_wall(b, &options, begun);
}

static void free_all(CaseBuilder *b)
{
    forget_work(b);
    volume_free(b->volume);
    volume_free(b->reduced);
    volume_free(b->soft);
    free(b->seen);
    free(b->trace);
    free(b->title);
    free(b->wanted);
    pthread_mutex_destroy(&b->lock);
    pthread_cond_destroy(&b->change);
    free(b);
}

// Of a CT what is not bone, from water on.
static void find_brightness(CaseBuilder *b, const Volume *volume)
{
    if (!volume_has_ct_numbers(volume)) {
        volume_brightness(volume, &b->low, &b->high);
        return;
    }
    const float water = 0, faint = 300;      // [HU] faint: contrast agent at least
    volume_brightness(b->reduced, &b->low, &b->high);
    b->low = water;
    b->high = b->high < faint ? faint : b->high;
}

static void load(CaseBuilder *b)
{
    enum { REDUCED = 160 };          // voxels along an axis: a projection of them takes 20 ms of one core
    double begun = clock_s(CLOCK_MONOTONIC);
    Volume *volume = volume_load_with(b->options.input, &b->watching, &b->faults);
    const bool is_ct = volume && volume_has_ct_numbers(volume);
    if (is_ct)
        b->soft = ct_soft_tissue(volume, (double)CT_NUMBER_BONE);
    const Volume *shown = is_ct ? b->soft : volume;
    if (volume && !(shown && (b->reduced = volume_reduced(shown, REDUCED)))) {
        volume_free(volume);
        volume = NULL;
    }
    if (volume)
        find_brightness(b, volume);
    pthread_mutex_lock(&b->lock);
    b->volume = volume;
    b->progress.load_s = clock_s(CLOCK_MONOTONIC) - begun;
    b->progress.part = 0;
    b->progress.stage = volume ? BUILD_IDLE : BUILD_FAILED;
    if (!volume)
        snprintf(b->progress.message, sizeof b->progress.message, "%s", b->faults.count > 0 ? b->faults.text[0] : "out of memory");
    pthread_mutex_unlock(&b->lock);
}

static void *run(void *context)
{
    CaseBuilder *b = context;
    load(b);
    pthread_mutex_lock(&b->lock);
    while (!b->quits) {
        if (!b->is_wanted) {
            pthread_cond_broadcast(&b->change);
            pthread_cond_wait(&b->change, &b->lock);
            continue;
        }
        free(b->trace);
        b->trace = b->wanted;
        b->wanted = NULL;
        b->is_wanted = false;
        Kept kept = b->keeps < b->held ? b->keeps : b->held;
        b->held = kept;
        atomic_store(&b->stops, false);
        pthread_mutex_unlock(&b->lock);
        if (b->trace && b->volume)
            build(b, kept);
        else
            forget_work(b);
        pthread_mutex_lock(&b->lock);
    }
    b->has_ended = true;
    pthread_cond_broadcast(&b->change);
    bool is_left = b->is_left;
    pthread_mutex_unlock(&b->lock);
    if (is_left)
        free_all(b);
    return NULL;
}

CaseBuilder *case_builder_create(const CaseOptions *options)
{
    CaseBuilder *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    b->options = *options;
    b->watching = (Progress){.call = take_part, .context = b, .is_stopped = is_stopped};
    b->watch = (RbtWatch){.context = b, .show = take_seen, .is_stopped = is_stopped, .words = options->words};
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&b->lock, NULL);
    pthread_cond_init(&b->change, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&b->thread, NULL, run, b) == 0)
        return b;
    free_all(b);
    return NULL;
}

// Waits for `*done`, or for the thread to be idle if it is NULL. The lock is held.
static void wait_for(CaseBuilder *b, const bool *done, double longest_s)
{
    struct timespec end;
    clock_gettime(CLOCK_MONOTONIC, &end);
    end.tv_sec += (time_t)longest_s;
    end.tv_nsec += (long)(1e9 * (longest_s - floor(longest_s)));
    if (end.tv_nsec >= 1000000000)
        end.tv_sec++, end.tv_nsec -= 1000000000;
    for (int code = 0; code == 0;) {
        BuildStage stage = b->progress.stage;
        if (done ? *done : !b->is_wanted && (stage == BUILD_IDLE || stage == BUILD_DONE || stage == BUILD_FAILED))
            return;
        code = pthread_cond_timedwait(&b->change, &b->lock, &end);
    }
}

void case_builder_free(CaseBuilder *b)
{
    const double patience = 0.3;     // [s] that a user hardly notices
    if (!b)
        return;
    pthread_mutex_lock(&b->lock);
    b->quits = true;
    atomic_store(&b->stops, true);
    pthread_cond_broadcast(&b->change);
    wait_for(b, &b->has_ended, patience);
    bool has_ended = b->has_ended;
    b->is_left = !has_ended;
    pthread_t thread = b->thread;
    pthread_mutex_unlock(&b->lock);
    if (!has_ended) {
        pthread_detach(thread);
        return;
    }
    pthread_join(thread, NULL);
    free_all(b);
}

BuildProgress case_builder_progress(CaseBuilder *b)
{
    pthread_mutex_lock(&b->lock);
    BuildProgress progress = b->progress;
    pthread_mutex_unlock(&b->lock);
    return progress;
}

static BuildStage stage_of(const CaseBuilder *builder)
{
    CaseBuilder *b = (CaseBuilder *)(uintptr_t)builder;      // only its lock changes
    pthread_mutex_lock(&b->lock);
    BuildStage stage = b->progress.stage;
    pthread_mutex_unlock(&b->lock);
    return stage;
}

const Volume *case_builder_volume(const CaseBuilder *b) { return stage_of(b) == BUILD_LOADING ? NULL : b->volume; }

const Volume *case_builder_soft(const CaseBuilder *b) { return case_builder_volume(b) ? b->soft : NULL; }

const Volume *case_builder_reduced(const CaseBuilder *b, float *low, float *high)
{
    const Volume *volume = case_builder_volume(b);
    *low = volume ? b->low : 0, *high = volume ? b->high : 1;
    return volume ? b->reduced : NULL;
}

static void want(CaseBuilder *b, const char *trace, Kept keeps)
{
    pthread_mutex_lock(&b->lock);
    if (b->progress.stage != BUILD_LOADING && b->volume) {
        keeps = keeps < b->held ? keeps : b->held;
        b->keeps = b->is_wanted && b->keeps < keeps ? b->keeps : keeps;
        if (b->keeps == KEPT_NOTHING)
            b->seen_count = 0;
        free(b->wanted);
        free(b->title);
        b->wanted = trace ? HEAP_TEXT(trace) : NULL;
        b->title = trace ? HEAP_TEXT(trace) : NULL;
        b->is_wanted = true;
        b->progress.seen++;
        b->progress.stage = !trace ? BUILD_IDLE : b->keeps > KEPT_NOTHING ? BUILD_FITTING : BUILD_TRACKING;
        b->progress.part = 0;
        atomic_store(&b->stops, true);
        pthread_cond_broadcast(&b->change);
    }
    pthread_mutex_unlock(&b->lock);
}

void case_builder_request(CaseBuilder *b, const char *trace) { want(b, trace, KEPT_NOTHING); }
void case_builder_refit(CaseBuilder *b, const char *trace) { want(b, trace, KEPT_TREE); }
void case_builder_edit(CaseBuilder *b, const char *trace) { want(b, trace, KEPT_MODEL); }

void case_builder_retitle(CaseBuilder *b, const char *trace)
{
    pthread_mutex_lock(&b->lock);
    free(b->title);
    b->title = HEAP_TEXT(trace);
    pthread_mutex_unlock(&b->lock);
}

int case_builder_seen(CaseBuilder *b, RbtSeen **node)
{
    pthread_mutex_lock(&b->lock);
    int count = b->seen_count;
    *node = HEAP_GROWN(*node, (size_t)count, sizeof **node);
    if (count > 0)
        memcpy(*node, b->seen, (size_t)count * sizeof **node);
    pthread_mutex_unlock(&b->lock);
    return count;
}

static bool is_there(const CaseBuilder *b, BuildStage least)
{
    BuildStage stage = stage_of(b);
    return stage >= least && stage != BUILD_FAILED;
}

const CaseWork *case_builder_work(const CaseBuilder *b) { return is_there(b, BUILD_LOOKING) ? &b->work : NULL; }
const ModelField *case_builder_wall(const CaseBuilder *b) { return is_there(b, BUILD_LOOKING) ? &b->wall : NULL; }
const TriangleMesh *case_builder_mesh(const CaseBuilder *b) { return is_there(b, BUILD_DONE) ? b->mesh : NULL; }

int case_builder_marks(const CaseBuilder *b, const CaseMark **mark)
{
    *mark = b->mark;
    return is_there(b, BUILD_DONE) ? b->mark_count : 0;
}

bool case_builder_save(CaseBuilder *b, const char *folder, Faults *faults)
{
    CaseOptions options = b->options;
    options.trace = b->title;
    if (!is_there(b, BUILD_LOOKING)) {
        faults_add(faults, folder, 0, 0, "there is no model to save yet");
        return false;
    }
    // the choices of the scene may have changed since the tree was tracked
    return case_work_choose(&b->work, &options, faults) && case_work_write(&b->work, folder, &options, faults);
}

void case_builder_wait(CaseBuilder *b, double longest_s)
{
    pthread_mutex_lock(&b->lock);
    wait_for(b, NULL, longest_s);
    pthread_mutex_unlock(&b->lock);
}
