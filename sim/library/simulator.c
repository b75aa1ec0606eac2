#include "seldinger/simulator.h"

#include "base/base.h"
#include "sim/library/context.h"
#include "sim/library/simulator.h"
#include "sim/session_tracker.h"

#include <stdlib.h>
#include <string.h>

#define SAME_FLAG(NAME) _Static_assert((int)SEL_STEP_##NAME == (int)STEP_##NAME, "public flags are the solver's")
SAME_FLAG(DIVERGED);
SAME_FLAG(NOT_CONVERGED);
SAME_FLAG(DEEP);
SAME_FLAG(FULLY_INSERTED);
SAME_FLAG(FULLY_WITHDRAWN);
SAME_FLAG(OUT_OF_VESSEL);
SAME_FLAG(DETECTION_UNSURE);
SAME_FLAG(LIMITED);
SAME_FLAG(MODEL_DISAGREES);
SAME_FLAG(HAND_SLIPS);
_Static_assert((int)SEL_SCORE_REACHED == (int)SCORE_REACHED && (int)SEL_SCORE_TIME_OUT == (int)SCORE_TIME_OUT, "public states are the score's");

void sel_simulator_options_init(SelSimulatorOptions *options, size_t size)
{
    SelSimulatorOptions own = {.keeps_score = 1};
    result_give(options, size, &own, sizeof own);
}

// --- making ---

static void free_simulator(SelSimulator *s)
{
    session_tracker_free(s->tracker);
    simulator_destroy(s->simulator);
    free(s->node);
    free(s->own);
    image_memory_free(&s->image);
    scene_release(s->scene);
    context_release(s->context);
    free(s);
}

typedef struct Making {
    const SelScene *scene;
    SelSimulatorOptions options;
    SelSimulator *made;
} Making;

static Checkpoint *state_of(const SelSimulator *s)
{
    Checkpoint *state = stepper_save(simulator_stepper(s->simulator), NULL);
    if (!state)
        heap_is_empty(0, __FILE__);
    return state;
}

// The first simulator of a scene keeps its start for all of them; of two at the same time one does.
static void keep_start(const SelSimulator *s)
{
    SelScene *scene = (SelScene *)(size_t)s->scene;
    Checkpoint *none = NULL, *own = atomic_load(&scene->start) ? NULL : state_of(s);
    if (own && !atomic_compare_exchange_strong(&scene->start, &none, own))
        checkpoint_free(own);
}

static SessionTracker *new_tracker(const SelSimulator *s)
{
    SessionTracker *tracker = session_tracker_create(s->simulator, s->scene->open.tree);
    if (!tracker)
        heap_is_empty(0, __FILE__);
    return tracker;
}

static void make_scratch(SelSimulator *s)
{
    s->node_capacity = stepper_node_capacity(simulator_stepper(s->simulator));
    for (int k = 0; k < s->scene->scene->tool_count; k++) {
        int nodes = scene_most_nodes(s->scene->scene, k);
        s->own_capacity = nodes > s->own_capacity ? nodes : s->own_capacity;
    }
    s->node = HEAP_ZEROED((size_t)s->node_capacity, sizeof *s->node);
    s->own = HEAP_ZEROED((size_t)s->own_capacity, sizeof *s->own);
}

static bool make(SelContext *context, void *what)
{
    Making *making = what;
    const SelScene *scene = making->scene;
    SelSimulator *s = making->made = HEAP_ZEROED(1, sizeof *s);
    s->context = context_held(context);
    s->scene = scene_held(scene);
    s->simulator = simulator_create(scene->scene, scene->open.vessel, &context->faults);
    if (!s->simulator)
        return false;
    make_scratch(s);
    keep_start(s);
    s->tracker = making->options.keeps_score ? new_tracker(s) : NULL;
    return true;
}

SelStatus sel_simulator_create(SelContext *context, const SelScene *scene, const SelSimulatorOptions *options, SelSimulator **simulator)
{
    Making making = {.scene = scene, .options = {.keeps_score = 1}};
    if (!context || !scene || !simulator)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, scene or simulator is NULL");
    if (!options_take(&making.options, sizeof making.options, options))
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "the size of options is not set; begin with sel_simulator_defaults()");
    SelStatus status = context_call(context, make, &making, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *simulator = making.made;
    else if (making.made)
        free_simulator(making.made);
    return status;
}

SelContext *sel_simulator_context(SelSimulator *s) { return s ? s->context : NULL; }

void sel_simulator_destroy(SelSimulator *s)
{
    if (!s)
        return;
    if (s->recording)
        sel_simulator_end_recording(s);
    free_simulator(s);
}

// --- steps ---

