#include "bench/collision_run.h"

#include "base/heap.h"
#include "base/sort_doubles.h"

#include <stdlib.h>
#include <string.h>

// The margin of solver/step_detect.c beyond the speed of the nodes, and its maximum [mm]; it queries twice as much.
static const double LOOK = 0.2, LOOK_MAX = 5;
static const double CONTAINED = 0.05, STALLED = 0.1; // [mm]
static const double GONE = 1;                // [mm] the run ends if a node is further outside
enum { JUDGE_EVERY = 5 };                    // steps

// --- a follower: every free node with its own query state ---

static void follow_locate(const Vessel *wall, int first, int node_count, const Vec3 *point, VesselMemory *memory)
{
    for (int i = node_count - 1; i >= first; i--)
        if (memory[i].node < 0)
            memory[i] = (VesselMemory){.node = wall->locate(wall, point[i - first], i + 1 < node_count ? memory[i + 1].node : -1)};
}

static VesselMemory *follow_start(VesselMemory *memory, int node_count)
{
    for (int i = 0; i < node_count; i++)
        memory[i] = (VesselMemory){.node = -1};
    return memory;
}

static void follow_forget(VesselMemory *memory, int first)
{
    for (int i = 0; i < first; i++)
        memory[i] = (VesselMemory){.node = -1};
}

// --- recorded motion ---

static bool grow(void **array, size_t size, size_t wanted)
{
    void *bigger = realloc(*array, size * wanted);
    if (bigger)
        *array = bigger;
    return bigger != NULL;
}

static bool motion_add(CollisionMotion *motion, int first, double reach, const Vec3 *position)
{
    if (motion->steps == motion->step_capacity) {
        size_t wanted = 2 * (size_t)motion->step_capacity + 256;
        if (!grow((void **)&motion->first_node, sizeof *motion->first_node, wanted) || !grow((void **)&motion->reach, sizeof *motion->reach, wanted) ||
            !grow((void **)&motion->offset, sizeof *motion->offset, wanted + 1))
            return false;
        motion->step_capacity = (int)wanted;
        motion->offset[0] = 0;
    }
    size_t count = (size_t)(motion->node_count - first), at = motion->offset[motion->steps];
    if (at + count > motion->point_capacity) {
        size_t wanted = 2 * motion->point_capacity + 65536;
        if (!grow((void **)&motion->point, sizeof *motion->point, wanted))
            return false;
        motion->point_capacity = wanted;
    }
    memcpy(motion->point + at, position + first, count * sizeof *position);
    motion->first_node[motion->steps] = first;
    motion->reach[motion->steps++] = reach;
    motion->offset[motion->steps] = at + count;
    return true;
}

void collision_motion_free(CollisionMotion *motion)
{
    free(motion->radius);
    free(motion->first_node);
    free(motion->offset);
    free(motion->reach);
    free(motion->point);
    free(motion->gap);
    free(motion->normal);
    *motion = (CollisionMotion){0};
}

// Queries all points of a step; the results are in hit from index 0 on.
static void ask_step(const Vessel *wall, const CollisionMotion *motion, int step, VesselMemory *memory, VesselHit *hit)
{
    int first = motion->first_node[step];
    const Vec3 *point = motion->point + motion->offset[step];
    follow_locate(wall, first, motion->node_count, point, memory);
    vessel_query(wall, motion->node_count - first, point, motion->reach[step], memory + first, hit);
}

static bool has_answer(const VesselHit *hit) { return !(hit->flags & (VESSEL_FAR | VESSEL_OPEN_END)) && isfinite(hit->gap); }

bool collision_motion_judge(CollisionMotion *motion, const Vessel *truth)
{
    size_t points = motion->steps > 0 ? motion->offset[motion->steps] : 0, nodes = (size_t)motion->node_count;
    VesselMemory *memory = calloc(nodes + 1, sizeof *memory);
    VesselHit *hit = calloc(nodes + 1, sizeof *hit);
    motion->gap = calloc(points + 1, sizeof *motion->gap);
    motion->normal = calloc(points + 1, sizeof *motion->normal);
    bool good = memory && hit && motion->gap && motion->normal;
    if (good)
        follow_start(memory, motion->node_count);
    for (int step = 0; good && step < motion->steps; step++) {
        follow_forget(memory, motion->first_node[step]);
        ask_step(truth, motion, step, memory, hit);
        size_t at = motion->offset[step], count = motion->offset[step + 1] - at;
        for (size_t k = 0; k < count; k++) {
            motion->gap[at + k] = has_answer(&hit[k]) ? hit[k].gap : HUGE_VAL;
            motion->normal[at + k] = hit[k].normal;
        }
    }
    free(memory);
    free(hit);
    return good;
}

