// Scores a trainee's run: figures, handling errors, points. One Score per simulator, stepped by the same thread right after each simulator_step(); the
// figures are plain data to be copied into a pose. The same steps give the same figures, so a replay has the session's score. A step allocates
// nothing, makes no vessel query and takes about 1 us; the tip is located in the tree every 10 ms.
//
// The clock starts with the first step in which the tool is moved, the pedal is down or contrast flows. Once the target has been held, or the time is
// over, all figures are frozen. Without an exercise they continue without limit.
//
// Each of the coaxial tools is observed: the force on its tip, its feed at the sheath, the place of its tip in the tree. The exercise's `tool`, or the tool
// furthest in, is the one whose tip has to reach the target; its path is measured, and contrast agent leaves from its tip.
//
// Points: 100 g (sum of w q / sum of w) - e n, at least 0, over the parts that are judged (par > 0, w > 0), with
//   q = par / max(par, figure), 1 down to 0; sim/score_points.c lists the figures;
//   g = 1 once the target was held, else half the largest fraction of the path to it that was covered;
//   e n = error_points times the number of errors.
// So a worse figure never gives more points, and doing nothing gives none.
//
// Errors are counted by episode: an episode begins when the measure exceeds its limit and ends once the measure has stayed below half the limit (forces: 0.8 of
// it) for half a second. Forces are judged by their mean over 20 ms (a first-order low-pass), so that a knock of a single step is no handling error.
//   wrong branch  a tip's node lies more than wrong_branch_mm beyond the mouth of a branch that does not lead from the sheath to the target:
//                 distance along the tree to the path, minus the radius of the path's vessel. A sac that holds the target is no wrong branch.
//   tip force     on the last tip_length_mm of a tool (score_tip.h): at rest the resultant of the wall's forces on them
//   wall force    largest contact force
//   buckling      of any tool: the length fed in at the mouth does not advance. The length lost next to the mouth, over the first 5 lumen diameters l
//                 beyond it (or up to where the tool's curved tip begins), is the integral of feed minus the tool's motion along itself at l, fading
//                 over 2 l of feed. A tool that slides keeps it at 0 in any bend, because each point follows the one before it. Without buckling a tool
//                 may come to lie on the other side of the lumen, which takes 2 c theta where the vessel turns by theta over l, and form one bow from
//                 wall to wall, which takes pi^2 c^2 / l (a half wave of amplitude a takes pi^2 a^2 / (4 l): Timoshenko and Gere, Theory of Elastic
//                 Stability, 1961, 1.9); c is the lumen's radius minus the tool's. If more than that plus 1 mm is lost while the hand pushes, the tool
//                 is folded between mouth and l.
//   blind         the tools were moved by more than blind_mm since they were last seen; of tools that move together the fastest counts
//   contrast      more than contrast_ml in total
//   wire lost     an inner tool's tip is more than wire_behind_mm behind the tip of the tool around it, or its proximal end has been drawn to less
//                 than 1 mm from that tool's hub, where no hand can hold it any more. A tool that may be exchanged has to be withdrawn for that: its
//                 tip may be behind while the tool around it is not pushed
//   kick          a tool's tip moves faster than kick_mm_s, mean of its velocity over 20 ms, while its own hand has rested for 0.1 s: energy that
//                 another tool's friction or bending stiffness had stored in it was released
//   tip moved     the tip of the tool that must stay has left its target, after it had been there for hold_s
//   perforation, dissection, spasm, clot       consequences (sim/consequence.h), if the exercise wants them; each costs its own points instead of n
//
// What a trainee sees. A movement is seen while the pedal is down and a pulse of the last 0.2 s showed the tool's tip, or that of a tool that reaches further:
// the tip lay in the open field, and the window showed the live image (XrayControl.seen). All other movements add up in blind_total_mm however short each
// was, pulling with half its length. Time in which a tool is moved with the 3D view or angioscopy in sight, or within 2 s after a look at them, adds up in
// guided_s. What the window shows is recorded step by step, so that a recording has one score. Without a window nothing is blind and nothing is guided.
//
// Beside that the score keeps the hint about what is happening (sim/hints.h) and the steps of a guided exercise (sim/guide.h).
//
// An exchange counts as no motion: length, tip and shape at the sheath are measured again for the new device.
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
// The figures as a JSON object {"state": …, "points": …, …}; the caller frees. NULL if out of memory. `scene` holds the exercise.
char *score_json(const ScoreFigures *figures, const Scene *scene);

#endif