static SelStatus record_step(SelSimulator *s, const ToolCommands *commands)
{
    if (!s->recording || s->has_lost_rows || recording_step(s->recording, s->simulator, commands, NULL))
        return SEL_OK;
    s->has_lost_rows = true;
    return context_refuse(s->context, SEL_ERROR_OUTPUT, "sel_simulator_step", "the recording cannot be written; sel_simulator_end_recording() says why");
}

SelStatus sel_simulator_step(SelSimulator *s, const SelHand *hand)
{
    const char *trouble = hand_trouble(hand);
    if (!s)
        return SEL_ERROR_ARGUMENT;
    if (trouble)
        return context_refuse(s->context, SEL_ERROR_ARGUMENT, __func__, trouble);
    const ToolCommands commands = commands_of(hand);
    simulator_step(s->simulator, &commands);
    if (s->tracker)
        session_tracker_step(s->tracker, s->simulator, &commands, NULL);
    return record_step(s, &commands);
}

SelStatus sel_simulator_repeat(SelSimulator *s, const SelHand *hand, int count)
{
    if (!s || count < 0)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "simulator is NULL, or count is negative");
    SelStatus status = SEL_OK;
    for (int i = 0; i < count && status == SEL_OK; i++)
        status = sel_simulator_step(s, hand);
    return status;
}

SelStatus sel_simulator_follow(SelSimulator *s, int count)
{
    if (!s || count < 0)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "simulator is NULL, or count is negative");
    SelStatus status = SEL_OK;
    SelHand hand;
    for (int i = 0; i < count && status == SEL_OK; i++) {
        sel_simulator_script_hand(s, &hand);
        status = sel_simulator_step(s, &hand);
    }
    return status;
}

// A tracker begins with the state at time 0.
static bool begin_again(SelContext *context, void *what)
{
    (void)context;
    SelSimulator *s = what;
    bool keeps_score = s->tracker;
    session_tracker_free(s->tracker);
    s->tracker = NULL;
    simulator_begin_again(s->simulator, atomic_load(&s->scene->start));
    s->script_cursor = 0;
    s->tracker = keeps_score ? new_tracker(s) : NULL;
    return true;
}

SelStatus sel_simulator_reset(SelSimulator *s)
{
    if (!s)
        return SEL_ERROR_ARGUMENT;
    if (s->recording)
        return context_refuse(s->context, SEL_ERROR_STATE, __func__, "a recording runs; end it first");
    return context_call(s->context, begin_again, s, SEL_ERROR_MEMORY);
}

typedef struct Copying {
    SelSimulator *to;
    const SelSimulator *from;
} Copying;

static bool copy(SelContext *context, void *what)
{
    (void)context;
    const Copying *copying = what;
    Checkpoint *state = state_of(copying->from);
    simulator_take_over(copying->to->simulator, copying->from->simulator, state);
    copying->to->script_cursor = copying->from->script_cursor;
    checkpoint_free(state);
    return true;
}

SelStatus sel_simulator_copy(SelSimulator *s, const SelSimulator *from)
{
    if (!s || !from || s->scene != from->scene)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "a simulator is NULL, or the two are of different scenes");
    if (s->tracker || from->tracker || s->recording || from->recording)
        return context_refuse(s->context, SEL_ERROR_STATE, __func__, "a simulator keeps a score or records; create both without");
    return context_call(s->context, copy, &(Copying){.to = s, .from = from}, SEL_ERROR_MEMORY);
}

SelStatus sel_simulator_script_hand(SelSimulator *s, SelHand *hand)
{
    if (!s || !hand)
        return SEL_ERROR_ARGUMENT;
    const Script *script = s->scene->scene->script;
    const ToolCommands commands = script ? script_tools_at(script, simulator_time_s(s->simulator), &s->script_cursor) : (ToolCommands){0};
    *hand = hand_of(&commands);
    return SEL_OK;
}

// --- reading ---

int64_t sel_simulator_steps(const SelSimulator *s) { return s ? simulator_totals(s->simulator)->steps : 0; }
double sel_simulator_time_s(const SelSimulator *s) { return s ? simulator_time_s(s->simulator) : 0; }
uint64_t sel_simulator_hash(const SelSimulator *s) { return s ? simulator_hash(s->simulator) : 0; }

static void report_tools(const Simulator *simulator, SelReport *report)
{
    const StepReport *last = simulator_last(simulator);
    const Stepper *stepper = simulator_stepper((Simulator *)(size_t)simulator);
    for (int k = 0; k < stepper_tool_count(stepper); k++) {
        report->push_n[k] = last->push[k];
        report->torque_n_mm[k] = last->torque[k];
        report->inserted_mm[k] = stepper_tool_inserted(stepper, k);
        report->turned_deg[k] = stepper_tool_turned(stepper, k) * 180 / PI;
    }
}

