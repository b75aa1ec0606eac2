// What is happening that a trainee should act on now, from the signs that a score measures at each step. A hint appears once its sign has been above 1 for 0.2 s
// and is taken back once it has been below 0.6 for a second, after two seconds at least, so that it can be read and does not flicker. Of several the most urgent
// counts. Deterministic, no allocation.
#ifndef SELDINGER_SIM_HINTS_H
#define SELDINGER_SIM_HINTS_H

#include "geom/geom.h"

// Most urgent first.
typedef enum {
    HINT_NONE,
    HINT_SAC,                // the tip is in a sac and the force on it rises; value: the force [N]
    HINT_BUCKLES,            // a tool buckles at the sheath; value: length lost there [mm]
    HINT_PRESSES,            // the tip presses on the wall and does not advance; value: length fed meanwhile [mm]
    HINT_COILS,              // the tool lies in a loop or takes up the length that is pushed in; value: that length [mm], 0: unknown
    HINT_WRONG_BRANCH,       // the tip is in a branch that does not lead to the target; value: distance back to the fork [mm]
    HINT_WIRE_LOST,          // a wire is behind the catheter around it, or drawn to its hub
    HINT_UNSEEN,             // the tool moves without X-rays; value: how far [mm]
    HINT_NO_CONTRAST,        // the tool is pushed on while the contrast agent has long gone; value: for how long [s]
    HINT_COUNT
} HintKind;

// Signs of one step. Of several tools that of the one that is worst off.
typedef struct HintSigns {
    double sign[HINT_COUNT];     // 1: as much as a hint needs; [HINT_NONE] is not used
    double value[HINT_COUNT];
} HintSigns;

typedef struct Hints {
    bool is_on[HINT_COUNT];
    double above_ms[HINT_COUNT], below_ms[HINT_COUNT], shown_ms[HINT_COUNT];
} Hints;

// After a step of `dt` [ms]. Returns the most urgent hint.
HintKind hints_step(Hints *hints, const HintSigns *signs, double dt);

// Length fed in while a tip has stayed where it is: the sign of a tip that is held, or of a tool that coils. Zeroed at the start.
typedef struct TipStall {
    Vec3 from;                   // where the tip was last seen to move on [mm]
    double fed;                  // [mm] pushed in since then, pulling subtracted
} TipStall;
void tip_stall_step(TipStall *stall, Vec3 tip, double fed);

#endif
