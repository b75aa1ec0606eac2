// What the files of a step and checkpoint.c share: the stepper's inside. Not for users of the solver.
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
    int node;                // shared by node and node + 1 …
    double weight;           // … with weights 1 - weight and weight
} LoadPlace;

// The walls a point has met: where two of them face each other and leave less room than the tool needs, no motion is to blame for what is lacking.
typedef struct WallMet {
    Vec3 normal, across;     // of the last linearisation, and of the last one before that faced it; 0: none
    double offset, beyond;   // their places: the gaps are n.x - offset
    Vec3 where;              // where `across` was met
} WallMet;
enum { WALL_MET_DOUBLES = sizeof(WallMet) / sizeof(double) };

// Who holds a tool at its proximal end (step_hands.c).
typedef struct Hand {
    double limit;            // [N] above which it slips along the tool; 0: never
    double valve;            // [N] friction of the valve that holds the tool while no hand does
    // of this step
    bool is_released;        // no hand holds it
    int slips[2];            // along, about: 0 holds, 1 slips on a tool that it pushes, -1 that it pulls
    bool is_stopped;         // the tool's hub has come to the hub of the tool around it, or to the sheath
    double start[2], force[2];       // [N], [N mm] what it, or the valve, pushes along and turns about the line with at the step's start and end
} Hand;

// One of several coaxial tools. Its own elements do not change; which of its nodes are nodes of the chain does (step_tools.c).
typedef struct Tool {
    Wire wire;
    BeamRest rest;           // (E) of its own elements
    double *rest_memory;
    CoaxialTool coaxial;     // its sections
    CoaxialSection *section; // … owned
    double *line_mass, *line_inertia;  // (sections) [g/mm], [g mm] about a diameter
    Slot *slot;              // of its own elements
    int *slot_start;         // (E + 1)
    double hand_limit, valve_friction;
    double friction_inside;  // of its lumen
    double border;           // [mm] over which a border of its rest shape passes the sheath's mouth
    double lumen, widest;    // [mm] least inner and largest outer diameter
    double friction, clearance;    // with the tool around it; [mm] between them, radial
    // what changes
    int first;               // own node from which on it carries the chain; node_count: nowhere
    int start;               // … which is this node of the chain
    int inside;              // it lies inside another tool at the chain's nodes before this one
    double inserted, twist;  // [mm], [rad] prescribed
} Tool;

typedef struct Inside {      // what lies inside at a node in the sheath
    double x;                // [mm] of the node along the line
    double value[STEP_TOOLS_MAX - 1][4];         // of each inner tool: slide, angle against the hub, their velocities
} Inside;

typedef struct SelfContact SelfContact;

// Where the tool enters: the line along which the sheath holds it, or that of a rig without a sheath.
typedef struct Entry {
    bool has_sheath;
    Vec3 mouth;              // of the sheath, or where the rig's wire starts
    Quat frame;              // there …
    Vec3 axis[3];            // … and its columns: direction, e2, e3
} Entry;

// Test bench: what fixes and loads the wire.
typedef struct Rig {
    uint8_t *fixed;          // (M) DOF_ mask
    bool can_swing;          // no node but the first is held in place
    int load_count;
    LoadPlace *load;
    Vec3 gravity;            // [mm/ms^2]
} Rig;

// The hands, that of the outermost tool first (step_hands.c).
typedef struct Hands {
    Hand hand[STEP_TOOLS_MAX];
    StepCommand command[STEP_TOOLS_MAX];                 // of this step
    double basis[BLOCK_LARGEST * BLOCK_LARGEST];         // node 0's unknowns in those of the hands
} Hands;

// Coaxial tools (step_tools.c, step_coaxial.c). With one tool only `count` is used.
typedef struct Tools {
    int count;
    int capacity;            // of nodes
    Tool tool[STEP_TOOLS_MAX];
    Tool *device[STEP_TOOLS_MAX][1 + STEP_SPARES_MAX];   // what may be tool k; these own the arrays, which `tool` borrows
    int spare_count[STEP_TOOLS_MAX], fitted[STEP_TOOLS_MAX];
    Inside *inside;          // (M) of an exchange
    int *carrier;            // (M) the tool that carries a node
    Vec3 *moment;            // (E, I) [N mm] of tool 1 + i and all inside it at the middle of an element …
    double *tension;         // (E, I) [N] … and their tension
    double *middle;          // (E) [mm] of an element along the line
    double *bent;            // (E) [1/mm] size of its curvature
} Tools;

