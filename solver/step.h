// One implicit Euler step, in the stages in which the simulator calls and times them (sim/simulator.c reads like the paper). First order in dt: the hand's
// work in the phantom is 3.5 % more at 1 ms than at 0.25 ms, 4.1 % without friction; with `follows_touch` 0.9 and 1.4 %.
//   step_feed      take the command: advance and rotation of the driven node become this step's prescribed displacement
//   step_detect    candidates and gaps at the iterate, at first x_n, from the vessel
//   step_assemble  (M/h^2 + D/h + K) u = M v/h + f(x) + ..., with tension and curvature terms, constraints as unit rows
//   step_factor
//   contact_solve  u and the contact forces: Newton's method on the contact conditions, for the problem of step_contacts()
//   step_judge     moves the iterate to the solution and says which stages are needed again; none: the step is solved
//   step_correct   x_{n+1}, v_{n+1}, reactions; on non-finite or absurd motion keeps x_n, sets STEP_DIVERGED
// A step allocates nothing, reads no clock. One thread per Stepper; several Steppers may share a vessel.
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
    STEP_DIVERGED = 1,           // state kept at x_n; the run cannot be trusted
    STEP_NOT_CONVERGED = 2,      // contact solve stopped at its cap
    STEP_DEEP = 4,               // a node further than 0.2 mm outside the wall
    STEP_FULLY_INSERTED = 8,     // advance was clamped: the whole tool is in
    STEP_FULLY_WITHDRAWN = 16,   // retraction was clamped
    STEP_OUT_OF_VESSEL = 32,     // a node beyond an open end that is not the sheath's
    STEP_DETECTION_UNSURE = 64,  // a projection did not converge
    STEP_LIMITED = 128,          // the motion was cut, later steps complete it: an element would have turned by more than 0.3 rad, the tool would have
                                 // gone through the wall, or the hand would have squeezed it by more than 3 % of its length
    STEP_MODEL_DISAGREES = 256,  // two parts of the vessel's model contradict each other about the wall at a point; it is not thrown
    STEP_HAND_SLIPS = 512,       // the tool asked for more force than the hand holds: the hand slid along it
};

typedef struct StepReport {
    unsigned flags;
    int candidates, active;
    int disagreements;           // contact points at which the vessel's model contradicts itself
    int iterations;
    double residual, cone_violation;
    double penetration;          // [mm] deepest, >= 0, of the state at the step's start (true distance)
    double proximal_force;       // [N] push reaction at the driven node, > 0 when the hand pushes
    double proximal_torque;      // [N mm]
    double push[STEP_TOOLS_MAX], torque[STEP_TOOLS_MAX];     // [N], [N mm] of each tool's hand; [0] as proximal_force and proximal_torque
    double wall_force_max;       // [N] largest contact force
    double wall_force_sum;       // [N] sum of magnitudes
    int self_contacts;           // places where the tool presses on itself
    double self_overlap;         // [mm] deepest of the tool in itself, >= 0, of the state at the step's start
    double slipped;              // [mm] that the hand moved further than the tool
    int newton;                  // further linearisations of this step, 0 in a quiet one
} StepReport;

typedef struct Stepper Stepper;

// Another tool that may take the place of tool `tool` of several, once that has been drawn back to its hub (stepper_exchange()).
typedef struct StepperSpare {
    int tool;
    WireOptions wire;        // sections, elements, hand_limit and valve_friction are read
    double friction_inside;  // of its lumen with the tool within
} StepperSpare;

// Does a tool meet itself? By default where it can coil up: in a vessel. A rig's wire is the ideal one of the textbooks, which rolls up twice in a plane.
typedef enum { SELF_CONTACT_AUTO, SELF_CONTACT_ON, SELF_CONTACT_OFF } SelfContactMode;

typedef struct StepperOptions {
    WireOptions wire;            // the tool, or the outermost of several
    // Coaxial tools inside it, outermost first; of their options sections, elements, hand_limit, valve_friction and inserted (length beyond the mouth, or the
    // rig's start) are read
    int inner_count;             // up to STEP_TOOLS_MAX - 1
    const WireOptions *inner;
    double inner_friction[STEP_TOOLS_MAX - 1];     // >= 0, Coulomb coefficient of each inner tool with the one around it
    int spare_count;             // at most STEP_SPARES_MAX a tool; none where there is one tool
    const StepperSpare *spare;
    const Vessel *vessel;        // may be NULL: no walls
    double wall_friction;
    ContactOptions contact;
    SelfContactMode self_contact;
    double dt;                   // [ms], default 1
    // Contacts stay where the tool touches while it slides, and the step is linearised about that slide (step_touch.c): half the changes of push from step to
    // step. One tool of slender elements only. Default off: a tip that flicks onto its own coil overlaps it by 16 um in one step of test_self_contact.
    bool follows_touch;
    int newton_max;              // linearisations of a step at most, twice as many where a snap overshoots the wall; 0: the default, 4
} StepperOptions;

