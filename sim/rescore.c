#include "sim/rescore.h"

#include "sim/clock.h"
#include "sim/replay.h"
#include "sim/session_tracker.h"

#include <stdlib.h>

static const double kept_s = 0.1;

struct Rescore {
    const RecordedRun *run;
    Simulator *simulator;
    SessionTracker *tracker;
    int64_t steps, different;
    bool was_watched;
    int kept_count;
    ScoreFigures *kept;              // at 0, 0.1, 0.2 s …
    int capacity;
};

static void keep(Rescore *rescore)
{
    if (rescore->kept_count == rescore->capacity || simulator_time_s(rescore->simulator) < rescore->kept_count * kept_s - 1e-9)
        return;
    rescore->kept[rescore->kept_count++] = score_figures(session_tracker_score(rescore->tracker));
}

Rescore *rescore_create(const RecordedRun *run, const Scene *scene, const OpenVessel *open, Faults *faults)
{
    Rescore *rescore = calloc(1, sizeof *rescore);
    if (rescore) {
        rescore->run = run;
        rescore->different = -1;
        rescore->was_watched = recorded_run_was_watched(run);
        rescore->capacity = (int)fmin(1e7, (double)run->step_count * run->step_ms / 1000 / kept_s + 2);
        rescore->kept = calloc((size_t)rescore->capacity, sizeof *rescore->kept);
        rescore->simulator = simulator_create(scene, open->vessel, faults);
        rescore->tracker = rescore->simulator ? session_tracker_create(rescore->simulator, open->tree) : NULL;
    }
    bool fits = rescore && rescore->simulator && replay_fits(run, rescore->simulator, faults);
    if (fits && rescore->kept && rescore->tracker) {
        keep(rescore);
        return rescore;
    }
    if (!rescore || (fits && !(rescore->kept && rescore->tracker)))
        faults_add(faults, scene->path, 0, 0, "not enough memory to simulate it again");
    rescore_free(rescore);
    return NULL;
}

void rescore_free(Rescore *rescore)
{
    if (!rescore)
        return;
    session_tracker_free(rescore->tracker);
    simulator_destroy(rescore->simulator);
    free(rescore->kept);
    free(rescore);
}

void rescore_advance(Rescore *rescore, int64_t to, double budget_s)
{
    const RecordedRun *run = rescore->run;
    double until = clock_s(CLOCK_MONOTONIC) + budget_s;
    to = to < run->step_count ? to : run->step_count;
    while (rescore->different < 0 && rescore->steps < to && clock_s(CLOCK_MONOTONIC) < until) {
        int64_t i = rescore->steps++;
        ToolCommands commands = recorded_run_commands(run, i);
        simulator_step(rescore->simulator, &commands);
        session_tracker_step(rescore->tracker, rescore->simulator, &commands, rescore->was_watched ? &run->xray[i] : NULL);
        if (simulator_hash(rescore->simulator) != run->state_hash[i])
            rescore->different = i;
        else
            keep(rescore);
    }
}

const ScoreFigures *rescore_at(Rescore *rescore, double time_s)
{
    int at = (int)fmax(0, fmin(time_s / kept_s + 1e-6, rescore->kept_count - 1));
    return &rescore->kept[at];
}

int64_t rescore_first_different(const Rescore *rescore) { return rescore->different; }
int64_t rescore_steps(const Rescore *rescore) { return rescore->steps; }
const Score *rescore_score(const Rescore *rescore) { return session_tracker_score(rescore->tracker); }