SelStatus sel_simulator_report(const SelSimulator *s, SelReport *report, size_t size)
{
    if (!s || !report || size < sizeof size)
        return SEL_ERROR_ARGUMENT;
    const StepReport *last = simulator_last(s->simulator);
    const RunTotals *totals = simulator_totals(s->simulator);
    SelReport own = {.flags = last->flags,
                     .flags_ever = totals->flags,
                     .contacts = last->active,
                     .self_contacts = last->self_contacts,
                     .iterations = last->iterations,
                     .residual = last->residual,
                     .penetration_mm = last->penetration,
                     .wall_force_max_n = last->wall_force_max,
                     .wall_force_sum_n = last->wall_force_sum,
                     .step_us = (double)simulator_step_ns(s->simulator) / 1000,
                     .push_least_n = totals->push_least,
                     .push_most_n = totals->push_most};
    report_tools(s->simulator, &own);
    result_give(report, size, &own, sizeof own);
    return SEL_OK;
}

static bool has_tool(const SelSimulator *s, int tool) { return s && tool >= 0 && tool < s->scene->scene->tool_count; }

int sel_simulator_node_capacity(const SelSimulator *s, int tool) { return has_tool(s, tool) ? scene_most_nodes(s->scene->scene, tool) : 0; }

static SelNode node_of(const ToolNode *node)
{
    Vec3 x = node->position;
    Quat q = node->orientation;
    return (SelNode){.s_mm = node->s, .position_mm = {x.x, x.y, x.z}, .quaternion = {q.w, q.x, q.y, q.z}, .radius_mm = node->radius, .carrier = node->carrier};
}

SelStatus sel_simulator_nodes(SelSimulator *s, int tool, SelNode *node, int capacity, int *count)
{
    if (!has_tool(s, tool) || !node || !count)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "a pointer is NULL, or there is no such tool");
    const Stepper *stepper = simulator_stepper(s->simulator);
    int nodes = stepper_tool_nodes(stepper, tool, NULL);
    if (nodes > capacity)
        return context_refuse(s->context, SEL_ERROR_ARGUMENT, __func__, "too little room; see sel_simulator_node_capacity()");
    stepper_tool_nodes(stepper, tool, s->own);
    for (int i = 0; i < nodes; i++)
        node[i] = node_of(&s->own[i]);
    *count = nodes;
    return SEL_OK;
}

_Static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Quat) == 4 * sizeof(double) && offsetof(Quat, w) == 0, "rows of a public array");

SelStatus sel_simulator_centreline(const SelSimulator *s, const double **position_mm, const double **quaternion, int *count)
{
    if (!s)
        return SEL_ERROR_ARGUMENT;
    const WireState *state = simulator_state(s->simulator);
    if (position_mm)
        *position_mm = &state->position->x;
    if (quaternion)
        *quaternion = &state->orientation->w;
    if (count)
        *count = state->node_count;
    return SEL_OK;
}

SelStatus sel_simulator_tip(SelSimulator *s, int tool, double position_mm[3])
{
    if (!has_tool(s, tool) || !position_mm)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "a pointer is NULL, or there is no such tool");
    const Stepper *stepper = simulator_stepper(s->simulator);
    int nodes = stepper_tool_nodes(stepper, tool, s->own);
    Vec3 x = s->own[nodes - 1].position;
    position_mm[0] = x.x, position_mm[1] = x.y, position_mm[2] = x.z;
    return SEL_OK;
}

static SelContact contact_of(const WireState *state, const NodeReport *report, int i)
{
    Vec3 x = state->position[i], f = report->force;
    return (SelContact){.node = i, .s_mm = report->s, .position_mm = {x.x, x.y, x.z}, .force_n = {f.x, f.y, f.z}, .gap_mm = report->gap};
}

SelStatus sel_simulator_contacts(SelSimulator *s, SelContact *contact, int capacity, int *count)
{
    if (!s || !count || (capacity > 0 && !contact))
        return SEL_ERROR_ARGUMENT;
    const WireState *state = simulator_state(s->simulator);
    stepper_node_report(simulator_stepper(s->simulator), s->node);
    *count = 0;
    for (int i = 0; i < state->node_count; i++) {
        if (!(vec3_norm2(s->node[i].force) > 0))
            continue;
        if (*count < capacity)
            contact[*count] = contact_of(state, &s->node[i], i);
        ++*count;
    }
    return SEL_OK;
}

int sel_simulator_target_count(const SelSimulator *s) { return s ? s->scene->scene->target_count : 0; }