// Contact points: the nodes, then the slots. P = M + K (step_detect.c, step_touch.c).
typedef struct Points {
    int slot_count, count;   // K, P
    int capacity;            // of coaxial tools there may be more
    Slot *slot;              // (K) by element
    int *slot_start;         // (M) first slot of element i; of the last node K
    SlotPlace *slot_place;   // (K) where the iterate has them
    // what the next step depends on
    Vec3 *force;             // (P) [N] of the wall on the point: warm start
    double *touch;           // (P) [mm] along the tool from the point to where it touches, or may next
    double *clearance;       // (P) [mm] how far the point may travel before it could touch: not queried until then
    WallMet *met;            // (P)
    VesselMemory *place;     // (P)
    // of this step
    int *candidate;          // (P) the points of the contact set
    double *touch_next;      // (P) [mm] `touch` at this step's end
    double *room;            // (P) [mm] how far a point that is no candidate may go from the iterate; HUGE_VAL for candidates
    double *lack;            // (P) [mm] of room between walls that face each other
    double *linger;          // (P) [mm] by which the wall is taken to be nearer in this step
    VesselMemory *trial;     // (P) what was found of the wall where trials have led since the last detection …
    bool *tried;             // (P) … of these points
    Vec3 *start_force;       // (P) [N] of the wall at x_n
} Points;

// Queries of the wall, made for many points at once: scratch of a detection.
typedef struct WallQueries {
    Vec3 *point;             // (P) [mm]
    VesselMemory *place;
    VesselHit *hit;
    int *which;              // (P) the contact point that is queried
    int *near;               // (P) queries whose points are candidates
    int *answer_of;          // (M) the query of a node, -1: none
    double *range;           // (M) [mm] or [mm/ms] that a node moves, or is likely to
} WallQueries;

// The linear system and its contacts (step_assemble.c, step_solve.c).
typedef struct StepSystem {
    BlockChain chain;
    BlockFactor *factor;
    ContactSolver *solver;
    ContactSet set;
    double *b, *u;           // (M, 6)
    double *product;         // (M, 6) scratch
    SheathElement mouth_element;
    double grip_diag[BLOCK_LARGEST * BLOCK_LARGEST], grip_lower[BLOCK_LARGEST * BLOCK_LARGEST], grip_b[BLOCK_LARGEST];    // rows of node 0 before its constraints
} StepSystem;

// x_n, where the step begins.
typedef struct StepStart {
    Vec3 *position;          // (M)
    Quat *orientation;
    double *slide, *angle;   // (M, I)
    BeamPose pose;           // scratch, for the damping of an iterate
    bool knows_energy;
    double elastic;          // [mJ] where `knows_energy`
    double wall_force_max, wall_force_sum;   // [N] of the step before
} StepStart;

// What the system is linear about: x_n at first, then what the step has come to. Its pose is the stepper's state.
typedef struct Iterate {
    bool is_moved;           // not x_n
    double *moved;           // (M, 6) displacement from x_n …
    double *seen;            // (M, 6) … at which the wall was last queried
    double *kept;            // (M, 13) an iterate to go back to: position, orientation, displacement
    bool knows_motion;       // u is a solution for this iterate: detection looks as far as it goes
    double depth;            // [mm] outside the wall
    double slides;           // [mm] by which the tool is expected to slide along itself
    double mouth_ahead;      // [mm] by how much the node behind the mouth is taken to move in this step
} Iterate;

