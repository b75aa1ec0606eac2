// The coaxial element: up to four tools one in another on one centreline, between two nodes. Inner tools slide and turn along it.
// Equations in coaxial.c. Lengths mm, forces N, moments N mm, energies mJ, angles rad. Nothing here allocates; all arrays are the caller's.
//
// A node has a position and a frame R, as everywhere (wire.h). A tool k that lies in the element has at each of its two nodes a material
// coordinate S and an angle phi, by which its own frame is turned about the tangent against the node's. Tool 0 is the carrier: its length between the
// nodes is the element's. An ordinary carrier is fixed (its nodes are points of it: S given, phi 0), but at a sheath's mouth, and where a tool
// leaves the tip of the one around it, its S1 and phi1 are unknowns like those of any tool.
//
// Two layers: coaxial_rest() makes of the tools the one corotational element that they are together; beam_equations.h has its geometry.
#ifndef SELDINGER_SOLVER_COAXIAL_H
#define SELDINGER_SOLVER_COAXIAL_H

#include "solver/beam.h"

enum {
    COAXIAL_TOOLS_MAX = 4,
    COAXIAL_UNKNOWNS = 4,    // of a tool in an element, in this order
    COAXIAL_S1 = 0,
    COAXIAL_PHI1 = 1,
    COAXIAL_S2 = 2,
    COAXIAL_PHI2 = 3,
    COAXIAL_COLUMNS = COAXIAL_TOOLS_MAX * COAXIAL_UNKNOWNS,
    COAXIAL_BORDERS_MAX = 12,      // section borders inside one element, of all its tools; those past them do not cut (the energy then jumps as they pass)
};

typedef struct CoaxialSection {    // uniform part of a tool
    double end;              // [mm] material coordinate of its distal end, more than that of the section before
    double bending;          // [N mm2] EI > 0
    double axial;            // [N] EA > 0
    double torsion;          // [N mm2] GJ > 0
    double shear;            // [N] kappa G A > 0
    double curve[2];         // [1/mm] rest curvature towards e2 and e3 of the tool's frame: curvature times (cos, sin) of its plane
} CoaxialSection;

typedef struct CoaxialTool {
    int count;               // sections, proximal to distal, >= 1; the first reaches back without end
    const CoaxialSection *section;
} CoaxialTool;

// The section at a material coordinate s, at a border the distal one; past the tip the last.
static inline const CoaxialSection *coaxial_section_at(const CoaxialTool *tool, double s)
{
    const CoaxialSection *section = tool->section, *last = section + tool->count - 1;
    while (section < last && section->end <= s)
        section++;
    return section;
}

typedef struct CoaxialSpan { // one tool in one element
    const CoaxialTool *tool;
    double s1, s2;           // [mm] S at the nodes, s1 < s2; s2 not read where has_tip. What is past the tool's tip stretches and twists and does not bend
    double phi1, phi2;       // [rad], of any size; where has_tip, coaxial_element() takes for phi2 what leaves the tool without torque
    double spread;           // [mm] strain is that of at least this length, what is behind S1 counted in; default 0. For an element that begins at a
                             // mouth or a tip and may be short: the full element's length
    bool spreads_twist;      // the twist too, and `spread` is exact: at a mouth, where the tools' angles at node 1 are those of the last node in the sheath
    double soft[2];          // [mm] default 0: over so much to either side of node 1, of node 2, a section's border of this tool goes from this element to the one
                             // there; its tip does not. Where the carrier's section changes or ends the energy would have a kink, and a step a force that depends on the side.
                             // 0 for the carrier
    bool has_tip;            // it ends inside, at its last section's end: it bends with the others up to there, as long as the carrier and not turned
                             // along it, and has no tension and no torque. S1 and phi1 are all that it has. Not for the carrier
    bool is_fixed;           // its values are no unknowns: no derivatives with them, which saves time
} CoaxialSpan;

typedef struct CoaxialPiece {      // part of an element between two borders
    double width, middle;    // in shares of the element, 0 to 1 from node 1
    double bending;          // [N mm] sum of EI_k / l_k
    double own[COAXIAL_TOOLS_MAX]; // [N mm] EI_k / l_k
    double moment[2];        // [N mm] sum of EI_k Rot(phi_k) kappa_k: what it takes to hold the tools straight, about e2 and e3
} CoaxialPiece;

// Slopes of CoaxialRest with one unknown. A span with a tip has them as if s2 and phi2 were free; coaxial_element() folds them together.
typedef struct CoaxialSlope {
    double flexibility[3], angle[2][2], waste;
} CoaxialSlope;

