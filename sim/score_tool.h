// What a score measures for each tool in each step. score.h explains the figures.
#ifndef SELDINGER_SIM_SCORE_TOOL_H
#define SELDINGER_SIM_SCORE_TOOL_H

#include "sim/score_figures.h"
#include "sim/score_sheath.h"
#include "sim/score_tip.h"
#include "sim/simulator.h"

typedef struct ScoreEpisode {
    bool is_on;
    double quiet;                // [ms] since its measure went back below the threshold
} ScoreEpisode;

typedef struct ScoreTool {
    int index;                   // of the scene's tools
    int fitted;                  // the inserted device
    double length;               // [mm]
    double tip_length;           // [mm]
    ScoreTip tip;
    ScoreSheath sheath;
    Vec3 at;                     // its tip
    Vec3 drift;                  // [mm/ms] mean velocity of the tip
    double rested;               // [ms] since its hand last moved it
    double diameter;             // [mm] of its tip
    ConsequenceTip wall;         // what its tip does to the wall
    TipStall stall;
    double hub_limit;            // [mm] spare_mm below which it counts as drawn in
    ScoreEpisode episode[ERROR_COUNT];
} ScoreTool;

// `lumen_radius` [mm] of the vessel at the mouth, HUGE_VAL if unknown. Returns false if out of memory.
bool score_tool_create(ScoreTool *tool, Simulator *simulator, int index, double lumen_radius, double tip_length, ScoreToolFigures *figures);
// To be called between a step in which a tool was exchanged and score_tool_feed(): continues from the tools' present positions. Allocates nothing.
void score_tool_refit(ScoreTool *tool, Simulator *simulator, ScoreToolFigures *figures);
// After a step of `dt` [ms]: returns the length fed [mm]. Sheath and ends only: forces while a tool settles before the first action do not count.
double score_tool_feed(ScoreTool *tool, const Stepper *stepper, double dt, ScoreToolFigures *figures);
void score_tool_watch(ScoreTool *tool, const Stepper *stepper, const ToolCommands *commands, double dt, ScoreToolFigures *figures);
// The force of its tip on a wall of this kind.
void score_tool_press(ScoreTool *tool, const Stepper *stepper, const ConsequenceRules *rules, ConsequenceWall wall, double dt);
// Updates a 20 ms mean with `value`, which held for `elapsed_ms`.
double score_mean(double mean, double value, double elapsed_ms);

#endif
