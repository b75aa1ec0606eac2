// What too much force, or too long a stay, does to the vessel: perforation, dissection, spasm, clot. Simple rules on the force with which a tool's tip presses on
// the wall; the wall itself, and so the motion of the tools, does not change. Deterministic, no allocation in a step.
//
// F is the wall's force on the last 2 mm of the tool (mean over 20 ms, as a vector), t the tip's tangent: `along` = -F t pushes the tip back, `across` is the
// rest. Limits follow from the tool's diameter d and the wall:
//   perforation   along > S pi d h, and along >= across (within 45 degrees of the tip's direction): the tip punches a plug of its own size out of the wall. h is
//                 the wall's thickness, a tenth of the vessel's radius, or 0.2 mm in a sac (both assumed); S its strength: 1.2 MPa (human carotid arteries, media
//                 1.23, adventitia 1.8 to 2.0 MPa: Teng et al. 2009, doi 10.1016/j.jbiomech.2009.07.009), in a sac 0.75 MPa (its thick part; the thin part
//                 1.45 MPa, along the meridian: Toth et al. 1998, J Vasc Res 35:345). Shear strength is taken to be the tensile strength
//   dissection    |F| > half of that plus the force that peels a flap of the tool's width, 35 mN/mm (human aortic media, axial: Sommer et al. 2008,
//                 doi 10.1115/1.2898733), while the tip looks along the wall (across > along) and slides on by 1 mm. The half stands for the inner layers (assumed)
//   spasm         each time |F| rises above 0.4 of the perforation's limit the vessel narrows by a tenth of its radius, at most to a half; a spasm has begun when
//                 it has lost a quarter. It relaxes with a time constant of 180 s, and is counted afresh 20 mm away (all assumed; mechanical spasm is seen in
//                 about 40 % of neurovascular procedures: Ishihara et al. 2015, doi 10.2176/nmc.oa.2014-0268)
//   clot          600 s without an injection, which also flushes: after 10 min 65 % of catheters with saline and 19 % with heparinised saline held clots
//                 ("Blood clot formation in angiographic catheters", in vitro); on guide wires in humans fibrin was visible after 5 min ("Guide wire
//                 thrombogenicity and its reduction", 1974)
// These are limits for teaching. They do not predict what happens in a patient.
#ifndef SELDINGER_SIM_CONSEQUENCE_H
#define SELDINGER_SIM_CONSEQUENCE_H

#include "base/base.h"
#include "solver/solver.h"

typedef enum { CONSEQUENCE_PERFORATION, CONSEQUENCE_DISSECTION, CONSEQUENCE_SPASM, CONSEQUENCE_CLOT, CONSEQUENCE_COUNT } Consequence;
// Whether they happen: not said means only in an examination.
typedef enum { CONSEQUENCES_IN_EXAMINATION, CONSEQUENCES_OFF, CONSEQUENCES_ON } ConsequenceMode;

typedef struct ConsequenceRules {
    ConsequenceMode mode;
    double wall_strength_mpa, sac_strength_mpa;      // 0.01 to 100
    double wall_to_radius;       // thickness over radius of a vessel, 0.001 to 1
    double sac_wall_mm;          // thickness, 0.001 to 10
    double clot_s;               // above 0, to 86,400
    double points[CONSEQUENCE_COUNT];    // 0 to 100, what each costs
} ConsequenceRules;

ConsequenceRules consequence_rules_default(void);
// Reads `consequences:`, true, false or a map of the rules' keys (`points` is a map of perforation, dissection, spasm, clot). Faults go to the reader.
void consequence_rules_read(YamlValue value, ConsequenceRules *rules);

// The wall at a tip.
typedef struct ConsequenceWall {
    double radius;               // [mm] of the vessel; HUGE_VAL if unknown
    bool is_sac;
} ConsequenceWall;
double consequence_perforation_n(const ConsequenceRules *rules, ConsequenceWall wall, double diameter);
double consequence_dissection_n(const ConsequenceRules *rules, ConsequenceWall wall, double diameter);

// State of one tool's tip; zeroed at the start.
typedef struct ConsequenceTip {
    Vec3 press;                  // [N] mean force F
    double along, across;        // [N] its parts; along < 0: the wall pulls the tip
    double limit;                // [N] of a perforation; HUGE_VAL where the vessel is unknown
    double dissection_limit;     // [N]
    double scraped;              // [mm] slid on along the wall under a force that dissects
    double narrowed;             // part of the radius lost to spasm, 0 to 0.5
    bool is_forced;              // an episode of force is in progress …
    double eased;                // [ms] … that has been below half its limit for so long
    Vec3 forced_at;              // place of the last one
} ConsequenceTip;

enum { CONSEQUENCE_TIP_MM = 2 }; // length of the tip
// After a step of `dt` [ms]. `end`: the tool's end; `force` [N] of the wall on its tip.
void consequence_tip_step(ConsequenceTip *tip, const ConsequenceRules *rules, ConsequenceWall wall, double diameter, ToolPlace end, Vec3 force, double dt);
bool consequence_perforates(const ConsequenceTip *tip);
bool consequence_dissects(const ConsequenceTip *tip);
bool consequence_is_spasm(const ConsequenceTip *tip);
bool consequence_has_eased(const ConsequenceTip *tip);       // neither perforation nor dissection goes on
bool consequence_has_relaxed(const ConsequenceTip *tip);

#endif