typedef struct CoaxialSoft {       // a border that goes from one element to the next
    int tool;
    bool end;                // at node 2
    double bends;            // [1/mm2] second derivative of where it counts, in shares of the element, with S at that node
    CoaxialSlope slope;      // with where it counts
    double stiffness;        // [N/mm] with that S, if positive; coaxial_element() sets it
} CoaxialSoft;

typedef struct CoaxialChord {      // the rest chord in a node's frame
    Quat turn;               // from the frame to it, by minus the rest angle, v
    double v[2], grow, stay, lean;             // a change of v turns it by grow dv + stay (v . dv) v + lean v x dv
} CoaxialChord;

typedef struct CoaxialRest {       // layer 1: what the tools are together
    int count;
    bool is_curved;          // any of them
    bool bends[COAXIAL_TOOLS_MAX];             // this one has a rest curvature, so that its angles matter beyond its torsion
    bool is_whole[COAXIAL_TOOLS_MAX];          // no border of this one inside: S1 acts as -S2
    double length;           // [mm] the carrier's
    double flexibility[3];   // [1/(N mm)] of node 1, of 1 with 2, of node 2: end angles by end moments
    double near1, near2, far;      // [N mm] its inverse
    double angle[2][2];      // [rad] rest angles from chord to tangent at the nodes, about e2 and e3 of the node's frame
    double share[COAXIAL_TOOLS_MAX][2][2];     // … what each tool adds to them
    CoaxialChord chord[2];
    double arc;              // [mm] length of the rest arc less chord and bow; its slopes with the length and with `angle`
    double arc_by_length, arc_by_angle[2][2];
    double waste;            // [mJ] energy of the tools' rest shapes against each other, where no force acts from outside
    double own_length[COAXIAL_TOOLS_MAX];      // [mm] l_k; of a tool that ends inside the carrier's …
    double strained_length[COAXIAL_TOOLS_MAX]; // … and S2 - S1 of what is stretched
    bool ends[COAXIAL_TOOLS_MAX];              // inside, with S2 past its tip
    double axial[COAXIAL_TOOLS_MAX];           // [N/mm] 1 / integral of dS / EA, over `spread` at least; 0 where the tool has its tip inside
    double torsion[COAXIAL_TOOLS_MAX];         // [N mm] 1 / integral of dS / GJ; likewise
    double axial_end[COAXIAL_TOOLS_MAX][2], torsion_end[COAXIAL_TOOLS_MAX][2];     // minus and plus the slopes of these integrals with S1 and S2
    CoaxialSlope slope[COAXIAL_COLUMNS];       // [4 k + COAXIAL_S1 ...]; not set for fixed spans
    int soft_count;
    CoaxialSoft soft[COAXIAL_TOOLS_MAX];
    // second derivatives of the waste with phi1 phi1, phi1 phi2, phi2 phi2 of tool i against tool j < i, where positive
    double couple[COAXIAL_TOOLS_MAX][COAXIAL_TOOLS_MAX][3];
    int piece_count;
    CoaxialPiece piece[COAXIAL_BORDERS_MAX + 1];
} CoaxialRest;

// One tool alone, straight, without its tip: as `strained_length`, `axial` and `torsion` of the element.
typedef struct CoaxialSprings {
    double length, axial, torsion;
    double drawn[2];         // [1/N], [1/(N mm2)] by which their compliances grow per mm that the tool goes through with both ends of the length
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
    BeamOutput beam;         // the element that they are together: chord, force2 (-force2 is node 1's), moment1 and moment2 are gradients
    double energy;           // [mJ]
    double gradient[COAXIAL_COLUMNS];          // [N], [N mm] of the energy with the tools' unknowns; 0 where fixed. At a hub, where what a hand
                                               // pushes in comes straight, -gradient of S1 lacks the EI kappa^2 / 2 of a curved tool; its tension has it
    double tension[COAXIAL_TOOLS_MAX];         // [N]
    double torque[COAXIAL_TOOLS_MAX];          // [N mm]
    Vec3 end_moment[2];      // [N mm] of bending, in space
} CoaxialOutput;
void coaxial_element(const CoaxialInput *in, CoaxialOutput *out);

// Symmetric, positive semi-definite. `nodes` as beam_tangent(); rows of `cross` are x1, rotation 1, x2, rotation 2.
typedef struct CoaxialTangent {
    BeamTangent nodes;
    double cross[12][COAXIAL_COLUMNS];
    double own[COAXIAL_COLUMNS][COAXIAL_COLUMNS];
} CoaxialTangent;
// Main stiffness times `scale` plus the positive part of the geometric one. Only the first 4 count columns (and rows of own) are written.
void coaxial_tangent(const CoaxialInput *in, const CoaxialOutput *out, double scale, CoaxialTangent *tangent);

#endif
