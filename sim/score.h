// Scores a trainee's run: figures, handling errors, points. One Score per simulator, stepped by the same thread right after each simulator_step(); the
// figures are plain data to be copied into a pose. The same steps give the same figures, so a replay has the session's score. A step allocates
// nothing, makes no vessel query and takes well under 1 us; the tip is located in the tree every 10 ms.
//
// The clock starts with the first step in which the tool is moved, the pedal is down or contrast flows. Once the target has been held, or the time is
// over, all figures are frozen. Without an exercise they continue without limit.
//
// Of coaxial tools each is watched: its tip's force, its feed at the sheath, its tip in the tree. The tip that has to reach the target, whose path is
// measured and from which contrast agent flows is that of the exercise's `tool`, or of the tool furthest in.
//
// Points: 100 g (sum of w q / sum of w) - e n, at least 0, over the parts that are judged (par > 0, w > 0), with
//   q = par / max(par, figure), 1 down to 0; the figures are time, fluoroscopy time, contrast, path over way, wall-force peak, wall-force impulse;
//   g = 1 once the target was held, else half the share of the way to it that was ever covered;
//   e n = error_points times the number of errors.
// So a worse figure never gives more points, and doing nothing gives none.
//
// Errors are counted by episode: one begins when its limit is passed and ends once its measure has been back below the limit's half (forces: 0.8 of
// it) for half a second. Forces are judged by their mean over 20 ms (a low-pass of first order): a knock of a single step is no handling error.
//   wrong branch  a tip's node lies more than wrong_branch_mm beyond the mouth of a branch that does not lead from the sheath to the target:
//                 way along the tree to the way there, less the radius of that vessel. A sac that holds the target is no wrong branch.
//   tip force on the last tip_length_mm of a tool (score_tip.h): at rest the resultant of the wall's forces on them wall force largest contact force
//   buckling of any tool: the length fed in at the mouth does not advance: length lost next to the mouth, over the first 5 lumen diameters l beyond
//   it (or up to
//                 where its curved tip begins), as the integral of feed less the tool's motion along itself at l, fading over 2 l of feed. A tool that
//                 slides keeps it at 0 in any bend, because each point follows the one before it. It may lie down on the other side of the lumen
//                 without buckling, which takes 2 c theta where the vessel turns by theta over l and pi^2 c^2 / l for one bow from wall to wall (a half
//                 wave of amplitude a takes pi^2 a^2 / (4 l): Timoshenko and Gere, Theory of Elastic Stability, 1961, 1.9), c being the lumen's radius
//                 less the tool's. More than that plus 1 mm, while the hand pushes: the tool stands in folds between mouth and l.
//   blind the tools were moved by more than blind_mm since the pedal was last down; of tools that move together the fastest counts contrast more than
//   contrast_ml in all; once wire lost an inner tool's tip is more than wire_behind_mm behind the tip of the tool around it, or its proximal end has
//   been drawn to less than
//                 1 mm from that one's hub, where no hand holds it any more. One that may be exchanged has to come out for that: its tip may be behind while
//                 the tool around it is not pushed
//   kick          a tool's tip moves faster than kick_mm_s, mean of its velocity over 20 ms, while its own hand has rested for 0.1 s: another tool's
//                 friction or bending stiffness was stored in it and let go
//   tip moved     the tip of the tool that stays has left its target, in which it had been for hold_s
//
// An exchange counts as no motion: the new device is measured afresh: its length, its tip, its shape at the sheath.
#ifndef SELDINGER_SIM_SCORE_H
#define SELDINGER_SIM_SCORE_H

#include "sim/score_figures.h"
#include "sim/simulator.h"
#include "sim/xray.h"

typedef struct Score Score;

// To be called before the first step. `tree` may be NULL (no tree) and must outlive the score. NULL if out of memory.
Score *score_create(Simulator *simulator, const VesselTree *tree);
void score_free(Score *score);
// To be called after each simulator_step(), with the same arguments. `xray` NULL: no viewer, so no motion counts as blind.
void score_step(Score *score, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
ScoreFigures score_figures(const Score *score);
const ScoreEvent *score_events(const Score *score, int *count);
// To continue from an earlier moment: `to` belongs to the same scene.
void score_copy(Score *to, const Score *from);

// The figures as a JSON object {"state": …, "points": …, …}; the caller frees. NULL if out of memory. `scene` holds the exercise.
char *score_json(const ScoreFigures *figures, const Scene *scene);

#endif