static double clear_of_tool(const CollisionMotion *motion, int step, size_t point)
{
    return motion->gap[point] - motion->radius[motion->first_node[step] + (int)(point - motion->offset[step])];
}

static bool is_near(const CollisionMotion *motion, int step, size_t point) { return clear_of_tool(motion, step, point) < motion->reach[step] / 2; }

// --- replay ---

typedef struct Gathered {    // the near points of a step, one after the other
    int *node;
    Vec3 *point;
    VesselMemory *memory;
    VesselHit *hit;
} Gathered;

static double time_all(const Vessel *wall, const CollisionMotion *motion, VesselMemory *memory, VesselHit *hit)
{
    follow_start(memory, motion->node_count);
    int64_t begin = bench_cpu_ns();
    for (int step = 0; step < motion->steps; step++)
        ask_step(wall, motion, step, memory, hit);
    return (double)(bench_cpu_ns() - begin) / 1000;
}

// Only the near points. With `ask` false it runs only the loop around the queries, whose time is subtracted.
static double time_near(const Vessel *wall, const CollisionMotion *motion, bool ask, VesselMemory *memory, const Gathered *near)
{
    follow_start(memory, motion->node_count);
    int64_t begin = bench_cpu_ns();
    for (int step = 0; step < motion->steps; step++) {
        int count = 0, first = motion->first_node[step];
        for (size_t p = motion->offset[step]; p < motion->offset[step + 1]; p++) {
            if (!is_near(motion, step, p))
                continue;
            int node = first + (int)(p - motion->offset[step]);
            near->node[count] = node;
            near->point[count] = motion->point[p];
            near->memory[count++] = memory[node];
        }
        for (int k = count - 1; ask && k >= 0; k--)
            if (near->memory[k].node < 0)
                near->memory[k].node = wall->locate(wall, near->point[k], k + 1 < count ? near->memory[k + 1].node : -1);
        if (ask)
            vessel_query(wall, count, near->point, motion->reach[step], near->memory, near->hit);
        for (int k = 0; k < count; k++)
            memory[near->node[k]] = near->memory[k];
    }
    return (double)(bench_cpu_ns() - begin) / 1000;
}

static void add_error(ErrorFigures *figures, double error)
{
    figures->rms += error * error;
    figures->max = fmax(figures->max, error);
}

static void measure_errors(const Vessel *wall, const CollisionMotion *motion, VesselMemory *memory, VesselHit *hit, CollisionReplay *out)
{
    int64_t normals = 0;
    follow_start(memory, motion->node_count);
    for (int step = 0; step < motion->steps; step++) {
        ask_step(wall, motion, step, memory, hit);
        for (size_t p = motion->offset[step]; p < motion->offset[step + 1]; p++) {
            if (!is_near(motion, step, p))
                continue;
            const VesselHit *h = &hit[p - motion->offset[step]];
            out->near_points++;
            if (!has_answer(h)) {
                out->lost++;
                continue;
            }
            out->judged++;
            add_error(&out->gap_um, fabs(h->gap - motion->gap[p]) * 1000);
            // near the middle of the lumen the direction to the wall is undefined
            if (clear_of_tool(motion, step, p) > motion->radius[0] / 2)
                continue;
            normals++;
            add_error(&out->normal_deg, vec3_angle(h->normal, motion->normal[p]) * 180 / PI);
        }
    }
    out->gap_um.rms = sqrt(out->gap_um.rms / fmax(1, (double)out->judged));
    out->normal_deg.rms = sqrt(out->normal_deg.rms / fmax(1, (double)normals));
}

