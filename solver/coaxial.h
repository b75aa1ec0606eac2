// Coaxial element: up to four nested tools on one centreline between two nodes. Inner tools slide and rotate along it.
// Equations in coaxial.c. Lengths in mm, forces in N, moments in N mm, energies in mJ, angles in rad. Nothing here allocates; the caller owns all arrays.
//
// A node has a position and a frame R (wire.h). A tool k in the element has at each of its two nodes a material coordinate S and an angle phi, the rotation of
// its own frame about the tangent relative to the node's frame. Tool 0 is the carrier: its length between the nodes is the length of the element. The carrier
// is usually fixed (the nodes are its material points: S is given, phi is 0), but at a sheath's mouth, and where a tool leaves the tip of the surrounding one,
// its S1 and phi1 are unknowns like those of any tool.
//
// Two layers: coaxial_rest() combines the tools into one equivalent corotational element; beam_equations.h has the geometry of that element.
#ifndef SELDINGER_SOLVER_COAXIAL_H
#define SELDINGER_SOLVER_COAXIAL_H

#include "solver/beam.h"

enum {
    COAXIAL_TOOLS_MAX = 4,
    COAXIAL_UNKNOWNS = 4,    // unknowns of a tool in an element, in this order
    COAXIAL_S1 = 0,
    COAXIAL_PHI1 = 1,
    COAXIAL_S2 = 2,
    COAXIAL_PHI2 = 3,
    COAXIAL_COLUMNS = COAXIAL_TOOLS_MAX * COAXIAL_UNKNOWNS,
    COAXIAL_BORDERS_MAX = 12,      // section borders inside one element, over all tools; further ones do not divide it (the energy then jumps as they pass)
};

typedef struct CoaxialSection {    // section of a tool with uniform properties
    double end;              // [mm] material coordinate of its distal end, larger than that of the preceding section
    double bending;          // [N mm2] EI > 0
    double axial;            // [N] EA > 0
    double torsion;          // [N mm2] GJ > 0
    double shear;            // [N] kappa G A > 0
    double curve[2];         // [1/mm] rest curvature towards e2 and e3 of the tool's frame: curvature times (cos, sin) of its plane angle
} CoaxialSection;

typedef struct CoaxialTool {
    int count;               // number of sections, proximal to distal, >= 1; the first extends proximally without limit
    const CoaxialSection *section;
} CoaxialTool;

// Section at the material coordinate s: at a border the distal one, beyond the tip the last one.
static inline const CoaxialSection *coaxial_section_at(const CoaxialTool *tool, double s)
{
    const CoaxialSection *section = tool->section, *last = section + tool->count - 1;
    while (section < last && section->end <= s)
        section++;
    return section;
}

typedef struct CoaxialSpan { // one tool in one element
    const CoaxialTool *tool;
    double s1, s2;           // [mm] S at the nodes, s1 < s2; s2 is ignored if has_tip. Beyond the tip a tool stretches and twists but does not bend
    double phi1, phi2;       // [rad], not limited to one turn; if has_tip, coaxial_element() chooses phi2 so that the tool has no torque
    double spread;           // [mm] minimum length over which the axial strain is spread, including the tool behind S1; default 0. For an element that begins
                             // at a mouth or a tip and may be short: the length of the full element
    bool spreads_twist;      // true: the twist is spread as well, and over exactly `spread`: at a mouth, where the tools' angles at node 1 are those of the
                             // last node in the sheath
    double soft[2];          // [mm] default 0. Over this distance to either side of node 1 and of node 2, a section border of this tool passes gradually from
                             // this element to the adjacent one; the tool's tip does not. Needed where the carrier's section changes or ends: the energy would
                             // otherwise have a kink there, and the force in a step would depend on the side. 0 for the carrier
    bool has_tip;            // the tool ends inside, at its last section's end: up to there it bends with the others and is as long as the carrier, without
                             // relative rotation, tension or torque. Its only unknowns are S1 and phi1. Not for the carrier
    bool is_fixed;           // its values are not unknowns: no derivatives are computed, which saves time
} CoaxialSpan;

typedef struct CoaxialPiece {      // part of an element between two borders
    double width, middle;    // fractions of the element, 0 to 1 from node 1
    double bending;          // [N mm] sum of EI_k / l_k
    double own[COAXIAL_TOOLS_MAX]; // [N mm] EI_k / l_k
    double moment[2];        // [N mm] sum of EI_k Rot(phi_k) kappa_k: moment that holds the tools straight, about e2 and e3
} CoaxialPiece;

// Derivatives of CoaxialRest with respect to one unknown. For a span with a tip s2 and phi2 are treated as free; coaxial_element() then condenses them.
typedef struct CoaxialSlope {
    double flexibility[3], angle[2][2], waste;
} CoaxialSlope;

typedef struct CoaxialSoft {       // a border that passes from one element to the next
    int tool;
    bool end;                // true: at node 2, false: at node 1
    double bends;            // [1/mm2] second derivative of the border's effective position (fraction of the element) with respect to S at that node
    CoaxialSlope slope;      // derivatives with respect to the effective position
    double stiffness;        // [N/mm] stiffness with respect to that S, if positive; set by coaxial_element()
} CoaxialSoft;

