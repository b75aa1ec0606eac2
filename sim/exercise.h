// The `exercise:` key of a scene: the trainee's task and how it is scored (sim/score.h). Numbers are kept in the file's units, which are part of their names,
// and are shown and compared as typed.
//
//   exercise:
//     title: Reach the aneurysm             # required, at most 95 bytes
//     instructions: |                       # text for the screen, at most 4000 bytes; default none
//       Advance through the siphon …
//     level: 2                              # difficulty, 1 (easy) to 5; default: not said
//     target: aneurysm                      # required: the name of one of the scene's targets
//     tool: microcatheter                   # whose tip has to reach it; default: the tool furthest in
//     exchange: {wire: 1}                   # the target counts only while these devices are in: 0 the tool itself, 1, 2, … those of its `exchange:`; default: any
//     stays: {tool: catheter, target: left carotid}     # once its tip has been in that target for hold_s it must not leave it; default: none
//     hold_s: 2                             # 0 to 60: the tip stays within the target that long
//     time_limit_s: 600                     # above 0, to 86,400: from the first movement or X-ray on
//     rules:                                # limits of handling errors; 0: not checked
//       tip_force_n: 0.5                    # on the last tip_length_mm of each tool, from the wall
//       tip_length_mm: 5
//       wall_force_n: 2                     # largest contact force anywhere
//       wrong_branch_mm: 5                  # distance into a branch that does not lead to the target, from its mouth
//       blind_mm: 10                        # distance that a tool is moved without X-rays
//       contrast_ml: 30                     # total contrast agent
//       wire_behind_mm: 5                   # distance of an inner tool's tip behind the tip of the tool around it
//       kick_mm_s: 100                      # speed of a tool's tip while the operator does not move it
//       buckling: true                      # at the sheath, see score.h
//     par:                                  # value for a part's full points; 0: the part is not scored
//       time_s: 60
//       fluoroscopy_s: 40
//       contrast_ml: 5
//       path_ratio: 1.5                     # path of the tip over the shortest path to the target
//       wall_force_n: 0.5
//       wall_impulse_n_s: 10
//       blind_mm: 5                         # sum of all movements without a fresh X-ray image, backwards half
//       guidance_s: 2                       # time of movements with the 3D view or angioscopy in sight
//     weights: {time: 1, fluoroscopy: 1, contrast: 1, path: 1, wall_force: 1, wall_impulse: 1, blind: 1, guidance: 1}   # 0 to 1000, relative
//     error_points: 5                       # 0 to 100, what each handling error costs
//     mode: practice                        # or examination: the trainer hides the 3D view and angioscopy
//     consequences: true                    # perforation, dissection, spasm, clot: false, true, or a map of limits (sim/consequence.h); default: in an examination
//     steps: [{text: Hold the pedal., xray_s: 1}, …]    # a guided exercise (sim/guide.h); default: none
#ifndef SELDINGER_SIM_EXERCISE_H
#define SELDINGER_SIM_EXERCISE_H

#include "base/base.h"
#include "input/input.h"
#include "sim/consequence.h"
#include "sim/guide.h"
#include "sim/score_part.h"

enum { EXERCISE_TITLE = 96, EXERCISE_TEXT_MOST = 4000 };

typedef struct ExerciseRules {   // limits; 0: not checked
    double tip_force_n;
    double tip_length_mm;        // > 0
    double wall_force_n;
    double wrong_branch_mm;
    double blind_mm;
    double contrast_ml;
    double wire_behind_mm;
    double kick_mm_s;
    bool buckling;
} ExerciseRules;

typedef struct Exercise {
    char title[EXERCISE_TITLE];
    char *instructions;          // "" if none; owned
    int level;                   // 1 to 5; 0: not said
    int target;                  // index of the scene's targets; -1 in exercise_default
    int tool;                    // index of the scene's tools; -1: the tool furthest in
    int device[TOOLS_MOST];      // device of each tool that must be inserted; -1: any
    int stays, stays_at;         // the tool whose tip must stay in a target once there, and that target; -1: none
    double hold_s, time_limit_s;
    ExerciseRules rules;
    double par[PART_COUNT];      // of each part: s, s, ml, ratio, N, N s, mm, s; 0: not scored
    double weight[PART_COUNT];
    double error_points;
    bool is_examination;
    ConsequenceRules consequences;
    Guide guide;
} Exercise;

// The defaults: 2 s, 600 s, buckling only, no par, all weights 1, 5 points per error.
Exercise exercise_default(void);
typedef struct ExerciseScene {   // names that an exercise may refer to; counts are 0 if they could not be read
    int target_count, tool_count;
    const char *const *target, *tool[TOOLS_MOST];
    int device_count[TOOLS_MOST];
} ExerciseScene;
// Reads the value of `exercise:`. Faults go to the reader; the caller frees.
void exercise_read(YamlValue value, const ExerciseScene *scene, Exercise *exercise);
void exercise_free(Exercise *exercise);

#endif
