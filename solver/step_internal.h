// Internal data of a stepper, shared by the files of a step and checkpoint.c. Not for users of the solver.
#ifndef SELDINGER_SOLVER_STEP_INTERNAL_H
#define SELDINGER_SOLVER_STEP_INTERNAL_H

#include "base/base.h"
#include "solver/beam.h"
#include "solver/coaxial.h"
#include "solver/sheath.h"
#include "solver/slot.h"
#include "solver/step.h"

#include <stddef.h>

typedef struct LoadPlace {
    WireLoad load;
    int node;                // the load is shared by node and node + 1 …
    double weight;           // … with weights 1 - weight and weight
} LoadPlace;

// The walls that a point has met. Where two of them face each other with less room between than the tool needs, the missing room is not due to the motion.
typedef struct WallMet {
    Vec3 normal, across;     // of the last linearisation, and of the latest earlier one that faced it; 0: none
    double offset, beyond;   // [mm] their positions: the gaps are n.x - offset
    Vec3 where;              // [mm] position at which `across` was met
} WallMet;
enum { WALL_MET_DOUBLES = sizeof(WallMet) / sizeof(double) };

// The hold on a tool at its proximal end (step_hands.c).
typedef struct Hand {
    double limit;            // [N] the hand slips along the tool above this force; 0: never
    double valve;            // [N] friction of the valve that holds the tool while no hand does
    // of this step
    bool is_released;        // no hand holds the tool
    int slips[2];            // along, about: 0 holds, 1 slips while pushing, -1 slips while pulling
    bool is_stopped;         // the tool's hub has reached the hub of the surrounding tool, or the sheath
    double start[2], force[2];       // [N], [N mm] force along and moment about the line, of hand or valve, at the start and the end of the step
} Hand;

// One of several coaxial tools. Its own elements are constant; which of its nodes are nodes of the chain varies (step_tools.c).
typedef struct Tool {
    Wire wire;
    BeamRest rest;           // (E) of the tool's own elements
    double *rest_memory;
    CoaxialTool coaxial;     // its sections …
    CoaxialSection *section; // … and their array, which this struct owns
    double *line_mass, *line_inertia;  // (sections) [g/mm], [g mm] about a diameter
    Slot *slot;              // slots of the tool's own elements
    int *slot_start;         // (E + 1)
    double hand_limit, valve_friction;
    double friction_inside;  // Coulomb coefficient of its lumen
    double border;           // [mm] distance over which a border of its rest shape passes the sheath's mouth
    double lumen, widest;    // [mm] smallest inner and largest outer diameter
    double friction, clearance;    // Coulomb coefficient with the surrounding tool; [mm] radial clearance
    // variable
    int first;               // its own node from which on it carries the chain; node_count: nowhere …
    int start;               // … and the index of this node in the chain
    int inside;              // it lies inside another tool at the nodes of the chain before this one
    double inserted, twist;  // [mm], [rad] prescribed
} Tool;

typedef struct Inside {      // the inner tools at a node in the sheath
    double x;                // [mm] position of the node along the line
    double value[STEP_TOOLS_MAX - 1][4];         // of each inner tool: slide, angle relative to the hub, and their velocities
} Inside;

typedef struct SelfContact SelfContact;

// The place where the tool enters: the line of the sheath, or that of a rig without a sheath.
typedef struct Entry {
    bool has_sheath;
    Vec3 mouth;              // [mm] mouth of the sheath, or start of the rig's wire
    Quat frame;              // frame at the mouth …
    Vec3 axis[3];            // … and its columns: direction, e2, e3
} Entry;

// Test rig: constraints and loads of the wire.
typedef struct Rig {
    uint8_t *fixed;          // (M) mask of DOF_ values
    bool can_swing;          // only the first node is constrained in position
    int load_count;
    LoadPlace *load;
    Vec3 gravity;            // [mm/ms^2]
} Rig;

// The hands, outermost tool first (step_hands.c).
typedef struct Hands {
    Hand hand[STEP_TOOLS_MAX];
    StepCommand command[STEP_TOOLS_MAX];                 // of this step
    double basis[BLOCK_LARGEST * BLOCK_LARGEST];         // transformation from the hands' unknowns to those of node 0
} Hands;

// Coaxial tools (step_tools.c, step_coaxial.c). With one tool only `count` is used.
typedef struct Tools {
    int count;
    int capacity;            // maximum number of nodes
    Tool tool[STEP_TOOLS_MAX];
    Tool *device[STEP_TOOLS_MAX][1 + STEP_SPARES_MAX];   // the candidates for tool k; they own the arrays that `tool` uses
    int spare_count[STEP_TOOLS_MAX], fitted[STEP_TOOLS_MAX];
    Inside *inside;          // (M) for an exchange
    int *carrier;            // (M) index of the tool that carries a node
    Vec3 *moment;            // (E, I) [N mm] moment of tool 1 + i and all tools inside it at the middle of an element …
    double *tension;         // (E, I) [N] … and their tension
    double *middle;          // (E) [mm] middle of an element, along the line
    double *bent;            // (E) [1/mm] magnitude of its curvature
} Tools;

