// The tool: a chain of corotational 3D beam elements (large rotation, small strain) with circular or tubular cross-sections that may differ along the tool,
// rest curvature and Rayleigh damping. A sheath guides it along a straight line, or a test rig clamps and loads it. Equations in beam_equations.h.
//
// Internal units: mm, g, ms, hence N, MPa, mJ. Node 0 is the proximal end, node M-1 the tip. Body frame of a node: e1 along the tool towards the tip, e2 the
// direction towards which a rest curvature with plane angle 0 bends the distal part, e3 = e1 x e2. Quaternions map body to space axes.
#ifndef SELDINGER_SOLVER_WIRE_H
#define SELDINGER_SOLVER_WIRE_H

#include "geom/geom.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct WireSection {
    double length;           // [mm] > 0
    double diameter;         // [mm] > 0
    double inner_diameter;   // [mm] 0 <= inner < diameter
    double young_modulus;    // [MPa] > 0
    double poisson_ratio;    // (-1, 0.5)
    double density;          // [g/mm3] > 0
    double rest_curvature;   // [1/mm]
    double rest_plane;       // [rad] angle of the plane of rest curvature, from e2 about e1
    double friction;         // Coulomb coefficient; < 0: the coefficient of the wall applies
    double attenuation;      // [1/mm] of X-rays; not used by the mechanics
} WireSection;

typedef struct WireLoad {    // dead or follower load, applied at s: shared linearly by the two nodes around s
    double s;                // [mm] from the proximal end
    Vec3 force;              // [N]
    Vec3 moment;             // [N mm]
    double ramp;             // [ms] duration of a linear ramp from 0; 0: full load at once
    bool follower;           // rotates with the frame of the node
} WireLoad;

enum { DOF_X = 1, DOF_Y = 2, DOF_Z = 4, DOF_RX = 8, DOF_RY = 16, DOF_RZ = 32, DOF_POSITION = 7, DOF_ALL = 63 };
typedef struct WireFix {
    double s;                // [mm] from the proximal end; applied at the nearest node
    uint8_t dof;             // mask of DOF_ values, space axes
} WireFix;

typedef struct WireOptions {
    int elements;            // 1 to 10,000; default 200. Section borders coincide with nodes; needs elements >= section_count
    int section_count;       // sections from proximal to distal
    const WireSection *section;
    double damping_mass;     // [1/ms] mass-proportional Rayleigh damping; default 1e-4
    double damping_stiffness; // [ms] stiffness-proportional Rayleigh damping; default 0.2
    Vec3 gravity;            // [mm/ms2]
    // initial configuration
    bool has_sheath;         // false: test rig, straight from `start` along `direction` (a rest curvature is then stressed at t = 0)
    Vec3 start;              // [mm] mouth of the sheath, or position of node 0 in a rig
    Vec3 direction;          // unit vector
    Vec3 normal;             // e2 at the start; zero vector: vec3_normal_to(direction)
    double inserted;         // [mm] with a sheath: length beyond its mouth at t = 0
    double hand_limit;       // [N] with a sheath: the hand slips along the tool above this push or pull; 0 (default): it never slips
    double valve_friction;   // [N] friction, while no hand holds the tool, of its valve at the sheath or at the hub of the surrounding tool; default 0
    int fix_count;
    const WireFix *fix;
    int load_count;
    const WireLoad *load;
} WireOptions;

typedef struct WireState {   // all variables that a step changes, M nodes; plain data, so that a copy is a checkpoint
    int node_count;
    double time;             // [ms]
    double inserted;         // [mm] prescribed: node 0 lies at -(total length - inserted) on the line of the sheath
    double twist;            // [rad] prescribed rotation of node 0
    Vec3 *position;          // (M)
    Quat *orientation;       // (M)
    Vec3 *velocity;          // (M) [mm/ms]
    Vec3 *spin;              // (M) [rad/ms], space axes
    // coaxial tools inside the carrier at a node (step.h); M then varies with time
    int inner_count;         // I, number of tools minus one
    double *slide;           // (M, I) [mm] material coordinate of tool 1 + i at a node where it lies inside another tool
    double *angle;           // (M, I) [rad] rotation of its frame about the tangent relative to the node's frame
    double *slide_velocity;  // (M, I) [mm/ms] velocity of its material along the tangent
    double *slide_spin;      // (M, I) [rad/ms] spin of its material about the tangent
    double *slide_force;     // (M, I, 3) [N] friction by the surrounding tool: along the tangent, about it (divided by the radius), and the bound
} WireState;

// --- discretised tool; constant after creation ---
typedef struct Wire {
    int element_count, node_count;   // E, M = E + 1
    double total_length;     // [mm]
    double *s;               // (M) [mm] arc length from the proximal end
    double *length;          // (E) [mm]
    int *section;            // (E)
    double *mass;            // (M) [g]
    double *inertia_axial;   // (M) [g mm2] about e1
    double *inertia_lateral; // (M) [g mm2] about e2 and e3
    double *radius;          // (M) [mm] outer radius; at a section border the larger one
    double *friction;        // (M) < 0: the coefficient of the wall applies; at a section border that of the distal section
} Wire;

WireOptions wire_default_options(void);          // 200 elements, Rayleigh damping 1e-4 per ms and 0.2 ms, no section, from the origin along +x
double wire_length(const WireOptions *options);   // [mm] sum of the section lengths
// Creates a tool, which wire_destroy() frees. Returns false, with a message in `why` (capacity >= 256), if an option is out of range or out of memory.
bool wire_create(Wire *wire, const WireOptions *options, char *why, int capacity);
bool wire_reserve(Wire *wire, int nodes);      // allocates for this number of nodes, discarding the contents; false if out of memory
void wire_destroy(Wire *wire);
// Number of elements of each section (section_count): proportional to its length, more where an element would otherwise turn by over 0.3 rad at rest, at
// least one each. Returns false if there are fewer elements than sections.
bool wire_divide(const WireOptions *options, int *elements);

// Stiffness and inertia of a cross-section.
typedef struct WireStiffness {
    double area;             // [mm2]
    double axial;            // [N] EA
    double bending;          // [N mm2] EI
    double torsion;          // [N mm2] GJ
    double shear;            // [N] kappa G A, kappa by Cowper
    double line_mass;        // [g/mm]
    double line_inertia;     // [g mm] rho I about a diameter; twice that about the axis
} WireStiffness;
WireStiffness wire_stiffness(const WireSection *section);

struct BeamRest;
// Fills the (E) arrays of `rest`, which the caller owns.
void wire_rest(const Wire *wire, const WireOptions *options, struct BeamRest *rest);
// Frame at the start: e1 = direction, e2 = normal, orthogonalised.
Quat wire_start_frame(const WireOptions *options);

#endif
