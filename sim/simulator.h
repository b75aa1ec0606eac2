// The simulator: a scene and its vessel, stepped by commands. A step runs the solver's stages, repeating some of them when it linearises again; each stage is
// timed with the thread's CPU clock. Internal units are mm, g, ms, N, rad; commands and totals have their unit in the name. A step allocates nothing. One
// thread owns a simulator; it borrows scene and vessel, which must outlive it.
#ifndef SELDINGER_SIM_SIMULATOR_H
#define SELDINGER_SIM_SIMULATOR_H

#include "input/input.h"
#include "sim/scene.h"
#include "sim/time_histogram.h"
#include "solver/solver.h"

typedef enum { STAGE_FEED, STAGE_DETECT, STAGE_ASSEMBLE, STAGE_FACTOR, STAGE_CONTACT, STAGE_JUDGE, STAGE_CORRECT, STAGE_COUNT } Stage;
extern const char *const stage_name[STAGE_COUNT];

// Statistics of all steps so far: thread CPU time [ns], counts, depths.
typedef struct StepProfile {
    TimeHistogram step;
    TimeHistogram stage[STAGE_COUNT];
    TimeHistogram iterations;        // of the contact solve, a count
    TimeHistogram candidates;        // points near enough to the wall to touch it
    TimeHistogram contacts;          // contacts with force
    TimeHistogram penetration_nm;    // deepest node of the state at the step's start
} StepProfile;

// Totals of all steps so far.
typedef struct RunTotals {
    int64_t steps;
    unsigned flags;                  // every STEP_ flag that was seen
    int64_t not_converged_steps;
    int64_t further_linearisations;  // steps that took two or more Newton iterations
    int64_t disagreeing_steps;       // steps in which the vessel's model was inconsistent about the wall at a point of the tool
    int64_t limited_steps;           // steps whose motion was shortened; the next ones completed it
    int64_t exchanges;               // exchanges of tools at the hub
    int64_t refused_exchanges;       // exchanges refused because the tool was still inserted, or a tool was too short …
    StepExchange refusal;            // … and the reason of the last refusal
    int64_t hand_slip_steps;         // steps in which the tool needed more force than the grip holds …
    double hand_slipped;             // [mm] … and how far the grip slid along it, in both directions
    int contacts_max;                // contacts with force
    int self_contacts_max;           // self-contacts …
    double self_overlap_max;         // [mm] … and their deepest penetration
    double penetration_max;          // [mm]
    double residual_max;
    double push_least, push_most;    // [N] at the hand
} RunTotals;

// The energy balance of a run [mJ] since watching began (solver/step.h, StepEnergy):
//   hand + load = elastic + kinetic + friction + damping + numerical
typedef struct EnergyBalance {
    bool watched;
    double hand, load, friction, damping;
    double elastic, kinetic;         // increase since the start
    double numerical;                // remainder: energy dissipated by implicit Euler, minus …
    double wall;                     // … the work of the wall's pressure on points outside the wall
    double work;                     // work of hand and loads, sum of absolute values
    // Sum of the energy gains of single steps that no force explains: gains above the work of hands, walls, friction and valves, whether computed with the
    // forces at the step's end or with those at its start. A force that varies in between does work between these two values. A rigid wall supplies energy
    // where it pushes a point out, and absorbs none.
    double gained;
    double gained_most;              // largest gain in one step …
    double gained_at_s;              // … and the time at which that step ended
    // The same sum computed with the forces at each step's end alone, as in implicit Euler, and with the mean of the forces at its start and end. The first
    // counts a gain of -dF u / 2 when a force F falls in a step that moves by u. The second is accurate to third order, but has an error of that size, of
    // either sign, when the force jumps: the hand reverses, or the tool begins to touch.
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

// Returns to the state of `start`, which stepper_save() made before the first step, and forgets all totals; the balance of energies is no longer watched.
void simulator_begin_again(Simulator *simulator, const Checkpoint *start);
// Takes over the state and the totals of `from`, of the same scene and vessel, which `state` holds; the next steps of both are the same bit for bit.
void simulator_take_over(Simulator *simulator, const Simulator *from, const Checkpoint *state);

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
double simulator_fastest_mm_s(const Simulator *simulator);        // speed of the fastest node, or of the surface where the tool turns

// Names of STEP_ flags, for files: "diverged", "not_converged", …, "limited", "model_disagrees", "hand_slips"; index 0 to STEP_FLAG_COUNT - 1 is the bit.
enum { STEP_FLAG_COUNT = 10 };
extern const char *const step_flag_name[STEP_FLAG_COUNT];

#endif
