#include "base/base.h"
#include "sim/library/context.h"
#include "sim/replay.h"

#include <stdlib.h>

// --- opening ---

typedef struct Reading {
    const char *path;
    SelRecording *recording;
} Reading;

static bool read_recording(SelContext *context, void *what)
{
    Reading *reading = what;
    RecordedRun *run = recorded_run_load(reading->path, &context->faults);
    if (!run)
        return false;
    reading->recording = HEAP_ZEROED(1, sizeof *reading->recording);
    *reading->recording = (SelRecording){.path = HEAP_TEXT(reading->path), .run = run};
    return true;
}

SelStatus sel_recording_open(SelContext *context, const char *path, SelRecording **recording)
{
    Reading reading = {.path = path};
    if (!context || !path || !recording)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, path or recording is NULL");
    SelStatus status = context_call(context, read_recording, &reading, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *recording = reading.recording;
    return status;
}

void sel_recording_destroy(SelRecording *recording)
{
    if (!recording)
        return;
    recorded_run_free(recording->run);
    free(recording->path);
    free(recording);
}

// --- reading ---

int64_t sel_recording_steps(const SelRecording *recording) { return recording ? recording->run->step_count : 0; }
double sel_recording_step_s(const SelRecording *recording) { return recording ? recording->run->step_ms / 1000 : 0; }
int sel_recording_tool_count(const SelRecording *recording) { return recording ? recording->run->tool_count : 0; }
int64_t sel_recording_frames(const SelRecording *recording) { return recording ? recording->run->frame_count : 0; }

static bool has_step(const SelRecording *recording, int64_t step) { return step >= 0 && step < sel_recording_steps(recording); }

SelStatus sel_recording_hand(const SelRecording *recording, int64_t step, SelHand *hand)
{
    if (!has_step(recording, step) || !hand)
        return SEL_ERROR_ARGUMENT;
    const ToolCommands commands = recorded_run_commands(recording->run, step);
    *hand = hand_of(&commands);
    return SEL_OK;
}

SelStatus sel_recording_hash(const SelRecording *recording, int64_t step, uint64_t *hash)
{
    if (!has_step(recording, step) || !hash)
        return SEL_ERROR_ARGUMENT;
    *hash = recording->run->state_hash[step];
    return SEL_OK;
}

SelStatus sel_recording_force(const SelRecording *recording, int64_t step, int tool, double *push_n, double *torque_n_mm)
{
    if (!has_step(recording, step) || tool < 0 || tool >= sel_recording_tool_count(recording))
        return SEL_ERROR_ARGUMENT;
    const double *proximal = recording->run->tool[tool].proximal + 2 * step;
    if (push_n)
        *push_n = proximal[0];
    if (torque_n_mm)
        *torque_n_mm = proximal[1];
    return SEL_OK;
}

SelStatus sel_recording_arrays(const SelRecording *recording, double *command, uint64_t *hash, double *push_n, double *torque_n_mm)
{
    int tools = sel_recording_tool_count(recording);
    if (!recording)
        return SEL_ERROR_ARGUMENT;
    for (int64_t i = 0; i < sel_recording_steps(recording); i++) {
        const ToolCommands commands = recorded_run_commands(recording->run, i);
        if (hash)
            hash[i] = recording->run->state_hash[i];
        for (int k = 0; k < tools; k++) {
            int64_t at = i * tools + k;
            if (command)
                command[2 * at] = commands.tool[k].push_mm_s, command[2 * at + 1] = commands.tool[k].twist_deg_s;
            sel_recording_force(recording, i, k, push_n ? &push_n[at] : NULL, torque_n_mm ? &torque_n_mm[at] : NULL);
        }
    }
    return SEL_OK;
}

SelStatus sel_recording_frame(const SelRecording *recording, int64_t frame, int64_t *step, double *position_mm, int capacity, int *count)
{
    if (frame < 0 || frame >= sel_recording_frames(recording) || !count || (capacity > 0 && !position_mm))
        return SEL_ERROR_ARGUMENT;
    const RecordedFrame at = recorded_run_frame(recording->run, frame);
    for (int i = 0; i < at.node_count && i < capacity; i++)
        position_mm[3 * i] = at.position[i].x, position_mm[3 * i + 1] = at.position[i].y, position_mm[3 * i + 2] = at.position[i].z;
    *count = at.node_count;
    if (step)
        *step = recording->run->frame_step[frame];
    return SEL_OK;
}

// --- the scene, and the run again ---

typedef struct SceneOf {
    const SelRecording *recording;
    SelOpenOptions options;
    SelScene *scene;
} SceneOf;

static bool open_recorded(SelContext *context, void *what)
{
    SceneOf *of = what;
    Scene *scene = replay_scene(of->recording->run, of->recording->path, &context->faults);
    return scene_open_parsed(context, scene, &of->options, &of->scene);
}

SelStatus sel_recording_scene(SelContext *context, const SelRecording *recording, const SelOpenOptions *options, SelScene **scene)
{
    SceneOf of = {.recording = recording};
    if (!context || !recording || !scene)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, recording or scene is NULL");
    if (!options_take(&of.options, sizeof of.options, options) || of.options.script)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "the size of options is not set, or they have a script, which a recording has itself");
    SelStatus status = context_call(context, open_recorded, &of, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *scene = of.scene;
    return status;
}

typedef struct Verifying {
    const SelRecording *recording;
    const SelScene *scene;
    ReplayVerdict verdict;
} Verifying;

static bool verify(SelContext *context, void *what)
{
    Verifying *v = what;
    Simulator *simulator = simulator_create(v->scene->scene, v->scene->open.vessel, &context->faults);
    bool fits = simulator && replay_fits(v->recording->run, simulator, &context->faults);
    if (fits)
        v->verdict = replay_verify(simulator, v->recording->run, -1, false, NULL, NULL);
    simulator_destroy(simulator);
    return fits;
}

SelStatus sel_recording_verify(SelContext *context, const SelRecording *recording, const SelScene *scene, SelVerdict *verdict)
{
    Verifying v = {.recording = recording, .scene = scene};
    if (!context || !recording || !scene)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, recording or scene is NULL");
    SelStatus status = context_call(context, verify, &v, SEL_ERROR_INPUT);
    if (status != SEL_OK)
        return status;
    if (verdict)
        *verdict = (SelVerdict){
            .steps = v.verdict.steps, .first_different = v.verdict.first_different, .recorded = v.verdict.recorded, .simulated = v.verdict.simulated};
    return v.verdict.first_different < 0 ? SEL_OK : SEL_DIFFERENT;
}
