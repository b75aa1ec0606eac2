// One step follows the paper's loop: feed the sheath, detect, assemble, factor, solve the contact, correct.
#include "sim/simulator.h"

#include "base/base.h"
#include "solver/solver.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

const char *const stage_name[STAGE_COUNT] = {"feed", "detect", "assemble", "factor", "contact", "judge", "correct"};
const char *const step_flag_name[STEP_FLAG_COUNT] = {"diverged",      "not_converged",    "deep",    "fully_inserted",  "fully_withdrawn",
                                                     "out_of_vessel", "detection_unsure", "limited", "model_disagrees", "hand_slips"};

struct Simulator {
    const Scene *scene;
    Stepper *stepper;
    StepProfile profile;
    int64_t step_ns;
    RunTotals totals;
    EnergyBalance energy;
    StepEnergy before;       // of the previous state
    TargetReach *target;
    double dt;               // [ms]
    int requested[TOOLS_MOST]; // devices requested by the last commands
};

static void measure_targets(Simulator *simulator)
{
    const WireState *state = stepper_state(simulator->stepper);
    SEL_ASSERT(state->node_count > 1, "a tool has a tip");
    for (int i = 0; i < simulator->scene->target_count; i++) {
        const SceneTarget *target = &simulator->scene->target[i];
        TargetReach *reach = &simulator->target[i];
        double distance = vec3_distance(state->position[state->node_count - 1], target->point);
        bool inside = distance <= target->radius;
        if ((inside && !reach->reached) || (!reach->reached && distance < reach->distance))
            reach->time_s = simulator_time_s(simulator);
        reach->reached |= inside;
        reach->distance = fmin(reach->distance, distance);
    }
}

static void begin_targets(Simulator *simulator)
{
    for (int i = 0; i < simulator->scene->target_count; i++)
        simulator->target[i] = (TargetReach){.distance = HUGE_VAL};
    measure_targets(simulator);
}

Simulator *simulator_create(const Scene *scene, const Vessel *vessel, Faults *faults)
{
    char why[FAULT_LENGTH / 2] = "no memory";
    Simulator *simulator = calloc(1, sizeof *simulator);
    if (simulator)
        simulator->target = calloc((size_t)scene->target_count + 1, sizeof *simulator->target);
    if (simulator && simulator->target) {
        StepperOptions options = {.wire = scene->wire,
                                  .vessel = vessel,
                                  .wall_friction = scene->friction,
                                  .contact = scene->contact_options,
                                  .self_contact = scene->self_contact,
                                  .follows_touch = scene->follows_touch,
                                  .dt = scene->dt};
        WireOptions inner[TOOLS_MOST];
        SEL_REQUIRE(scene->tool_count <= TOOLS_MOST && scene->exchange_count <= TOOLS_MOST * EXCHANGES_MOST,
                    "a scene was checked for its number of tools and devices");
        for (int k = 1; k < scene->tool_count; k++)
            inner[k - 1] = scene_tool_wire(scene, k), options.inner_friction[k - 1] = scene->tool[k - 1].friction_inside;
        options.inner_count = scene->tool_count > 1 ? scene->tool_count - 1 : 0;
        options.inner = inner;
        StepperSpare spare[TOOLS_MOST * EXCHANGES_MOST];
        for (int i = 0; i < scene->exchange_count; i++) {
            const SceneExchange *e = &scene->exchange[i];
            spare[i] = (StepperSpare){.tool = e->tool, .wire = scene_placed_wire(scene, &e->device.wire), .friction_inside = e->device.friction_inside};
        }
        options.spare_count = scene->exchange_count;
        options.spare = spare;
        simulator->stepper = stepper_create(&options, why, (int)sizeof why);
    }
    if (!simulator || !simulator->stepper) {
        faults_add(faults, scene->path, 0, 0, "cannot be simulated: %s", why);
        simulator_destroy(simulator);
        return NULL;
    }
    simulator->scene = scene;
    simulator->dt = scene->dt;
    begin_targets(simulator);
    return simulator;
}