// Contact points: nodes first, then slots. P = M + K (step_detect.c, step_touch.c).
typedef struct Points {
    int slot_count, count;   // K, P
    int capacity;            // maximum of K + M, which can vary with coaxial tools
    Slot *slot;              // (K) sorted by element
    int *slot_start;         // (M) first slot of element i; K for the last node
    SlotPlace *slot_place;   // (K) positions at the iterate
    // state on which the next step depends
    Vec3 *force;             // (P) [N] force of the wall on the point: warm start
    double *touch;           // (P) [mm] position along the tool, relative to the point, at which it touches or may touch next
    double *clearance;       // (P) [mm] distance that the point may travel before it can touch; it is not queried until then
    WallMet *met;            // (P)
    VesselMemory *place;     // (P)
    // of this step
    int *candidate;          // (P) indices of the points in the contact set
    double *touch_next;      // (P) [mm] `touch` at the end of this step
    double *allowed;         // (P) [mm] allowed motion from the iterate of a point that is not a candidate; HUGE_VAL for candidates
    double *overlap;         // (P) [mm] by which the gaps to two opposite walls overlap
    double *linger;          // (P) [mm] by which the wall is assumed closer in this step
    VesselMemory *trial;     // (P) results of the trials since the last detection: the wall …
    bool *tried;             // (P) … for the points that were tried
    Vec3 *start_force;       // (P) [N] force of the wall at x_n
} Points;

// Work space for wall queries of many points at once.
typedef struct WallQueries {
    Vec3 *point;             // (P) [mm]
    VesselMemory *place;
    VesselHit *hit;
    int *which;              // (P) index of the contact point of each query
    int *near;               // (P) queries whose points are candidates
    int *answer_of;          // (M) index of a node's query, -1: none
    double *range;           // (M) [mm] or [mm/ms] actual or expected motion of a node
} WallQueries;

// The linear system and its contacts (step_assemble.c, step_solve.c).
typedef struct StepSystem {
    BlockChain chain;
    BlockFactor *factor;
    bool is_factored;        // `factor` is that of `chain`
    ContactSolver *solver;
    ContactSet set;
    double *b, *u;           // (M, 6)
    double *product;         // (M, 6) work space
    SheathElement mouth_element;
    double grip_diag[BLOCK_LARGEST * BLOCK_LARGEST], grip_lower[BLOCK_LARGEST * BLOCK_LARGEST], grip_b[BLOCK_LARGEST];    // node 0 unconstrained
} StepSystem;

// x_n, the state at the start of the step.
typedef struct StepStart {
    Vec3 *position;          // (M)
    Quat *orientation;
    double *slide, *angle;   // (M, I)
    BeamPose pose;           // work space for the damping of an iterate
    bool knows_energy;
    double elastic;          // [mJ] valid if `knows_energy`
    double wall_force_max, wall_force_sum;   // [N] of the preceding step
} StepStart;

// The state about which the system is linearised: x_n at first, then the current iterate. Its pose is the stepper's state.
typedef struct Iterate {
    bool is_moved;           // the iterate differs from x_n
    double *moved;           // (M, 6) displacement from x_n …
    double *seen;            // (M, 6) … at which the wall was last queried
    double *kept;            // (M, 13) saved iterate: position, orientation, displacement
    bool knows_motion;       // u is a solution for this iterate: detection covers its motion
    double depth;            // [mm] penetration of the wall
    double slides;           // [mm] expected motion of the tool along itself
    double mouth_ahead;      // [mm] predicted displacement in this step of the node behind the mouth
} Iterate;

// Progress of a step and properties of its last solution (step_judge.c).
typedef struct StepProgress {
    int linearisations;      // number of judged linearisations
    bool has_failed;         // the system has no solution
    bool was_held;           // some solve of the step was regularised towards its iterate (`firmness`)
    unsigned tips_changed;   // bit k: the node at the tip of the tool around tool k was added or removed since step_feed()
    // of this linearisation
    int looks;               // number of searches for walls that the solution penetrates
    int hand_tries;          // number of corrections of the states of hands and mouth since the last search
    bool is_held_back;       // the sheath holds a node again
    bool is_blocked;         // no part of the path to the solution could be followed
    double firmness;         // regularisation of the unknowns towards the iterate, where the contacts could not be solved without it
    // of its solution
    double turn;             // [rad] largest rotation relative to the iterate
    bool overshoots;         // it penetrates the wall, or may do so
    bool makes_energy;       // it creates energy although it rotates little
} StepProgress;

