// One implicit Euler step, divided into the stages that the simulator calls and times (sim/simulator.c follows the order of the paper). First order in dt:
// the hand's work in the phantom is 3.5 % larger at 1 ms than at 0.25 ms, 4.1 % without friction; with `follows_touch` 0.9 and 1.4 %.
//   step_feed      takes the command: advance and rotation of the driven node become the prescribed displacement of this step
//   step_detect    finds candidates and gaps in the vessel at the iterate, which is x_n at first
//   step_assemble  (M/h^2 + D/h + K) u = M v/h + f(x) + ..., with tension and curvature terms, constraints as unit rows
//   step_factor
//   contact_solve  u and the contact forces: Newton's method on the contact conditions, for the problem of step_contacts()
//   step_judge     moves the iterate to the solution and returns which stages must be repeated; none: the step is solved
//   step_correct   x_{n+1}, v_{n+1}, reactions; if the motion is not finite or implausibly large, keeps x_n and sets STEP_DIVERGED
// A step neither allocates memory nor reads a clock. One thread per Stepper; several Steppers may share a vessel.
#ifndef SELDINGER_SOLVER_STEP_H
#define SELDINGER_SOLVER_STEP_H

#include "geom/geom.h"
#include "solver/contact_solve.h"
#include "solver/wire.h"

enum { STEP_TOOLS_MAX = 4, STEP_SPARES_MAX = 4 };

typedef struct StepCommand {
    double advance;          // [mm] in this step, > 0 into the patient
    double twist;            // [rad] in this step, right-handed about the direction of advance
} StepCommand;

enum {
    STEP_DIVERGED = 1,           // the state remains x_n; the run is no longer valid
    STEP_NOT_CONVERGED = 2,      // the contact solve reached its iteration limit
    STEP_DEEP = 4,               // a node is more than 0.2 mm outside the wall
    STEP_FULLY_INSERTED = 8,     // the advance was limited: the whole tool is inserted
    STEP_FULLY_WITHDRAWN = 16,   // the retraction was limited
    STEP_OUT_OF_VESSEL = 32,     // a node is beyond an open end other than that of the sheath
    STEP_DETECTION_UNSURE = 64,  // a projection did not converge
    STEP_LIMITED = 128,          // the motion was limited and later steps complete it: otherwise an element would have turned by more than 0.3 rad, the tool
                                 // would have passed through the wall, or the hand would have compressed it by more than 3 % of its length
    STEP_MODEL_DISAGREES = 256,  // two parts of the vessel model contradict each other about the wall at a point; the gap is smoothed so that the tool is not
                                 // thrown
    STEP_HAND_SLIPS = 512,       // the tool required more force than the hand can hold: the hand slipped along it
};

typedef struct StepReport {
    unsigned flags;
    int candidates, active;
    int disagreements;           // number of contact points at which the vessel model contradicts itself
    int iterations;
    double residual, cone_violation;
    double penetration;          // [mm] largest penetration, >= 0, of the state at the start of the step (true distance)
    double proximal_force;       // [N] reaction at the driven node, > 0 when the hand pushes
    double proximal_torque;      // [N mm]
    double push[STEP_TOOLS_MAX], torque[STEP_TOOLS_MAX];     // [N], [N mm] of each tool's hand; [0] equals proximal_force and proximal_torque
    double wall_force_max;       // [N] largest contact force
    double wall_force_sum;       // [N] sum of magnitudes
    int self_contacts;           // number of loaded contacts of the tool with itself
    double self_overlap;         // [mm] largest overlap of the tool with itself, >= 0, of the state at the start of the step
    double slipped;              // [mm] motion of the hand minus that of the tool
    bool is_at_rest;             // the step left the state exactly as it was, except for the time (step_rests)
    int newton;                  // further linearisations in this step; 0 in a step without difficulties
} StepReport;

typedef struct Stepper Stepper;

// A tool that may replace tool `tool` of several, once that has been withdrawn to its hub (stepper_exchange()).
typedef struct StepperSpare {
    int tool;
    WireOptions wire;        // sections, elements, hand_limit and valve_friction are used
    double friction_inside;  // Coulomb coefficient of its lumen with the next inner tool
} StepperSpare;