// How far a step has come, and what its last solution is like (step_judge.c).
typedef struct StepProgress {
    int linearisations;      // that have been judged
    bool has_failed;         // the system has no solution
    bool was_held;           // some solve of the step was held to its iterate
    unsigned tips_changed;   // bit k: the node at the tip around tool k has come or gone since the step was fed
    // of this linearisation
    int looks;               // for walls that the solution goes beyond
    int hand_tries;          // since the last look, of what hands and mouth do
    bool is_held_back;       // the sheath has taken a node back
    bool is_blocked;         // no part of the path to the solution could be followed
    double firmness;         // by which the unknowns are held to the iterate, where the contacts could not be solved without
    // of its solution
    double turn;             // [rad] largest against the iterate
    bool overshoots;         // it goes through the wall, or may
    bool makes_energy;       // though it turns little
} StepProgress;

struct Stepper {
    // given once
    Wire wire;
    BeamChain beam;          // its pose and right-hand side: scratch of an assembly
    bool is_slender;         // of one tool: elements bend more than they shear
    double damping_mass, damping_stiffness, dt;
    const Vessel *vessel;
    double wall_friction;
    ContactOptions contact;
    int newton_max;
    Entry entry;
    Rig rig;
    Hands hands;
    Tools tools;

    // what the next step depends on, with parts of `points` (checkpoint.c)
    WireState state;         // arrays in `memory`; within a step the iterate
    size_t memory_count;
    double *memory;          // position, orientation, velocity, spin, force, clearance, met, touch
    int first_free;          // nodes before it are held by the sheath

    Points points;
    WallQueries query;
    StepSystem system;
    SelfContact *self;       // NULL: the tool passes through itself (self_contact.h)
    double *scratch;         // owns the arrays of doubles

    // of this step
    StepCommand command;
    StepStart start;
    Iterate iterate;
    StepProgress progress;
    StepReport report;
};

// Where a node's unknowns begin in a vector, and its block in the matrix.
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