bool collision_replay(const Vessel *wall, const CollisionMotion *motion, int repeats, CollisionReplay *out)
{
    size_t nodes = (size_t)motion->node_count + 1;
    Gathered near = {calloc(nodes, sizeof(int)), calloc(nodes, sizeof(Vec3)), calloc(nodes, sizeof(VesselMemory)), calloc(nodes, sizeof(VesselHit))};
    VesselMemory *memory = calloc(nodes, sizeof *memory);
    bool good = near.node && near.point && near.memory && near.hit && memory;
    *out = (CollisionReplay){.steps = motion->steps, .points_per_step = motion->steps > 0 ? (double)motion->offset[motion->steps] / motion->steps : 0};
    if (good) {
        measure_errors(wall, motion, memory, near.hit, out);    // also warms up the caches
        double all = HUGE_VAL, asked = HUGE_VAL, copied = HUGE_VAL;
        for (int k = 0; k < repeats; k++) {
            all = fmin(all, time_all(wall, motion, memory, near.hit));
            asked = fmin(asked, time_near(wall, motion, true, memory, &near));
            copied = fmin(copied, time_near(wall, motion, false, memory, &near));
        }
        out->us_per_step = all / fmax(1, motion->steps);
        out->us_per_80_points = fmax(0, asked - copied) * 80 / fmax(1, (double)out->near_points);
    }
    free(near.node);
    free(near.point);
    free(near.memory);
    free(near.hit);
    free(memory);
    return good;
}

// --- closed loop ---

typedef struct Judge {       // the true wall, queried outside the timed part
    const Vessel *wall, *truth, *truth_gap;
    int node_count;
    VesselMemory *memory;    // (M) of the truth, for depths …
    VesselMemory *work_memory;       // (M) … and for normals
    VesselMemory *wall_memory;       // (M)
    VesselHit *hit;          // (M)
    NodeReport *node;        // (M)
    Vec3 *before;            // (M)
    double work, normal_work;        // [mJ]
} Judge;

// Nodes before it are in the sheath.
static int first_free(const Scene *scene, const WireState *state, const NodeReport *node)
{
    int first = 0;
    double in_sheath = node[state->node_count - 1].s - state->inserted;
    while (scene->wire.has_sheath && first < state->node_count && node[first].s <= in_sheath + 1e-9)
        first++;
    return first;
}

// The deepest node outside the true wall [mm].
static double judge_depth(Judge *judge, const WireState *state, int first)
{
    double deepest = 0, thickest = 0;
    int count = judge->node_count - first;
    for (int k = first; k < judge->node_count; k++)
        thickest = fmax(thickest, judge->node[k].radius);
    follow_forget(judge->memory, first);
    follow_locate(judge->truth_gap, first, judge->node_count, state->position + first, judge->memory);
    vessel_query(judge->truth_gap, count, state->position + first, thickest, judge->memory + first, judge->hit);   // further inside is not outside
    for (int k = 0; k < count; k++)
        if (has_answer(&judge->hit[k]))
            deepest = fmax(deepest, judge->node[first + k].radius - judge->hit[k].gap);
    return deepest;
}

// The wall's force in the last step. The solver's force is along the normal at the start of the step (unless it looked ahead). In a concave wall its stiffness
// matrix contains the rotation of the normal during the step; this part of the force is added here.
static Vec3 force_in_step(const Judge *judge, int i, Vec3 d, VesselMemory *memory)
{
    Vec3 force = judge->node[i].force;
    VesselHit hit;
    if (memory->node < 0)
        *memory = (VesselMemory){.node = judge->wall->locate(judge->wall, judge->before[i], -1)};
    vessel_query(judge->wall, 1, &judge->before[i], HUGE_VAL, memory, &hit);
    if (!has_answer(&hit) || sym3_quadratic(&hit.hessian, d) >= 0)
        return force;
    return vec3_add_scaled(force, fmax(0, vec3_dot(force, hit.normal)), sym3_mul_vec(&hit.hessian, d));
}

// W = sum of -F . (dx - (dx.n) n): the work that the wall's forces take from the wire as it slides along the true wall; 0 for a smooth wall without friction.
// n is the true normal at the end of the step.
static void judge_work(Judge *judge, const WireState *state, int first)
{
    follow_forget(judge->wall_memory, first);
    follow_forget(judge->work_memory, first);
    for (int i = first; i < judge->node_count; i++) {
        if (!(vec3_norm2(judge->node[i].force) > 0) || judge->memory[i].node < 0)
            continue;
        VesselHit hit;
        if (judge->work_memory[i].node < 0)
            judge->work_memory[i].node = judge->memory[i].node;
        vessel_query(judge->truth, 1, &state->position[i], HUGE_VAL, &judge->work_memory[i], &hit);
        if (!has_answer(&hit))
            continue;
        Vec3 d = vec3_sub(state->position[i], judge->before[i]), along = vec3_add_scaled(d, -vec3_dot(d, hit.normal), hit.normal);
        Vec3 force = force_in_step(judge, i, d, &judge->wall_memory[i]);
        judge->work -= vec3_dot(force, along);
        judge->normal_work += vec3_norm(force) * vec3_norm(along);
    }
}

