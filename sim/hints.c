#include "sim/hints.h"

#include <math.h>

static const double AFTER_MS = 200, GONE = 0.6, GONE_MS = 1000, READ_MS = 2000;
static const double MOVES_ON_MM = 1.5;

HintKind hints_step(Hints *hints, const HintSigns *signs, double dt)
{
    HintKind urgent = HINT_NONE;
    for (int i = HINT_COUNT - 1; i > HINT_NONE; i--) {
        hints->above_ms[i] = signs->sign[i] >= 1 ? hints->above_ms[i] + dt : 0;
        hints->below_ms[i] = signs->sign[i] < GONE ? hints->below_ms[i] + dt : 0;
        if (hints->is_on[i]) {
            hints->shown_ms[i] += dt;
            hints->is_on[i] = hints->below_ms[i] < GONE_MS || hints->shown_ms[i] < READ_MS;
        } else if (hints->above_ms[i] >= AFTER_MS) {
            hints->is_on[i] = true;
            hints->shown_ms[i] = 0;
        }
        urgent = hints->is_on[i] ? (HintKind)i : urgent;
    }
    return urgent;
}

void tip_stall_step(TipStall *stall, Vec3 tip, double fed)
{
    stall->fed = fmax(stall->fed + fed, 0);
    if (vec3_distance(tip, stall->from) < MOVES_ON_MM)
        return;
    stall->from = tip;
    stall->fed = 0;
}