void simulator_begin_again(Simulator *simulator, const Checkpoint *start)
{
    *simulator = (Simulator){.scene = simulator->scene, .stepper = simulator->stepper, .target = simulator->target, .dt = simulator->dt};
    stepper_restore(simulator->stepper, start);
    begin_targets(simulator);
}

void simulator_take_over(Simulator *simulator, const Simulator *from, const Checkpoint *state)
{
    SEL_ASSERT(simulator->scene == from->scene, "both simulate the same scene");
    Stepper *stepper = simulator->stepper;
    TargetReach *target = simulator->target;
    *simulator = *from;
    simulator->stepper = stepper;
    simulator->target = target;
    memcpy(target, from->target, (size_t)from->scene->target_count * sizeof *target);
    stepper_restore(stepper, state);
}

void simulator_destroy(Simulator *simulator)
{
    if (!simulator)
        return;
    if (simulator->stepper)
        stepper_destroy(simulator->stepper);
    free(simulator->target);
    free(simulator);
}

static int64_t thread_cpu_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

// Time spent in each stage of a step; a stage may be repeated.
typedef struct StageClock {
    int64_t start, since, spent[STAGE_COUNT];
} StageClock;

static StageClock start_clock(void)
{
    int64_t now = thread_cpu_ns();
    return (StageClock){.start = now, .since = now};
}

static void lap(StageClock *clock, Stage stage)
{
    int64_t now = thread_cpu_ns();
    clock->spent[stage] += now - clock->since;
    clock->since = now;
}

static void keep_times(Simulator *simulator, const StageClock *clock)
{
    StepProfile *profile = &simulator->profile;
    for (int k = 0; k < STAGE_COUNT; k++)
        histogram_add(&profile->stage[k], clock->spent[k]);
    simulator->step_ns = clock->since - clock->start;
    histogram_add(&profile->step, simulator->step_ns);
}

const double energy_gain_share = 1e-3;

void simulator_watch_energy(Simulator *simulator)
{
    simulator->energy.watched = true;
    simulator->before = (StepEnergy){.elastic = stepper_elastic_energy(simulator->stepper), .kinetic = stepper_kinetic_energy(simulator->stepper)};
}

const EnergyBalance *simulator_energy(const Simulator *simulator) { return &simulator->energy; }

bool simulator_gains_energy(const Simulator *simulator)
{
    // rounding errors of an energy of some mJ do not count as a gain
    return simulator->energy.gained > energy_gain_share * simulator->energy.work + 1e-6;
}

static void balance_energy(Simulator *simulator)
{
    EnergyBalance *sum = &simulator->energy;
    StepEnergy e = stepper_energy(simulator->stepper);
    SEL_ASSERT(isfinite(e.elastic) && isfinite(e.kinetic), "a state has an energy");
    double elastic = e.elastic - simulator->before.elastic, kinetic = e.kinetic - simulator->before.kinetic;
    double numerical = e.hand + e.load - e.friction - e.damping - elastic - kinetic, contact = e.wall - e.friction;
    double by_end = -numerical - e.wall, by_start = by_end + e.hand + contact - e.hand_start - e.contact_start, by_mean = 0.5 * (by_end + by_start);
    double gained = fmin(by_end + fmin(0, e.wall), by_start);
    simulator->before = e;
    sum->hand += e.hand;
    sum->load += e.load;
    sum->wall += e.wall;
    sum->friction += e.friction;
    sum->damping += e.damping;
    sum->elastic += elastic;
    sum->kinetic += kinetic;
    sum->numerical += numerical;
    sum->work += fabs(e.hand) + fabs(e.load);
    sum->gained += fmax(0, gained);
    sum->gained_end += fmax(0, by_end);
    sum->gained_mean += fmax(0, by_mean);
    if (gained > sum->gained_most) {
        sum->gained_most = gained;
        sum->gained_at_s = simulator_time_s(simulator);
    }
}