SelStatus sel_simulator_target(const SelSimulator *s, int target, SelTargetReach *reach)
{
    if (target < 0 || target >= sel_simulator_target_count(s) || !reach)
        return SEL_ERROR_ARGUMENT;
    const TargetReach *from = &simulator_targets(s->simulator)[target];
    *reach = (SelTargetReach){.distance_mm = from->distance, .time_s = from->time_s, .is_reached = from->reached};
    return SEL_OK;
}

// --- score ---

SelStatus sel_simulator_score(const SelSimulator *s, SelScore *score, size_t size)
{
    if (!s || !score || size < sizeof size)
        return SEL_ERROR_ARGUMENT;
    if (!s->tracker)
        return context_refuse(s->context, SEL_ERROR_STATE, __func__, "the simulator was created without a score");
    const ScoreFigures f = score_figures(session_tracker_score(s->tracker));
    SelScore own = {.state = (SelScoreState)f.state,
                    .points = f.points,
                    .time_s = f.time_s,
                    .path_mm = f.path_mm,
                    .way_mm = f.way_mm,
                    .remaining_mm = f.remaining_mm,
                    .inserted_mm = f.inserted_mm,
                    .withdrawn_mm = f.withdrawn_mm,
                    .wall_force_peak_n = f.wall_force_peak_n,
                    .wall_impulse_n_s = f.wall_impulse_n_s,
                    .tip_force_peak_n = f.tip_force_peak_n,
                    .contrast_ml = f.contrast_ml,
                    .errors = f.error_total};
    result_give(score, size, &own, sizeof own);
    return SEL_OK;
}

typedef struct Printing {
    const SelSimulator *simulator;
    char *text;
} Printing;

static bool print_score(SelContext *context, void *what)
{
    (void)context;
    Printing *printing = what;
    const ScoreFigures figures = score_figures(session_tracker_score(printing->simulator->tracker));
    printing->text = score_json(&figures, printing->simulator->scene->scene);
    return printing->text != NULL;
}

SelStatus sel_simulator_score_json(const SelSimulator *s, char **json)
{
    if (!s || !json)
        return SEL_ERROR_ARGUMENT;
    if (!s->tracker)
        return context_refuse(s->context, SEL_ERROR_STATE, __func__, "the simulator was created without a score");
    Printing printing = {.simulator = s};
    SelStatus status = context_call(s->context, print_score, &printing, SEL_ERROR_MEMORY);
    if (status == SEL_OK)
        *json = printing.text;
    return status;
}

// --- recording ---

void sel_recording_options_init(SelRecordingOptions *options, size_t size)
{
    SelRecordingOptions own = {.frame_ms = recording_default_options().frame_ms};
    result_give(options, size, &own, sizeof own);
}

typedef struct Starting {
    SelSimulator *simulator;
    const char *path;
    SelRecordingOptions options;
} Starting;

static bool start_recording(SelContext *context, void *what)
{
    const Starting *starting = what;
    SelSimulator *s = starting->simulator;
    RecordingOptions options = recording_default_options();
    options.frame_ms = starting->options.frame_ms;
    options.expected_steps = (int64_t)ceil(starting->options.expected_s * 1000 / s->scene->scene->dt);
    s->recording = recording_create(starting->path, s->simulator, &options, &context->faults);
    return s->recording != NULL;
}

static bool is_range(double value, double least, double most) { return value >= least && value <= most; }

SelStatus sel_simulator_record(SelSimulator *s, const char *path, const SelRecordingOptions *options)
{
    Starting starting = {.simulator = s, .path = path};
    if (!s || !path)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "simulator or path is NULL");
    sel_recording_options_init(&starting.options, sizeof starting.options);
    if (!options_take(&starting.options, sizeof starting.options, options) || !is_range(starting.options.frame_ms, 0.001, 1e6) ||
        !is_range(starting.options.expected_s, 0, SCRIPT_LONGEST_S))
        return context_refuse(s->context, SEL_ERROR_ARGUMENT, __func__, "size is not set, frame_ms is not above 0, or expected_s is not 0 to 86400");
    if (s->recording || sel_simulator_steps(s) > 0)
        return context_refuse(s->context, SEL_ERROR_STATE, __func__, "a recording begins before the first step, and only one runs at a time");
    s->has_lost_rows = false;
    return context_call(s->context, start_recording, &starting, SEL_ERROR_OUTPUT);
}

static bool close_recording(SelContext *context, void *what)
{
    SelSimulator *s = what;
    Recording *recording = s->recording;
    s->recording = NULL;
    return recording_close(recording, s->simulator, &context->faults);
}

SelStatus sel_simulator_end_recording(SelSimulator *s)
{
    if (!s)
        return SEL_ERROR_ARGUMENT;
    if (!s->recording)
        return context_refuse(s->context, SEL_ERROR_STATE, __func__, "nothing is recorded");
    return context_call(s->context, close_recording, s, SEL_ERROR_OUTPUT);
}
