// The tool: a chain of corotational 3D beam elements (large rotation, small strain), circular or tubular, sections that differ,
// rest curvature, Rayleigh damping; a sheath that guides it on a line, or a test rig that clamps and loads it. DESIGN section 3.
//
// Units inside: mm, g, ms, hence N, MPa, mJ. Node 0 is proximal, node M-1 the tip. A node's body frame: e1 along the tool towards the
// tip, e2 the direction to which a rest curvature with plane angle 0 bends the distal part, e3 = e1 x e2; quaternions carry body into space.
#ifndef SELDINGER_SOLVER_WIRE_H
#define SELDINGER_SOLVER_WIRE_H

#include "geom/linear.h"

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
    double damping_stiffness;// [ms]
    Vec3 gravity;            // [mm/ms2]
    // where it starts
    bool has_sheath;         // else rig: straight from start along direction (with rest curvature: stressed, it springs)
    Vec3 start;              // sheath's mouth (entry), or position of node 0
    Vec3 direction;          // unit
    Vec3 normal;             // e2 at the start; zero: vec3_normal_to(direction)
    double inserted;         // [mm] sheath: length beyond the mouth at t = 0
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
} WireState;

#endif