static void fail(CollisionLoop *out, int64_t step, const char *format, double value)
{
    if (out->failed_step >= 0)
        return;
    out->failed_step = step;
    snprintf(out->why, sizeof out->why, format, value);
}

static bool judge_create(Judge *judge, int node_count)
{
    size_t room = (size_t)node_count + 1;
    judge->node_count = node_count;
    judge->memory = calloc(room, sizeof *judge->memory);
    judge->work_memory = calloc(room, sizeof *judge->work_memory);
    judge->wall_memory = calloc(room, sizeof *judge->wall_memory);
    judge->hit = calloc(room, sizeof *judge->hit);
    judge->node = calloc(room, sizeof *judge->node);
    judge->before = calloc(room, sizeof *judge->before);
    if (!judge->memory || !judge->work_memory || !judge->wall_memory || !judge->hit || !judge->node || !judge->before)
        return false;
    follow_start(judge->memory, node_count);
    follow_start(judge->work_memory, node_count);
    follow_start(judge->wall_memory, node_count);
    return true;
}

static void judge_free(Judge *judge)
{
    free(judge->memory);
    free(judge->work_memory);
    free(judge->wall_memory);
    free(judge->hit);
    free(judge->node);
    free(judge->before);
}

static bool start_record(CollisionMotion *record, const Judge *judge)
{
    collision_motion_free(record);
    record->node_count = judge->node_count;
    record->radius = calloc((size_t)judge->node_count, sizeof *record->radius);
    for (int i = 0; record->radius && i < judge->node_count; i++)
        record->radius[i] = judge->node[i].radius;
    return record->radius != NULL;
}

static double reach_at(const Scene *scene, const WireState *state, Command command, const Judge *judge, int first)
{
    double fastest = 0, radius = 0;
    for (int i = first; i < state->node_count; i++) {
        fastest = fmax(fastest, vec3_norm(state->velocity[i]));
        radius = fmax(radius, judge->node[i].radius);
    }
    return 2 * (fmin(LOOK_MAX, LOOK + fabs(command.push_mm_s) * scene->dt / 1000 + 2 * scene->dt * fastest) + radius);
}

typedef struct Hand {
    double length, fed, travel;      // [mm] of the wire; net length fed by the hand; total length pushed and pulled
} Hand;

// One step and its measurements; false if the run is over.
static bool loop_step(Simulator *simulator, const Scene *scene, const LoopOptions *o, int64_t i, Command command, Judge *judge, Hand *hand, CollisionLoop *out,
                      bool *out_of_memory)
{
    const WireState *state = simulator_state(simulator);
    if (o->without_friction)
        memcpy(judge->before, state->position, (size_t)judge->node_count * sizeof *judge->before);
    simulator_step_one_tool(simulator, command);
    const StepReport *report = simulator_last(simulator);
    double fed = fmin(hand->length, fmax(0, hand->fed + command.push_mm_s * scene->dt / 1000));
    hand->travel += fabs(fed - hand->fed);
    hand->fed = fed;
    out->steps = i + 1;
    if (o->push_n)
        o->push_n[i] = report->proximal_force;
    if (report->flags & STEP_DIVERGED) {
        fail(out, i, "diverged", 0);
        return false;
    }
    if (report->flags & STEP_OUT_OF_VESSEL)
        fail(out, i, "left through an end", 0);
    int first = first_free(scene, state, judge->node);
    if (i % JUDGE_EVERY == 0 || i + 1 == out->wanted) {
        double depth = judge_depth(judge, state, first);
        out->penetration_um = fmax(out->penetration_um, 1000 * depth);
        if (depth > CONTAINED)
            fail(out, i, depth > GONE ? "went through the wall" : "%.0f um outside", 1000 * depth);
        if (depth > GONE || (o->stop_at_failure && out->failed_step >= 0))
            return false;
    }
    if (o->without_friction) {
        stepper_node_report(simulator_stepper(simulator), judge->node);
        judge_work(judge, state, first);
    }
    if (o->record && !motion_add(o->record, first, reach_at(scene, state, command, judge, first), state->position)) {
        *out_of_memory = true;
        return false;
    }
    return true;
}

