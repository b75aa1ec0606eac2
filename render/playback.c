#include "render/playback.h"

#include <stdlib.h>
#include <string.h>

// Contrast is simulated in strides of this many recorded steps; a checkpoint is stored every few strides.
enum { STRIDE = 10, KEEP_EVERY = 500, MOST_KEPT = 1024 };

// What a pulse saw.
typedef struct PulseSight {
    int64_t step;
    uint32_t pulse;
    float *concentration;        // at the nodes of the tree, then of the tools
} PulseSight;

enum { LAST, MASK, SIGHTS };

typedef struct Place {
    int64_t step;
    PulseClock pulses;
    double injected_ml;          // since the last whole stride
    ContrastInjection *injection;
    PulseMemory memory;
    PulseSight sight[SIGHTS];    // of the last pulse, and of the mask
} Place;

struct Playback {
    const RecordedRun *run;
    const Scene *scene;
    const VesselTree *tree;
    XrayControl unseen, control;     // control: of the last requested step
    float *concentration;            // at the current moment: at the nodes of the tree, then of the tools
    bool is_seen;
    Pose *pose;
    Pose *sight_pose[SIGHTS];
    int64_t posed[SIGHTS];           // steps of these poses, -1: none yet
    FluoroscopePast past;
    Place now;
    double flow_ml_s;                // current flow of contrast agent
    int kept_count;
    int64_t keep_steps;          // steps between checkpoints
    Place kept[MOST_KEPT];
};

static const XrayControl *control(Playback *playback, int64_t step)
{
    const RecordedRun *run = playback->run;
    playback->control = playback->is_seen ? run->xray[step] : playback->unseen;
    if (!playback->is_seen && run->xray) {
        playback->control.contrast_ml_s = run->xray[step].contrast_ml_s;
        playback->control.contrast_tool = run->xray[step].contrast_tool;
    }
    return &playback->control;
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

// The tree node at the node of the shared centreline nearest to x.
static int node_at(const RecordedFrame *frame, Vec3 x)
{
    int nearest = frame->node_count - 1;
    for (int i = nearest - 1; i >= 0; i--)
        if (vec3_distance(frame->position[i], x) < vec3_distance(frame->position[nearest], x))
            nearest = i;
    return frame->vessel_node[nearest];
}

static void find_inserted(const RecordedRun *run, int64_t step, double *inserted)
{
    for (int k = 0; k < run->tool_count; k++)
        inserted[k] = run->tool[k].inserted[step];
}

static TipPlaces find_tips(const RecordedRun *run, int64_t step)
{
    int64_t at = frame_at(run, step);
    RecordedFrame frame = recorded_run_frame(run, at);
    TipPlaces places = {.foremost_node = frame.vessel_node[frame.node_count - 1]};
    find_inserted(run, step, places.inserted);
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedTool *tool = &run->tool[k];
        places.node[k] = places.foremost_node;
        if (tool->position) {
            RecordedToolFrame own = recorded_run_tool_frame(run, k, at);
            places.node[k] = node_at(&frame, own.position[own.node_count - 1]);
        }
    }
    return places;
}

static ContrastInjection *create_injection(const Playback *playback)
{
    const RecordedRun *run = playback->run;
    int count[TOOLS_MOST] = {run->node_count};
    const double *s[TOOLS_MOST] = {run->s};
    for (int k = 0; run->tool_count > 1 && k < run->tool_count; k++) {
        count[k] = run->tool[k].device_nodes[0];
        s[k] = run->tool[k].s;
    }
    return contrast_injection_create(playback->tree, playback->scene, count, s);
}

static size_t concentration_bytes(const Playback *playback) { return ((size_t)contrast_injection_node_count(playback->now.injection) + 1) * sizeof(float); }

static void place_free(Place *place)
{
    contrast_injection_free(place->injection);
    pulse_memory_free(&place->memory);
    for (int i = 0; i < SIGHTS; i++)
        free(place->sight[i].concentration);
    *place = (Place){0};
}

// A place's memory; its contents are those of place_copy. Needs the injection of `now`.
static bool place_make(Place *place, const Playback *playback)
{
    *place = (Place){.injection = create_injection(playback)};
    bool good = pulse_memory_make(&place->memory, playback->tree ? playback->tree->node_count : 0) && place->injection;
    for (int i = 0; good && i < SIGHTS; i++)
        good = (place->sight[i].concentration = calloc(1, ((size_t)contrast_injection_node_count(place->injection) + 1) * sizeof(float))) != NULL;
    return good;
}

static void place_copy(const Playback *playback, Place *to, const Place *from)
{
    to->step = from->step;
    to->pulses = from->pulses;
    to->injected_ml = from->injected_ml;
    contrast_injection_copy(to->injection, from->injection);
    pulse_memory_copy(&to->memory, &from->memory);
    for (int i = 0; i < SIGHTS; i++) {
        to->sight[i].step = from->sight[i].step;
        to->sight[i].pulse = from->sight[i].pulse;
        memcpy(to->sight[i].concentration, from->sight[i].concentration, concentration_bytes(playback));
    }
}

// The flow at a step.
static double flow_at(Playback *playback, int64_t step)
{
    double inserted[TOOLS_MOST] = {0};
    find_inserted(playback->run, step, inserted);
    return contrast_injection_flow(playback->now.injection, control(playback, step), inserted);
}

