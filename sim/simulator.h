// The simulator: a scene and its vessel, stepped by commands. One step is the solver's stages, some of them repeated when it is linearised again,
// each timed with the thread's CPU clock. Internal units mm, g, ms, N, rad; commands and totals have their unit in the name. A step allocates
// nothing. One thread owns a simulator; it borrows scene and vessel, which must outlive it.
#ifndef SELDINGER_SIM_SIMULATOR_H
#define SELDINGER_SIM_SIMULATOR_H

#include "input/input.h"
#include "sim/scene.h"
#include "sim/time_histogram.h"
#include "solver/solver.h"

typedef enum { STAGE_FEED, STAGE_DETECT, STAGE_ASSEMBLE, STAGE_FACTOR, STAGE_CONTACT, STAGE_JUDGE, STAGE_CORRECT, STAGE_COUNT } Stage;
extern const char *const stage_name[STAGE_COUNT];

// Of all steps so far: thread CPU time [ns], counts, depths.
typedef struct StepProfile {
    TimeHistogram step;
    TimeHistogram stage[STAGE_COUNT];
    TimeHistogram iterations;        // of the contact solve, a count
    TimeHistogram candidates;        // points near enough to the wall to touch it
    TimeHistogram contacts;          // with force
    TimeHistogram penetration_nm;    // deepest node of the state at the step's start
} StepProfile;

// Totals over all steps so far.
typedef struct RunTotals {
    int64_t steps;
    unsigned flags;                  // every STEP_ flag that was seen
    int64_t not_converged_steps;
    int64_t further_linearisations;  // steps that took two or more Newton iterations
    int64_t disagreeing_steps;       // steps in which the vessel's model was inconsistent about the wall at a point of the tool
    int64_t limited_steps;           // steps whose motion was shortened; the next ones completed it
    int64_t exchanges;               // of tools at the hub
    int64_t refused_exchanges;       // exchanges refused because the tool was still in the vessel, or the new one too short …
    StepExchange refusal;            // … and why, of the last
    int64_t hand_slip_steps;         // steps in which the tool needed more force than the grip holds …
    double hand_slipped;             // [mm] … and how far the grip slid along it, in both directions
    int contacts_max;                // contacts with force
    int self_contacts_max;           // self-contacts …
    double self_overlap_max;         // [mm] … and their deepest penetration
    double penetration_max;          // [mm]
    double residual_max;
    double push_least, push_most;    // [N] at the hand
} RunTotals;

// The energy balance of a run [mJ], while it is watched (solver/step.h, StepEnergy):
//   hand + load = elastic + kinetic + friction + damping + numerical
typedef struct EnergyBalance {
    bool watched;
    double hand, load, friction, damping;
    double elastic, kinetic;         // more than at the start
    double numerical;                // the remainder: dissipated by implicit Euler, less what …
    double wall;                     // … the wall's pressure gave to points outside
    double work;                     // done by hand and loads, without sign
    // Sum of the gains of single steps that no force explains: more than hands, walls, friction and valves gave both by their forces at the step's end and by
    // those at its start. In between a force's work lies between the two; a rigid wall gives where it pushes out and takes nothing.
    double gained;
    double gained_most;              // in one step …
    double gained_at_s;              // … which ended then
    // The same sum by the forces at each step's end alone, as implicit Euler has it, and by the mean of those at its start and end. The first counts a gain of
    // -dF u / 2 when a force F falls in a step that moves by u. The second is then accurate to third order, but off by as much, either way, when the force
    // jumps: a reversed hand, a tool that begins to touch.
    double gained_end, gained_mean;
} EnergyBalance;
// A gain of more than this share of the work needs an explanation.
extern const double energy_gain_share;

// How close the tip came to a target of the scene.
typedef struct TargetReach {
    double distance;                 // [mm] least distance of the tip so far
    double time_s;                   // when that was, or when the target was first reached
    bool reached;                    // within its radius in some step
} TargetReach;

typedef struct Simulator Simulator;

// `vessel` may be NULL (no walls). NULL with a fault if the solver refuses an option.
Simulator *simulator_create(const Scene *scene, const Vessel *vessel, Faults *faults);
void simulator_destroy(Simulator *simulator);

void simulator_step_one_tool(Simulator *simulator, Command command);       // with several tools the inner ones are pinned
void simulator_step(Simulator *simulator, const ToolCommands *commands);

// Watches the energy from now on: costs about one assembly per step, outside the timed stages.
void simulator_watch_energy(Simulator *simulator);
const EnergyBalance *simulator_energy(const Simulator *simulator);
bool simulator_gains_energy(const Simulator *simulator);           // more than energy_gain_share of the work

double simulator_time_s(const Simulator *simulator);
const WireState *simulator_state(const Simulator *simulator);
const StepReport *simulator_last(const Simulator *simulator);     // of the last step; zeros before the first
const RunTotals *simulator_totals(const Simulator *simulator);
int64_t simulator_step_ns(const Simulator *simulator);             // thread CPU time of the last step
const StepProfile *simulator_profile(const Simulator *simulator);
const TargetReach *simulator_targets(const Simulator *simulator); // (scene->target_count)
const Scene *simulator_scene(const Simulator *simulator);
Stepper *simulator_stepper(Simulator *simulator);                 // for save, restore and node reports
// FNV-1a over time, inserted length, twist and all nodes' position, orientation, velocity and spin, word by word in four lanes.
uint64_t simulator_hash(const Simulator *simulator);
double simulator_fastest_mm_s(const Simulator *simulator);        // the fastest node's speed, or the surface's where the tool turns

// Names of STEP_ flags, for files: "diverged", "not_converged", …, "limited", "model_disagrees", "hand_slips"; index 0 to STEP_FLAG_COUNT - 1 is the bit.
enum { STEP_FLAG_COUNT = 10 };
extern const char *const step_flag_name[STEP_FLAG_COUNT];

#endif