// Rest (step_rest.c).
typedef struct Rest {
    double time;             // [ms] for which the tool has stayed at one place in quiet steps, a long step counted as STEP_MOST (step_rest.c)
    size_t rows;             // of the longest chain
    double *moved;           // (rows) motion of the unknowns since then
    unsigned released;       // tools that no hand held in the last step
    bool is_quiet;           // of this step: the hands are still, and no load grows
} Rest;

struct Stepper {
    // constant after creation
    Wire wire;
    BeamChain beam;          // pose and right-hand side are work space of an assembly
    bool is_slender;         // a single tool whose elements bend more than they shear
    double damping_mass, damping_stiffness, dt;
    const Vessel *vessel;
    double wall_friction;
    ContactOptions contact;
    int newton_max;
    Entry entry;
    Rig rig;
    Hands hands;
    Tools tools;

    // state on which the next step depends, with parts of `points` (checkpoint.c)
    WireState state;         // arrays in `memory`; during a step the pose of the iterate
    size_t memory_count;
    double *memory;          // position, orientation, velocity, spin, force, clearance, met, touch
    int first_free;          // the sheath holds the nodes before this one

    Points points;
    WallQueries query;
    StepSystem system;
    SelfContact *self;       // NULL: no self-contact, the tool passes through itself (self_contact.h)
    double *scratch;         // owner of the arrays of doubles

    // of this step
    StepCommand command;
    StepStart start;
    Iterate iterate;
    StepProgress progress;
    StepReport report;
    Rest rest;
};

// Offset of a node's unknowns in a vector, and of its block in the matrix.
static inline size_t row_of(const Stepper *s, int node)
{
    SEL_ASSERT(node >= 0 && node <= s->system.chain.count, "a node of the chain, or its end");
    return (size_t)s->system.chain.size * (size_t)node;
}
static inline size_t block_of(const Stepper *s, int node) { return (size_t)s->system.chain.size * row_of(s, node); }

static inline bool stepper_presses(const Stepper *s, int point)
{
    SEL_ASSERT(point >= 0 && point < s->points.count, "the point is a node or a slot of the tool");
    Vec3 f = s->points.force[point];
    return f.x != 0 || f.y != 0 || f.z != 0;
}