// Stores a checkpoint if one is due.
static void keep(Playback *playback)
{
    if (playback->kept_count == MOST_KEPT || playback->now.step != playback->kept_count * playback->keep_steps)
        return;
    Place *place = &playback->kept[playback->kept_count];
    if (place_make(place, playback)) {
        place_copy(playback, place, &playback->now);
        playback->kept_count++;
    } else {
        place_free(place);
    }
}

static void take_pulse(Playback *playback, const XrayControl *xray)
{
    Place *now = &playback->now;
    PulseSight *last = &now->sight[LAST], *mask = &now->sight[MASK];
    last->step = now->step;
    last->pulse = (uint32_t)now->pulses.count;
    contrast_injection_read(now->injection, last->concentration);
    if (pulse_memory_take(&now->memory, xray, playback->tree ? last->concentration : NULL)) {
        mask->step = last->step;
        mask->pulse = last->pulse;
        memcpy(mask->concentration, last->concentration, concentration_bytes(playback));
    }
}

// Contrast advances in whole strides only, as in the session; otherwise the picture would depend on where playback had stopped.
static void go_on(Playback *playback, int64_t step)
{
    const RecordedRun *run = playback->run;
    Place *now = &playback->now;
    double dt = run->step_ms / 1000, stride_s = STRIDE * dt;
    while (now->step < step) {
        const XrayControl *xray = control(playback, now->step);
        if (pulse_clock_advance(&now->pulses, run->time_s[now->step], xray) || now->step == 0)
            take_pulse(playback, xray);
        int fitted[TOOLS_MOST] = {0};
        for (int k = 0; k < run->tool_count; k++)
            fitted[k] = recorded_run_fitted(run, k, now->step);
        contrast_injection_fit(now->injection, fitted);
        now->injected_ml += flow_at(playback, now->step) * dt;
        if (++now->step % STRIDE != 0)
            continue;
        TipPlaces places = find_tips(run, now->step - 1);
        contrast_injection_advance(now->injection, stride_s, xray, now->injected_ml, &places);
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
    bool good = playback->pose && place_make(&playback->now, playback) && (playback->concentration = calloc(1, concentration_bytes(playback)));
    for (int i = 0; good && i < SIGHTS; i++) {
        good = (playback->sight_pose[i] = pose_create_for_run(run)) != NULL;
        playback->posed[i] = -1;
    }
    if (!good) {
        playback_close(playback);
        return NULL;
    }
    playback->now.pulses = pulse_clock_start(0);
    keep(playback);
    playback_seek(playback, 0);
    return playback;
}

void playback_close(Playback *playback)
{
    if (!playback)
        return;
    for (int i = 0; i < playback->kept_count; i++)
        place_free(&playback->kept[i]);
    place_free(&playback->now);
    for (int i = 0; i < SIGHTS; i++)
        pose_free(playback->sight_pose[i]);
    free(playback->concentration);
    pose_free(playback->pose);
    free(playback);
}

// The frame of a pulse.
static FluoroscopeFrame frame_of(Playback *playback, int which)
{
    const PulseSight *sight = &playback->now.sight[which];
    if (playback->posed[which] != sight->step)
        pose_from_run(playback->sight_pose[which], playback->scene, playback->run, frame_at(playback->run, sight->step));
    playback->posed[which] = sight->step;
    return (FluoroscopeFrame){.pose = playback->sight_pose[which],
                              .xray = *control(playback, sight->step),
                              .contrast = playback->tree ? sight->concentration : NULL,
                              .filling = sight->concentration + contrast_injection_tree_nodes(playback->now.injection),
                              .pulse = sight->pulse};
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
    if (playback->kept_count > 0 && (step < now->step || playback->kept[nearest].step > now->step))
        place_copy(playback, now, &playback->kept[nearest]);
    go_on(playback, step);
    contrast_injection_read(now->injection, playback->concentration);
    int64_t row = step - 1;
    pose_from_run(playback->pose, playback->scene, run, frame_at(run, row));
    pose_figures_from_run(playback->pose, run, row);
    playback->pose->xray = *control(playback, row);
    playback->flow_ml_s = flow_at(playback, row);
    playback->past = (FluoroscopePast){
        .last = frame_of(playback, LAST), .mask = frame_of(playback, MASK), .memory = &now->memory, .is_held = !(playback->pose->xray.pedal > 0.5F)};
    return step < before || (double)(step - before) * dt > 1;
}

double playback_time_s(const Playback *playback) { return playback->pose->time_s; }
double playback_end_s(const Playback *playback) { return playback->run->time_s[playback->run->step_count - 1]; }
const Pose *playback_pose(const Playback *playback) { return playback->pose; }
const float *playback_contrast(const Playback *playback) { return playback->tree ? playback->concentration : NULL; }
const float *playback_filling(const Playback *playback) { return playback->concentration + contrast_injection_tree_nodes(playback->now.injection); }
double playback_injected_ml(const Playback *playback) { return contrast_injection_injected_ml(playback->now.injection); }
int playback_contrast_tool(const Playback *playback) { return contrast_injection_tool(playback->now.injection, &playback->pose->xray); }
double playback_flow_ml_s(const Playback *playback) { return playback->flow_ml_s; }
const PulseClock *playback_pulses(const Playback *playback) { return &playback->now.pulses; }
const FluoroscopePast *playback_past(const Playback *playback) { return &playback->past; }