// Self-contact of a tool. Default: on in a vessel, where it can coil up. The wire of a rig is the ideal one of textbooks, which rolls up twice in a plane.
typedef enum { SELF_CONTACT_AUTO, SELF_CONTACT_ON, SELF_CONTACT_OFF } SelfContactMode;

typedef struct StepperOptions {
    WireOptions wire;            // the tool, or the outermost of several
    // Coaxial tools inside it, outermost first. Of their options sections, elements, hand_limit, valve_friction and inserted (length beyond the mouth, or
    // beyond the rig's start) are used.
    int inner_count;             // up to STEP_TOOLS_MAX - 1
    const WireOptions *inner;
    double inner_friction[STEP_TOOLS_MAX - 1];     // >= 0, Coulomb coefficient of each inner tool with the surrounding one
    int spare_count;             // at most STEP_SPARES_MAX per tool; 0 if there is only one tool
    const StepperSpare *spare;
    const Vessel *vessel;        // NULL: no walls
    double wall_friction;
    ContactOptions contact;
    SelfContactMode self_contact;
    double dt;                   // [ms], default 1
    // Contacts stay at the touching point while the tool slides, and the step is linearised about that slide (step_touch.c): this halves the variation of the
    // push from step to step. Only for a single tool of slender elements. Default off: a tip that snaps onto its own coil overlaps it by 16 um in one step of
    // test_self_contact.
    bool follows_touch;
    int newton_max;              // maximum number of linearisations per step, twice as many where a snap overshoots the wall; 0: the default, 4
} StepperOptions;

// Returns NULL, with a message in `why` (capacity >= 256), if an option is out of range or memory is insufficient.
Stepper *stepper_create(const StepperOptions *options, char *why, int capacity);
void stepper_destroy(Stepper *stepper);

void step_feed(Stepper *stepper, StepCommand command);
// Commands of all tools, [1 + inner_count]; step_feed() holds the inner ones still. Bit k of `released`: no hand holds tool k; only the friction of its valve
// does (WireOptions.valve_friction).
void step_feed_tools(Stepper *stepper, const StepCommand *command, unsigned released);
// Between two steps: replaces tool `tool` by the original tool (0) or by a spare (1, 2, … in the order of the options). Allocates nothing. The poses of the
// other tools do not change; friction forces on the old tool are discarded.
typedef enum {
    EXCHANGE_DONE,
    EXCHANGE_NO_SUCH_TOOL,
    EXCHANGE_INSERTED,       // the tool must first be withdrawn to its hub, the outermost one to the sheath's mouth
    EXCHANGE_TOO_SHORT,      // a proximal end would lie inside a hub: the inner tool, or the new one, is too short
} StepExchange;
StepExchange stepper_exchange(Stepper *stepper, int tool, int which);
const char *step_exchange_refusal(StepExchange outcome);   // reason and remedy, to follow "because" or a colon; "" for EXCHANGE_DONE
// The tool in place: 0 for the first one, k for its k-th spare.
int stepper_fitted(const Stepper *stepper, int tool);

// Instead of a step with these commands ([1 + inner_count]): whether the tools are at rest (step_rest.c) and the hands leave them so. If so, the step is done, in
// less than a microsecond: the time has gone on by dt, all else is as it was.
bool step_rests(Stepper *stepper, const StepCommand *command, unsigned released);

void step_detect(Stepper *stepper);
void step_assemble(Stepper *stepper);
void step_factor(Stepper *stepper);
ContactProblem step_contacts(Stepper *stepper);    // valid until the next call of a stage
enum {
    STEP_NEEDS_WALLS = 1,    // step_detect()
    STEP_NEEDS_SYSTEM = 2,   // step_assemble() and step_factor()
    STEP_NEEDS_CONTACT = 4,  // contact_solve(), always
    STEP_NEEDS_ALL = 7
};
unsigned step_judge(Stepper *stepper, const ContactReport *solved);
void step_correct(Stepper *stepper);
void step_solve(Stepper *stepper);       // all stages after step_feed()
const StepReport *step_report(const Stepper *stepper);

