#include "cli/playback.h"

#include <stdlib.h>
#include <string.h>

// Contrast goes on in steps of this many recorded steps; places to go on from are kept every so many of those.
enum { STRIDE = 10, KEEP_EVERY = 500, MOST_KEPT = 1024 };

typedef struct Place {
    int64_t step;
    PulseClock pulses;
    double injected_ml;          // since the last whole stride
    Contrast *contrast;
} Place;

struct Playback {
    const RecordedRun *run;
    const Scene *scene;
    const VesselTree *tree;
    XrayControl unseen;
    bool is_seen;
    Pose *pose;
    Place now;
    int kept_count;
    int64_t keep_steps;          // between places
    Place kept[MOST_KEPT];
};

static const XrayControl *control(const Playback *playback, int64_t step)
{
    return playback->is_seen ? &playback->run->xray[step] : &playback->unseen;
}

static int64_t frame_at(const RecordedRun *run, int64_t step)
{
    int64_t low = 0, high = run->frame_count - 1;
    while (low < high) {
        int64_t middle = (low + high + 1) / 2;
        if (run->frame_step[middle] <= step)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

static int tip_node(const Playback *playback, int64_t step)
{
    RecordedFrame frame = recorded_run_frame(playback->run, frame_at(playback->run, step));
    return frame.vessel_node[frame.node_count - 1];
}

// Keeps the place reached where it is the next one to keep.
static void keep(Playback *playback)
{
    if (playback->kept_count == MOST_KEPT || playback->now.step != playback->kept_count * playback->keep_steps)
        return;
    Place *place = &playback->kept[playback->kept_count];
    Contrast *contrast = playback->tree ? contrast_create(playback->tree, NULL) : NULL;
    if (playback->tree && !contrast)
        return;
    if (contrast)
        contrast_copy(contrast, playback->now.contrast);
    *place = playback->now;
    place->contrast = contrast;
    playback->kept_count++;
}

// Contrast goes on in whole strides only, as in the session: else what is seen would depend on where one stopped on the way.
static void go_on(Playback *playback, int64_t step)
{
    const RecordedRun *run = playback->run;
    Place *now = &playback->now;
    double dt = run->step_ms / 1000, stride_s = STRIDE * dt;
    while (now->step < step) {
        const XrayControl *xray = control(playback, now->step);
        pulse_clock_advance(&now->pulses, run->time_s[now->step], xray);
        now->injected_ml += (double)xray->contrast_ml_s * dt;
        if (++now->step % STRIDE != 0)
            continue;
        if (now->contrast)
            contrast_advance(now->contrast, stride_s, tip_node(playback, now->step - 1), now->injected_ml / stride_s);
        now->injected_ml = 0;
        keep(playback);
    }
}

Playback *playback_open(const RecordedRun *run, const Scene *scene, const VesselTree *tree, const XrayControl *unseen)
{
    Playback *playback = run->step_count > 0 && run->frame_count > 0 ? calloc(1, sizeof *playback) : NULL;
    if (!playback)
        return NULL;
    playback->run = run;
    playback->scene = scene;
    playback->tree = tree;
    playback->unseen = *unseen;
    playback->is_seen = recorded_run_was_watched(run);
    int64_t strides = (run->step_count / MOST_KEPT + 1) / STRIDE + 1;
    playback->keep_steps = STRIDE * (strides > KEEP_EVERY ? strides : KEEP_EVERY);
    playback->pose = pose_create_for_run(run);
    playback->now = (Place){.pulses = pulse_clock_start(0), .contrast = tree ? contrast_create(tree, NULL) : NULL};
    if (!playback->pose || (tree && !playback->now.contrast)) {
        playback_close(playback);
        return NULL;
    }
    keep(playback);
    playback_seek(playback, 0);
    return playback;
}

void playback_close(Playback *playback)
{
    if (!playback)
        return;
    for (int i = 0; i < playback->kept_count; i++)
        contrast_free(playback->kept[i].contrast);
    contrast_free(playback->now.contrast);
    pose_free(playback->pose);
    free(playback);
}

bool playback_seek(Playback *playback, double time_s)
{
    const RecordedRun *run = playback->run;
    Place *now = &playback->now;
    double dt = run->step_ms / 1000, first = run->time_s[0] - dt;
    int64_t step = (int64_t)fmax(1, fmin(floor((time_s - first) / dt + 1e-6), (double)run->step_count)), before = now->step;
    int nearest = 0;
    while (nearest + 1 < playback->kept_count && playback->kept[nearest + 1].step <= step)
        nearest++;
    if (playback->kept_count > 0 && (step < now->step || playback->kept[nearest].step > now->step)) {
        Contrast *contrast = now->contrast;
        *now = playback->kept[nearest];
        if ((now->contrast = contrast))
            contrast_copy(contrast, playback->kept[nearest].contrast);
    }
    go_on(playback, step);
    int64_t row = step - 1;
    pose_from_run(playback->pose, playback->scene, run, frame_at(run, row));
    pose_figures_from_run(playback->pose, run, row);
    playback->pose->xray = *control(playback, row);
    return step < before || (double)(step - before) * dt > 1;
}

double playback_time_s(const Playback *playback) { return playback->pose->time_s; }
double playback_end_s(const Playback *playback) { return playback->run->time_s[playback->run->step_count - 1]; }
const Pose *playback_pose(const Playback *playback) { return playback->pose; }
const float *playback_contrast(const Playback *playback) { return playback->now.contrast ? contrast_concentration(playback->now.contrast) : NULL; }
double playback_injected_ml(const Playback *playback) { return playback->now.contrast ? contrast_injected_ml(playback->now.contrast) : 0; }
const PulseClock *playback_pulses(const Playback *playback) { return &playback->now.pulses; }

int playback_bookmarks(const Playback *playback, double *time_s, int capacity)
{
    const RecordedRun *run = playback->run;
    int count = 0;
    for (int64_t i = 1; run->xray && i < run->step_count && count < capacity; i++)
        if (run->xray[i].bookmark != run->xray[i - 1].bookmark)
            time_s[count++] = run->time_s[i];
    return count;
}