// NULL with a message in `why` (capacity >= 256) where an option is out of range.
Stepper *stepper_create(const StepperOptions *options, char *why, int capacity);
void stepper_destroy(Stepper *stepper);

void step_feed(Stepper *stepper, StepCommand command);
// The commands of all tools, [1 + inner_count]; step_feed() pins the inner ones. Bit k of `released`: no hand holds tool k, only the valve that it goes
// through does, by friction (WireOptions.valve_friction).
void step_feed_tools(Stepper *stepper, const StepCommand *command, unsigned released);
// Between two steps: the first (0) or a spare tool (1, 2, … in the order of the options) takes the place of tool `tool`. Allocates nothing; poses of
// the other tools stay, and what the old tool held by friction is let go.
typedef enum {
    EXCHANGE_DONE,
    EXCHANGE_NO_SUCH_TOOL,
    EXCHANGE_INSERTED,       // the tool must first be drawn back to its hub, or the outermost one to the sheath's mouth
    EXCHANGE_TOO_SHORT,      // a proximal end would come to lie inside a hub: the tool within, or the new one, is too short
} StepExchange;
StepExchange stepper_exchange(Stepper *stepper, int tool, int which);
const char *step_exchange_refusal(StepExchange outcome);   // why, after "because" or a colon, with what would help; "" for EXCHANGE_DONE
int stepper_fitted(const Stepper *stepper, int tool);

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

// State. The pointer stays valid; write through stepper_restore only.
const WireState *stepper_state(const Stepper *stepper);
// A checkpoint holds everything that the next step depends on (state, warm-start forces, vessel memory): restored, the run repeats bit for bit.
typedef struct Checkpoint Checkpoint;
Checkpoint *stepper_save(const Stepper *stepper, Checkpoint *reuse);   // reuse may be NULL
void stepper_restore(Stepper *stepper, const Checkpoint *checkpoint);
void checkpoint_free(Checkpoint *checkpoint);
uint64_t stepper_hash(const Stepper *stepper);            // FNV-1a over the checkpoint's bytes

// Per node, for files and pictures (arrays of M).
typedef struct NodeReport {
    double s;                    // [mm] arc length from the proximal end
    double radius;               // [mm] of the tool at the node
    Vec3 force;                  // [N] from the wall
    double gap;                  // [mm] at the current state, tool radius taken off; +HUGE_VAL in the sheath or where nothing is near
    int vessel_node;             // -1 in the sheath or without vessel
} NodeReport;
// Detects afresh at the current state (for the end of a run, not for a step).
void stepper_node_report(Stepper *stepper, NodeReport *node);
// Where a tool's own nodes are, behind the hub and inside other tools too. (elements + 1) of the tool.
typedef struct ToolNode {
    double s;                    // [mm] from its proximal end
    Vec3 position;
    Quat orientation;            // of its own frame
    double radius;               // [mm]
    int carrier;                 // the outermost tool there; -1: in the sheath or behind the hub
} ToolNode;
int stepper_node_capacity(const Stepper *stepper);       // M at most
int stepper_tool_count(const Stepper *stepper);
int stepper_tool_nodes(const Stepper *stepper, int tool, ToolNode *node);   // their number; node may be NULL
double stepper_tool_inserted(const Stepper *stepper, int tool);             // [mm]
double stepper_tool_turned(const Stepper *stepper, int tool);               // [rad] by its hand, since the start
double stepper_tool_length(const Stepper *stepper, int tool);               // [mm]
// A material point of a tool, wherever it lies, on the chords of the chain's elements; for use in every step.
typedef struct ToolPlace {
    Vec3 position;
    Vec3 along;              // unit, the chord towards the tip
    Vec3 velocity;           // [mm/ms] of the tool's own material
} ToolPlace;
ToolPlace stepper_tool_place(const Stepper *stepper, int tool, double s);
// [N] what the wall has done in the last step to the tool beyond s [mm], in sum: 0 where other tools are around it.
Vec3 stepper_tool_wall_force(const Stepper *stepper, int tool, double s);
double stepper_elastic_energy(const Stepper *stepper);    // [mJ]
double stepper_kinetic_energy(const Stepper *stepper);    // [mJ]

// What a state holds, and what the last step's motion has given to it or taken from it [mJ]. Between two steps
//   elastic + kinetic grow by hand + load + wall - friction - damping - numerical.
// `numerical` is what is left: implicit Euler takes energy from all that vibrates. Where it is negative the step has made energy.
typedef struct StepEnergy {
    double elastic, kinetic;     // of the state
    double hand;                 // work of push and torque
    double load;                 // work of gravity and of a rig's loads
    double wall;                 // work of the wall's pressure: 0 but where a point was outside
    double friction, damping;    // taken by friction, by Rayleigh damping
    // The same motion by the forces of the step's start: the hands, and the walls, friction and valves together. Between smooth states the mean of start and
    // end is right to the second order, the end alone to the first.
    double hand_start, contact_start;
} StepEnergy;
// Of the step that step_correct() has ended. Costs about as much as an assembly.
StepEnergy stepper_energy(Stepper *stepper);

#endif