// The state. The pointer stays valid; change the state only through stepper_restore().
const WireState *stepper_state(const Stepper *stepper);
// A checkpoint holds everything on which the next step depends (state, warm-start forces, vessel memory): a restored run repeats bit for bit.
typedef struct Checkpoint Checkpoint;
// stepper_save() overwrites `reuse` if it has the right dimensions and otherwise frees it. It returns NULL if out of memory. checkpoint_free() accepts NULL.
Checkpoint *stepper_save(const Stepper *stepper, Checkpoint *reuse);   // reuse: a checkpoint to overwrite, or NULL
// Has no effect if the checkpoint is of a stepper of other dimensions.
void stepper_restore(Stepper *stepper, const Checkpoint *checkpoint);
void checkpoint_free(Checkpoint *checkpoint);
uint64_t stepper_hash(const Stepper *stepper);            // FNV-1a (by words) of the state that a checkpoint holds

// Report per node, for files and display (arrays of M).
typedef struct NodeReport {
    double s;                    // [mm] arc length from the proximal end
    double radius;               // [mm] of the tool at the node
    Vec3 force;                  // [N] from the wall
    double gap;                  // [mm] at the current state, tool radius subtracted; +HUGE_VAL in the sheath or where no wall is near
    int vessel_node;             // -1 in the sheath or without a vessel
} NodeReport;
// Repeats the detection at the current state (for the end of a run, not during a step).
void stepper_node_report(Stepper *stepper, NodeReport *node);
// A tool's own nodes (elements + 1), including those behind the hub and inside other tools.
typedef struct ToolNode {
    double s;                    // [mm] from its proximal end
    Vec3 position;
    Quat orientation;            // of the tool's own frame
    double radius;               // [mm]
    int carrier;                 // outermost tool at this place; -1: in the sheath or behind the hub
} ToolNode;
int stepper_node_capacity(const Stepper *stepper);       // maximum of M
int stepper_tool_count(const Stepper *stepper);
int stepper_tool_nodes(const Stepper *stepper, int tool, ToolNode *node);   // returns their number; node may be NULL
double stepper_tool_inserted(const Stepper *stepper, int tool);             // [mm]
double stepper_tool_turned(const Stepper *stepper, int tool);               // [rad] rotation by its hand since the start
double stepper_tool_length(const Stepper *stepper, int tool);               // [mm]
// A material point of a tool, wherever it lies, on the chords of the chain's elements; fast enough for use in every step.
typedef struct ToolPlace {
    Vec3 position;
    Vec3 along;              // unit chord vector towards the tip
    Vec3 velocity;           // [mm/ms] of the tool's own material
} ToolPlace;
ToolPlace stepper_tool_place(const Stepper *stepper, int tool, double s);
// Sum of the wall's forces [N] in the last step on the tool distal to s [mm]; 0 where other tools surround it.
Vec3 stepper_tool_wall_force(const Stepper *stepper, int tool, double s);
double stepper_elastic_energy(const Stepper *stepper);    // [mJ]
double stepper_kinetic_energy(const Stepper *stepper);    // [mJ]

// Energy of a state, and energy exchanged by the motion of the last step [mJ]. Between two steps
//   elastic + kinetic grow by hand + load + wall - friction - damping - numerical.
// `numerical` is the remainder: implicit Euler dissipates the energy of vibrations. If it is negative, the step has created energy.
typedef struct StepEnergy {
    double elastic, kinetic;     // of the state
    double hand;                 // work of push and torque
    double load;                 // work of gravity and of a rig's loads
    double wall;                 // work of the wall's pressure: 0 unless a point was outside
    double friction, damping;    // dissipated by friction, by Rayleigh damping
    // Work of the forces of the step's start over the same motion: of the hands, and of walls, friction and valves together. Between smooth states the mean of
    // the work by start and end forces is second-order accurate, that by end forces alone first-order.
    double hand_start, contact_start;
} StepEnergy;
// Energy balance of the step that step_correct() has completed. Costs about as much as an assembly.
StepEnergy stepper_energy(Stepper *stepper);

#endif