// [rad] Among contacts an element that turns by less is linearised again only where that makes energy.
static const double NEWTON_MOTION_IN_CONTACT = 0.04;
// The step begins at the state's pose.
void stepper_begin(Stepper *s);
// The pose is that of the step's start again.
void stepper_go_back(Stepper *s);
// Nodes up to the mouth are held, and a little further; one that the hand brings back in this step is held from now on.
int stepper_count_held(const Stepper *s, double advance);
// Puts a node that comes back on the sheath's line.
void stepper_hold(Stepper *s, int node);
// The share of its length by which the tool is squeezed between hand and mouth, where it slides freely.
double stepper_squeeze(const Stepper *s, const Vec3 *position);
// Takes the solution over. False where there is none: the system is firmer now, and must be solved again.
bool stepper_take_contacts(Stepper *s, const ContactReport *solved);
bool stepper_is_spent(const Stepper *s);         // so many contact iterations that the step looks no further
double stepper_largest_turn(const Stepper *s);   // [rad] of an element's chord or a node against the iterate; not about the axis
// By how much the tool's elastic energy would grow more than hands, walls and weight give, were the solution followed to its end: as a share of all that is given
// and taken. The system is linear, the energy is not.
double stepper_energy_made(Stepper *s);
// Moves the iterate towards the solution, half of it at most where `halfway`; returns the share that was followed.
double stepper_follow(Stepper *s, bool halfway);
void stepper_detect(Stepper *s);
// Forces of the solved set go to their points.
void stepper_keep_forces(Stepper *s);
// Has a point that was no candidate gone further than its room?
bool stepper_escapes(const Stepper *s);
// No trial was good: the wall may be nearer than the detection found it. It is looked for from scratch next time, where trials have asked.
void stepper_doubt(Stepper *s);
// How deep outside the true wall the solution would leave the points that it moves far from the iterate [mm], >= 0.
double stepper_overshoot(Stepper *s);
// How deep outside it the points are that have gone beyond what is known of it since they were last asked [mm], >= 0.
double stepper_depth(Stepper *s);
// At a trial, `part` of the way: moves the candidates' linear walls in to where the trial finds the true ones. False where all stand right.
bool stepper_meet_walls(Stepper *s, double part);
// Takes the travel so far off the clearances.
void stepper_use_clearance(Stepper *s);
// A node goes into the sheath, with the element before it: nothing of the wall is remembered.
void stepper_forget(Stepper *s, int node);
// Adds the slots' forces to the nodes between which they are.
void stepper_share_forces(const Stepper *s, NodeReport *node);
// By how much the tool slides along itself in this step, as far as can be foreseen.
double stepper_slides(const Stepper *s);
bool stepper_is_slender(const Stepper *s);
// The cell of the tool for which a contact point stands, and where in it the point is asked about (step_touch.c).
typedef struct Touch {
    int element;             // between nodes `element` and the next
    double xi;               // (0, 1) of its rest length
    double offset;           // [mm] along the tool from the contact point
    double half;             // [mm] to each side of it the cell's share reaches
    Vec3 own1, own2;         // the nodes' tangents
    Vec3 bend;               // [1/mm] the line's curvature
    SlotPlace place;
} Touch;
// False where the point touches at its own place.
// (step_touch.c)
bool touch_at(const Stepper *s, int point, double offset, Touch *touch);
// ... as the step has it.
bool touch_of(const Stepper *s, int point, Touch *touch);
// What the wall is at the point's own place, by what it is where it was asked.
VesselHit touch_back(const Stepper *s, int point, const VesselHit *hit);
// Makes of what the wall is at `touch` the contact there; `advance` [mm]: what the tool slides in this step.
void touch_contact(Stepper *s, int point, const VesselHit *hit, double gap, const Touch *touch, ContactPoint *contact);
// The displacement of the step so far at a contact between two nodes, at `arm` from the axis.
Vec3 touch_done(const Stepper *s, const Touch *touch, Vec3 arm);
// The step is done: contacts that have left their cell go over to the next one's point.
void touch_keep(Stepper *s);
// Element i, between two nodes of one tool, as it is now.
BeamInput stepper_beam(const Stepper *s, int i);
// Row and column of one unknown become a unit row with its value.
void stepper_prescribe(Stepper *s, int node, int dof, double value);
// What a load puts on its node (end 0) or the one after it (1) at this time, in space; false: nothing.
bool stepper_load(const Stepper *s, const LoadPlace *place, int end, double time, Vec3 *force, Vec3 *moment);
// [mJ] of weight and a rig's loads in this step.
double stepper_load_work(const Stepper *s);
// [mJ] that stiffness damping took from the motion of this step …
double stepper_stiffness_damping(Stepper *s);
// … and what the wall's pressure gave and its friction took.
void stepper_wall_work(const Stepper *s, double *wall, double *friction);
double stepper_start_work(const Stepper *s);   // [mJ] of the walls' forces of the step's start, friction's included, over this step's motion
double stepper_sheath_coordinate(const Stepper *s, int node);
// [mm] displacement of node 0 in this step that the command asks for.
double stepper_wanted(const Stepper *s);
// [N] what it takes to straighten the tip, where the whole tool is held: its length past the mouth is bent as it likes.
double stepper_tip_straightening(const Stepper *s);
Vec3 stepper_tip_curvature(const Stepper *s);    // [1/mm] at rest, in space
// [N] reaction on node 0 along (index 0 to 2) and about (3 to 5) the axes of its unknowns.
double stepper_reaction(const Stepper *s, int dof);
// The commands of the step are taken.
void hands_feed(Stepper *s, unsigned released);
// What the hands prescribe at node 0; then, after the solve, back from their unknowns.
void hands_constrain(Stepper *s);
void hands_solved(Stepper *s);
// Does a hand hold what it cannot, or slip where it could hold? Then it does otherwise from now on.
bool hands_misjudge(Stepper *s);
void hands_report(Stepper *s);
void hands_count(Stepper *s);
double hand_moved(const Stepper *s, int tool, int about);     // … in this step, to the iterate
// [mJ] that they may do in the step: their forces are those of before, since a solution that is not to be trusted says anything.
double hands_work_bound(const Stepper *s);
double hands_work(const Stepper *s);           // [mJ] that the hands have done in this step …
double hands_valve_work(const Stepper *s);     // … and that the valves have taken
double hands_start_work(const Stepper *s, bool valves);     // … by their forces of the step's start; what valves give is negative
// [mm] of a cut advance that later steps make up.
static const double HAND_OWED_MAX = 0.2;
// [N] push that the tool's strain at the hand asks for.
double stepper_strain_force(const Stepper *s);

#endif
