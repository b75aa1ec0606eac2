// The tool: a chain of corotational 3D beam elements (large rotation, small strain), circular or tubular, sections that differ,
// rest curvature, Rayleigh damping; a sheath that guides it on a line, or a test rig that clamps and loads it. Equations in beam_equations.h.
//
// Units inside: mm, g, ms, hence N, MPa, mJ. Node 0 is proximal, node M-1 the tip. A node's body frame: e1 along the tool towards the
// tip, e2 the direction to which a rest curvature with plane angle 0 bends the distal part, e3 = e1 x e2; quaternions carry body into space.
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
    double rest_plane;       // [rad] turns e2 about e1
    double friction;         // Coulomb coefficient; < 0: the wall's
    double attenuation;      // [1/mm] of X-rays; mechanics never looks at it
} WireSection;

typedef struct WireLoad {    // dead or follower, at the node nearest s (exactly: shared linearly by the two nodes around s)
    double s;                // [mm] from the proximal end
    Vec3 force;              // [N]
    Vec3 moment;             // [N mm]
    double ramp;             // [ms] linear from 0; 0: at once
    bool follower;           // turns with the node's frame
} WireLoad;

enum { DOF_X = 1, DOF_Y = 2, DOF_Z = 4, DOF_RX = 8, DOF_RY = 16, DOF_RZ = 32, DOF_POSITION = 7, DOF_ALL = 63 };
typedef struct WireFix {
    double s;                // [mm], at the nearest node
    uint8_t dof;             // DOF_ mask, space axes
} WireFix;

typedef struct WireOptions {
    int elements;            // 1 to 10,000; default 200. Element borders are placed so that section borders fall on nodes where elements >= sections
    int section_count;       // proximal to distal
    const WireSection *section;
    double damping_mass;     // [1/ms]
    double damping_stiffness; // [ms]
    Vec3 gravity;            // [mm/ms2]
    // where it starts
    bool has_sheath;         // else rig: straight from start along direction (with rest curvature: stressed, it springs)
    Vec3 start;              // sheath's mouth (entry), or position of node 0
    Vec3 direction;          // unit
    Vec3 normal;             // e2 at the start; zero: vec3_normal_to(direction)
    double inserted;         // [mm] sheath: length beyond the mouth at t = 0
    double hand_limit;       // [N] sheath: above this push or pull the hand slips along the tool; 0 (default): it never does
    double valve_friction;   // [N] of the valve that it goes through, at the hub of the tool around it or at the sheath, while no hand holds it; default 0
    int fix_count;
    const WireFix *fix;
    int load_count;
    const WireLoad *load;
} WireOptions;

typedef struct WireState {   // all that a step changes, M nodes; plain data, so a copy is a checkpoint
    int node_count;
    double time;             // [ms]
    double inserted;         // [mm] prescribed: node 0 lies at -(total length - inserted) on the sheath's line
    double twist;            // [rad] prescribed at node 0
    Vec3 *position;          // (M)
    Quat *orientation;       // (M)
    Vec3 *velocity;          // (M) [mm/ms]
    Vec3 *spin;              // (M) [rad/ms], space axes
    // coaxial tools inside the one that carries a node (step.h); M is then not the same for ever
    int inner_count;         // I = tools less one
    double *slide;           // (M, I) [mm] material coordinate of tool 1 + i where it lies inside at that node
    double *angle;           // (M, I) [rad] by which its frame is turned about the tangent against the node's
    double *slide_velocity;  // (M, I) [mm/ms] of its material along the tangent
    double *slide_spin;      // (M, I) [rad/ms] about it
    double *slide_force;     // (M, I, 3) [N] friction of the tool around it, along and (over the radius) about the tangent, and its bound
} WireState;

// --- What the chain is made of; does not change after its creation. ---
typedef struct Wire {
    int element_count, node_count;   // E, M = E + 1
    double total_length;     // [mm]
    double *s;               // (M) [mm] arc length from the proximal end
    double *length;          // (E) [mm]
    int *section;            // (E)
    double *mass;            // (M) [g]
    double *inertia_axial;   // (M) [g mm2] about e1
    double *inertia_lateral; // (M) [g mm2] about e2 and e3
    double *radius;          // (M) [mm] outer; at a border the larger one
    double *friction;        // (M) < 0: the wall's; at a border the distal section's
} Wire;

WireOptions wire_default_options(void);          // 200 elements, Rayleigh damping 1e-4 per ms and 0.2 ms, no section, along +x from the origin
double wire_length(const WireOptions *options);   // [mm] of all sections
bool wire_create(Wire *wire, const WireOptions *options, char *why, int capacity);
bool wire_reserve(Wire *wire, int nodes);      // room for so many nodes; what it holds is lost
void wire_destroy(Wire *wire);
// Elements per section, (section_count): in proportion to length, more where an element would turn by over 0.3 rad at rest, each at least one.
// False where elements < sections.
bool wire_divide(const WireOptions *options, int *elements);

// Properties of a section's cross-section.
typedef struct WireStiffness {
    double area;             // [mm2]
    double axial;            // [N] EA
    double bending;          // [N mm2] EI
    double torsion;          // [N mm2] GJ
    double shear;            // [N] kappa G A, Cowper's coefficient
    double line_mass;        // [g/mm]
    double line_inertia;     // [g mm] rho I, about a diameter; twice that about the axis
} WireStiffness;
WireStiffness wire_stiffness(const WireSection *section);

struct BeamRest;
// Fills the (E) arrays of `rest` (caller's).
void wire_rest(const Wire *wire, const WireOptions *options, struct BeamRest *rest);
// The frame at the start: e1 = direction, e2 = normal made perpendicular.
Quat wire_start_frame(const WireOptions *options);

#endif