static void read_profile(const Simulator *simulator, CollisionLoop *out)
{
    const StepProfile *profile = simulator_profile(simulator);
    out->step_us = bench_spread(&profile->step, 1000);
    out->detect_us = histogram_quantile(&profile->stage[STAGE_DETECT], 0.5) / 1000;
    out->contact_us = histogram_quantile(&profile->stage[STAGE_CONTACT], 0.5) / 1000;
    out->candidates = histogram_quantile(&profile->candidates, 0.5);
    out->candidates_max = (double)profile->candidates.largest;
    out->contacts = histogram_quantile(&profile->contacts, 0.5);
    out->contacts_max = (double)profile->contacts.largest;
    out->iterations = histogram_quantile(&profile->iterations, 0.5);
    out->not_converged = simulator_totals(simulator)->not_converged_steps;
}

// The scene with other options for friction and contact; the caller provides the sections.
static Scene scene_for(const Scene *scene, const LoopOptions *o, WireSection *section)
{
    Scene own = *scene;
    own.contact_options = o->contact;
    if (!o->without_friction)
        return own;
    own.friction = 0;
    for (int i = 0; i < scene->wire.section_count; i++) {
        section[i] = scene->wire.section[i];
        section[i].friction = -1;
    }
    own.wire.section = section;
    return own;
}

bool collision_loop(const Scene *scene, const Vessel *wall, const Vessel *truth, const Vessel *truth_gap, const LoopOptions *o, CollisionLoop *out,
                    Faults *faults)
{
    *out = (CollisionLoop){.failed_step = -1, .wanted = bench_steps(scene, o->most_steps)};
    WireSection *section = calloc((size_t)scene->wire.section_count + 1, sizeof *section);
    if (!section) {
        faults_add(faults, scene->path, 0, 0, "no memory for the run");
        return false;
    }
    Scene own = scene_for(scene, o, section);
    Simulator *simulator = simulator_create(&own, wall, faults);
    Judge judge = {.wall = wall, .truth = truth, .truth_gap = truth_gap};
    bool out_of_memory = simulator && !judge_create(&judge, simulator_state(simulator)->node_count);
    if (simulator && !out_of_memory) {
        stepper_node_report(simulator_stepper(simulator), judge.node);
        out_of_memory = o->record && !start_record(o->record, &judge);
    }
    if (simulator && !out_of_memory) {
        Hand hand = {.length = judge.node[judge.node_count - 1].s, .fed = simulator_state(simulator)->inserted};
        int cursor = 0;
        for (int64_t i = 0; i < out->wanted; i++)
            if (!loop_step(simulator, &own, o, i, bench_command(&own, i, &cursor), &judge, &hand, out, &out_of_memory))
                break;
        read_profile(simulator, out);
        out->fed_mm = hand.travel;
        out->stalled_mm = own.wire.has_sheath ? hand.fed - simulator_state(simulator)->inserted : 0;
        if (fabs(out->stalled_mm) > STALLED)
            fail(out, out->steps - 1, "stalled, %.2f mm not fed", out->stalled_mm);
        out->survived = out->failed_step < 0;
        out->work_n = judge.work / fmax(hand.travel, 1e-9);
        out->work_mu = judge.normal_work > 0 ? judge.work / judge.normal_work : 0;
    }
    if (out_of_memory)
        faults_add(faults, scene->path, 0, 0, "no memory for the run");
    judge_free(&judge);
    if (simulator)
        simulator_destroy(simulator);
    free(section);
    return simulator && !out_of_memory;
}

PushFigures collision_push(const double *push_n, int64_t steps, const double *reference_n, int64_t reference_steps)
{
    PushFigures out = {0};
    int64_t common = steps < reference_steps ? steps : reference_steps;
    if (common < 2)
        return out;
    double *change = HEAP_ZEROED((size_t)common, sizeof *change), square = 0;
    for (int64_t i = 0; i < common; i++) {
        out.mean_n += push_n[i] / (double)common;
        out.reference_n += reference_n[i] / (double)common;
    }
    for (int64_t i = 1; i < common; i++) {
        change[i - 1] = fabs(push_n[i] - push_n[i - 1]) / fmax(fabs(out.mean_n), 1e-12);
        square += change[i - 1] * change[i - 1];
    }
    sort_doubles(change, (size_t)common - 1);
    out.jitter_rms = sqrt(square / (double)(common - 1));
    out.jitter_p99 = change[(size_t)(0.99 * (double)(common - 2))];
    free(change);
    return out;
}