static void accumulate(Simulator *simulator)
{
    const StepReport *report = step_report(simulator->stepper);
    RunTotals *totals = &simulator->totals;
    totals->steps++;
    totals->flags |= report->flags;
    totals->not_converged_steps += (report->flags & STEP_NOT_CONVERGED) != 0;
    totals->further_linearisations += report->newton > 0;
    totals->disagreeing_steps += (report->flags & STEP_MODEL_DISAGREES) != 0;
    totals->limited_steps += (report->flags & STEP_LIMITED) != 0;
    totals->hand_slip_steps += (report->flags & STEP_HAND_SLIPS) != 0;
    totals->hand_slipped += fabs(report->slipped);
    totals->contacts_max = report->active > totals->contacts_max ? report->active : totals->contacts_max;
    totals->self_contacts_max = report->self_contacts > totals->self_contacts_max ? report->self_contacts : totals->self_contacts_max;
    totals->self_overlap_max = fmax(totals->self_overlap_max, report->self_overlap);
    totals->penetration_max = fmax(totals->penetration_max, report->penetration);
    totals->residual_max = fmax(totals->residual_max, report->residual);
    totals->push_least = fmin(totals->push_least, report->proximal_force);
    totals->push_most = fmax(totals->push_most, report->proximal_force);
    StepProfile *profile = &simulator->profile;
    histogram_add(&profile->iterations, report->iterations);
    histogram_add(&profile->candidates, report->candidates);
    histogram_add(&profile->contacts, report->active);
    histogram_add(&profile->penetration_nm, (int64_t)fmin(report->penetration * 1e6, 1e12));
    measure_targets(simulator);
}

void simulator_step_one_tool(Simulator *simulator, Command command) { simulator_step(simulator, &(ToolCommands){.tool = {command}}); }

// A refused exchange is not retried until the command changes.
static void exchange(Simulator *simulator, const ToolCommands *commands)
{
    for (int k = 0; k < stepper_tool_count(simulator->stepper); k++) {
        int requested = commands->fitted[k];
        if (requested == simulator->requested[k])
            continue;
        simulator->requested[k] = requested;
        if (requested == stepper_fitted(simulator->stepper, k))  // after a refused exchange
            continue;
        double before = simulator->energy.watched ? stepper_elastic_energy(simulator->stepper) : 0;
        StepExchange outcome = stepper_exchange(simulator->stepper, k, requested);
        if (outcome == EXCHANGE_DONE) {
            simulator->totals.exchanges++;
            // the energy of the tools behind the hub, straight in the hand, is excluded
            simulator->before.elastic += simulator->energy.watched ? stepper_elastic_energy(simulator->stepper) - before : 0;
        } else {
            simulator->totals.refused_exchanges++;
            simulator->totals.refusal = outcome;
        }
    }
}

// All stages of a step. A stage is repeated where its solution is not good enough.
static void solve(Stepper *stepper, const StepCommand *command, unsigned released, StageClock *clock)
{
    step_feed_tools(stepper, command, released);
    lap(clock, STAGE_FEED);
    for (unsigned needs = STEP_NEEDS_ALL; needs != 0;) {
        if (needs & STEP_NEEDS_WALLS) {
            step_detect(stepper);
            lap(clock, STAGE_DETECT);
        }
        if (needs & STEP_NEEDS_SYSTEM) {
            step_assemble(stepper);
            lap(clock, STAGE_ASSEMBLE);
            step_factor(stepper);
            lap(clock, STAGE_FACTOR);
        }
        ContactProblem contacts = step_contacts(stepper);
        ContactReport solved = contact_solve(&contacts);
        lap(clock, STAGE_CONTACT);
        needs = step_judge(stepper, &solved);
        lap(clock, STAGE_JUDGE);
    }
    step_correct(stepper);
    SEL_VALIDATE(!stepper_broken(stepper), stepper_broken(stepper));
    lap(clock, STAGE_CORRECT);
}

