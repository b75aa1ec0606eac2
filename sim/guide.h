// The steps of a guided exercise: a list that ticks from the top, each step once its condition is met. A step counts from when the one before it was done.
//
//   exercise:
//     steps:                                # 1 to 12
//       - {text: Hold the X-ray pedal., xray_s: 1}          # text: at most 119 bytes; one condition:
//       - {text: Inject contrast agent., contrast_ml: 2}    # xray_s, contrast_ml: so much in this step
//       - {text: Turn the wire., turned_deg: 90}            # turned_deg: by the tool's hand in this step, either way
//       - {text: Push it on., inserted_mm: 30}              # inserted_mm: beyond the sheath's mouth
//       - {text: Enter the branch., tip_in: branch}         # tip_in: a target of the scene that holds the tool's tip
//       - {text: Hold still., held_s: 2}                    # held_s: the exercise's target held for so long
// A text names the user's keys by the names of their buttons in braces, "Hold {X-ray pedal}." (render/key_table.h: key_table_fill).
// `tool: NAME` beside turned_deg, inserted_mm or tip_in: of this tool; default: of the tool that has to reach the target.
#ifndef SELDINGER_SIM_GUIDE_H
#define SELDINGER_SIM_GUIDE_H

#include "base/base.h"

enum { GUIDE_STEPS = 12, GUIDE_TEXT = 120 };

typedef enum { GUIDE_XRAY, GUIDE_CONTRAST, GUIDE_TURNED, GUIDE_INSERTED, GUIDE_TIP_IN, GUIDE_HELD, GUIDE_CONDITIONS } GuideCondition;

typedef struct GuideStep {
    char text[GUIDE_TEXT];
    GuideCondition condition;
    double least;                // in the unit of its key
    int target, tool;            // of GUIDE_TIP_IN; -1: the tool that has to reach the target
} GuideStep;

typedef struct Guide {
    int count;                   // 0: not guided
    GuideStep step[GUIDE_STEPS];
} Guide;

// Names that steps may refer to. Faults go to the reader.
void guide_read(YamlValue value, int target_count, const char *const *target, int tool_count, const char *const *tool, Guide *guide);

// Values of the conditions that add up over a session, so that a step counts by differences.
typedef struct GuideSigns {
    double xray_s, contrast_ml, held_s;
    double turned_deg, inserted_mm;      // of the step's tool
    bool is_tip_in;                      // its tip is in the step's target
} GuideSigns;

typedef struct GuideProgress {
    int begun, done;             // steps begun and done
    double done_s[GUIDE_STEPS];  // simulated time of each; 0 if not done
    GuideSigns from;             // when the present step began
} GuideProgress;

// The step to do now; NULL if all are done.
const GuideStep *guide_now(const Guide *guide, const GuideProgress *progress);
// Ticks the present step if its condition is met. `signs` are those of its tool and target.
void guide_watch(const Guide *guide, GuideProgress *progress, const GuideSigns *signs, double now_s);

#endif
