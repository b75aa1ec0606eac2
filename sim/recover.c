#include "sim/recover.h"

#include "sim/replay.h"
#include "sim/rescore.h"
#include "sim/session_files.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

// Only a session has a trainee and a date.
static const char *device_of(const RecordedRun *run) { return run->trainee || run->date ? "not known: the session was interrupted" : "none: a scripted run"; }

static bool save(const RecordedRun *run, const Scene *scene, const OpenVessel *open, const char *recording, void (*progress)(void *, double), void *context,
                 Faults *faults)
{
    static const double often_s = 0.05;
    Rescore *rescore = rescore_create(run, scene, open, faults);
    if (!rescore)
        return false;
    while (rescore_first_different(rescore) < 0 && rescore_steps(rescore) < run->step_count) {
        rescore_advance(rescore, run->step_count, often_s);
        if (progress)
            progress(context, (double)rescore_steps(rescore) / (double)run->step_count);
    }
    bool good = rescore_first_different(rescore) < 0;
    char date[SESSION_DATE];
    struct stat file;
    if (run->date && session_is_date(run->date))
        snprintf(date, sizeof date, "%s", run->date);
    else
        session_date(stat(recording, &file) == 0 ? file.st_mtime : 0, date);
    if (!good)
        faults_add(faults, recording, 0, 0, "cannot be scored: step %lld gives another state than the recorded one; see `seldinger replay --verify`",
                   (long long)rescore_first_different(rescore));
    else
        good = session_files_save(scene, run->trainee ? run->trainee : "", device_of(run), date, rescore_score(rescore), recording, faults);
    rescore_free(rescore);
    return good;
}

bool recover_session(const char *recording, const OpenVesselOptions *options, void (*progress)(void *context, double part), void *context, Faults *faults)
{
    OpenVessel open = {0};
    int before = faults->count;
    RecordedRun *run = recorded_run_load_series(recording, faults);
    if (run && run->step_count < 1)
        faults_add(faults, recording, 0, 0, "holds no step to be scored");
    Scene *scene = run && faults->count == before ? replay_scene(run, recording, faults) : NULL;
    bool good = scene && open_vessel(scene, options, &open, faults) && open_vessel_inlet(scene, &open, faults) &&
                save(run, scene, &open, recording, progress, context, faults);
    open_vessel_close(&open);
    scene_free(scene);
    recorded_run_free(run);
    return good;
}