typedef struct CoaxialChord {      // the rest chord in the frame of a node
    Quat turn;               // rotation from the frame to the chord, by minus the rest angle v
    double v[2], grow, stay, lean;             // a change dv rotates the chord by grow dv + stay (v . dv) v + lean v x dv
} CoaxialChord;

typedef struct CoaxialRest {       // layer 1: the equivalent element of all tools
    int count;
    bool is_curved;          // some tool has a rest curvature
    bool bends[COAXIAL_TOOLS_MAX];             // this tool has a rest curvature, so that its angles affect more than its torsion
    bool is_whole[COAXIAL_TOOLS_MAX];          // no border of this tool is inside: S1 acts as -S2
    double length;           // [mm] length of the carrier
    double flexibility[3];   // [1/(N mm)] end rotations per end moment: node 1, coupling, node 2
    double near1, near2, far;      // [N mm] inverse of `flexibility`
    double angle[2][2];      // [rad] rest angles from chord to tangent at the nodes, about e2 and e3 of the node's frame
    double share[COAXIAL_TOOLS_MAX][2][2];     // … and the contribution of each tool to them
    CoaxialChord chord[2];
    double arc;              // [mm] length of the rest arc minus chord minus bow; below: its derivatives with respect to length and `angle`
    double arc_by_length, arc_by_angle[2][2];
    double waste;            // [mJ] energy of the tools' conflicting rest shapes in the absence of external force
    double own_length[COAXIAL_TOOLS_MAX];      // [mm] l_k; for a tool that ends inside, the carrier's length …
    double strained_length[COAXIAL_TOOLS_MAX]; // … and S2 - S1 of the stretched length
    bool ends[COAXIAL_TOOLS_MAX];              // the tip is inside and S2 is beyond it
    double axial[COAXIAL_TOOLS_MAX];           // [N/mm] 1 / integral of dS / EA, over at least `spread`; 0 where the tool has its tip inside
    double torsion[COAXIAL_TOOLS_MAX];         // [N mm] 1 / integral of dS / GJ, likewise
    double axial_end[COAXIAL_TOOLS_MAX][2], torsion_end[COAXIAL_TOOLS_MAX][2];     // derivatives of these integrals: minus that with respect to S1, plus that
                                                                                   // with respect to S2
    CoaxialSlope slope[COAXIAL_COLUMNS];       // [4 k + COAXIAL_S1 ...]; not set for fixed spans
    int soft_count;
    CoaxialSoft soft[COAXIAL_TOOLS_MAX];
    // Second derivatives of the waste with respect to phi1 phi1, phi1 phi2, phi2 phi2 of tool i relative to tool j < i, where positive
    double couple[COAXIAL_TOOLS_MAX][COAXIAL_TOOLS_MAX][3];
    int piece_count;
    CoaxialPiece piece[COAXIAL_BORDERS_MAX + 1];
} CoaxialRest;

// A single straight tool without its tip: the same as `strained_length`, `axial` and `torsion` of the element.
typedef struct CoaxialSprings {
    double length, axial, torsion;
    double drawn[2];         // [1/N], [1/(N mm2)] growth of the axial and torsional compliance per mm by which S1 and S2 advance together
} CoaxialSprings;
CoaxialSprings coaxial_springs(const CoaxialSpan *span);

typedef struct CoaxialInput {
    Vec3 x1, x2;
    Quat q1, q2;
    int count;
    CoaxialSpan span[COAXIAL_TOOLS_MAX];
} CoaxialInput;

typedef struct CoaxialOutput {
    CoaxialRest rest;
    BeamOutput beam;         // the equivalent element: chord, force2 (node 1 has -force2), moment1 and moment2 are gradients
    double energy;           // [mJ]
    double gradient[COAXIAL_COLUMNS];          // [N], [N mm] of the energy with respect to the tools' unknowns; 0 where fixed. At a hub, where a hand feeds in
                                               // the tool straight, -gradient of S1 of a curved tool does not include EI kappa^2 / 2; its tension does
    double tension[COAXIAL_TOOLS_MAX];         // [N]
    double torque[COAXIAL_TOOLS_MAX];          // [N mm]
    Vec3 end_moment[2];      // [N mm] bending moments in space axes
} CoaxialOutput;
void coaxial_element(const CoaxialInput *in, CoaxialOutput *out);

// Symmetric and positive semi-definite. `nodes` as in beam_tangent(); the rows of `cross` are x1, rotation 1, x2, rotation 2.
typedef struct CoaxialTangent {
    BeamTangent nodes;
    double cross[12][COAXIAL_COLUMNS];
    double own[COAXIAL_COLUMNS][COAXIAL_COLUMNS];
} CoaxialTangent;
// Main stiffness times `scale` plus the positive part of the geometric stiffness. Only the first 4 count columns (and rows of own) are written.
void coaxial_tangent(const CoaxialInput *in, const CoaxialOutput *out, double scale, CoaxialTangent *tangent);

#endif
