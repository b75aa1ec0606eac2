// Buckling of one tool at the sheath: the length that was fed in at the mouth and did not advance, over the first part of the tool beyond it. score.h explains
// what is measured and why.
#ifndef SELDINGER_SIM_SCORE_SHEATH_H
#define SELDINGER_SIM_SCORE_SHEATH_H

#include "geom/geom.h"
#include "solver/solver.h"

typedef struct ScoreSheath {
    bool is_judged;              // a sheath, and a lumen whose radius is known
    Vec3 mouth, direction;
    double lumen_radius, clearance;      // [mm]
    double reach;                // [mm] l, 5 lumen diameters
    double straight;             // [mm] arc length up to which the tool is straight at rest
    double lost;                 // [mm] >= 0
    double turn;                 // [rad] by which the vessel turns over l
    bool turn_is_known;          // otherwise it is measured from the tool while it slides
    double last_inserted;        // [mm]
} ScoreSheath;

void score_sheath_start(ScoreSheath *sheath, const WireOptions *wire, double lumen_radius, double inserted);
// Replaces the tool; mouth, lumen and the vessel's turn stay.
void score_sheath_refit(ScoreSheath *sheath, const WireOptions *wire, double inserted);
// The vessel's centreline from the mouth on, `count` points: sets the turn, by chords of one lumen diameter.
void score_sheath_set_line(ScoreSheath *sheath, const Vec3 *point, int count);
// Updates the state of tool `tool` after a step of `dt` [ms]. Returns the length fed in [mm].
double score_sheath_step(ScoreSheath *sheath, const Stepper *stepper, int tool, double dt);
void score_sheath_set_pieces(ScoreSheath *sheath, const TubePiece *piece, int count);   // the same of lines and arcs
// If the turn is unknown: measures it from the tool while hardly any length is lost.
void score_sheath_look(ScoreSheath *sheath, const Stepper *stepper, int tool);
// [mm] that may be lost without folding.
double score_sheath_limit(const ScoreSheath *sheath);

#endif
