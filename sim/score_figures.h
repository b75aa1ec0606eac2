// The figures and errors of a run, explained in score.h: plain data.
#ifndef SELDINGER_SIM_SCORE_FIGURES_H
#define SELDINGER_SIM_SCORE_FIGURES_H

#include "sim/exercise.h"
#include "sim/hints.h"
#include "sim/xray_tube.h"

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    ERROR_WRONG_BRANCH,
    ERROR_TIP_FORCE,
    ERROR_WALL_FORCE,
    ERROR_BUCKLING,
    ERROR_BLIND,
    ERROR_CONTRAST,
    ERROR_WIRE_LOST,
    ERROR_KICK,
    ERROR_TIP_MOVED,
    ERROR_PERFORATION,           // these four are consequences (sim/consequence.h), in their order
    ERROR_DISSECTION,
    ERROR_SPASM,
    ERROR_CLOT,
    ERROR_COUNT
} ScoreError;
extern const char *const score_error_name[ERROR_COUNT + 1];    // in files: "wrong_branch", "tip_force", …; NULL at the end
extern const char *const score_error_words[ERROR_COUNT];       // on screens: "wrong branch", "tip force above the limit", …

typedef enum { SCORE_WAITING, SCORE_RUNNING, SCORE_REACHED, SCORE_TIME_OUT } ScoreState;   // WAITING: nothing moved yet
extern const char *const score_state_name[5];                  // "waiting", "running", "reached", "time_out", NULL

typedef struct ScoreErrorFigures {
    int count;
    bool is_on;                  // an episode is in progress
    double last_s;               // simulated time at which the last one began; 0 if none
} ScoreErrorFigures;

// Of one tool. Names in files as here.
typedef struct ScoreToolFigures {
    char name[TOOL_NAME_SIZE];
    double inserted_mm, withdrawn_mm;    // total length fed in and pulled out, both >= 0
    double tip_force_n, tip_force_peak_n;    // means over 20 ms
    double kick_mm_s, kick_peak_mm_s;    // of its tip while its hand does not move it, else 0
    double lost_mm, lost_limit_mm;       // length lost next to the mouth, and its limit (buckling); limit 0: not yet known
    double behind_mm;            // distance of its tip behind the tip of the tool around it, >= 0
    double spare_mm;             // distance of its proximal end behind that tool's hub, >= 0
    double strayed_mm;           // for the tool that must stay: largest distance of its tip from where it had reached its target
    int tip_node;                // node of the tree at which its tip is; -1 without tree
    double narrowed;             // part of the vessel's radius at its tip that is lost to spasm
    double off_way_mm;           // beyond the mouth of a branch that leads elsewhere; 0 on the path
} ScoreToolFigures;

// A part as it was judged, so that the points can be explained from a session's file alone.
typedef struct ScorePartFigures {
    double measured, par;        // in the part's unit; par 0: not judged
    double most, points;         // points that it gives at most, 100 times its share of the weights, and those reached
} ScorePartFigures;

// Where a consequence happened.
typedef struct ScoreMark {
    ScoreError kind;             // ERROR_PERFORATION or one of those after it
    Vec3 at;                     // [mm] the tip
    double time_s;               // simulated
    double force_n, limit_n;     // force on the tip and the limit that it exceeded; 0 for a clot
    double leaked_ml;            // contrast agent that has left through a perforation
} ScoreMark;
enum { SCORE_MARKS_MOST = 8 };   // further consequences are counted but not marked

typedef struct ScoreFigures {
    ScoreState state;
    bool has_exercise, has_xray;     // has_xray: there is a viewer (xray not NULL)
    double points;               // 0 to 100; 0 without exercise
    double part[PART_COUNT];     // q of each part, 0 to 1; 1 where not judged
    ScorePartFigures judged[PART_COUNT];
    double start_s;              // simulated time at which the clock began
    double time_s;               // since then
    double fluoroscopy_s;        // pedal down
    int64_t pulses;              // of X-rays
    double dose_area_cm2;        // pulses times the field's open area at the isocentre: proportional to the dose-area product
    double air_kerma_mgy;        // reference air kerma, see sim/xray_tube.h; of both planes
    double kerma_area_gy_cm2;    // dose-area product
    double second_kerma_mgy, second_kerma_area_gy_cm2;   // the second plane's part of them
    double mean_kv, mean_ma;     // of the first plane's tube, over pulses; 0 without
    XrayExposure pulse, second_pulse;    // the last one; not in files
    double contrast_ml;
    double path_mm;              // of the tip that has to reach the target, in chords of 0.2 mm, so that tremor does not count
    double way_mm;               // length of the path from the tip's place at the start to the target, along the tree's centrelines; straight without a tree
    double remaining_mm;         // remaining length of that path
    double least_remaining_mm;
    double efficiency;           // part of that path gained / path length of the tip, 0 to 1
    double inserted_mm, withdrawn_mm;    // of all tools in sum
    double wall_force_peak_n;    // largest contact force of any step
    double wall_impulse_n_s;     // sum of all contact forces over time
    double tip_force_n, tip_force_peak_n;    // the largest of any tool's
    int tip_node;                // of the tool that has to reach the target
    double blind_mm;             // moved since the X-ray image last showed the tool
    double blind_total_mm;       // sum of all movements without a fresh X-ray image of the tool's tip; pulling counts half
    double guided_s;             // time in which a tool was moved with the 3D view or angioscopy in sight
    double target_distance_mm;   // from that tool's tip, straight
    double held_s;               // time within the target without interruption
    double reached_s;            // simulated time when the target had been held; 0 before
    bool has_consequences;       // they happen in this session
    double narrowest;            // smallest radius so far that spasm has left of a vessel, as a part; 1: no spasm
    double dwell_s;              // since the last injection, or since the clock began
    int mark_count;
    ScoreMark mark[SCORE_MARKS_MOST];    // in the order of their times
    GuideProgress guide;
    HintKind hint;               // what is happening …
    double hint_value;           // … and its value
    int error_total;
    ScoreErrorFigures error[ERROR_COUNT];
    int tool_count;
    ScoreToolFigures tool[TOOLS_MOST];   // outermost first
} ScoreFigures;

typedef struct ScoreEvent {
    ScoreError kind;
    int tool;                    // tool concerned; -1: no single tool (wall force, blind, contrast)
    double time_s;               // simulated
} ScoreEvent;
enum { SCORE_EVENTS_MOST = 200 };    // further errors are counted but not listed

#endif