void simulator_step(Simulator *simulator, const ToolCommands *commands)
{
    exchange(simulator, commands);
    Stepper *stepper = simulator->stepper;
    double seconds = simulator->dt / 1000;
    StageClock clock = start_clock();
    StepCommand command[STEP_TOOLS_MAX];
    for (int k = 0; k < STEP_TOOLS_MAX; k++)
        command[k] = (StepCommand){.advance = commands->tool[k].push_mm_s * seconds, .twist = commands->tool[k].twist_deg_s * seconds * PI / 180};
    for (int k = 0; k < STEP_TOOLS_MAX; k++)
        SEL_ASSERT(isfinite(command[k].advance) && isfinite(command[k].twist), "commands are finite: devices and scripts were checked");
    if (step_rests(stepper, command, commands->released))
        lap(&clock, STAGE_FEED);
    else
        solve(stepper, command, commands->released, &clock);

    keep_times(simulator, &clock);
    accumulate(simulator);
    if (simulator->energy.watched && !simulator_last(simulator)->is_at_rest)
        balance_energy(simulator);
}

double simulator_time_s(const Simulator *simulator) { return (double)simulator->totals.steps * simulator->dt / 1000; }
const WireState *simulator_state(const Simulator *simulator) { return stepper_state(simulator->stepper); }
const StepReport *simulator_last(const Simulator *simulator) { return step_report(simulator->stepper); }
const RunTotals *simulator_totals(const Simulator *simulator) { return &simulator->totals; }
int64_t simulator_step_ns(const Simulator *simulator) { return simulator->step_ns; }
const StepProfile *simulator_profile(const Simulator *simulator) { return &simulator->profile; }
const TargetReach *simulator_targets(const Simulator *simulator) { return simulator->target; }
const Scene *simulator_scene(const Simulator *simulator) { return simulator->scene; }
Stepper *simulator_stepper(Simulator *simulator) { return simulator->stepper; }

typedef struct HashLanes {
    uint64_t lane[4];
} HashLanes;

static void hash_doubles(HashLanes *hash, const void *data, size_t count)
{
    SEL_ASSERT(count > 0, "a state has numbers");
    const unsigned char *byte = data;
    for (size_t i = 0; i < count; i++) {
        uint64_t word;
        memcpy(&word, byte + i * sizeof word, sizeof word);
        hash->lane[i % 4] = (hash->lane[i % 4] ^ word) * UINT64_C(0x100000001b3);
        // FNV only propagates upwards: without this a sign bit would affect only one bit of the result
        hash->lane[i % 4] ^= hash->lane[i % 4] >> 29;
    }
}

uint64_t simulator_hash(const Simulator *simulator)
{
    const WireState *state = stepper_state(simulator->stepper);
    const uint64_t basis = UINT64_C(0xcbf29ce484222325);
    HashLanes hash = {{basis, basis + 1, basis + 2, basis + 3}};
    size_t nodes = (size_t)state->node_count;
    double scalars[4] = {state->time, state->inserted, state->twist, (double)state->node_count};
    hash_doubles(&hash, scalars, 4);
    hash_doubles(&hash, state->position, nodes * 3);
    hash_doubles(&hash, state->orientation, nodes * 4);
    hash_doubles(&hash, state->velocity, nodes * 3);
    hash_doubles(&hash, state->spin, nodes * 3);
    uint64_t all = basis;
    for (int i = 0; i < 4; i++) {
        all = (all ^ hash.lane[i]) * UINT64_C(0x100000001b3);
        all ^= all >> 32;
    }
    return all;
}

double simulator_fastest_mm_s(const Simulator *simulator)
{
    const WireState *state = stepper_state(simulator->stepper);
    double fastest = 0, turning = 0, radius = 0;
    for (int i = 0; i < state->node_count; i++) {
        fastest = fmax(fastest, vec3_norm2(state->velocity[i]));
        turning = fmax(turning, vec3_norm2(state->spin[i]));
    }
    for (int i = 0; i < simulator->scene->wire.section_count; i++)
        radius = fmax(radius, simulator->scene->wire.section[i].diameter / 2);
    return fmax(sqrt(fastest), sqrt(turning) * radius) * 1000;
}