// [rad] In contact, if no element turns by more than this, the step is linearised again only if the solution creates energy.
static const double NEWTON_MOTION_IN_CONTACT = 0.04;
// Sets the start of the step to the pose of the state.
void stepper_begin(Stepper *s);
// Restores the pose of the step's start.
void stepper_go_back(Stepper *s);
// Number of nodes held by the sheath: those up to the mouth and slightly beyond. A node that the hand retracts in this step is held from now on.
int stepper_count_held(const Stepper *s, double advance);
// Puts a retracted node on the line of the sheath.
void stepper_hold(Stepper *s, int node);
// Relative compression of the tool between hand and mouth, where it slides freely.
double stepper_squeeze(const Stepper *s, const Vec3 *position);
// Accepts the solution. Returns false if there is none: the system is regularised more strongly and must be solved again.
bool stepper_take_contacts(Stepper *s, const ContactReport *solved);
bool stepper_is_spent(const Stepper *s);         // the contact iterations are used up: the step is not refined further
double stepper_largest_turn(const Stepper *s);   // [rad] largest rotation of a chord or node from the iterate, without spin
// Excess of the growth of elastic energy, along the full solution, over the work of hands, walls and weight, as a share of all energy exchanged. It is nonzero
// because the system is linear but the energy is not quadratic.
double stepper_energy_made(Stepper *s);
// Moves the iterate towards the solution, by at most half of it if `halfway`. Returns the fraction that was followed.
double stepper_follow(Stepper *s, bool halfway);
void stepper_detect(Stepper *s);
// Stores the forces of the solved set in their points.
void stepper_keep_forces(Stepper *s);
// Whether a point that was not a candidate has moved further than allowed.
bool stepper_escapes(const Stepper *s);
// For use when every trial failed, as the wall may be closer than detection found it: at the next detection, the tried points search it from scratch.
void stepper_doubt(Stepper *s);
// Penetration [mm], >= 0, of the true wall by those points that the solution moves far from the iterate.
double stepper_overshoot(Stepper *s);
// Penetration [mm], >= 0, of the points that have left their known clearance since they were last queried.
double stepper_depth(Stepper *s);
// At a trial, the fraction `part` of the solution: moves the candidates' linearised walls inwards to the true ones. Returns false if all are correct already.
bool stepper_meet_walls(Stepper *s, double part);
// Subtracts the motion so far from the clearances.
void stepper_use_clearance(Stepper *s);
// Discards the contact memory of a node that enters the sheath and of the element before it.
void stepper_forget(Stepper *s, int node);
// Adds the slots' forces to their adjacent nodes.
void stepper_share_forces(const Stepper *s, NodeReport *node);
// Predicted motion of the tool along itself in this step [mm].
double stepper_slides(const Stepper *s);
bool stepper_is_slender(const Stepper *s);
// The cell of the tool that a contact point represents, and the place in it at which the wall is queried (step_touch.c).
typedef struct Touch {
    int element;             // between nodes `element` and the next
    double xi;               // (0, 1) fraction of its rest length
    double offset;           // [mm] along the tool from the contact point
    double half;             // [mm] extent of the cell to each side of the contact point
    Vec3 own1, own2;         // tangents of the nodes
    Vec3 bend;               // [1/mm] curvature of the line
    SlotPlace place;
} Touch;
// Finds the cell and the queried place. Returns false if the point touches at its own position. (step_touch.c)
bool touch_at(const Stepper *s, int point, double offset, Touch *touch);
// The same for the offset of this step.
bool touch_of(const Stepper *s, int point, Touch *touch);
// Extrapolates a wall query from the queried place to the point's own position.
VesselHit touch_back(const Stepper *s, int point, const VesselHit *hit);
// Converts the wall query at `touch` to a contact there; `advance` [mm]: distance that the tool slides in this step.
void touch_contact(Stepper *s, int point, const VesselHit *hit, double gap, const Touch *touch, ContactPoint *contact);
// Displacement in the step so far of a contact between two nodes, at `arm` from the axis.
Vec3 touch_done(const Stepper *s, const Touch *touch, Vec3 arm);
// At the end of the step: contacts that have left their cell pass to the adjacent point.
void touch_keep(Stepper *s);
// Input of element i, between two nodes of one tool, at the present state.
BeamInput stepper_beam(const Stepper *s, int i);
// Writes the pose of nodes first to count-1 into arrays by quantity.
void stepper_load_pose(const Vec3 *restrict position, const Quat *restrict orientation, int first, int count, const BeamPose *pose);
// Replaces the row and column of one unknown by a unit row with its value.
void stepper_prescribe(Stepper *s, int node, int dof, double value);
// Force and moment of a load in space axes at this time, on its node (end 0) or the next one (end 1). Returns false if there is none.
bool stepper_load(const Stepper *s, const LoadPlace *place, int end, double time, Vec3 *force, Vec3 *moment);
// Work of weight and a rig's loads in this step [mJ].
double stepper_load_work(const Stepper *s);
// Energy dissipated by stiffness damping in this step [mJ] …
double stepper_stiffness_damping(Stepper *s);
// … work of the wall's pressure, and energy dissipated by its friction.
void stepper_wall_work(const Stepper *s, double *wall, double *friction);
double stepper_start_work(const Stepper *s);   // [mJ] work of the wall's start-of-step forces, including friction, over this step's motion
double stepper_sheath_coordinate(const Stepper *s, int node);
// Displacement of node 0 [mm] that the command requires in this step.
double stepper_wanted(const Stepper *s);
// Straightening force [N] of the tip when the whole tool is held: beyond the mouth it can bend freely.
double stepper_tip_straightening(const Stepper *s);
Vec3 stepper_tip_curvature(const Stepper *s);    // [1/mm] at rest, in space axes
// Reaction [N] on node 0 along (dof 0 to 2) and about [N mm] (3 to 5) the axes of its unknowns.
double stepper_reaction(const Stepper *s, int dof);
// Before a step takes its commands, and after it has corrected the state (step_rest.c).
void rest_feed(Stepper *s, const StepCommand *command, unsigned released);
void rest_judge(Stepper *s);
// Takes the commands of the step.
void hands_feed(Stepper *s, unsigned released);
// Prescribes the motion of the hands at node 0; after the solve, transforms their unknowns back.
void hands_constrain(Stepper *s);
void hands_solved(Stepper *s);
// Checks whether a hand holds more than it can, or slips although it could hold, and corrects its state. Returns whether any state changed.
bool hands_misjudge(Stepper *s);
void hands_report(Stepper *s);
void hands_count(Stepper *s);
double hand_moved(const Stepper *s, int tool, int about);     // … in this step, up to the iterate
// Upper bound of the hands' work in this step [mJ]. It uses the previous forces, because those of an unreliable solution may be arbitrary.
double hands_work_bound(const Stepper *s);
double hands_work(const Stepper *s);           // [mJ] work of the hands in this step …
double hands_valve_work(const Stepper *s);     // … and energy dissipated by the valves
double hands_start_work(const Stepper *s, bool valves);     // … by the forces of the step's start; work of the valves is negative
// [mm] maximum reduction of an advance that later steps make up.
static const double HAND_LAG_MAX = 0.2;
// Push [N] required by the strain of the tool at the hand.
double stepper_strain_force(const Stepper *s);

#endif
